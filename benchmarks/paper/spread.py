"""What makes the paper's experiments 1 and 2 differ, and what makes the runs of one experiment scatter.

The paper's estimates in experiment 2 lie outside their ranges in experiment 1. On a plant that obeys the model both
experiments give the same numbers; an effect that the model lacks biases each in its own way. For an entry of the
catalogue, its coefficient c and the plant's own a_wx, a_th, k_x are fitted so that identification gives the midpoints m
of the six ranges:

    misfit(c) = sqrt(1/6 sum (estimate - m)^2 / r^2),    r half the width of each range

Without an effect the best misfit is that of one plant between both experiments; below 1 the estimates lie inside the
ranges on average. Every effect is fitted alone, then every effect together with the best one. Two effects are five
numbers fitted to six, so a good fit of two effects says little.

Within an experiment, the standard deviation of a random torque (first-order Gauss-Markov) is scaled until the geometric
mean of the six ratios, found range to printed range, is one. A range is proportional to a weak torque.

All of this runs off line, on the compiled plant and identifier, with theta0 known as in the paper's Table 1.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from math import exp, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares
from scipy.signal import lfilter

from benchmarks.replay import replay
from heli_identifier.online import IdentifierSettings
from heli_identifier.online.excitation import paper_excitation, voltages
from heli_plant.along import run_alone
from heli_plant.effects import CATALOGUE, Effect
from heli_plant.parameters import TABLE_2, PlantParameters
from heli_plant.simulation import simulate
from heli_plant.state import rest_state

EXPERIMENTS = (1, 2)
PITCH = ("a_wx", "a_th", "k_x")
"""Parameters of the paper's Table 1 [1/s, 1/s^2, rad/s^2/V]."""

TABLE_1 = {
    1: {"a_wx": (0.059, 0.062), "a_th": (0.658, 0.668), "k_x": (0.289, 0.298)},
    2: {"a_wx": (0.064, 0.068), "a_th": (0.595, 0.623), "k_x": (0.257, 0.269)},
}
"""Ranges of twelve estimates, as printed, by experiment."""

RANGES = np.array([[TABLE_1[experiment][name] for name in PITCH] for experiment in EXPERIMENTS])
MIDDLES, HALF_WIDTHS = RANGES.mean(axis=2), 0.5 * np.ptp(RANGES, axis=2)
COLUMNS = tuple(f"{name} in experiment {experiment}" for experiment in EXPERIMENTS for name in PITCH)

STEP, DURATION, BASE = 0.01, 200.0, 0.5
"""Sampling period and length [s] of an experiment, voltage of each rotor beneath the signal [V]."""

SETTINGS = IdentifierSettings(rest_angle=TABLE_2.theta0, initial_gain=1e6, gain_limit=1e6)
"""Gamma(0) is so large that Omega(0) is forgotten: what deviates from Table 2 is due to the effect."""

AS_GOOD = 1.05
"""Explanations whose misfits differ by less than this factor are equally good."""

SHARES = np.geomspace(1e-3, 1.0, 9)
"""Coefficients that are tried first, as shares of the catalogue's bound."""

LOWEST, HIGHEST = (0.0, 0.05, 0.01), (1.0, 5.0, 5.0)
"""Bounds of the plant's own a_wx, a_th, k_x: a damping cannot be negative."""

WORST = 1e3
"""Residual of a plant that runs away."""

CORRELATION_TIMES = (0.1, 1.0, 10.0)
"""Of the random torque [s]: from a rotor's wash to a draught in the room."""

Values = NDArray[np.float64]
Identify = Callable[[PlantParameters, int], Values]
"""Estimates of `PITCH` from a plant and an experiment, as :func:`identify_pitch` gives them."""


@cache
def pitch_voltages(experiment: int, duration: float = DURATION) -> Values:
    """Give front and rear voltage (N, 2) [V] of the pitch experiment."""
    excitation = paper_excitation(experiment, "difference", BASE)
    return np.array([voltages(k * STEP, excitation) for k in range(round(duration / STEP))])


