"""Instrumental variables: parameters and judgements that rest on what came from outside the loop alone.

An axis obeys p^2 y = sum_k theta_k p^(d_k) f_k(s) + torque of the air, s the signals that were measured. A controller
carries the air into s, so least squares are biased; references b know nothing of the air:

    b(t): 8 Laguerre outputs (pole 3 rad/s) of every reference;      s_hat of a log = mean + (b - mean b) K
    Y = L p^2 y,     Phi_k = L p^(d_k) f_k(s),     Z_k = L p^(d_k) f_k(s_hat),     means of each log removed
    theta = (Z'Phi)^-1 Z'Y,     V = (Z'Phi)^-1 (sum_b g_b g_b') (Phi'Z)^-1,     g_b = sum of Z e over 4 s
    share_k = |M P_Z Phi_k|^2 / |M Phi_k|^2,     M removes the other regressors

L is a Butterworth filter of third order at 20 rad/s, everything runs at 25 Hz, and an AR(12) model of the residual
whitens Y, Phi and Z, four times over. K is fitted on the *other* logs: fitted on the same it would carry the log's own
air into Z. A single log is cut into two halves, each with the K of the other less a gap of 4 s, many times the air's
correlation time. There are as many Z as regressors whatever the number of references: with more references than
needed this is two-stage least squares, with fewer Z'Phi becomes singular and the intervals say so.

Judge of any plant: g = Z'(Y - L a_plant), q = g' (sum_b g_b g_b')^-1 g, a Hotelling statistic over the blocks,

    (B - k)/k  q/(B - q) ~ F(k, B - k),     chi2 = that quantile of F as the one of chi2 with k degrees of freedom

Sources: T. Soderstrom and P. Stoica, Instrumental Variable Methods for System Identification, Springer 1983, eq. (3.1)
and chapter 6; J. D. Angrist, G. W. Imbens, A. B. Krueger, J. Appl. Econometrics 14 (1999) 57, for cross-fitted Z.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from math import inf, nan

import numpy as np
from numpy.typing import NDArray
from scipy.signal import bilinear, butter, lfilter, resample_poly
from scipy.stats import chi2 as chi2_distribution
from scipy.stats import f as f_distribution
from scipy.stats import t as t_distribution

from heli_identifier.errors import LogError

Array = NDArray[np.float64]

RATE = 25.0
"""Everything is reduced to this rate [Hz], six times the corner of L."""
CORNER = 20.0
"""Corner of L [rad/s]: above the rig's motion, below where an encoder's quantisation rules p^2 y."""
LAGUERRE_POLE, LAGUERRE_ORDER = 3.0, 8
"""Pole [rad/s] and outputs of the bank: memory up to 5 s, a closed loop's."""
AR_ORDER = 12
"""Order of the whitening model, half a second: the correlation time of measured air."""
BLOCK = 4.0
"""Length of a block of scores [s], and the gap within a single log: eight correlation times of the air."""
SETTLING = 2.0
"""Start of a log that is left out [s]: filters from rest."""


@dataclass(frozen=True)
class Term:
    """One regressor of an axis, p^order f(s) with its parameter.

    Attributes
    ----------
    name : str
        The parameter.
    of : Callable
        f: signals of shape (N, n) to a column of shape (N,).
    order : int
        Order of differentiation, 0 or 1.
    """

    name: str
    of: Callable[[Array], Array]
    order: int = 0


@dataclass(frozen=True, eq=False)
class Regression:
    """One axis: p^2 y = sum of parameter times term.

    Attributes
    ----------
    name : str
        The axis.
    outputs : sequence of NDArray, shape (N,) each
        The angle y of each log [rad].
    terms : tuple[Term, ...]
        The regressors; a constant by log need not be among them.
    """

    name: str
    outputs: Sequence[Array]
    terms: tuple[Term, ...]


@dataclass(frozen=True, eq=False)
class AxisInstruments:
    """Estimates of an axis and what a judge needs.

    Attributes
    ----------
    name : str
        The axis.
    parameters : tuple[str, ...]
        Names of the k parameters.
    values : NDArray, shape (k,)
        theta; nan where nothing came from outside.
    covariance : NDArray, shape (k, k)
        V with the factor B/(B - k) for B blocks.
    half_widths : NDArray, shape (k,)
        Of the 95 % intervals, by Student's t with B - k degrees of freedom.
    shares : NDArray, shape (k,)
        Outside share of each regressor, 0 to 1.
    blocks : tuple[Array, ...]
        Of each log its samples' block numbers, -1 where left out.
    """

    name: str
    parameters: tuple[str, ...]
    values: Array
    covariance: Array
    half_widths: Array
    shares: Array
    blocks: tuple[Array, ...]
    response: tuple[Array, ...] = field(repr=False)
    regressors: tuple[Array, ...] = field(repr=False)
    instruments: tuple[Array, ...] = field(repr=False)
    whitening: Array = field(repr=False)


