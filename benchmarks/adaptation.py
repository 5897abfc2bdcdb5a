"""Adaptation (7) over a whole record, beside padasip's RLS filter on the same regressors.

Both are recursive least squares with forgetting: padasip with mu = beta and R(0) = I/eps is (7) with Gamma_max
infinite, R = w Gamma and hence 1/eps = w Gamma(0), see :mod:`heli_identifier.online.adaptation`. So both must arrive
at the same Omega, which is checked before anything is timed. padasip gets y and phi ready made; the replay filters
the log and forms them itself. padasip steps in Python and costs the same for every sample: it runs over fewer, and
its time is scaled.
"""

from functools import partial
from math import exp, inf

import numpy as np
from numpy.typing import NDArray

from benchmarks.machine import measured_at
from benchmarks.online_identifier import samples
from benchmarks.replay import Replay, replay
from benchmarks.tables import Bar, bar_table, figure, seconds, table
from benchmarks.timing import in_turn, ratio
from heli_identifier.online import IdentifierSettings, prepare, start
from heli_identifier.online.adaptation import adaptation_coefficients
from heli_identifier.online.signals import (
    advance_signals,
    elevation_regression,
    pitch_regression_free,
    travel_regression,
)

LONG, SHORT, ROUNDS = 1_000_000, 20_000, 3

Regression = tuple[NDArray[np.float64], NDArray[np.float64]]
"""y (N,) and phi (N, n) of one axis."""


def record(count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Voltages (count, 2) and angles (count, 3): the on-line benchmark's samples, repeated where more are asked."""
    whole = np.resize(np.array(list(samples(min(count, SHORT)))), (count, 5))
    return whole[:, :2], whole[:, 2:]


def regressions(
    voltages: NDArray[np.float64], angles: NDArray[np.float64], settings: IdentifierSettings
) -> list[Regression]:
    """Regressand and regressors of the three axes, from the first adapted sample on."""
    plan = prepare(settings)
    f, signals = plan.signals.filter, start(plan, *voltages[0], *angles[0]).signals
    rows: list[list] = [[], [], []]
    for k in range(1, len(angles)):
        signals = advance_signals(signals, *voltages[k], *angles[k], plan.signals)
        if k >= plan.hold_samples:
            axes = pitch_regression_free(signals, f), elevation_regression(signals, f), travel_regression(signals, f)
            for axis, (y, phi) in zip(rows, axes, strict=True):
                axis.append((y, *phi))
    tables = [np.array(axis) for axis in rows]
    return [(axis[:, 0], axis[:, 1:]) for axis in tables]


def padasip_omega(regressions_: list[Regression], settings: IdentifierSettings) -> NDArray[np.float64]:
    """Omega (11,) of padasip's filters after their last sample."""
    from padasip.filters import FilterRLS

    h, alpha = settings.sample_time, settings.forgetting
    c = adaptation_coefficients(alpha, h, inf)
    weight = c.forgetting / c.noise
    plan = prepare(settings)
    state = start(plan, 0.0, 0.0, 0.0, 0.0, 0.0)
    final = []
    for (y, phi), axis in zip(regressions_, (state.pitch, state.elevation, state.travel), strict=True):
        eps = 1.0 / (weight * settings.initial_gain)
        filter_ = FilterRLS(phi.shape[1], mu=exp(-alpha * h), eps=eps, w=np.array(axis.omega))
        filter_.run(y, phi)
        final.append(filter_.w)
    return np.concatenate(final)


def replay_omega(history: Replay) -> NDArray[np.float64]:
    """Omega (11,) of the replay's last row, p and q in place of a_th and theta0."""
    a_wx, a_th, k_x, theta0, *rest = history.parameters[-1]
    return np.array([a_wx, a_th * np.cos(theta0), a_th * np.sin(theta0), k_x, *rest])


def disagreement(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """Largest relative distance of two Omega, parameter by parameter."""
    return float(np.max(np.abs(first - second) / np.abs(second)))


def section(load: float) -> str:
    as_printed, bounded = IdentifierSettings(gain_limit=inf), IdentifierSettings()
    log, short = record(LONG), record(SHORT)
    ready = regressions(*short, as_printed)
    theirs = padasip_omega(ready, as_printed)
    apart = disagreement(replay_omega(replay(*short, as_printed)), theirs)
    bound = disagreement(replay_omega(replay(*short, bounded)), theirs)
    times = in_turn(
        {"replay": partial(replay, *log, bounded), "padasip": partial(padasip_omega, ready, as_printed)}, ROUNDS
    )
    adapted = len(ready[0][0])
    own, other = times["replay"], times["padasip"].scaled(LONG / adapted)
    faster = ratio(other, own)
    rows = [
        ("replay: filters, regressors, adaptation with bounded gain", figure(LONG), *_cells(own), "1"),
        ("padasip FilterRLS, regressors given, scaled", f"{adapted}", *_cells(other), figure(faster)),
    ]
    return "\n\n".join(
        [
            "## Adaptation (7) over a record, three axes",
            bar_table(
                [
                    Bar("1e6 samples on three axes", own.median, 1.5, "s"),
                    Bar("against padasip's RLS on the same regressors", faster, 20.0, "times faster", at_least=True),
                ]
            ),
            table(("what", "samples run", "median for 1e6", "least for 1e6", "times as long"), rows),
            f"{ROUNDS} rounds. padasip steps in Python, sample by sample; its time is scaled linearly. With the gain "
            f"unbounded both are the same recursion: after {adapted} samples no parameter differs by more than "
            f"{apart:.1e} of itself. With the default bound of the gain, which (7) lacks, one differs by {bound:.1e}.",
            measured_at(("numpy", "numba", "padasip"), load),
        ]
    )


def _cells(times) -> tuple[str, str]:
    return seconds(times.median), seconds(times.least)