def identify_pitch(
    parameters: PlantParameters, experiment: int, duration: float = DURATION, torque: Values | None = None
) -> Values:
    """Run the pitch experiment on a plant, with a ``torque`` (N,) [rad/s^2] on the pitch, and estimate as the paper.

    The estimates come from exact angles; they are NaN where the plant left the finite range.
    """
    held, start = pitch_voltages(experiment, duration), rest_state(parameters, 2.0 * BASE)
    if torque is None:
        angles = simulate(held, STEP, start, parameters)[1]
    else:
        pushes = np.column_stack((torque, np.zeros((len(torque), 2))))
        angles = run_alone(held, STEP, np.array(start, dtype=float), parameters, pushes)
    if not np.isfinite(angles).all():
        return np.full(3, np.nan)
    final = replay(held, angles, SETTINGS, every=len(held)).final
    return np.array([getattr(final, name) for name in PITCH])


# --- between the experiments -------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Explanation:
    """A fit to Table 1: none to two effects, coefficients, the plant's own `PITCH`, and estimates (2, 3)."""

    effects: tuple[Effect, ...]
    coefficients: tuple[float, ...]
    own: tuple[float, ...]
    estimates: Values

    @property
    def misfit(self) -> float:
        """Root mean square of the six deviations in half widths [1]."""
        return float(np.sqrt(np.mean(residuals(self.estimates) ** 2)))


def candidates() -> tuple[Effect, ...]:
    """Give the entries of the catalogue that act on the pitch."""
    return tuple(effect for effect in CATALOGUE if "pitch" in effect.axes)


def residuals(estimates: Values) -> Values:
    """Give the deviations of ``estimates`` (2, 3) from the midpoints in half widths, shape (2, 3)."""
    return np.clip(np.nan_to_num((estimates - MIDDLES) / HALF_WIDTHS, nan=WORST), -WORST, WORST)


def explained(identify: Identify, effects: Sequence[Effect], x: Values) -> Explanation:
    """Identify the plant whose own parameters and coefficients are ``x``, in this order."""
    fields = (*PITCH, *(effect.field for effect in effects))
    plant = TABLE_2._replace(**dict(zip(fields, x.tolist(), strict=True)))
    estimates = np.array([identify(plant, experiment) for experiment in EXPERIMENTS])
    return Explanation(tuple(effects), tuple(x[3:].tolist()), tuple(x[:3].tolist()), estimates)


def fitted(
    identify: Identify, effects: Sequence[Effect], start: Values, evaluations: int, held: int = 0
) -> tuple[Values, OptimizeResult]:
    """Fit own parameters and coefficients from ``start``, the last ``held`` kept."""
    free = len(start) - held
    lowest = np.array([*LOWEST, *(effect.lower for effect in effects)])[:free]
    highest = np.array([*HIGHEST, *(effect.upper for effect in effects)])[:free]
    first = np.clip(start[:free], lowest, highest)
    scale = np.maximum(np.abs(first), 1e-6 * (highest - lowest))

    def deviations(x: Values) -> Values:
        return residuals(explained(identify, effects, np.append(x * scale, start[free:])).estimates).ravel()

    bounds = (lowest / scale, highest / scale)
    # The step of the differences is far larger than the rounding of the identification.
    fit = least_squares(deviations, first / scale, bounds=bounds, diff_step=1e-3, max_nfev=evaluations)
    return fit.x * scale, fit


def explain(identify: Identify, effect: Effect, given: Explanation) -> Explanation:
    """Add one effect to an explanation: a scan over its coefficient, then least squares from the best place.

    The scan runs outwards from zero, and each fit of everything else begins where its neighbour's ended.
    """
    effects = (*given.effects, effect)
    known = np.array([*given.own, *given.coefficients])
    best, least = np.append(known, 0.0), np.inf
    for bound in (effect.lower, effect.upper):
        others = known
        for c in bound * SHARES if bound != 0.0 else ():
            others, fit = fitted(identify, effects, np.append(others, c), 3, held=1)
            if fit.cost < least:
                best, least = np.append(others, c), fit.cost
    return explained(identify, effects, fitted(identify, effects, best, 30)[0])


