"""Computing time of the on-line identifier: an interpreted step, a replayed record, and ten million steps of the gain.

    python benchmarks/online_identifier.py

An FMU runs the interpreted step; at most 40 us on an idle core are required. The replay compiles the same functions; at
most 1.5 s for 1e6 samples on three axes are required.
"""

from math import sin
from statistics import median
from time import perf_counter, process_time

import numpy as np

from heli_identifier.online import PREDICTION_ERROR, IdentifierSettings, prepare, start, step
from heli_identifier.online.adaptation import (
    adapt,
    adaptation_coefficients,
    gain_matrix,
    initial_factor,
    loosen,
    measure,
)
from heli_identifier.online.excitation import paper_excitation, voltages
from heli_identifier.workbench.identify.replay import replay
from heli_plant.compiled import compiled

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


def _many_steps(count, factor, omega, direction, coefficients, refresh):
    """Adapt with excitation for 1000 s in every 12 000 s, and without it otherwise.

    Every ``refresh`` samples the last two parameters may have changed, as those of the noise model, and return to their
    prior; never if it is 0.
    """
    seed, phi = 1, [0.0] * 5
    for k in range(count):
        scale = 1.0 if (k // 100_000) % 12 == 0 else 0.0
        for i in range(5):
            seed = (seed * 1103515245 + 12345) % 2147483648
            phi[i] = scale * (seed / 1073741824.0 - 1.0)
        adapt(factor, omega, phi, phi[0] - phi[4], k, coefficients, direction)
        if refresh > 0 and k % refresh == 0:
            loosen(factor, 3, 2e-4)
            measure(factor, omega, (0.0, 0.0, 0.0, 1.0, 0.0), 0.0, 0.16 * 0.16 / 2e-4, 1.0, direction)
            loosen(factor, 4, 2e-3)
            measure(factor, omega, (0.0, 0.0, 0.0, 0.0, 1.0), 0.0, 0.49 * 0.49 / 2e-3, 1.0, direction)


def long_run(refresh, count=10_000_000):
    """Give the seconds of ``count`` steps, and the extreme eigenvalues of Gamma after them."""
    run, coefficients = compiled(_many_steps), adaptation_coefficients(0.001, 0.01, 1e3)
    run(10, np.array(initial_factor(5, 1e3)), np.zeros(5), np.zeros(5), coefficients, refresh)
    factor = np.array(initial_factor(5, 1e3))
    begin = perf_counter()
    run(count, factor, np.zeros(5), np.zeros(5), coefficients, refresh)
    seconds = perf_counter() - begin
    eigenvalues = np.linalg.eigvalsh(gain_matrix(factor.tolist(), 5))
    return seconds, eigenvalues[0], eigenvalues[-1]


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
    for name, refresh in (("adaptation", 0), ("prediction errors", 20)):
        seconds, smallest, largest = long_run(refresh)
        print(f"1e7 steps of the gain, {name}: {seconds:.2f} s, eigenvalues {smallest:.3g} to {largest:.6g}")


if __name__ == "__main__":
    main()
