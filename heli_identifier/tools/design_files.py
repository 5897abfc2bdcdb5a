"""A design as a table, a figure of steps over the plants that the data allow, and a MATLAB file.

The inputs of the MATLAB file are V_s = v_front + v_rear and V_d = v_front - v_rear, as in the laboratory of TTK4115
Linear System Theory, NTNU.
"""

import math

import numpy as np
from numpy.typing import NDArray

from heli_identifier.results import Axes, Table, figure, figure_file, join_words, render, to_digits
from heli_identifier.tools.judging import CONFIDENCE, Design
from heli_identifier.tools.linearisation import linear_system
from heli_identifier.tools.loop import STEP
from heli_identifier.tools.margins import LOOPS
from heli_plant.state_feedback import FeedbackSettings

_FROM_ROTORS = np.array([[1.0, 1.0], [1.0, -1.0]])
"""(V_s, V_d) of (v_front, v_rear); half of it gives (v_front, v_rear) of (V_s, V_d)."""


def design_table(design: Design) -> Table:
    """Return margins, settling times and stable loops of both designs: of the estimated plant, and what plants keep."""
    titles = {"disk": "disk margin, both rotors"}
    for loop in LOOPS:
        margins = {"gain": "gain margin", "phase": "phase margin [deg]", "sensitivity": "peak of the sensitivity"}
        titles |= {f"{loop}.{name}": f"{loop} loop: {title}" for name, title in margins.items()}
    titles |= {f"{axis}.settling": f"{axis}: settles in [s]" for axis in design.axes}
    rows = []
    for name, title in titles.items():
        figures = [judged.figures[name] for judged in design.by_name.values()]
        rows.append((title, *(_figure_text(value) for x in figures for value in (x.value, x.promised))))
    shares = (text for x in design.by_name.values() for text in ("", _figure_text(100.0 * x.stable_share)))
    rows.append(("plants with a stable loop [%]", *shares))
    for axis in LOOPS if design.kind == "pid" else ():
        gains = (getattr(judged.settings, axis) for judged in design.by_name.values())
        own = (", ".join(to_digits(gain, 4) for gain in of_axis) for of_axis in gains)
        rows.append((f"{axis} loop: P, I, D", *(text for gains_text in own for text in (gains_text, ""))))
    what = f"what {100.0 * CONFIDENCE:.0f} % of {len(design.plants.drawn)} plants keep"
    title = f"{design.kind.upper()} of {join_words(design.axes)}: {what}"
    return Table(title, ("figure", *(head for name in design.by_name for head in (name, "kept"))), rows)


def _figure_text(value: float) -> str:
    return to_digits(value) if math.isfinite(value) else "none"


def step_figure(design: Design) -> str:
    """Return the text of design.svg: steps of all controllers over the band of 95 % of the plants with the last one."""
    *_, (last, judged) = design.by_name.items()
    panels = []
    for axis, band in judged.band.items():
        time, (low, high) = np.arange(band.shape[1]) * design.plants.model.sampled.dt, STEP * band
        panel = Axes(f"{axis} [rad]", limits=(-STEP, 2.5 * STEP))  # drawn plants may be unstable
        panel.band(time, low, high, f"95 % of the plants, {last}")
        panel.level(STEP, "muted")
        for (name, controller), role in zip(design.by_name.items(), ("before", "after"), strict=False):
            panel.line(time, controller.steps[axis], role, name)
        panels.append(panel)
    names = " and ".join(design.by_name)
    return figure_file(figure(panels, "time since the step of the reference [s]", f"Steps, {names}", 1100.0))


def controller_m(design: Design) -> str:
    """Return the text of controller.m: the linear model and the delivered controller, for the inputs (V_s, V_d)."""
    model, point = design.plants.model, design.plants.model.point
    system = linear_system(model.plant, point)
    return render(
        "controller.m.j2",
        point=point,
        held=_FROM_ROTORS @ (point.v_front, point.v_rear),
        system=system,
        B=system.B @ (0.5 * _FROM_ROTORS),
        x0=[*point.state(model.plant)[:8], *[0.0] * (system.nstates - 8)],
        input_delay=model.plant.input_delay_rotors,
        design=design,
        confidence=CONFIDENCE,
        matrices=_matrices,
    )


def _matrices(settings: FeedbackSettings) -> dict[str, NDArray[np.float64]]:
    """Return the matrices of a state feedback by the symbols of its equations, for the inputs (V_s, V_d)."""
    return {
        "K": _FROM_ROTORS @ np.array(settings.gain),
        "K_z": _FROM_ROTORS @ np.array(settings.integral),
        "N": _FROM_ROTORS @ np.array(settings.reference),
        "F": np.array(settings.transition),
        "G": np.array(settings.drive) @ (0.5 * _FROM_ROTORS),
        "L": np.array(settings.innovation),
    }
