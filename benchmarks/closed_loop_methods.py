"""Methods of estimation in closed loop that lost to recursive prediction errors, over whole records.

Both take the regressions of the unit (:mod:`heli_identifier.online.signals`), with the state filters' bandwidth given:

* least squares with the residual whitened by an autoregression (generalised least squares, Clarke 1967): z passes
  1 - a_1 z^-1 - .. - a_p z^-p, fitted to the residual, and least squares is repeated;
* instrumental variables with the outside part r of the voltages known, in two stages (Van den Hof and Schrama 1993):
  every regressor is projected on r behind a bank of Laguerre filters, which noise in the loop cannot reach, and the
  projections are the instruments. Data are whitened by G with omega_o = 7 rad/s and gamma = 1 rad/s, as in refined
  instrumental variables (Gilson, Garnier, Young and Van den Hof 2008).
"""

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from heli_identifier.online import IdentifierSettings, prepare, start
from heli_identifier.online.signals import (
    advance_signals,
    elevation_regression,
    pitch_regression_free,
    travel_regression,
)
from heli_identifier.online.whitening import filter_polynomial, whitening
from heli_identifier.records import Log
from heli_plant.compiled import compiled

Axis = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Estimates and standard errors of one axis."""

SIZES = (4, 5, 2)
"""Numbers of regressors of pitch (theta0 free), elevation and travel."""

_ITERATIONS = 4
_LAGUERRE_POLE, _LAGUERRE_ORDER = 3.0, 8
"""Pole [rad/s] and number of the Laguerre filters behind r, for each of the two voltages."""


def _fill(voltages, angles, s, c, out):
    f = c.filter
    for k in range(len(angles)):
        if k > 0:
            s = advance_signals(s, voltages[k, 0], voltages[k, 1], angles[k, 0], angles[k, 1], angles[k, 2], c)
        y_1, phi_1 = pitch_regression_free(s, f)
        y_2, phi_2 = elevation_regression(s, f)
        y_3, phi_3 = travel_regression(s, f)
        for i in range(4):
            out[k, i] = phi_1[i]
        out[k, 4] = y_1
        for i in range(5):
            out[k, 5 + i] = phi_2[i]
        out[k, 10] = y_2
        out[k, 11], out[k, 12], out[k, 13] = phi_3[0], phi_3[1], y_3


def regressions(log: Log, bandwidth: float) -> list[NDArray[np.float64]]:
    """Return (phi, y) of pitch, elevation and travel, each (N, n + 1), behind F of the ``bandwidth`` [rad/s]."""
    settings = IdentifierSettings(sample_time=log.step, filter_frequency=bandwidth)
    plan = prepare(settings)
    signals = start(plan, *log.voltages[0].tolist(), *log.angles[0].tolist()).signals
    out = np.empty((len(log.angles), 14))
    compiled(_fill)(np.array(log.voltages), np.array(log.angles), signals, plan.signals, out)
    held = plan.hold_samples
    return [out[held:, :5], out[held:, 5:11], out[held:, 11:]]


def _least_squares(z: NDArray[np.float64], instruments: NDArray[np.float64] | None = None) -> tuple[Axis, NDArray]:
    """Return estimate, standard errors of white residuals, and residual; by instruments (N, n) where given."""
    phi, y = z[:, :-1], z[:, -1]
    w = phi if instruments is None else instruments
    information = w.T @ phi
    omega = np.linalg.solve(information, w.T @ y)
    e = y - phi @ omega
    inverse = np.linalg.inv(information)
    covariance = inverse @ (w.T @ w) @ inverse.T * (e @ e / len(e))
    return (omega, np.sqrt(np.diag(covariance))), e


def generalised(log: Log, bandwidth: float, order: int) -> list[Axis]:
    """Least squares with an autoregression of the residual, of an ``order`` in samples 50 ms apart."""
    found = []
    stride = max(1, round(0.05 / log.step))
    for z in regressions(log, bandwidth):
        z = z[::stride]
        (omega, errors), _ = _least_squares(z)
        for _ in range(_ITERATIONS):
            e = z[:, -1] - z[:, :-1] @ omega
            past = np.column_stack([e[order - 1 - i : len(e) - 1 - i] for i in range(order)])
            a = np.linalg.lstsq(past, e[order:], rcond=None)[0]
            (omega, errors), _ = _least_squares(lfilter(np.r_[1.0, -a], [1.0], z, axis=0)[order:])
        found.append((omega, errors))
    return found


def instrumental(log: Log, outside: NDArray[np.float64]) -> list[Axis]:
    """Two-stage instrumental variables; ``outside`` (N, 2) is the part of the voltages from outside the loop [V]."""
    h = log.step
    w = whitening(np.log(7.0), 0.0, *filter_polynomial(1.0, 0.7, h), h)
    b = np.convolve([1.0, w.f1, w.f2], [1.0, -w.kept])
    a = np.convolve([1.0, w.o1, w.o2, w.o3], [1.0, -2.0 / 13.0, 1.0 / 13.0])
    pole = np.exp(-_LAGUERRE_POLE * h)
    found = []
    for z in regressions(log, 1.0):
        bank = [np.ones(len(outside))]
        for r in (outside[:, 0] - outside[:, 1], outside.sum(axis=1)):
            x = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], r)
            for _ in range(_LAGUERRE_ORDER):
                bank.append(x)
                x = lfilter([-pole, 1.0], [1.0, -pole], x)
        settled = round(2.0 / h)
        first = len(outside) - len(z)
        basis = lfilter(b, a, np.column_stack(bank), axis=0)[first:][settled:]
        white = lfilter(b, a, z, axis=0)[settled:]
        instruments = basis @ np.linalg.lstsq(basis, white[:, :-1], rcond=None)[0]
        found.append(_least_squares(white, instruments)[0])
    return found


def named(axes: list[Axis]) -> tuple[dict[str, float], dict[str, float]]:
    """Return values and standard errors by the paper's symbols; a_th to first order from p and q."""
    values: dict[str, float] = {}
    errors: dict[str, float] = {}
    for (omega, sigma), names in zip(
        axes, (("a_wx", "p", "q", "k_x"), ("a_wz", "a_e", "a_1", "a_lt", "k_z"), ("a_wy", "k_y")), strict=True
    ):
        values |= dict(zip(names, omega.tolist(), strict=True))
        errors |= dict(zip(names, sigma.tolist(), strict=True))
    p, q = values.pop("p"), values.pop("q")
    values["a_th"] = float(np.hypot(p, q))
    errors["a_th"] = float(np.hypot(p * errors.pop("p"), q * errors.pop("q")) / values["a_th"])
    return values, errors
