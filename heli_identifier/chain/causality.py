"""What caused a signal: whether a controller flew, and whether a signal moved the rig from outside or is feedback.

Source: C. W. J. Granger, Econometrica 37 (1969) 424, for "the past of y adds nothing to the past of r".
"""

import numpy as np
from scipy.special import fdtrc

from heli_identifier.records import Array, Log

ADDED_R2 = 0.01
"""R2 that past outputs may add to a reference's own past: feedback in disguise adds .1 to 1. And the R2 above which the
angles' innovations explain the voltages, so that a controller flies."""


def feedback(log: Log) -> bool:
    """Recognise a controller: the angles' innovations predict the voltages better than the past of the voltages does.

    The innovations are the part of the angles that the past of angles and voltages does not predict: air and encoder
    errors. In open loop the voltages do not depend on them, however long the rig's memory is. All voltages count, as an
    arm that bends answers those between two samples of 25 Hz.
    """
    every, lags = max(1, round(log.rate_hz / 25.0)), 6  # 25 Hz: below a controller's rate, above the rig's motion
    angles = log.angles[::every]
    every_voltage = log.voltages @ np.array([[1.0, 1.0], [1.0, -1.0]])
    voltages = every_voltage[::every]
    if len(angles) < 100:
        return False
    between = [np.roll(every_voltage, j, axis=0)[::every][lags:] for j in range(1, every)]
    innovations = _residual(angles[lags:], np.hstack([_past(np.hstack([angles, voltages]), lags), *between]))
    answered = np.hstack([innovations[lags:], _past(innovations, lags)])
    past, now = _past(voltages, lags)[lags:], voltages[2 * lags :]
    tests = [_added_r2(now[:, i], past, answered) for i in range(2)]
    return any(added > ADDED_R2 and p_value < 1e-4 for added, p_value in tests)


def refusal(signal: Array, angles: Array, rate_hz: float, *, planned: bool = True) -> str | None:
    """Say why a signal (N,) beside angles (N, 3) is no reference; None if it is one.

    It has to be ``planned``, as steps, ramps and sines are: in at least half of the samples its own past predicts it to
    a twentieth of its range in a second. And past outputs must not predict it.
    """
    every, lags = max(1, round(rate_hz / 10.0)), 5  # 10 Hz and five samples: the loop's last half second
    slow, outputs = np.asarray(signal, dtype=float)[::every], _past(angles[::every], lags + 1)
    span = float(np.ptp(slow))
    if not span > 1e-9 * max(1.0, float(np.abs(slow).max())):
        return "it never moves"
    past, target = np.column_stack([_past(np.diff(slow)[:, None], lags), slow[lags:-1]]), np.diff(slow)[lags:]
    predicted = float(np.mean(np.abs(_residual(target, past)) * rate_hz / every < 0.05 * span))
    if planned and predicted < 0.5:
        return f"its own past predicts {100.0 * predicted:.0f} % of its samples, that of a plan at least 50 %"
    added, p_value = _added_r2(target, past, outputs)
    if added <= ADDED_R2 or p_value > 1e-3:
        return None
    # a few steps are no normal noise, so outputs shifted by 2 s and more say how much is added by chance
    shifts = np.linspace(20, max(20, len(outputs) - 20), 99).astype(int)
    if added < max(_added_r2(target, past, np.roll(outputs, shift, axis=0))[0] for shift in shifts):
        return None
    return f"it is feedback (past angles explain {100.0 * added:.0f} % of it, {100.0 * ADDED_R2:g} % is allowed)"


def _past(signals: Array, lags: int) -> Array:
    """Put the ``lags`` samples before each sample side by side, shape (N - lags, lags m)."""
    return np.hstack([signals[lags - i : len(signals) - i] for i in range(1, lags + 1)])


def _residual(target: Array, columns: Array) -> Array:
    """Return the residual of a regression on columns and a constant."""
    bank = np.column_stack([columns, np.ones(len(columns))])
    bank = bank / (np.linalg.norm(bank, axis=0) + 1e-30)
    return target - bank @ np.linalg.lstsq(bank, target, rcond=1e-9)[0]


def _added_r2(target: Array, past: Array, others: Array) -> tuple[float, float]:
    """Return adjusted R2 of ``others`` for the residual of a regression on ``past``, and p value of an F test."""
    without = float(np.sum(_residual(target, past) ** 2))
    beside = float(np.sum(_residual(target, np.hstack([past, others])) ** 2))
    number, free = others.shape[1], len(target) - past.shape[1] - others.shape[1] - 1
    if free < 10 or without <= 1e-12 * float(np.sum(target**2)):
        return 0.0, 1.0
    p_value = float(fdtrc(number, free, max((without - beside) / number / (beside / free + 1e-300), 0.0)))
    return 1.0 - (beside / free) / (without / (free + number)), p_value
