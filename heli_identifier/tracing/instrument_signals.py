"""Signals of instruments: at 25 Hz, differentiated, predicted from references, whitened, and their blocks."""

from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import bilinear, butter, lfilter, resample_poly

from .rig import Array
from .settings import BLOCK, SETTLING, SLOW_RATE

Rows = Sequence[NDArray[Any]]

AR_ORDER = 12
"""Order of the whitening model, half a second: the correlation time of measured air."""


def reduce_rate(signal: Array, rate: float) -> Array:
    """Bring a signal (N,) or (N, n) to 25 Hz, shape (M, n), behind a zero-phase filter against aliasing."""
    signal = np.reshape(signal, (len(signal), -1))
    ratio = Fraction(SLOW_RATE / rate).limit_denominator(400)
    if ratio == 1:
        return np.asarray(signal, dtype=float)
    return resample_poly(signal, ratio.numerator, ratio.denominator, axis=0, padtype="line")


def differentiate(signal: Array, order: int) -> Array:
    """L p^order of a signal, from rest at its first value."""
    fine = resample_poly(signal - signal[:1], 8, 1, axis=0, padtype="line")
    return lfilter(*_differentiator(order), fine, axis=0)[::8]


@cache
def _differentiator(order: int) -> tuple[Array, Array]:
    """L p^order by the bilinear transform at 200 Hz: at 25 Hz its p^2 is 12 % too large at the corner."""
    numerator, denominator = butter(3, 20.0, analog=True)
    return bilinear(np.r_[numerator, np.zeros(order)], denominator, 8 * SLOW_RATE)


def laguerre_outputs(references: Array) -> Array:
    """Laguerre outputs of every reference, shape (N, 8 m): sqrt(2 a)/(p + a) ((p - a)/(p + a))^i."""
    a = 3.0
    outputs = [lfilter(*bilinear([np.sqrt(2.0 * a)], [1.0, a], SLOW_RATE), references - references[:1], axis=0)]
    through = bilinear([1.0, -a], [1.0, a], SLOW_RATE)
    for _ in range(7):
        outputs.append(lfilter(*through, outputs[-1], axis=0))
    return np.hstack(outputs)


def predict_signals(signals: Sequence[Array], banks: Sequence[Array]) -> tuple[Array, ...]:
    """s_hat of every log by the K of the others; of a single log's halves by the K of the other half."""
    if len(signals) == 1:
        n, gap = len(signals[0]) // 2, round(BLOCK * SLOW_RATE / 2.0)
        ends = [(slice(0, n), slice(n + gap, None)), (slice(n, None), slice(0, max(n - gap, 0)))]
        halves = [_predict(signals[0][near], banks[0][near], [signals[0][far]], [banks[0][far]]) for near, far in ends]
        return (np.vstack(halves),)
    others = [[j for j in range(len(signals)) if j != i] for i in range(len(signals))]
    return tuple(
        _predict(signals[i], banks[i], [signals[j] for j in far], [banks[j] for j in far])
        for i, far in enumerate(others)
    )


def _predict(signals: Array, bank: Array, others: Sequence[Array], banks: Sequence[Array]) -> Array:
    """Mean + (b - mean b) K, with a ridge of 1e-6 of the mean variance: Laguerre outputs of a short log are alike."""
    x = np.vstack([b - b.mean(axis=0) for b in banks])
    y = np.vstack([s - s.mean(axis=0) for s in others])
    if x.shape[1] == 0 or not np.any(x):
        return np.tile(signals.mean(axis=0), (len(signals), 1))
    scale = np.linalg.norm(x, axis=0)
    scale[scale == 0.0] = inf
    x /= scale
    gains = np.linalg.solve(x.T @ x + 1e-6 * np.eye(x.shape[1]), x.T @ y) / scale[:, None]
    return signals.mean(axis=0) + (bank - bank.mean(axis=0)) @ gains


def number_blocks(kept: Rows) -> tuple[Array, ...]:
    """Return the number of the 4 s block of each sample; -1 at the start, where left out, and shortly after that."""
    numbers, first, length = [], 0, round(BLOCK * SLOW_RATE)
    for keep in kept:
        number = first + np.arange(len(keep)) // length
        left_out = np.convolve(~keep, np.ones(AR_ORDER + 12), "full")[: len(keep)] > 0
        left_out[: round(SETTLING * SLOW_RATE)] = left_out[-AR_ORDER:] = True  # filters start at rest; resampling
        first = int(number[-1]) + 1
        numbers.append(np.where(left_out, -1, number))
    return tuple(numbers)


def whitened_rows(white: Array, blocks: Rows, *signals: Rows) -> tuple[list[Array], Array]:
    """Whiten signals of each log, keep the samples that have a block, remove means by log; the block numbers."""
    parts, ends = [], np.cumsum([rows[0].shape[1] for rows in signals])
    for number, *columns in zip(blocks, *signals, strict=True):
        keep = number >= 0
        bank = lfilter(white, [1.0], np.column_stack(columns), axis=0)[keep]
        parts.append(bank - bank.mean(axis=0) if keep.any() else bank)
    return np.split(np.vstack(parts), ends[:-1], axis=1), np.concatenate(blocks)[np.concatenate(blocks) >= 0]


def whitening_filter(residuals: Rows, blocks: Rows) -> Array:
    """1 - a_1/z - ... of an AR(12) model by least squares over all logs, from samples whose past was kept.

    White noise 20 dB below the residual is added: in a log without encoder noise the errors of K would be amplified.
    """
    products = np.zeros((AR_ORDER + 1, AR_ORDER + 1))
    for e, number in zip(residuals, blocks, strict=True):
        keep = number >= 0
        e = np.where(keep, e - e[keep].mean() if keep.any() else 0.0, 0.0)
        both = np.flatnonzero(keep[AR_ORDER:] & keep[:-AR_ORDER]) + AR_ORDER
        rows = np.array([e[both - i] for i in range(AR_ORDER + 1)])
        products += rows @ rows.T
    normal = products[1:, 1:] + 1e-2 * products[0, 0] * np.eye(AR_ORDER)
    return np.r_[1.0, -np.linalg.solve(normal, products[1:, 0])]


def sum_blocks(rows: Array, number: Array) -> Array:
    """Sum rows over blocks, shape (B, k); blocks with nothing in them left out."""
    present, index = np.unique(number, return_inverse=True)
    scores = np.zeros((len(present), rows.shape[1]))
    np.add.at(scores, index, rows)
    return scores
