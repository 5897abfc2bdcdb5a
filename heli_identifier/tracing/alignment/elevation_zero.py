"""Logs whose elevation was zeroed in another position than that of the others.

The encoder counts from where the arm was when the rig was switched on: on the table, or held by hand. A log that
reads z less than the others needs the voltages of another height: the constant torque -a_e z seems to act on it. Of a
constant torque the observer's innovations omega_f^2 e keep the share omega_f^2 / (omega_f^2 + a_e), so that with m_l
their median in log l

    eps'' = -a_e (eps + z) - a_1 + ...,    z_l = (median over l of m_l - m_l) (1 / a_e + 1 / omega_f^2).

Small zeros are offsets of a log, which the fits allow for. A zero is in another position if it lies beyond
:data:`LEAST` and :data:`OUTLYING` robust standard deviations from the others. An arm that was balanced otherwise, by a
counterweight that was moved, looks the same: only laws with a sine of the elevation tell the two apart.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import Log
from heli_identifier.tracing.multistep.robust import NORMAL
from heli_identifier.tracing.prediction.problem import Residuals
from heli_identifier.tracing.search.steps import ELEVATION

LEAST = 0.2
"""Zero [rad] from which on it is another position: half of what an arm on the table lies below the horizontal."""

OUTLYING = 3.5
"""Standard deviations from the median of all logs, estimated from their median absolute deviation: the bound of
Iglewicz and Hoaglin (1993) for outliers."""

FEWEST = 3
"""Logs of which one can be told to differ from the others."""

LEAST_STIFFNESS = 0.1
"""Stiffness a_e [1/s^2] below which the arm is balanced everywhere, and its zero shows in no torque."""

ROUNDS = 4
"""Rounds of fit and shift: the fit to logs of different zeros is wrong, so that the first shift is not the last."""

SETTLED = 0.01
"""Change of all zeros [rad] below which no further round is needed."""


def zeros(residuals: Residuals, stiffness: float, bandwidth: float) -> NDArray[np.float64]:
    """Zero of each log's elevation [rad] against that of the others.

    Parameters
    ----------
    residuals : Residuals
        Reduced innovations [rad/s^2] of all logs under one model.
    stiffness : float
        a_e of the model [1/s^2].
    bandwidth : float
        omega_f of the observer [rad/s].
    """
    medians = np.array([float(np.median(r[:, ELEVATION])) if len(r) else np.nan for r in residuals])
    if stiffness < LEAST_STIFFNESS or np.isfinite(medians).sum() < FEWEST:
        return np.zeros(len(residuals))
    return np.nan_to_num((np.nanmedian(medians) - medians) * (1.0 / stiffness + 1.0 / bandwidth**2))


def outlying(zero: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which of the logs' zeros (L,) [rad] were set in another position than those of the others."""
    spread = NORMAL * float(np.median(abs(zero - np.median(zero))))
    return np.asarray(abs(zero - np.median(zero)) > max(LEAST, OUTLYING * spread), dtype=bool)


def shifted(logs: Sequence[Log], zero: NDArray[np.float64]) -> tuple[Log, ...]:
    """Raise each log's elevation by its zero [rad]; a log with the zero 0 is given as it is."""
    moved = []
    for log, shift in zip(logs, zero, strict=True):
        if shift != 0.0:
            angles = log.angles.copy()
            angles[:, ELEVATION] += shift
            log = replace(log, angles=angles)
        moved.append(log)
    return tuple(moved)


def zero_note(log: str, zero: float) -> str:
    """Say what was done to a log."""
    less = "less" if zero > 0.0 else "more"
    return (
        f"{log}: its elevation reads {abs(zero):.2f} rad {less} than that of the other logs at like voltages, as if "
        "its encoder had been zeroed in another position or the arm balanced otherwise; it was shifted by that much"
    )