@dataclass(frozen=True)
class Judgement:
    """Whether a plant contradicts the instruments of an axis.

    Attributes
    ----------
    chi2 : float
        About chi-squared with ``freedom`` degrees of freedom for the true plant.
    freedom : int
        Number of instruments k.
    p_value : float
        Probability of a chi2 at least as large under the true plant.
    """

    chi2: float
    freedom: int
    p_value: float


@dataclass(frozen=True, eq=False)
class InstrumentEstimates:
    """Estimates of all axes from one set of logs.

    Attributes
    ----------
    axes : tuple[AxisInstruments, ...]
        In the order of the regressions.
    rates : tuple[float, ...]
        Rate of each log [Hz].
    """

    axes: tuple[AxisInstruments, ...]
    rates: tuple[float, ...]

    def judge(self, plant: Sequence[Array]) -> tuple[Judgement, ...]:
        """Judge a plant, nonlinear or not, by its accelerations along the measured motion.

        Parameters
        ----------
        plant : sequence of NDArray, shape (N, number of axes) each
            For each log the plant's accelerations [rad/s2] at the measured angles, rates and motor voltages, at the
            log's own rate.

        Returns
        -------
        tuple[Judgement, ...]
            One for each axis.
        """
        reduced = [_filtered(_reduce(a, rate), 0) for a, rate in zip(plant, self.rates, strict=True)]
        return tuple(
            _judgement(axis, [y - a[:, i] for y, a in zip(axis.response, reduced, strict=True)])
            for i, axis in enumerate(self.axes)
        )

    def judge_parameters(self, name: str, values: Array) -> Judgement:
        """Judge values of one axis's parameters, shape (k,), under the regression itself."""
        axis = next(axis for axis in self.axes if axis.name == name)
        return _judgement(axis, [y - phi @ values for y, phi in zip(axis.response, axis.regressors, strict=True)])


def instruments(
    regressions: Sequence[Regression],
    signals: Sequence[Array],
    references: Sequence[Array],
    rates: Sequence[float],
    keep: Sequence[NDArray[np.bool_]] | None = None,
) -> InstrumentEstimates:
    """Estimate every axis by instrumental variables.

    Parameters
    ----------
    regressions : sequence of Regression
        The axes.
    signals : sequence of NDArray, shape (N, n) each
        s of each log, at its own rate.
    references : sequence of NDArray, shape (N, m) each
        What came from outside, zeros where a log lacks a column.
    rates : sequence of float
        Sampling rate of each log [Hz], 25 Hz at least.
    keep : sequence of NDArray of bool, shape (N,) each, optional
        False where a sample says nothing (an axis at rest, a hand).

    Returns
    -------
    InstrumentEstimates
        An axis that nothing moved from outside has values nan and infinite half-widths.

    Raises
    ------
    LogError
        If a log is slower than 25 Hz.
    """
    for index, rate in enumerate(rates):
        if rate < RATE * (1.0 - 1e-6):
            raise LogError(f"log {index + 1}: its rate {rate:g} Hz must be at least {RATE:g} Hz for instruments.")
    inputs = [_reduce(s, rate) for s, rate in zip(signals, rates, strict=True)]
    banks = [_bank(_reduce(r, rate)) for r, rate in zip(references, rates, strict=True)]
    hats = _cross_fitted(inputs, banks)
    kept = [np.ones(len(s), bool) for s in signals] if keep is None else keep
    blocks = _blocks([_reduce(k.astype(float), rate) > 0.99 for k, rate in zip(kept, rates, strict=True)])
    axes = []
    for regression in regressions:
        outputs = [_reduce(np.asarray(y)[:, None], rate) for y, rate in zip(regression.outputs, rates, strict=True)]
        response = tuple(_filtered(y, 2)[:, 0] for y in outputs)
        phi, z = (tuple(_columns(regression.terms, s) for s in source) for source in (inputs, hats))
        axes.append(_axis(regression, response, phi, z, blocks))
    return InstrumentEstimates(tuple(axes), tuple(rates))


