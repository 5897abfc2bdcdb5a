"""References as instruments: a second opinion on an axis' gain, from outside the loop alone.

Prediction errors are right where the noise model is. Air that swirls has another colour, and moves k_x by a fifth
while innovations stay nearly white. References (a stick, steps) know nothing of the air. With b = (1, four Laguerre
outputs of each reference), psi and y the whitened regressors and regressand of an axis (:mod:`.prediction_error`), and
sums over all samples, h apart and of noise with the intensity 1,

    B = sum b b^T,    C = sum b (psi, y)^T,    S = h C^T B^-1 C                   two-stage least squares
    gain = Omega + (S_psi + P^-1)^-1 (S_y - S_psi Omega),    variance (S_psi + P^-1)^-1

P is the prior around the present estimate: references that do not move a rig contradict nothing. b changes slowly and
is held for .1 s. Columns of B that depend on earlier ones (a reference that rests, a second copy) are left out.

Omega and the instruments' gain rest on the same flight, so that they differ by less than the standard error says
(Hausman, Econometrica 46 (1978)): beyond ``CONTRADICTION`` of them the noise model is wrong, or what is connected is no
reference but feedback.
Sources: Soderstrom and Stoica, Instrumental Variable Methods for System Identification, 1983; for the filters
:mod:`.outside`.
"""

from collections.abc import Sequence
from math import sqrt
from operator import add
from typing import NamedTuple

from .outside import FILTERS, OutsideCoefficients, cholesky, half_solved

CONTRADICTION = 2.5
"""Standard errors of the instruments beyond which they exclude an estimate: by chance in less than one of 80."""

GAINS = "k_x", "k_z", "k_y"
"""Gains of pitch, elevation and travel."""

NO_REFERENCES = (0.0, 0.0, 0.0)
"""References of pitch, elevation and travel [rad] where none is connected: they never move."""

_SIZE = 1 + 3 * FILTERS
"""Length of b."""

_LEAST_PIVOT = 1e-8
"""Share of the square of an element of b that must remain beside the earlier ones."""


class References(NamedTuple):
    """What all axes share: b, the packed sums of b b^T; ``first`` references [rad], and whether one has ``moved``."""

    first: tuple[float, float, float]
    moved: bool
    b: tuple[float, ...]
    products: tuple[float, ...]


class Instruments(NamedTuple):
    """What an axis keeps.

    Sums of (psi, y) since the last products, ``waiting``; ``products``, the sums of b (psi, y)^T by rows; the ``gain``
    and its ``standard_error`` as last evaluated [rad/s^2/V], both 0 while no reference has moved.
    """

    waiting: tuple[float, ...]
    products: tuple[float, ...]
    gain: float
    standard_error: float


def first_references(references: tuple[float, float, float]) -> References:
    """Return the state at sample 0, before which the ``references`` [rad] rested."""
    return References(references, False, (1.0, *([0.0] * (_SIZE - 1))), (0.0,) * (_SIZE * (_SIZE + 1) // 2))


def no_instruments(parameters: int) -> Instruments:
    """Return the state before the first sample of an axis with so many ``parameters``."""
    return Instruments((0.0,) * (parameters + 1), (0.0,) * (_SIZE * (parameters + 1)), 0.0, 0.0)


def have_moved(r: References, references: tuple[float, float, float]) -> References:
    """Return ``r`` at a sample with these ``references`` [rad]."""
    if r.moved or (references[0] == r.first[0] and references[1] == r.first[1] and references[2] == r.first[2]):
        return r
    return r._replace(moved=True)


def advance_references(
    r: References, references: tuple[float, float, float], kept: float, c: OutsideCoefficients
) -> References:
    """Return ``r`` after ``c.stride`` samples over which b was held, of whose earlier products a share is ``kept``."""
    stride, _, a, entry = c
    products = [stride * x * y for i, x in enumerate(r.b) for y in r.b[i:]]
    faded = [kept * x for x in r.products]
    b = [1.0]
    for k in range(3):
        u = entry * (references[k] - r.first[k])
        last = 0.0
        for i in range(FILTERS):
            x = r.b[1 + FILTERS * k + i]
            y = a * x + u if i == 0 else a * x + last - a * u
            last, u = x, y
            b.append(y)
    return References(r.first, True, tuple(b), tuple(map(add, faded, products)))


def add_signals(
    i: Instruments, psi: Sequence[float], y: float, b: tuple[float, ...], due: bool, kept: float
) -> Instruments:
    """Return ``i`` after a sample; products are taken with the ``b`` that was held where they are ``due``."""
    waiting = tuple(map(add, i.waiting, (*psi, y)))
    if not due:
        return Instruments(waiting, i.products, i.gain, i.standard_error)
    products = [x * z for x in b for z in waiting]
    faded = [kept * x for x in i.products]
    return Instruments((0.0,) * len(waiting), tuple(map(add, faded, products)), i.gain, i.standard_error)


def evaluated(
    i: Instruments, r: References, omega: tuple[float, ...], prior: tuple[float, ...], index: int, h: float
) -> Instruments:
    """Return ``i`` with the gain at ``index`` of Omega, from samples every ``h`` [s].

    The ``prior`` variances stand at the places of Omega.
    """
    n = len(i.waiting) - 1
    S = [h * x for x in _explained(i, r, n + 1)]
    normal, g = [], []
    for j in range(n):
        left = S[j * (n + 1) + n]
        for k in range(n):
            left -= S[j * (n + 1) + k] * omega[k]
        g.append(left)
        for k in range(j, n):
            normal.append(S[j * (n + 1) + k] + (1.0 / prior[j] if j == k else 0.0))
    lower = cholesky(tuple(normal), n, 0)
    if len(lower) < n:
        return i
    unit = half_solved(lower, tuple([1.0 if j == index else 0.0 for j in range(n)]))
    other = half_solved(lower, tuple(g))
    shift, variance = 0.0, 0.0
    for j in range(n):
        shift += unit[j] * other[j]
        variance += unit[j] * unit[j]
    return Instruments(i.waiting, i.products, omega[index] + shift, sqrt(variance))


def contradicts(i: Instruments, gain: float) -> bool:
    """Return whether the instruments exclude the estimate ``gain`` [rad/s^2/V]."""
    return abs(i.gain - gain) > CONTRADICTION * i.standard_error > 0.0


def _explained(i: Instruments, r: References, columns: int) -> list[float]:
    """Return S = C^T B^-1 C by rows, shape (columns, columns), by elimination of B."""
    B = [[r.products[j * _SIZE - j * (j - 1) // 2 + k - j] for k in range(j, _SIZE)] for j in range(_SIZE)]
    C = [[i.products[j * columns + k] for k in range(columns)] for j in range(_SIZE)]
    wholes = [B[j][0] for j in range(_SIZE)]
    S = [0.0] * (columns * columns)
    for j in range(_SIZE):
        pivot = B[j][0]
        if pivot > _LEAST_PIVOT * wholes[j]:
            for k in range(j + 1, _SIZE):
                share = B[j][k - j] / pivot
                for m in range(k, _SIZE):
                    B[k][m - k] -= share * B[j][m - j]
                for m in range(columns):
                    C[k][m] -= share * C[j][m]
            for k in range(columns):
                for m in range(columns):
                    S[k * columns + m] += C[j][k] * C[j][m] / pivot
    return S