def search(effects: Sequence[Effect], identify: Identify = identify_pitch) -> list[Explanation]:
    """Fit none, one and two effects; give all explanations, the best first.

    Effects that fit as well as the best one are not combined with it: they imitate each other.
    """
    none = explained(identify, (), fitted(identify, (), MIDDLES.mean(axis=0), 30)[0])
    singles = [explain(identify, effect, none) for effect in effects]
    best = min([none, *singles], key=lambda one: one.misfit)
    pairs: list[Explanation] = []
    if best.misfit * AS_GOOD < none.misfit:
        same = {one.effects[0] for one in singles if one.misfit < AS_GOOD * best.misfit}
        pairs = [explain(identify, effect, best) for effect in effects if effect not in same]
    return sorted([none, *singles, *pairs], key=lambda one: one.misfit)


def spread_table(found: Sequence[Explanation]) -> tuple[list[str], list[list[object]]]:
    """Give header and rows: the explanations, the best first."""
    header = [f"{word} {number}" for number in (1, 2) for word in ("effect", "axis", "coefficient", "unit")]
    rows = []
    for one in found:
        row: list[object] = []
        for effect, c in zip(one.effects, one.coefficients, strict=True):
            row += [effect.name, effect.axis, c, effect.unit]
        rows.append([*row, *[""] * (8 - len(row)), one.misfit, *one.own, *one.estimates.ravel().tolist()])
    return [*header, "misfit", *(f"plant's own {name}" for name in PITCH), *COLUMNS], rows


# --- within an experiment ----------------------------------------------------------------------------------------


def random_torque(deviation: float, correlation_time: float, count: int, seed: int) -> Values:
    """Give ``count`` samples [rad/s^2] with standard deviation ``deviation`` and ``correlation_time`` [s]."""
    kept = exp(-STEP / correlation_time)
    white = np.random.default_rng(seed).standard_normal(count)
    white[1:] *= sqrt(1.0 - kept * kept)  # the first sample is drawn from the stationary distribution
    return deviation * lfilter([1.0], [1.0, -kept], white)


def estimates_under_torque(
    correlation_time: float, deviation: float, runs: int = 12, duration: float = DURATION
) -> Values:
    """Give estimates (2, runs, 3) of the plant of Table 2, each run with a torque of its own."""
    count = round(duration / STEP)
    return np.array(
        [
            [
                identify_pitch(TABLE_2, e, duration, random_torque(deviation, correlation_time, count, 1000 * e + run))
                for run in range(runs)
            ]
            for e in EXPERIMENTS
        ]
    )


def matched_torque(correlation_time: float, runs: int = 12) -> tuple[float, Values]:
    """Give deviation [rad/s^2] and estimates under the torque whose ranges are as wide as the paper's."""
    deviation = 0.01
    for _ in range(3):
        widths = np.ptp(estimates_under_torque(correlation_time, deviation, runs), axis=1)
        deviation *= exp(-float(np.mean(np.log(widths / (2.0 * HALF_WIDTHS)))))
    return deviation, estimates_under_torque(correlation_time, deviation, runs)


def within_table() -> tuple[list[str], list[list[object]]]:
    """Give header and rows: the paper's widths, then widths and means under random torques."""
    rows: list[list[object]] = [["the paper", "", "", *(2.0 * HALF_WIDTHS).ravel().tolist()]]
    for correlation_time in CORRELATION_TIMES:
        deviation, estimates = matched_torque(correlation_time)
        for what, values in (("width", np.ptp(estimates, axis=1)), ("mean", estimates.mean(axis=1))):
            rows.append([f"random torque: {what}", correlation_time, deviation, *values.ravel().tolist()])
    return ["what", "correlation time [s]", "standard deviation [rad/s^2]", *COLUMNS], rows