def _axis(regression: Regression, response, phi, z, blocks) -> AxisInstruments:
    """Iterate estimate and whitening of one axis, then its covariance and shares."""
    k = len(regression.terms)
    names = tuple(term.name for term in regression.terms)
    white = np.array([1.0])
    values = np.full(k, nan)
    for _ in range(5):
        y, x, w, number = _rows(white, blocks, response, phi, z)
        scale = np.linalg.norm(x, axis=0) + 1e-300
        if np.linalg.norm(w, axis=0).min() < 1e-9 * scale.min() or len(y) < 10 * k:
            break
        cross = (w / scale).T @ (x / scale)
        if np.linalg.cond(cross) > 1e10:
            break
        values = np.linalg.solve(cross, (w / scale).T @ y) / scale
        white = _whitening([r - p @ values for r, p in zip(response, phi, strict=True)], blocks)
    else:
        scores = _scores(w * (y - x @ values)[:, None], number)
        count = len(scores)
        inverse = np.linalg.solve(cross, np.eye(k)) / scale[:, None] / scale[None, :]
        covariance = inverse @ (scores.T @ scores) @ inverse.T * count / max(count - k, 1)
        student = t_distribution.ppf(0.975, max(count - k, 1))
        half_widths = student * np.sqrt(np.diag(covariance))
        shares = _shares(x, w)
        return AxisInstruments(
            regression.name, names, values, covariance, half_widths, shares, blocks, response, phi, z, white
        )
    unknown = np.full((k, k), inf)
    return AxisInstruments(
        regression.name, names, np.full(k, nan), unknown, unknown[0], np.zeros(k), blocks, response, phi, z, white
    )


def _judgement(axis: AxisInstruments, residuals: Sequence[Array]) -> Judgement:
    """Hotelling's statistic of the block scores of a residual, told as chi-squared."""
    k = len(axis.parameters)
    if not np.isfinite(axis.values).all():
        return Judgement(0.0, k, 1.0)
    e, _, z, number = _rows(axis.whitening, axis.blocks, tuple(residuals), axis.regressors, axis.instruments)
    scores = _scores(z * e[:, None], number)
    scores = scores / (np.linalg.norm(scores, axis=0) + 1e-300)
    count, total = len(scores), scores.sum(axis=0)
    q = float(total @ np.linalg.lstsq(scores.T @ scores, total, rcond=1e-10)[0])
    free = max(count - k, 1)
    ratio = free / k * q / max(count - q, 1e-12)
    p_value = float(f_distribution.sf(ratio, k, free))
    return Judgement(float(chi2_distribution.isf(max(p_value, 1e-300), k)), k, p_value)


def _reduce(signal: Array, rate: float) -> Array:
    """A signal of shape (N, n) or (N,) at 25 Hz, behind a zero-phase filter against aliasing."""
    ratio = Fraction(RATE / rate).limit_denominator(400)
    if ratio == 1:
        return np.asarray(signal, dtype=float)
    return resample_poly(signal, ratio.numerator, ratio.denominator, axis=0, padtype="line")


def _filtered(signal: Array, order: int) -> Array:
    """L p^order of a signal, from rest at its first value, by the bilinear transform."""
    numerator, denominator = butter(3, CORNER, analog=True)
    b, a = bilinear(np.r_[numerator, np.zeros(order)], denominator, RATE)
    return lfilter(b, a, signal - signal[:1], axis=0)


def _columns(terms: Sequence[Term], signals: Array) -> Array:
    """L p^order f(s) of every term, shape (N, k)."""
    return np.column_stack([_filtered(np.asarray(term.of(signals)), term.order) for term in terms])


def _bank(references: Array) -> Array:
    """Laguerre outputs of every reference, shape (N, 8 m): sqrt(2 a)/(p + a) ((p - a)/(p + a))^i."""
    a = LAGUERRE_POLE
    outputs = [lfilter(*bilinear([np.sqrt(2.0 * a)], [1.0, a], RATE), references - references[:1], axis=0)]
    through = bilinear([1.0, -a], [1.0, a], RATE)
    for _ in range(LAGUERRE_ORDER - 1):
        outputs.append(lfilter(*through, outputs[-1], axis=0))
    return np.hstack(outputs)


