"""Effects of the catalogue that can be watched on line, each as one more regressor of an axis.

An effect that enters an axis' acceleration as c g(motion) is watched by the signal g, filtered as every other. g is
the plant's own law with c = 1.

* On the axis itself (friction, couplings, constant torque, ...): g is what the law adds to the acceleration.
* In the rotors (place THRUST): g is the thrust voltage that the effect adds, in the place of mu_d, mu_s cos(theta) or
  mu_s sin(theta). The regression finds k c with k the axis' gain, as for an effect that is a share of the lift:
  divided by the estimate of k.

**Rates.** A nonlinear law needs the rate itself, not the filtered one. It comes from a faster state filter of its own,
omega_d = 20 rad/s, whose delay of 2 rho / omega_d is taken back with the acceleration that the filter has as well:

    w = s F_d theta + (2 rho / omega_d) s^2 F_d theta = (1 - s^2 / omega_d^2 + ...) theta'

The law of that motion is a signal at the sampling instants, and passes F as a straight line between them.

Prediction errors may use nothing of the newest sample in a regressor, which holds the innovation: the sign of a rate
near zero would follow it, and friction would be found in every held flight. There the law is held at its value at the
beginning of the sampling period, omega_d is 7 rad/s and the delay is not taken back.

**Running score:** how clearly a watched effect explains the residual of its axis' base regression. From the block sums
of z z^T, z = (phi, candidates, y) (:mod:`.moments`), weighted by the forgetting:

    g_p   = g - phi^T b           the candidate's regressor with the base regressors projected out
    e     = y - phi^T Omega       the residual of the base regression, by least squares as well
    c     = <g_p, e> / <g_p, g_p>
    score = c / standard error    the error from the blocks' sums of g_p (e - c g_p), as in :mod:`.moments`

c is the coefficient of a regression on phi and g together (Frisch and Waugh 1933, Lovell 1963). Where the effect is
absent, the score follows roughly a t distribution with ten degrees of freedom: it exceeds 3 in about 1 % of the cases.

Of prediction errors (:mod:`.prediction_error`) the residual is white with intensity 1, and the standard error of c is
<g_p, g_p>^-1/2. That from the blocks' sums is taken where it is larger, since a noise model is never quite right, and
needs no correction for the parameters that were fitted.

The score is 0 where the motion so far cannot decide: with a visibility, the norm of g_p over that of g, below .01, or
with nearly all of g_p in too few blocks (an axis that came to rest once). The effective number of blocks is
(sum e_b)^2 / sum e_b^2 with e_b the square of g_p in block b.
"""

from collections.abc import Callable
from math import cos, sin, sqrt
from typing import NamedTuple

from heli_plant.effects import AXES, CATALOGUE, ROTORS, Effect
from heli_plant.laws import law_alone

from ..errors import ConfigurationError
from .linear_algebra import bilinear_form, bordered, dot, eliminated, is_singular, solved, total, unit_vector
from .moments import LEAST_FREEDOM, OVERLAP, freedom, variance_of_sum
from .signals import Signals
from .state_filter import FilterCoefficients, Pair, discretise, filter_line, second_derivative


class Motion(NamedTuple):
    """What the laws depend on at one instant: angles [rad], rates [rad/s], nu_f and nu_r [V], travel at rest [rad]."""

    pitch: float
    elevation: float
    travel: float
    pitch_rate: float
    elevation_rate: float
    travel_rate: float
    nu_front: float
    nu_rear: float
    cable_rest: float


class Candidate(NamedTuple):
    """One watched effect."""

    name: str
    axis: str
    law: Callable[..., float]  # the plant's with c = 1
    in_rotors: bool  # it changes the thrust voltages
    times_gain: bool  # the regression finds c times the axis' gain k


