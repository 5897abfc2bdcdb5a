"""Does a controller close the loop? The cross-correlation of innovations with the voltages to come.

An innovation e_k is what nothing before the angles of sample k can tell. In open loop no later voltage depends on it;
under a controller every later one does, and most of all those held from t_k or t_(k+1) on. With v_k the voltage held
from t_k on (the rotors' difference for pitch and travel, their sum for elevation), the score is

    s_b   = sum of (e_k - e_(k-2)) (v_k - v_(k-1)) over a block of 1 s
    score = sum_b w_b s_b / sqrt(sum_b w_b^2 s_b^2),    w_b = exp(-age / 60 s)

The differences leave out slow changes, which errors of the estimate and an excitation have in common. In open loop the
s_b are independent with mean zero, and the score follows roughly a normal distribution; ``CLOSED`` is exceeded in about
.3 % of the cases. In closed loop the s_b have one sign and the score grows with the square root of time, to 5 in 30 s.

The paper's adaptation has no innovations; its error sigma is whitened here, with a fixed G.
Source: Soderstrom and Stoica, System Identification, 1989, section 11.2 (independence of residuals and inputs).
"""

from math import exp, log, sqrt
from typing import NamedTuple

from .noise_model import Noise
from .whitening import Memory, Whitening, settled_memory, whiten, whitening

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
    """Return ``f`` after a sample.

    Parameters
    ----------
    f : Feedback
    e : float
        Innovation [rad/s^2].
    voltage : float
        Voltage that is held from this sample on [V].
    count : int
        Numbers the samples from 0.
    c : FeedbackCoefficients
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
