"""The loop that a controller closes: whether there is one, and how much the data tell in spite of it.

**Is there one?** An innovation e_k cannot be predicted from anything before the angles of sample k. In open loop no
later voltage depends on it; in closed loop every later one does. With v_k the voltage held from t_k on (the rotors'
difference for pitch and travel, their sum for elevation), and d_k = v_k - v_(k-1), the score is

    s_b   = sum of (e_k - e_(k-2)) (d_k - a_1 d_(k-1) - .. - a_4 d_(k-4)) over a block of 1 s
    score = sum_b w_b s_b / sqrt(sum_b w_b^2 s_b^2),    w_b = exp(-age / 60 s)

If the model lacks a delay or friction, e_k depends on earlier voltages, and so do the voltages of a smooth excitation.
Therefore only that part of d_k counts which earlier ones do not predict; a is the solution of the Yule-Walker equations
with the weights w_b. In open loop the score has roughly a normal distribution; in closed loop it grows with the square
root of time, to 5 in 30 s. The paper's adaptation has no innovations; its error is whitened first, with a fixed G.
Source: Soderstrom and Stoica, System Identification, 1989, section 11.2 (independence of residuals and inputs).

**What comes from outside?** If nothing from outside excites a loop, every regressor is the loop's answer to past
innovations, and prediction errors tell gain and stiffness apart by the noise model alone. If the noise model may be
wrong, only the part of the regressors counts that past innovations do not explain.

Past innovations, scaled to the intensity 1, pass four Laguerre filters of the pole p; b are their outputs. From the
weighted sums of products of b and of the whitened regressors psi follow, for a combination j^T Omega,

    R   = sum of psi psi^T,    C = sum of psi b^T,    B = sum of b b^T
    share = j^T R^-1 j / j^T (R - C B^-1 C^T)^-1 j

between 0 (all can be an answer to innovations) and 1. Four filters do not describe a loop completely: in hover without
excitation the share was up to .4. Only the share beyond ``UNEXPLAINED`` counts,

    standard error = that of white innovations / sqrt((share - UNEXPLAINED) / (1 - UNEXPLAINED))

Sources: Gevers, Ljung and Van den Hof, Asymptotic variance expressions for closed-loop identification, Automatica 37
(2001); Forssell and Ljung, Closed-loop identification revisited, Automatica 35 (1999), section 5 (bias by a wrong noise
model); Wahlberg, System identification using Laguerre models, IEEE Trans. Automatic Control 36 (1991).
"""

from collections.abc import Sequence
from math import exp, sqrt
from typing import NamedTuple

from .linear_algebra import back_solve, dot, eliminate, is_singular, quadratic_form, split_packed, with_products
from .whitening import Memory

CLOSED = 3.0
"""Absolute score from which the loop counts as closed; in open loop it is exceeded by chance in .3 % of the cases."""

_BLOCK_TIME = 1.0  # length of a block [s]
_BLOCK_DECAY = exp(-_BLOCK_TIME / 60.0)  # factor of the sums from block to block [1]
_REST_TIME = 3.0  # time of the estimation before the first block [s]: sigma is not an innovation yet


Five = tuple[float, float, float, float, float]
"""Sums of products with d_k .. d_(k-4)."""
_NOTHING = (0.0, 0.0, 0.0, 0.0, 0.0)


class Feedback(NamedTuple):
    """State of the score of one axis."""

    memory: Memory  # of whitening adaptation errors
    voltage: float  # since the last sample [V]
    e1: float = 0.0  # last innovation [rad/s^2]
    e2: float = 0.0
    changes: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)  # the last ones, newest first [V]
    block: Five = _NOTHING  # sums of (e_k - e_(k-2)) d_(k-i) over the unfinished block
    powers: Five = _NOTHING  # weighted sums of d_k d_(k-i)
    filled: int = 0  # samples in that block
    total: float = 0.0  # weighted sum of s_b
    squares: float = 0.0  # weighted sum of s_b^2


def score_samples(h: float) -> tuple[int, int]:
    """Return the number of samples of period ``h`` [s] before the first block, and in a block."""
    return round(_REST_TIME / h), max(1, round(_BLOCK_TIME / h))


