"""The loop that a controller closes: whether there is one, and what the data tell in spite of it.

**Is there one?** An innovation e_k is what nothing before the angles of sample k can tell. In open loop no later
voltage depends on it; under a controller every later one does, and most of all those held from t_k or t_(k+1) on. With
v_k the voltage held from t_k on (the rotors' difference for pitch and travel, their sum for elevation), the score is

    s_b   = sum of (e_k - e_(k-2)) (v_k - v_(k-1)) over a block of 1 s
    score = sum_b w_b s_b / sqrt(sum_b w_b^2 s_b^2),    w_b = exp(-age / 60 s)

The differences leave out slow changes, which errors of the estimate and an excitation have in common. In open loop the
s_b are independent with mean zero, and the score follows roughly a normal distribution; ``CLOSED`` is exceeded in about
.3 % of the cases. In closed loop the s_b have one sign and the score grows with the square root of time, to 5 in 30 s.

The paper's adaptation has no innovations; its error sigma is whitened here, with a fixed G.
Source: Soderstrom and Stoica, System Identification, 1989, section 11.2 (independence of residuals and inputs).

**What comes from outside?** Where nothing from outside moves a loop, every regressor is the loop's answer to past
innovations. Prediction errors then tell gain and stiffness apart by the noise model alone, and only as well as that is
right; their standard errors do not cover what it lacks. With a noise model that may be anything, all that counts is the
part of the regressors that past innovations do not explain: the asymptotic variance of a gain is that of the noise over
the spectrum of the input from outside.

Past innovations, scaled to the intensity 1, pass four Laguerre filters of the pole p; b are their outputs. From the
weighted sums of products of b and of the whitened regressors psi follow, for a combination j^T Omega,

    R   = sum of psi psi^T,    C = sum of psi b^T,    B = sum of b b^T
    share = j^T R^-1 j / j^T (R - C B^-1 C^T)^-1 j

between 0 (all of it can be an answer to innovations) and 1. Products are taken at 10 Hz, which is ample for the
correlation of signals as slow as these. Four filters do not describe a loop completely: in hover without excitation
they left a share of up to .4. What is beyond ``UNEXPLAINED`` counts,

    standard error = that of white innovations / sqrt((share - UNEXPLAINED) / (1 - UNEXPLAINED))

Sources: Gevers, Ljung and Van den Hof, Asymptotic variance expressions for closed-loop identification, Automatica 37
(2001); Forssell and Ljung, Closed-loop identification revisited, Automatica 35 (1999), section 5 (bias by a wrong noise
model); Wahlberg, System identification using Laguerre models, IEEE Trans. Automatic Control 36 (1991).
"""

from collections.abc import Sequence
from math import exp, log, sqrt
from operator import add
from typing import NamedTuple

from .linear_algebra import eliminated, explained, is_singular
from .whitening import Memory, Noise, Whitening, settled_memory, whiten, whitening

CLOSED = 3.0
"""A score beyond it, of either sign, says that the loop is closed."""

_BLOCK_TIME, _MEMORY = 1.0, 60.0
"""Length of a block and time over which blocks are forgotten [s]."""

_REST_TIME = 3.0
"""Time after the estimation's beginning for which nothing is taken in [s]: sigma is not an innovation yet."""


class FeedbackCoefficients(NamedTuple):
    """``length`` of a block and of the ``rest`` before the first one [samples]; ``kept`` of the sums per block [1].

    ``whitening``: the fixed G for adaptation errors.
    """

    length: int
    rest: int
    kept: float
    whitening: Whitening


class Feedback(NamedTuple):
    """What is known about the loop of one axis.

    The ``memory`` of whitening adaptation errors; the last ``voltage`` [V] and innovations ``e1``, ``e2`` [rad/s^2];
    the unfinished block's sum and its number of samples; the weighted sums of s_b and of its square.
    """

    memory: Memory
    voltage: float
    e1: float
    e2: float
    block: float
    filled: int
    total: float
    squares: float


def feedback_coefficients(h: float, f1: float, f2: float) -> FeedbackCoefficients:
    """Return the coefficients for samples every ``h`` [s]; ``f1``, ``f2`` are those of A_F (:mod:`.whitening`)."""
    noise = Noise()
    return FeedbackCoefficients(
        max(1, round(_BLOCK_TIME / h)),
        round(_REST_TIME / h),
        exp(-_BLOCK_TIME / _MEMORY),
        whitening(log(noise.bandwidth), log(noise.corner), f1, f2, h),
    )


def first_feedback(voltage: float, c: FeedbackCoefficients) -> Feedback:
    """Return what is known at sample 0, from which the axis' ``voltage`` [V] is held."""
    return Feedback(settled_memory(0.0, c.whitening), voltage, 0.0, 0.0, 0.0, 0, 0.0, 0.0)


def watch_error(f: Feedback, sigma: float, voltage: float, count: int, c: FeedbackCoefficients) -> Feedback:
    """Return ``f`` after a sample with adaptation error ``sigma``; the rest as for :func:`watch_innovation`."""
    memory, e = whiten((f.memory,), (sigma,), c.whitening)
    return watch_innovation(f._replace(memory=memory[0]), e[0], voltage, count, c)


