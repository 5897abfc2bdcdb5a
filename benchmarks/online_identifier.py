"""Computing time of the on-line identifier: an interpreted step, a replayed record; Gamma over ten million samples.

    python -m benchmarks.online_identifier [--gamma]      only Gamma over 1e7 samples of the native unit

An FMU runs the interpreted step; at most 40 us on an idle core are required. The replay compiles the same functions; at
most 1.5 s for 1e6 samples on three axes are required.
"""

import sys
from math import sin
from statistics import median
from time import perf_counter, process_time

import numpy as np

from benchmarks.native_identifier import built_units
from benchmarks.native_memory import identifier_state
from benchmarks.replay import replay
from heli_identifier.online import PREDICTION_ERROR, IdentifierSettings, prepare, start, step
from heli_identifier.online.adaptation import gain_matrix
from heli_identifier.online.excitation import paper_excitation, voltages

WATCHED = (("dry_friction", "pitch"), ("quadratic_thrust", "pitch"), ("dry_friction", "travel"))


def samples(count):
    """Voltages of the paper and angles that move at three frequencies."""
    excitation = paper_excitation(1)
    for k in range(count):
        t = 0.01 * k
        yield (
            *voltages(t, excitation),
            0.1 + 0.3 * sin(1.3 * t),
            0.2 + 0.2 * sin(1.7 * t),
            0.3 * t + 0.2 * sin(0.5 * t),
        )


def step_times(settings, count=12_000):
    """Median time of a step and mean processor time of all [s], once the adaptation runs.

    The mean takes in the steps in which standard errors are evaluated; in processor time, other programs on the
    machine do not count.
    """
    plan, rows = prepare(settings), list(samples(count))
    state, times = start(plan, *rows[0]), []
    for k, row in enumerate(rows[1:], 1):
        if k == plan.hold_samples:
            begun = process_time()
        begin = perf_counter()
        state, _ = step(state, *row, plan)
        times.append(perf_counter() - begin)
    return median(times[plan.hold_samples :]), (process_time() - begun) / (count - plan.hold_samples)


def replay_time(count=1_000_000):
    """Seconds for ``count`` samples, compiled beforehand."""
    table = np.resize(np.array(list(samples(20_000))), (count, 5))
    voltage, angle = table[:, :2], table[:, 2:]
    replay(voltage[:2000], angle[:2000], IdentifierSettings())
    begin = perf_counter()
    replay(voltage, angle, IdentifierSettings())
    return perf_counter() - begin


def flight(steps, seed):
    """Return samples (steps, 5) of a rig that is shaken every twelfth stretch of 1e5 samples and rests in between."""
    random = np.random.default_rng(seed)
    count = 2.0 * np.pi / 4096
    shaken = (np.arange(steps) // 100_000) % 12 == 0
    voltages = 1.0 + shaken[:, None] * np.repeat(random.uniform(-1.0, 1.0, (-(-steps // 50), 2)), 50, axis=0)[:steps]
    time = 0.01 * np.arange(steps)
    swing = np.column_stack([np.sin(1.3 * time), np.sin(1.7 * time), np.sin(0.5 * time)])
    flips = random.random((steps, 3)) < 0.002
    angles = shaken[:, None] * 0.2 * swing + (flips.cumsum(axis=0) % 2) * count
    return np.column_stack([voltages, np.round(angles / count) * count])


def long_run(units, count=10_000_000, block=100_000, **parameters):
    """Give the extreme eigenvalues of Gamma over ``count`` samples of the native unit, read after every block."""
    low, high = [], []
    with units.unit(0.01, ("k_x",), **parameters) as unit:
        for first in range(0, count, 12 * block):
            rows = flight(min(12 * block, count - first), first)
            for k in range(0, len(rows), block):
                unit.take(rows[k : k + block], block)
                state = identifier_state(unit.instance)
                for axis in (state.pitch, state.elevation, state.travel):
                    spectrum = np.linalg.eigvalsh(gain_matrix(axis.factor, len(axis.omega)))
                    low.append(spectrum[0])
                    high.append(spectrum[-1])
    return min(low), max(high)


METHODS = {
    "adaptation": {"method": "adaptation"},
    "prediction errors, lag known": {"method": PREDICTION_ERROR, "motor__lag_known": True},
    "prediction errors": {"method": PREDICTION_ERROR},
}


def main():
    for name, settings in (
        ("theta0 estimated", IdentifierSettings()),
        ("theta0 given", IdentifierSettings(rest_angle=-0.136)),
        (f"{len(WATCHED)} effects watched", IdentifierSettings(watched=WATCHED)),
        ("prediction errors, lag known", IdentifierSettings(method=PREDICTION_ERROR, lag_known=True)),
        ("prediction errors", IdentifierSettings(method=PREDICTION_ERROR)),
    ):
        middle, mean = step_times(settings)
        print(f"step, {name:18} median {middle * 1e6:5.1f} us   mean {mean * 1e6:5.1f} us")
    print(f"replay of 1e6 samples   {replay_time():.2f} s")
    gamma()


def gamma():
    """Print what Gamma does over 1e7 samples of the native unit, for every method and two rates of forgetting [1/s]."""
    with built_units() as units:
        for name, given in METHODS.items():
            for alpha in (0.001, 0.1):
                low, high = long_run(units, adaptation__forgetting=alpha, **given)
                print(f"1e7 samples, {name}, alpha {alpha:g}: eigenvalues of Gamma {low:.3g} to {high:.6g}", flush=True)


if __name__ == "__main__":
    gamma() if "--gamma" in sys.argv else main()
