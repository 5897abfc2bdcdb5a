"""References as instruments: a second estimate of an axis' gain, from outside the loop alone.

Prediction errors are right only if the noise model is right, and the noise of swirling air has another spectrum.
References (a stick, steps) are independent of the air. With b = (1, four Laguerre outputs of each reference), psi and y
the whitened regressors and regressand of an axis (:mod:`.prediction_error`), and sums over samples h apart, of noise
with the intensity 1,

    Pi   = (sum b b^T)^-1 sum b psi^T         from earlier samples only
    z    = Pi^T b                             psi as the references predict it
    M    = h sum z psi^T,    m = h sum z (y - psi^T Omega),    V = h sum z z^T
    gain = Omega + (M^T V^-1 M + P^-1)^-1 M^T V^-1 m,    variance (M^T V^-1 M + P^-1)^-1

P is the prior around the present estimate: references that do not move a rig contradict nothing. Pi comes from earlier
samples, so z is independent of the present noise; with Pi of the same samples a short flight would give the biased
value of least squares. b changes slowly and is held for .1 s. Columns that depend on earlier ones are left out.

Omega and the instruments' gain come from the same flight, so they should differ by less than the standard error
(Hausman, Econometrica 46 (1978)). If they differ by more than ``CONTRADICTION`` standard errors, the noise model is
wrong, or the connected signal is no reference but feedback.
Sources: Soderstrom and Stoica, Instrumental Variable Methods for System Identification, 1983; Angrist, Imbens and
Krueger, J. Applied Econometrics 14 (1999), for Pi of other samples.
"""

from collections.abc import Sequence
from math import sqrt
from operator import add
from typing import NamedTuple

from .linear_algebra import back_solve, dot, eliminate, is_singular, outer, quadratic_form, split_packed, with_products
from .loop import FILTERS, advance_laguerre

CONTRADICTION = 2.5
"""Number of standard errors from which the instruments exclude an estimate: by chance in less than one of 80 cases."""

GAINS = "k_x", "k_z", "k_y"
"""Gains of pitch, elevation and travel."""

NO_REFERENCES = (0.0, 0.0, 0.0)
"""References of pitch, elevation and travel [rad] if none is connected: they never move."""

_SIZE = 1 + 3 * FILTERS  # length of b


class References(NamedTuple):
    """State of the references, common to all axes."""

    first: tuple[float, float, float]  # references at sample 0 [rad], constant before it
    moved: bool = False  # whether one has changed
    b: tuple[float, ...] = (1.0, *([0.0] * (_SIZE - 1)))


class Instruments(NamedTuple):
    """State of the instruments of one axis."""

    signal_sums: tuple[float, ...]  # sums of (psi, y) since the last products
    first_products: tuple[float, ...]  # packed sums of products of (b, psi)
    second_products: tuple[float, ...]  # packed sums of products of (z, psi, y)
    first_stage: tuple[tuple[float, ...], ...]  # Pi by columns, 0 before its first evaluation
    gain: float  # at the last evaluation [rad/s^2/V], 0 while no reference has moved
    standard_error: float  # of the gain


def initial_instruments(parameters: int) -> Instruments:
    """Return the state before the first sample of an axis with ``parameters`` parameters."""
    n = parameters
    first_products, second_products = outer([0.0] * (_SIZE + n)), outer([0.0] * (2 * n + 1))
    return Instruments((0.0,) * (n + 1), tuple(first_products), tuple(second_products), ((0.0,) * _SIZE,) * n, 0.0, 0.0)


def advance_references(
    r: References, references: tuple[float, float, float], count: int, stride: int, h: float
) -> References:
    """Return ``r`` after sample number ``count`` of period ``h`` [s]; b changes every ``stride`` samples."""
    pitch, elevation, travel = r.first
    if not r.moved and references[0] == pitch and references[1] == elevation and references[2] == travel:
        return r
    if count % stride != 0:
        return r._replace(moved=True)
    b = [1.0]
    for k in range(3):
        x = r.b[1 + FILTERS * k : 1 + FILTERS * (k + 1)]
        b = [*b, *advance_laguerre(x, references[k] - r.first[k], stride * h)]
    return References(r.first, True, tuple(b))


def update_instruments(
    i: Instruments, psi: Sequence[float], y: float, b: tuple[float, ...], stride: int, decay: float
) -> Instruments:
    """Return ``i`` after a sample; ``b`` was held over ``stride`` samples, which is 0 if no products are due."""
    signal_sums = tuple(map(add, i.signal_sums, (*psi, y)))
    if stride == 0:
        return Instruments(signal_sums, *i[1:])
    mean = [x / stride for x in signal_sums]
    z = [dot(column, b) for column in i.first_stage]
    return i._replace(
        signal_sums=(0.0,) * len(signal_sums),
        first_products=with_products(i.first_products, decay, [*b, *mean[:-1]], stride),
        second_products=with_products(i.second_products, decay, [*z, *mean], stride),
    )


def solve_gain(i: Instruments, omega: tuple[float, ...], prior: tuple[float, ...], index: int, h: float) -> Instruments:
    """Return ``i`` with Pi and the gain, the element ``index`` of Omega; ``prior`` are the prior variances."""
    n = len(i.first_stage)
    V, cross = split_packed(i.second_products, 2 * n + 1, n)
    S = quadratic_form(*eliminate(V, [[*row[:n], row[n] - dot(row[:n], omega)] for row in cross]))
    normal = [[h * S[j][k] + (1.0 / prior[j] if j == k else 0.0) for k in range(j, n)] for j in range(n)]
    B, products = split_packed(i.first_products, _SIZE + n, _SIZE)
    first_stage = back_solve(*eliminate(B, products))
    U, C = eliminate(normal, [[1.0 if j == index else 0.0, h * S[j][n]] for j in range(n)])
    if is_singular(U):
        return i._replace(first_stage=first_stage)
    solution = quadratic_form(U, C)
    return i._replace(first_stage=first_stage, gain=omega[index] + solution[0][1], standard_error=sqrt(solution[0][0]))


def contradicts(i: Instruments, gain: float) -> bool:
    """Return whether the instruments exclude the estimate ``gain`` [rad/s^2/V]."""
    return abs(i.gain - gain) > CONTRADICTION * i.standard_error > 0.0
