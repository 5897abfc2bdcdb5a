"""Figure 4: pitch steps in closed loop, the plant against identified models, each under a PID of its own.

The paper's PID (with its sign corrected) takes every rig from its rest angle to zero and, later, through a step. Three
models are compared with the plant: the one that our experiment 1 found, and the midpoints of the paper's Table 1 for
both of its experiments. The latter two show how much the difference between the experiments matters to a controller.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from heli_identifier.online import ModelParameters
from heli_identifier.results import AFTER, BEFORE, MEASURED, THIRD, canvas, key, styled, thinned
from heli_identifier.workbench.paper.open_loop import model_of
from heli_identifier.workbench.paper.published import EXPERIMENTS, PITCH, TABLE_1, TRUTH
from heli_identifier.workbench.paper.runs import STEP
from heli_identifier.workbench.paper.tables import write_table

if TYPE_CHECKING:
    from fmu_src import Value

STEP_SIZE = 0.3
"""Of the reference [rad]."""

STEP_TIME, DURATION = 20.0, 40.0
"""Time of the step and of the end [s]; the slowest pole of the loop is near .5 1/s."""

PLANT = "plant"
_STRIDE = 5
_COLOURS = (AFTER, BEFORE, THIRD)


def models(identified: ModelParameters) -> dict[str, ModelParameters]:
    """Return the models by name: the identified one and the paper's two."""
    printed = {
        f"paper_{experiment}": TRUTH._replace(**{name: TABLE_1[experiment][name].middle for name in PITCH})
        for experiment in EXPERIMENTS
    }
    return {"identified": identified, **printed}


def closed_loops(
    estimates: Mapping[str, ModelParameters], fmus: dict[str, Path], duration: float = DURATION
) -> tuple[NDArray[np.float64], dict[str, NDArray[np.float64]]]:
    """Run the plant and one plant per estimate, each with a controller, in one process.

    Returns
    -------
    time : ndarray, shape (N,)
        [s].
    responses : dict of ndarray, shape (N, 2)
        Pitch [rad] as the encoder reads it and v_f - v_r [V], by name.

    Raises
    ------
    fmu_src.FmuError
        A unit could not be stepped.
    """
    from fmu_src import AXES, VOLTAGES, Connection, Scenario
    from fmu_src.master import run_apart

    rigs = (PLANT, *estimates)
    units, wires, record = [], [], []
    order: dict[str, Value] = {}
    for rig in rigs:
        controller = f"controller_{rig}"
        units += [(rig, "HelicopterPlant"), (controller, "PidController")]
        wires += [Connection(rig, axis, controller, axis) for axis in AXES]
        wires += [Connection(controller, voltage, rig, voltage) for voltage in VOLTAGES]
        order |= {
            f"{rig}.encoder.enabled": True,
            f"{controller}.reference.step_pitch": STEP_SIZE,
            f"{controller}.reference.step_time": STEP_TIME,
        }
        record += [f"{rig}.pitch", *(f"{controller}.{voltage}" for voltage in VOLTAGES)]
    for rig, estimate in estimates.items():
        order |= model_of(estimate, PITCH, rig)
    scenario = Scenario("paper_closed_loop", "pitch steps in closed loop", tuple(units), tuple(wires))
    result = run_apart(scenario, duration, STEP, order, {name: fmus[unit] for name, unit in units}, record=record)
    responses = {}
    for rig in rigs:
        front, rear = (result.column(f"controller_{rig}.{voltage}") for voltage in VOLTAGES)
        responses[rig] = np.column_stack([result.column(f"{rig}.pitch"), front - rear])
    return result.time, responses


@styled
def closed_loop_figure(time: NDArray[np.float64], responses: Mapping[str, NDArray[np.float64]]) -> Figure:
    """Draw pitch, voltage difference, and the models' difference from the plant."""
    figure, (angle, voltage, difference) = canvas(8.0, 6.0, (1.5, 1.0, 1.0))
    plant = responses[PLANT]
    angle.plot(*thinned(time, plant[:, 0]), color=MEASURED, linewidth=2.6, label="plant")
    voltage.plot(*thinned(time, plant[:, 1]), color=MEASURED, linewidth=2.6)
    for (rig, response), colour in zip(((r, x) for r, x in responses.items() if r != PLANT), _COLOURS, strict=False):
        label = rig.replace("paper_", "paper's experiment ")
        angle.plot(*thinned(time, response[:, 0]), color=colour, linewidth=1.0, label=label)
        voltage.plot(*thinned(time, response[:, 1]), color=colour, linewidth=0.8)
        difference.plot(*thinned(time, 1e3 * (response[:, 0] - plant[:, 0])), color=colour, linewidth=0.9)
    angle.set_ylabel("pitch [rad]")
    voltage.set_ylabel("v_f − v_r [V]")
    difference.set_ylabel("model − plant [mrad]")
    difference.set_xlabel("time [s]")
    key(angle, len(responses))
    for panel in (angle, voltage, difference):
        panel.margins(x=0.01)
    return figure


def closed_loop(identified: ModelParameters, fmus: dict[str, Path], folder: Path) -> tuple[Figure, dict[str, float]]:
    """Run the loops and write ``figure4.csv``; return the figure and each model's largest difference [rad]."""
    time, responses = closed_loops(models(identified), fmus)
    header = ["time [s]"]
    for rig in responses:
        header += [f"{rig} pitch [rad]", f"{rig} v_f - v_r [V]"]
    rows = np.column_stack([time, *responses.values()])[::_STRIDE]
    write_table(folder / "figure4.csv", header, rows.tolist())
    worst = {
        rig: float(np.abs(response[:, 0] - responses[PLANT][:, 0]).max())
        for rig, response in responses.items()
        if rig != PLANT
    }
    return closed_loop_figure(time, responses), worst