def candidate(name: str, axis: str) -> Candidate:
    """Return the candidate of the effect ``name`` watched on ``axis``; ConfigurationError if it cannot be."""
    for own, candidates in _CANDIDATES:
        if axis == own:
            for one in candidates:
                if name == one.name:
                    return one
            names = ", ".join([one.name for one in candidates])
            raise ConfigurationError(f"effect {name!r} cannot be watched on {axis}; choose of {names}")
    raise ConfigurationError(f"watched axis {axis!r} must be one of {', '.join(WATCHABLE)}")


def _made(entry: Effect, axis: str) -> Candidate:
    in_rotors = entry.axis == ROTORS
    return Candidate(entry.name, axis, law_alone(entry), in_rotors, in_rotors or entry.share_of_lift)


_CANDIDATES = tuple(
    (axis, tuple([_made(entry, axis) for entry in CATALOGUE if entry.watchable and entry.axis in (axis, ROTORS)]))
    for axis in AXES
)
WATCHABLE = {axis: tuple(one.name for one in candidates) for axis, candidates in _CANDIDATES}
"""Names of the effects that can be watched, per axis."""


def candidate_value(c: Candidate, m: Motion) -> float:
    """Return g of the candidate for the motion ``m``: [rad/s^2] or [V] per unit of its coefficient."""
    if c.in_rotors:
        front, rear = c.law(m.nu_front, 0.0) - m.nu_front, c.law(m.nu_rear, 0.0) - m.nu_rear
        if c.axis == "pitch":
            return front - rear
        return (front + rear) * (cos(m.pitch) if c.axis == "elevation" else sin(m.pitch))
    return c.law(0.0, *m[:6], m.nu_front + m.nu_rear, m.nu_front - m.nu_rear, m.cable_rest)


_RATE_BANDWIDTH = 20.0  # omega_d [rad/s]
_HELD_RATE_BANDWIDTH = 7.0  # that of prediction errors [rad/s]: beyond it a rate is mostly noise
_RATE_DAMPING = 0.7
_DELAY = 2.0 * _RATE_DAMPING / _RATE_BANDWIDTH  # what is taken back of the delay of F_d [s]


class WatchState(NamedTuple):
    """What is remembered of watched effects."""

    rates: tuple[Pair, Pair, Pair]  # (xi_1, xi_2) of the rate filters
    cable_rest: float  # travel at sample 0 [rad]
    values: tuple[float, ...]  # of the candidates
    filtered: tuple[Pair, ...]  # (xi_1, xi_2) of each


def discretised_rates(h: float, held: bool) -> FilterCoefficients:
    """Return the filter that rates come from every ``h`` [s]; ``held`` for prediction errors."""
    return discretise(_HELD_RATE_BANDWIDTH if held else _RATE_BANDWIDTH, _RATE_DAMPING, h, 0.0)


def settled_watch(s: Signals, candidates: tuple[Candidate, ...]) -> WatchState:
    """Return the state at sample 0, at rest in the angles of ``s``."""
    pitch, elevation, travel = s.angles
    at_rest = Motion(pitch, elevation, travel, 0.0, 0.0, 0.0, s.lagged[0], s.lagged[1], travel)
    values = tuple([candidate_value(candidate, at_rest) for candidate in candidates])
    settled = tuple([(value, 0.0) for value in values])
    return WatchState(((pitch, 0.0), (elevation, 0.0), (travel, 0.0)), travel, values, settled)


