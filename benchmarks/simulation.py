"""The plant off line: one step interpreted and compiled, and a 90 s log beside scipy and python-control.

The log is the held-out one of rig-a, 10 ms, voltages held over a sample. Bars: 500 times the speed of scipy and 100
times that of python-control, with an error below 1e-8 rad against a tight reference.
"""

from functools import partial
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from benchmarks.harness import Bar, bar_table, figure, in_turn, measured_at, ratio, seconds, table
from heli_identifier.records import demo_logs
from heli_plant.compiled import compiled, parameter_record
from heli_plant.effects import CATALOGUE
from heli_plant.parameters import TABLE_2, PlantParameters
from heli_plant.plant import step
from heli_plant.simplified_model import simplified_accelerations
from heli_plant.simulation import simulate
from heli_plant.state import PlantState, start_state

Array = NDArray[np.float64]
H, ROUNDS = 0.01, 3
INTERPRETED, COMPILED = 300, 20_000
"""Steps of a round."""

SETS = {
    "all effects off": TABLE_2,
    "one effect on": TABLE_2._replace(dry_friction_pitch=0.025),
    "all effects on": TABLE_2._replace(**{e.field: 0.01 for e in CATALOGUE}),
    "general model": TABLE_2._replace(general_model=1.0),
}
FLYING = PlantState(0.1, 0.05, 0.2, 0.1, 0.05, -0.2, 1.2, 1.1)


def interpreted_steps(parameters: PlantParameters) -> None:
    """Step as a unit does."""
    for k in range(INTERPRETED):
        step(FLYING, 1.5, 1.0, 0.0, k * H, H, parameters)


def _compiled_steps(state: Any, count: int, p: Any) -> Any:
    start = state
    for k in range(count):
        state = step(start, 1.5 + 1e-12 * state.pitch, 1.0, 0.0, k * H, H, p)
    return state


def compiled_steps(parameters: PlantParameters) -> None:
    """Step in compiled code."""
    compiled(_compiled_steps)(FLYING, COMPILED, parameter_record(parameters))


def slope(t: float, x: Any, v_front: float, v_rear: float) -> list[float]:
    """Right-hand side for the peers: the same equations, with the motors as two more states."""
    a = simplified_accelerations(x[0], x[1], x[3], x[4], x[5], x[6] - x[7], x[6] + x[7], TABLE_2)
    T = TABLE_2.T_m
    return [x[3], x[4], x[5], *a, (v_front - x[6]) / T, (v_rear - x[7]) / T]


def ours(V: Array, start: Any) -> Array:
    """Run the compiled simulation."""
    return simulate(V, H, start, TABLE_2)[1]


def scipy_by_samples(V: Array, start: Any, lines: bool = False, **options: Any) -> Array:
    """Run solve_ivp again for every sample, under the held voltage, or along straight ``lines`` between samples."""
    x = np.array(start[:8])
    angles = [x[:3]]
    for a, b in zip(V[:-1], V[1:], strict=True):

        def right(t: float, x: Any, a: Array = a, b: Array = b) -> list[float]:
            return slope(t, x, *(a + (b - a) * t / H if lines else a))

        x = solve_ivp(right, (0.0, H), x, **options).y[:, -1]
        angles.append(x[:3])
    return np.array(angles)


def python_control(V: Array, start: Any, **options: Any) -> Array:
    """Run input_output_response, which joins the voltage samples by straight lines."""
    plant = control.nlsys(lambda t, x, u, params: slope(t, x, u[0], u[1]), None, inputs=2, states=8, outputs=8)
    t = H * np.arange(len(V))
    return control.input_output_response(plant, t, V.T, list(start[:8]), solve_ivp_kwargs=options).outputs[:3].T


def simulation() -> str:
    """Measure both."""
    columns = np.loadtxt(demo_logs("rig-a")[1][0], delimiter=",", skiprows=1)
    V = columns[:, 1:3].clip(-TABLE_2.v_max, TABLE_2.v_max)
    start = start_state(*columns[0, 3:6], *V[0])
    tight = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
    held, joined = (scipy_by_samples(V, start, lines, **tight) for lines in (False, True))
    ways = {
        "this project, 10 ms": (partial(ours, V, start), held),
        "scipy RK45, begun again each sample": (partial(scipy_by_samples, V, start, rtol=1e-6, atol=1e-9), held),
        "python-control, default tolerances": (partial(python_control, V, start), joined),
        "python-control, tight": (partial(python_control, V, start, rtol=1e-9, atol=1e-10), joined),
    }
    errors = {name: float(np.abs(way() - reference).max()) for name, (way, reference) in ways.items()}
    times = in_turn({name: way for name, (way, _) in ways.items()}, ROUNDS, warm_up=False)
    own, rk45, _, theirs = times.values()
    counts = {interpreted_steps: INTERPRETED, compiled_steps: COMPILED}
    work = {f"{name} {way.__name__}": partial(way, p) for name, p in SETS.items() for way in counts}
    steps = in_turn(work, 20 * ROUNDS)
    slow, fast = (
        {name: 1e6 * steps[f"{name} {way.__name__}"].median / count for name in SETS} for way, count in counts.items()
    )
    return "\n\n".join(
        [
            "## The plant off line",
            bar_table(
                [
                    Bar("error of a 90 s log at 10 ms", errors["this project, 10 ms"], 1e-8, "rad"),
                    Bar("against scipy solve_ivp (RK45)", ratio(rk45, own), 500.0, "times faster", True),
                    Bar("against python-control, tight tolerances", ratio(theirs, own), 100.0, "times faster", True),
                ]
            ),
            table(
                ("90 s at 10 ms", "median", "least", "error [rad]", "times as long"),
                [(name, seconds(t.median), seconds(t.least), f"{errors[name]:.1e}", figure(ratio(t, own)))
                 for name, t in times.items()],
            ),
            table(
                ("one step", "interpreted [us]", "compiled [us]"),
                [(name, figure(slow[name]), figure(fast[name])) for name in SETS],
            ),
            f"{ROUNDS} rounds in turn for the log, {20 * ROUNDS} for the step. Errors are against a reference "
            "integrated to 1e-12 under the voltages as each takes them: held over a sample, or, for python-control, "
            "joined by straight lines.",
            measured_at("numpy", "numba", "scipy", "control"),
        ]
    )  # fmt: skip