def update_score(f: Feedback, e: float, voltage: float, count: int, samples: tuple[int, int]) -> Feedback:
    """Return ``f`` after the sample ``count`` with innovation ``e`` [rad/s^2]; ``voltage`` is held from it on.

    ``samples`` are those of :func:`score_samples`.
    """
    memory, old_voltage, e1, e2, (d_1, d_2, d_3, d_4), block, powers, filled, total, squares = f
    d, new = voltage - old_voltage, e - e2
    if count >= samples[0]:
        s, s_1, s_2, s_3, s_4 = block
        r, r_1, r_2, r_3, r_4 = powers
        block = s + new * d, s_1 + new * d_1, s_2 + new * d_2, s_3 + new * d_3, s_4 + new * d_4
        powers = r + d * d, r_1 + d * d_1, r_2 + d * d_2, r_3 + d * d_3, r_4 + d * d_4
        filled += 1
    if filled >= samples[1]:
        s_b = _unpredicted(block, powers)
        total, squares = _BLOCK_DECAY * total + s_b, _BLOCK_DECAY * _BLOCK_DECAY * squares + s_b * s_b
        r, r_1, r_2, r_3, r_4 = powers
        powers = _BLOCK_DECAY * r, _BLOCK_DECAY * r_1, _BLOCK_DECAY * r_2, _BLOCK_DECAY * r_3, _BLOCK_DECAY * r_4
        block, filled = _NOTHING, 0
    return Feedback(memory, voltage, e, e1, (d, d_1, d_2, d_3), block, powers, filled, total, squares)


def _unpredicted(block: Five, powers: Five) -> float:
    """Return s_b: the sum with d_k without its prediction from earlier changes."""
    r = [*powers]
    a = back_solve(*eliminate([r[: 4 - i] for i in range(4)], [[x] for x in r[1:]]))[0]
    return block[0] - dot(a, block[1:])


def is_closed(scores: tuple[float, float, float]) -> bool:
    """Return whether the score of one of the axes says that the loop is closed."""
    return max(abs(scores[0]), abs(scores[1]), abs(scores[2])) > CLOSED


def feedback_score(f: Feedback) -> float:
    """Return the score [1]; 0 before the first block is full."""
    return f.total / sqrt(f.squares) if f.squares > 0.0 else 0.0


FILTERS = 4  # number of Laguerre filters
_POLE = 2.0  # p [rad/s]: that of loops of elevation and pitch
_PERIOD = 0.1  # time between two products [s], short enough for signals as slow as these
UNEXPLAINED = 0.4
"""Largest share that counts as nothing, chosen with other generated rigs than those in the results."""

_LEAST_SHARE = 1e-4  # least share that counts: standard errors grow by a factor of a hundred at most


class Outside(NamedTuple):
    """State of the regressors' share from outside the loop."""

    filtered: tuple[float, ...]  # outputs of the filters
    products: tuple[float, ...]  # packed sums of products of (b, psi)


def product_interval(h: float) -> int:
    """Return the number of samples of period ``h`` [s] between two products."""
    return max(1, round(_PERIOD / h))


def advance_laguerre(x: Sequence[float], u: float, time: float) -> list[float]:
    """Return the outputs of the filters with the input ``u``, ``time`` [s] after the outputs ``x``."""
    a = exp(-_POLE * time)
    y = [a * x[0] + sqrt(1.0 - a * a) * u]
    for i in range(1, FILTERS):
        y.append(a * x[i] + x[i - 1] - a * y[i - 1])
    return y


def initial_outside(parameters: int) -> Outside:
    """Return the state before the first sample of an axis with ``parameters`` parameters."""
    size = FILTERS + parameters
    return Outside((0.0,) * FILTERS, (0.0,) * (size * (size + 1) // 2))


def update_outside(o: Outside, innovation_sum: float, psi: Sequence[float], decay: float, time: float) -> Outside:
    """Return the state after adding products of the whitened regressors ``psi``, ``time`` [s] after the last ones.

    ``innovation_sum`` is that of the innovations since then. ``psi`` are known before the sample; ``decay`` is the
    factor of the earlier products [1].
    """
    filtered = advance_laguerre(o.filtered, innovation_sum, time)
    return Outside(tuple(filtered), with_products(o.products, decay, [*filtered, *psi]))


def shares(o: Outside, combinations: tuple[tuple[float, ...], ...]) -> tuple[float, ...]:
    """Return the share of each combination j^T Omega that counts, 1e-4 if the data do not determine it."""
    n = len(combinations[0])
    rows = [[j[i] for j in combinations] for i in range(n)]
    zeros = [[0.0 for _ in combinations] for _ in range(FILTERS)]
    B, _ = split_packed(o.products, FILTERS + n, FILTERS + n)
    U, C = eliminate(B[FILTERS:], [list(row) for row in rows])
    V, D = eliminate(B, [*zeros, *rows])
    if is_singular(U) or is_singular(V):
        return tuple([_LEAST_SHARE for _ in combinations])
    by_all, by_outside = quadratic_form(U, C), quadratic_form(V, D)
    counted: list[float] = []
    for k in range(len(combinations)):
        share = by_all[k][k] / by_outside[k][k] if by_outside[k][k] > 0.0 else 0.0
        counted.append(max(_LEAST_SHARE, (share - UNEXPLAINED) / (1.0 - UNEXPLAINED)))
    return tuple(counted)
