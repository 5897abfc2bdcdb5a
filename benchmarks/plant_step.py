"""Computing time of a step of the plant, and of a record beside python-control and scipy at equal accuracy.

    python benchmarks/plant_step.py [ROUNDS]

All contenders run in turn in each round; the tables give the median and the smallest of the rounds. For the whole unit
at most 15 us with all effects off and 30 us with all on are required, on an idle core. The record is the held-out log
of rig-a, 90 s at 10 ms, with voltages held over a sample. Required are 100 times the speed of python-control and 500
times that of scipy, with an error below 1e-8 rad against a tight reference.
"""

import sys
from functools import partial
from pathlib import Path
from statistics import median
from time import perf_counter

import control
import numpy as np
from scipy.integrate import solve_ivp

import heli_identifier
from heli_plant.compiled import compiled, parameter_record
from heli_plant.effects import CATALOGUE
from heli_plant.parameters import TABLE_2
from heli_plant.plant import step
from heli_plant.simplified_model import simplified_accelerations
from heli_plant.simulation import simulate
from heli_plant.state import PlantState, start_state

H = 0.01
LOG = Path(heli_identifier.__file__).parent / "demo_logs" / "rig-a" / "held.csv"
SETS = {
    "all effects off": TABLE_2,
    "one effect on": TABLE_2._replace(dry_friction_pitch=0.025),
    "all effects on": TABLE_2._replace(**{e.field: 0.01 for e in CATALOGUE}),
    "general model": TABLE_2._replace(general_model=1.0),
}
FLYING = PlantState(0.1, 0.05, 0.2, 0.1, 0.05, -0.2, 1.2, 1.1)


def seconds(work):
    begin = perf_counter()
    work()
    return perf_counter() - begin


# --- steps -------------------------------------------------------------------------------------------------------


def interpreted_steps(parameters, count=300):
    for k in range(count):
        step(FLYING, 1.5, 1.0, 0.0, k * H, H, parameters)
    return count


def _compiled_steps(state, count, p):
    start = state
    for k in range(count):
        state = step(start, 1.5 + 1e-12 * state.pitch, 1.0, 0.0, k * H, H, p)
    return state


def compiled_steps(parameters, count=20_000):
    compiled(_compiled_steps)(FLYING, count, parameter_record(parameters))
    return count


def step_table(rounds):
    """Print microseconds a step, interpreted and compiled."""
    contenders = {
        (name, way.__name__.split("_")[0]): partial(way, p)
        for name, p in SETS.items()
        for way in (interpreted_steps, compiled_steps)
    }
    times = {key: [] for key in contenders}
    for work in contenders.values():
        work()
    for _ in range(20 * rounds):
        for key, work in contenders.items():
            begin = perf_counter()
            count = work()
            times[key].append((perf_counter() - begin) / count * 1e6)
    print("one step, microseconds        interpreted            compiled        ratio")
    print("                             median  smallest     median  smallest")
    for name in SETS:
        slow, fast = times[name, "interpreted"], times[name, "compiled"]
        print(
            f"{name:26} {median(slow):8.2f} {min(slow):9.2f} {median(fast):10.3f} {min(fast):9.3f}"
            f" {median(slow) / median(fast):8.0f}"
        )


# --- a record ----------------------------------------------------------------------------------------------------


def slope(t, x, v_front, v_rear):
    """Right-hand side for the peers: the same equations, with the motors as two more states."""
    a = simplified_accelerations(x[0], x[1], x[3], x[4], x[5], x[6] - x[7], x[6] + x[7], TABLE_2)
    T = TABLE_2.T_m
    return [x[3], x[4], x[5], *a, (v_front - x[6]) / T, (v_rear - x[7]) / T]


def scipy_by_samples(V, start, **options):
    """Run solve_ivp again for every sample, so that the voltage steps between its integrations only."""
    x = np.array(start[:8])
    angles = [x[:3]]
    for v in V[:-1]:
        x = solve_ivp(slope, (0.0, H), x, args=tuple(v), **options).y[:, -1]
        angles.append(x[:3])
    return np.array(angles)


def scipy_in_one_go(V, start, **options):
    """Run solve_ivp once with the held voltage as a function of time: its step control must find every voltage step."""
    last, t = len(V) - 1, H * np.arange(len(V))

    def held(t, x):
        return slope(t, x, *V[min(int(t / H + 1e-9), last)])

    return solve_ivp(held, (0.0, t[-1]), start[:8], t_eval=t, **options).y[:3].T


def python_control(V, start, **options):
    """Run input_output_response, which joins the voltage samples by straight lines."""
    plant = control.nlsys(lambda t, x, u, params: slope(t, x, u[0], u[1]), None, inputs=2, states=8, outputs=8)
    t = H * np.arange(len(V))
    return control.input_output_response(plant, t, V.T, list(start[:8]), solve_ivp_kwargs=options).outputs[:3].T


def straight_lines(V, start):
    """Tight reference for voltages that are joined by straight lines."""
    x = np.array(start[:8])
    angles = [x[:3]]
    for a, b in zip(V[:-1], V[1:], strict=True):

        def joined(t, x, a=a, b=b):
            return slope(t, x, *(a + (b - a) * t / H))

        x = solve_ivp(joined, (0.0, H), x, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        angles.append(x[:3])
    return np.array(angles)


def ours(V, start, substeps=1):
    """Run the compiled simulation, with several Runge-Kutta steps a sample where asked."""
    return simulate(np.repeat(V, substeps, axis=0), H / substeps, start, TABLE_2)[1][::substeps]


def record_table(rounds):
    """Print seconds, error and ratio of each way to simulate the log."""
    columns = np.loadtxt(LOG, delimiter=",", skiprows=1)
    V = columns[:, 1:3].clip(-TABLE_2.v_max, TABLE_2.v_max)
    start = start_state(*columns[0, 3:6], *V[0])
    held = scipy_by_samples(V, start, method="DOP853", rtol=1e-12, atol=1e-13)
    tight = {"rtol": 1e-9, "atol": 1e-10}
    contenders = {
        "ours, 10 ms": (ours, {}, held),
        "ours, two steps a sample": (ours, {"substeps": 2}, held),
        "scipy RK45, anew each sample": (scipy_by_samples, {"rtol": 1e-6, "atol": 1e-9}, held),
        "scipy LSODA, in one go": (scipy_in_one_go, {"method": "LSODA", "rtol": 1e-11, "atol": 1e-12}, held),
        "python-control, as it comes": (python_control, {}, straight_lines(V, start)),
        "python-control, tight": (python_control, tight, straight_lines(V, start)),
    }
    errors = {
        name: np.abs(way(V, start, **options) - reference).max()
        for name, (way, options, reference) in contenders.items()
    }
    times = {name: [] for name in contenders}
    for _ in range(rounds):
        for name, (way, options, _) in contenders.items():
            times[name].append(seconds(partial(way, V, start, **options)))
    mine = median(times["ours, 10 ms"])
    print(f"\n{len(V) * H:.0f} s at 10 ms                  median s   smallest s  error rad     ratio")
    for name in contenders:
        middle = median(times[name])
        print(f"{name:30} {middle:9.5f} {min(times[name]):12.5f} {errors[name]:10.1e} {middle / mine:9.0f}")


def main():
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    step_table(rounds)
    record_table(rounds)


if __name__ == "__main__":
    main()