def watch_innovation(f: Feedback, e: float, voltage: float, count: int, c: FeedbackCoefficients) -> Feedback:
    """Return ``f`` after a sample with innovation ``e`` [rad/s^2]; ``voltage`` [V] is held from it on.

    ``count`` numbers the samples from 0.
    """
    memory, last, e1, e2, block, filled, total, squares = f
    if count < c.rest:
        return Feedback(memory, voltage, e, e1, block, filled, total, squares)
    block += (e - e2) * (voltage - last)
    filled += 1
    if filled < c.length:
        return Feedback(memory, voltage, e, e1, block, filled, total, squares)
    total, squares = c.kept * total + block, c.kept * c.kept * squares + block * block
    return Feedback(memory, voltage, e, e1, 0.0, 0, total, squares)


def is_closed(scores: tuple[float, float, float]) -> bool:
    """Return whether one of the axes' scores says that the loop is closed."""
    return max(abs(scores[0]), abs(scores[1]), abs(scores[2])) > CLOSED


def feedback_score(f: Feedback) -> float:
    """Return the score [1]; 0 before the first block is full."""
    return f.total / sqrt(f.squares) if f.squares > 0.0 else 0.0


FILTERS = 4
"""Number of Laguerre filters."""

_POLE = 2.0
"""p [rad/s]: that of loops of elevation and pitch."""

_PERIOD = 0.1
"""Time between two products [s]."""

UNEXPLAINED = 0.4
"""Share that counts as nothing. Chosen with generated rigs of another seed than those that results are reported on."""

_LEAST_SHARE = 1e-4
"""Of what counts: standard errors grow to a hundred times at most."""


class OutsideCoefficients(NamedTuple):
    """``stride`` samples between products; share ``kept`` of earlier ones, ``pole`` and ``entry`` of a filter [1]."""

    stride: int
    kept: float
    pole: float
    entry: float


class Outside(NamedTuple):
    """Outputs of the filters; packed sums of products of (b, psi)."""

    filtered: tuple[float, float, float, float]
    products: tuple[float, ...]


def outside_coefficients(h: float, alpha: float) -> OutsideCoefficients:
    """Return the coefficients for samples every ``h`` [s] and forgetting ``alpha`` [1/s]."""
    stride = max(1, round(_PERIOD / h))
    pole = exp(-_POLE * stride * h)
    return OutsideCoefficients(stride, exp(-alpha * stride * h), pole, sqrt(1.0 - pole * pole))


def nothing_outside(parameters: int) -> Outside:
    """Return the state before the first sample of an axis with so many ``parameters``."""
    size = FILTERS + parameters
    return Outside((0.0, 0.0, 0.0, 0.0), (0.0,) * (size * (size + 1) // 2))


def add_regressors(
    o: Outside, psi: Sequence[float], innovations: float, kept: float, c: OutsideCoefficients
) -> Outside:
    """Return the state after a sample whose products are taken.

    ``psi`` are the whitened regressors, known before the sample; ``innovations`` the sum of those since the last
    products, this sample's not among them, of intensity 1; ``kept`` the share of the earlier products [1].
    """
    x_1, x_2, x_3, x_4 = o.filtered
    a = c.pole
    y_1 = a * x_1 + c.entry * innovations
    y_2 = a * x_2 + x_1 - a * y_1
    y_3 = a * x_3 + x_2 - a * y_2
    y_4 = a * x_4 + x_3 - a * y_3
    z = [y_1, y_2, y_3, y_4, *psi]
    products = [a * b for i, a in enumerate(z) for b in z[i:]]
    faded = [kept * x for x in o.products]
    return Outside((y_1, y_2, y_3, y_4), tuple(map(add, faded, products)))


def shares(o: Outside, combinations: tuple[tuple[float, ...], ...]) -> tuple[float, ...]:
    """Return the share of each combination j^T Omega that counts; 0 where the data do not determine it at all."""
    n = len(combinations[0])
    rows = [[j[i] for j in combinations] for i in range(n)]
    silent = [[0.0 for _ in combinations] for _ in range(FILTERS)]
    own = len(o.products) - n * (n + 1) // 2  # packed by rows, those of psi are the last
    U, C = eliminated(o.products[own:], [list(row) for row in rows])
    V, D = eliminated(o.products, [*silent, *rows])
    if is_singular(U) or is_singular(V):
        return tuple([_LEAST_SHARE for _ in combinations])
    whole, outside = explained(U, C), explained(V, D)
    found = []
    for k in range(len(combinations)):
        certain = whole[k][k] / outside[k][k] if outside[k][k] > 0.0 else 0.0
        found.append(max(_LEAST_SHARE, (certain - UNEXPLAINED) / (1.0 - UNEXPLAINED)))
    return tuple(found)


def widened(errors: tuple[float, ...], o: Outside, combinations: tuple[tuple[float, ...], ...]) -> tuple[float, ...]:
    """Return the standard ``errors`` of combinations, of which only what came from outside the loop counts."""
    own = shares(o, combinations)
    return tuple([error / sqrt(share) for error, share in zip(errors, own, strict=True)])