def advance_watch(
    w: WatchState, s: Signals, candidates: tuple[Candidate, ...], d: FilterCoefficients, held: bool,
    f: FilterCoefficients,
) -> WatchState:  # fmt: skip
    """Return the state at the sample that ``s`` has just taken in; ``d`` filters the rates, ``f`` the laws.

    ``held``: each law is held over a sampling period at its value at the beginning.
    """
    xi_1, xi_2, xi_3 = [filter_line(xi, a, b, d) for xi, a, b in zip(w.rates, s.angles_1, s.angles, strict=True)]
    rates = xi_1, xi_2, xi_3
    w_1, w_2, w_3 = [
        xi[1] if held else xi[1] + _DELAY * second_derivative(xi, now, before, oldest, d)
        for xi, now, before, oldest in zip(rates, s.angles, s.angles_1, s.angles_2, strict=True)
    ]
    pitch, elevation, travel = s.angles
    motion = Motion(pitch, elevation, travel, w_1, w_2, w_3, s.lagged[0], s.lagged[1], w.cable_rest)
    values = tuple([candidate_value(candidate, motion) for candidate in candidates])
    filtered = [
        filter_line(xi, before, before if held else now, f)
        for xi, before, now in zip(w.filtered, w.values, values, strict=True)
    ]
    return WatchState(rates, w.cable_rest, values, tuple(filtered))


_LEAST_VISIBILITY = 0.01


class Score(NamedTuple):
    """Score [1] and coefficient c (unit of the effect's) of one watched effect."""

    score: float
    coefficient: float


NOTHING = Score(0.0, 0.0)  # the score while nothing is known


def scores(
    weights: list[float], blocks: list[tuple[float, ...]], n: int, candidates: int, interval: float, whitened: bool
) -> tuple[Score, ...]:
    """Return the score of each candidate from ``n`` base regressors, from weighted blocks.

    ``interval`` [s] is the time of each sample; ``whitened``: the residual is white with intensity 1.
    """
    size = n + candidates + 1
    # Neighbouring blocks of a white residual are independent: a parameter takes one of them.
    if candidates == 0 or freedom(weights, n + 1, 1.0 if whitened else OVERLAP) < LEAST_FREEDOM:
        return (NOTHING,) * candidates
    moments = [dot(weights, [block[k] for block in blocks]) for k in range(len(blocks[0]))]
    base, others = bordered(moments, size, n)
    U, C = eliminated(base, others)
    if is_singular(U):
        return (NOTHING,) * candidates
    # each signal behind phi with phi projected out, by its coefficients on z
    left = [[*(-x for x in column), *unit_vector(k, candidates + 1)] for k, column in enumerate(solved(U, C))]
    wholes = [row[0] for row in bordered(moments, size, size)[0][n:-1]]
    least = 1.0 / sqrt(interval) if whitened else 0.0
    taken = 0 if whitened else n + 1
    return tuple(
        [
            _score(weights, blocks, moments, candidate, left[-1], whole, least, taken)
            for candidate, whole in zip(left[:-1], wholes, strict=True)
        ]
    )


def _score(
    weights: list[float], blocks: list[tuple[float, ...]], moments: list[float], candidate: list[float],
    residual: list[float], whole: float, least: float, taken: int,
) -> Score:  # fmt: skip
    """Return the score of g_p = ``candidate``; it and the ``residual`` e are combinations of z, ``whole`` is <g, g>.

    ``least``: standard error of c times the norm of g_p, at least. ``taken``: degrees of freedom that a fit has taken.
    """
    own = bilinear_form(candidate, candidate)
    strengths = [weight * max(0.0, dot(own, block)) for weight, block in zip(weights, blocks, strict=True)]
    strength = total(strengths)
    left = min(freedom(strengths, min(taken, 1)), freedom(weights, taken))
    if whole <= 0.0 or strength < _LEAST_VISIBILITY * _LEAST_VISIBILITY * whole or left < LEAST_FREEDOM:
        return NOTHING
    coefficient = dot(bilinear_form(candidate, residual), moments) / strength
    explained = [e - coefficient * g for e, g in zip(residual, candidate, strict=True)]
    form = bilinear_form(candidate, explained)
    terms = [weight * dot(form, block) for weight, block in zip(weights, blocks, strict=True)]
    error = sqrt((1.0 + OVERLAP * taken / left) * variance_of_sum(terms)) / strength
    error = max(error, least / sqrt(strength))
    return Score(coefficient / error if error > 0.0 else 0.0, coefficient)