def _cross_fitted(signals: Sequence[Array], banks: Sequence[Array]) -> tuple[Array, ...]:
    """s_hat of every log by the K of the others; of a single log's halves by the K of the other half."""
    if len(signals) == 1:
        n, gap = len(signals[0]) // 2, round(BLOCK * RATE / 2.0)
        ends = [(slice(0, n), slice(n + gap, None)), (slice(n, None), slice(0, max(n - gap, 0)))]
        halves = [_predicted(signals[0][own], banks[0][own], [signals[0][far]], [banks[0][far]]) for own, far in ends]
        return (np.vstack(halves),)
    return tuple(
        _predicted(
            signals[i], banks[i], [s for j, s in enumerate(signals) if j != i], [b for j, b in enumerate(banks) if j != i]
        )
        for i in range(len(signals))
    )


def _predicted(signals: Array, bank: Array, others: Sequence[Array], banks: Sequence[Array]) -> Array:
    """Mean + (b - mean b) K, with a ridge of 1e-6 of the mean variance: Laguerre outputs of a short log are alike."""
    x = np.vstack([b - b.mean(axis=0) for b in banks])
    y = np.vstack([s - s.mean(axis=0) for s in others])
    if x.shape[1] == 0 or not np.any(x):
        return np.tile(signals.mean(axis=0), (len(signals), 1))
    scale = np.linalg.norm(x, axis=0)
    scale[scale == 0.0] = inf
    x = x / scale
    gains = np.linalg.solve(x.T @ x + 1e-6 * np.eye(x.shape[1]), x.T @ y) / scale[:, None]
    return signals.mean(axis=0) + (bank - bank.mean(axis=0)) @ gains


def _blocks(kept: Sequence[Array]) -> tuple[Array, ...]:
    """Number of each sample's block of 4 s; -1 at the start, where left out, and for a whitening filter after that."""
    numbers, first, length = [], 0, round(BLOCK * RATE)
    for keep in kept:
        own = first + np.arange(len(keep)) // length
        gone = np.convolve(~keep, np.ones(AR_ORDER + 12), "full")[: len(keep)] > 0
        gone[: round(SETTLING * RATE)] = True
        first = int(own[-1]) + 1
        numbers.append(np.where(gone, -1, own))
    return tuple(numbers)


def _rows(white: Array, blocks, response, phi, z) -> tuple[Array, Array, Array, Array]:
    """Whitened Y, Phi and Z and the block numbers of the samples kept, means by log removed."""
    parts = []
    for number, y, x, w in zip(blocks, response, phi, z, strict=True):
        keep = number >= 0
        if keep.any():
            bank = lfilter(white, [1.0], np.column_stack([y, x, w]), axis=0)[keep]
            parts.append(np.column_stack([bank - bank.mean(axis=0), number[keep]]))
    k = phi[0].shape[1]
    table = np.vstack(parts) if parts else np.zeros((0, 2 * k + 2))
    return table[:, 0], table[:, 1 : k + 1], table[:, k + 1 : -1], table[:, -1].astype(int)


def _whitening(residuals: Sequence[Array], blocks) -> Array:
    """1 - a_1/z - ... of an AR(12) model by least squares over all logs, from samples whose past was kept."""
    rows = []
    for e, number in zip(residuals, blocks, strict=True):
        keep = number >= 0
        e = np.where(keep, e - e[keep].mean() if keep.any() else 0.0, 0.0)
        past = np.column_stack([e[AR_ORDER - i : len(e) - i] for i in range(AR_ORDER + 1)])
        rows.append(past[keep[AR_ORDER:] & keep[:-AR_ORDER]])
    table = np.vstack(rows)
    return np.r_[1.0, -np.linalg.lstsq(table[:, 1:], table[:, 0], rcond=1e-10)[0]]


def _scores(rows: Array, number: Array) -> Array:
    """Sums of rows over blocks, shape (B, k); blocks with nothing in them left out."""
    present, index = np.unique(number, return_inverse=True)
    scores = np.zeros((len(present), rows.shape[1]))
    np.add.at(scores, index, rows)
    return scores


def _shares(x: Array, z: Array) -> Array:
    """|M P_Z Phi_k|^2 / |M Phi_k|^2 for every regressor."""
    projected = z @ np.linalg.lstsq(z, x, rcond=1e-10)[0]
    shares = []
    for k in range(x.shape[1]):
        others = np.delete(x, k, axis=1)
        pair = np.column_stack([projected[:, k], x[:, k]])
        left = pair - others @ np.linalg.lstsq(others, pair, rcond=1e-10)[0]
        shares.append(min(1.0, float(np.sum(left[:, 0] ** 2) / (np.sum(left[:, 1] ** 2) + 1e-300))))
    return np.array(shares)
