"""Instrumental variables: parameters and judgements that rest only on signals from outside the loop.

An axis obeys p^2 y = sum_k theta_k p^(d_k) f_k(s) + torque of the air, s the measured signals. A controller carries the
air into s, so least squares are biased. References b do not depend on the air:

    b(t): 8 Laguerre outputs (pole 3 rad/s) of every reference;      s_hat of a log = mean + (b - mean b) K
    Y = L p^2 y,     Phi_k = L p^(d_k) f_k(s),     Z_k = L p^(d_k) f_k(s_hat),     means of each log removed
    theta = (Z'Phi)^-1 Z'Y,     V = (Z'Phi)^-1 (sum_b g_b g_b') (Phi'Z)^-1,     g_b = sum of Z e over 4 s
    share_k = min_a |P_Z (Phi_k - Phi_others a)|^2 / min_a |Phi_k - Phi_others a|^2     the outside share, 0 to 1

L is a Butterworth filter of third order at 20 rad/s: above the rig's motion, below where an encoder's counts rule p^2
y. The Laguerre outputs remember up to 5 s, as a closed loop does. Everything runs at 25 Hz, and an AR(12) model of the
residual whitens Y, Phi and Z, four times over. K is fitted on the *other* logs: fitted on the same log it would carry
the air of that log into Z. A single log is cut into two halves with a gap of 2 s. With fewer references than needed
Z'Phi becomes singular and the intervals say so. There a weak prior N(m, P) of the rig's parameters keeps the others
determined (a damping of elevation is seldom moved from outside):

    theta = argmin  g' Omega^-1 g + (theta - m)' P^-1 (theta - m),   g = Z'(Y - Phi theta),   Omega = sum_b g_b g_b'

Any plant is judged with the Omega of its own residual's scores over B blocks (with that of the estimate a true plant
would be rejected in 14 of 100 sets at 5 %),

    g = Z'(Y - L a_plant),  q = g' Omega^-1 g,  (B - k)/k  q/(B - q) ~ F(k, B - k), stated as chi2 of the same p value

Sources: T. Soderstrom and P. Stoica, Instrumental Variable Methods for System Identification, Springer 1983, eq. (3.1)
and chapter 6; J. D. Angrist, G. W. Imbens, A. B. Krueger, J. Appl. Econometrics 14 (1999) 57, for cross-fitted Z; J.
Shea, Rev. Economics and Statistics 79 (1997) 348, for the share.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from math import inf, nan

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri, fdtrc, stdtrit

from heli_identifier.errors import LogError

from . import instrument_signals as iv
from .instrument_signals import Rows
from .rig import Array
from .settings import SLOW_RATE


@dataclass(frozen=True)
class Term:
    """One regressor of an axis, p^order f(s) with its parameter."""

    name: str
    """The parameter."""
    of: Callable[[Array], Array]
    """f: signals of shape (N, n) to a column of shape (N,)."""
    order: int = 0
    """Order of differentiation, 0 or 1."""
    prior: tuple[float, float] = (0.0, inf)
    """Prior mean and standard deviation of the parameter, in its unit; infinite without a prior."""


@dataclass(frozen=True, eq=False)
class Regression:
    """One axis: p^2 y = sum of parameter times term."""

    name: str
    """The axis."""
    outputs: Sequence[Array]
    """The angle y of each log [rad], shape (N,) each."""
    terms: tuple[Term, ...]
    """The regressors; a constant by log need not be among them."""
    known: Sequence[Array] | None = None
    """Accelerations [rad/s2] of effects that are not estimated here, shape (N,) each."""


@dataclass(frozen=True, eq=False)
class AxisInstruments:
    """Estimates of an axis, and the signals of each log at 25 Hz with which plants are judged."""

    name: str
    parameters: tuple[str, ...]
    """name, parameters: The axis and its k parameters."""
    values: Array
    """theta, nan where nothing came from outside, shape (k,)."""
    half_widths: Array
    """Of the 95 % intervals, shape (k,): Student's t with B - k degrees of freedom for B blocks, Omega with the factor
    B/(B - k)."""
    shares: Array
    """Outside shares, 0 to 1, shape (k,)."""
    blocks: Rows
    """Block numbers of the samples, -1 where left out."""
    accelerations: Rows
    """L p^2 y of each log, shape (n, 1)."""
    instruments: Rows
    whitening: Array
    """instruments, whitening: Z of each log, and the whitening filter."""


@dataclass(frozen=True, eq=False)
class InstrumentEstimates:
    """Estimates of all axes, in the order of the regressions, from logs of these rates [Hz]."""

    axes: tuple[AxisInstruments, ...]
    rates: tuple[float, ...]

    def judge(self, plant: Sequence[Array]) -> tuple[float, int]:
        """Judge a plant, nonlinear or not, by chi2 and its degrees of freedom over all axes moved from outside.

        ``plant`` has for each log its accelerations (N, number of axes) [rad/s2] at the measured angles, rates and
        motor voltages, at the log's own rate.
        """
        reduced = [iv.differentiate(iv.reduce_rate(a, rate), 0) for a, rate in zip(plant, self.rates, strict=True)]
        moved = [(i, axis) for i, axis in enumerate(self.axes) if np.isfinite(axis.values).all()]
        chi2 = [_judge_axis(axis, [a[:, i : i + 1] for a in reduced]) for i, axis in moved]
        return sum(chi2), sum(len(axis.parameters) for _, axis in moved)


def instruments(
    regressions: Sequence[Regression],
    signals: Iterable[Array],
    references: Sequence[Array],
    rates: Sequence[float],
    keep: Sequence[NDArray[np.bool_]] | None = None,
) -> InstrumentEstimates:
    """Estimate every axis by instrumental variables; if nothing moved an axis from outside, half-widths are infinite.

    Each log has ``signals`` s (N, n), ``references`` (N, m) from outside, zero where it lacks a column, its sampling
    rate [Hz], at least 25 Hz, and ``keep`` (N, number of axes), which is False where a sample says nothing on an axis,
    which rests or is held.
    """
    for index, rate in enumerate(rates):
        if rate < SLOW_RATE * (1.0 - 1e-6):
            raise LogError(f"log {index + 1}: its rate {rate:g} Hz must be at least {SLOW_RATE:g} Hz for instruments.")

    def reduce_all(every: Iterable[Array]) -> list[Array]:
        return [iv.reduce_rate(signal, rate) for signal, rate in zip(every, rates, strict=True)]

    inputs = reduce_all(signals)
    hats = iv.predict_signals(inputs, [iv.laguerre_outputs(b) for b in reduce_all(references)])
    kept = [np.ones((len(s), len(regressions)), dtype=bool) for s in inputs]
    if keep is not None:
        kept = [share > 0.99 for share in reduce_all(part.astype(float) for part in keep)]
    axes = []
    for i, axis in enumerate(regressions):
        blocks = iv.number_blocks([counts[:, i] for counts in kept])
        measured = [iv.differentiate(y, 2) for y in reduce_all(axis.outputs)]
        known = [iv.differentiate(a, 0) for a in reduce_all(axis.known)] if axis.known else [0.0 * y for y in measured]
        phi, z = ([filter_terms(axis.terms, s) for s in source] for source in (inputs, hats))
        axes.append(_estimate_axis(axis, measured, known, phi, z, blocks))
    return InstrumentEstimates(tuple(axes), tuple(rates))


def _estimate_axis(
    regression: Regression, measured: Rows, known: Rows, phi: Rows, hats: Rows, blocks: Rows
) -> AxisInstruments:
    """Iterate estimate and whitening of one axis, then its covariance and shares."""
    k = len(regression.terms)
    nothing = AxisInstruments(
        regression.name, tuple(term.name for term in regression.terms), np.full(k, nan), np.full(k, inf), np.zeros(k),
        blocks, measured, hats, np.array([1.0]),
    )  # fmt: skip
    mean, std = np.array([term.prior for term in regression.terms], dtype=float).T
    response = [y - a for y, a in zip(measured, known, strict=True)]
    white, values = nothing.whitening, mean
    for turn in range(6):  # two turns from Z'Z to block scores, then four to let whitening and theta settle
        (y, x, z), number = iv.whitened_rows(white, blocks, response, phi, hats)
        size = np.linalg.norm(z, axis=0)
        if len(y) < 10 * k or size.max() < 1e-9 * np.linalg.norm(x):
            return nothing
        z = z / (size + 1e-300)
        cross = z.T @ x
        scores = iv.sum_blocks(z * (y - x @ values[:, None]), number)
        count = len(scores)
        spread = scores.T @ scores * count / max(count - k, 1) if turn else z.T @ z * float(y.var())
        weighted = np.linalg.lstsq(spread, cross, rcond=1e-10)[0]
        information = cross.T @ weighted + np.diag(std**-2.0)
        scale = 1.0 / np.sqrt(np.diag(information) + 1e-300)
        scaled = information * np.outer(scale, scale)
        if np.linalg.cond(scaled) > 1e12:
            return nothing
        covariance = np.linalg.inv(scaled) * np.outer(scale, scale)
        values = covariance @ (weighted.T @ (z.T @ y[:, 0]) + mean * std**-2.0)
        white = iv.whitening_filter([r[:, 0] - p @ values for r, p in zip(response, phi, strict=True)], blocks)
    widths = stdtrit(max(count - k, 1), 0.975) * np.sqrt(np.diag(covariance))
    return replace(nothing, values=values, half_widths=widths, shares=_shares(x, z), whitening=white)


def _judge_axis(axis: AxisInstruments, plant: Rows) -> float:
    """Hotelling's statistic of the block scores of a plant's residual, given as chi-squared."""
    k = len(axis.parameters)
    residuals = [y - a for y, a in zip(axis.accelerations, plant, strict=True)]
    (e, z), number = iv.whitened_rows(axis.whitening, axis.blocks, residuals, axis.instruments)
    scores = iv.sum_blocks(z / (np.linalg.norm(z, axis=0) + 1e-300) * e, number)
    count, total = len(scores), scores.sum(axis=0)
    q = float(total @ np.linalg.lstsq(scores.T @ scores, total, rcond=1e-10)[0])
    free = max(count - k, 1)
    p_value = float(fdtrc(k, free, free / k * q / max(count - q, 1e-12)))
    return float(chdtri(k, max(p_value, 1e-300)))


def _shares(x: Array, z: Array) -> Array:
    """Shea's partial R2 of every regressor: its part beside the others after projection on Z, over that part before."""
    projected = z @ np.linalg.lstsq(z, x, rcond=1e-10)[0]
    return np.array([_alone(projected, k) / (_alone(x, k) + 1e-300) for k in range(x.shape[1])])


def _alone(x: Array, k: int) -> float:
    """|M x_k|^2, M removing the other columns."""
    others = np.delete(x, k, axis=1)
    return float(np.sum((x[:, k] - others @ np.linalg.lstsq(others, x[:, k], rcond=1e-10)[0]) ** 2))


def filter_terms(terms: Sequence[Term], signals: Array) -> Array:
    """L p^order f(s) of every term, shape (N, k)."""
    return np.column_stack([iv.differentiate(np.asarray(term.of(signals)), term.order) for term in terms])
