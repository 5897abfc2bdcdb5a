r"""Find how late an angle is in its log: a controller answers an angle only after it has read it.

A controller depends linearly on an angle y, so the second differences D of its voltages v and of y obey

    D v_k = sum_j g_j D y_{k-j} + D r_k,    j = 0 ... 5,

with a reference r that has few steps. If the counts of the encoder dominate D y, they are a noise that no voltage
causes; only the angle contains it. If angles read s samples later explain more of D v, R2(s) > R2(0), the angle is late
by s samples, or by one less if the controller answers a period later. On logs of a plant and a controller R2 is .9 to 1
at the right s, and falls below .7 one sample before.

A likelihood cannot decide this: the voltages of a late log contain the angle's future, and a wrong plant, such as one
with an arm that bends, can make use of it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import ANGLES, Array, Log

from .inspection import Defect

CHANNELS: Mapping[str, tuple[float, tuple[str, ...], tuple[int, ...]]] = {
    "v_front - v_rear": (-1.0, ("pitch", "travel"), (0, 2)),
    "v_front + v_rear": (1.0, ("elevation",), (1,)),
}
"""Each channel of the voltages: sign of the rear one, the axes it answers, their columns among the angles."""

LONGEST = 0.1
"""Longest delay of an angle [s]: with more, a controller is no longer stable."""

TAPS, ROWS = 6, 4000
"""Number of samples of the angle in an answer, and most equations of one log: more only cost time."""

VISIBLE, IMPROVED, EQUAL = 0.1, 0.1, 0.02
"""R2 from which a controller's answer is visible, increase of R2 that shows a delay, and difference by chance."""

NOISY = -0.4
"""Correlation of D y from sample to sample below which the encoder's noise dominates: that of white noise is -2/3."""


def undo_delays(logs: Sequence[Log]) -> tuple[tuple[Log, ...], tuple[Defect, ...], frozenset[str]]:
    """Shift late angles of a rig in closed loop; return the logs, the defects, and the axes that are surely on time."""
    corrected, defects, prompt = list(logs), list[Defect](), set[str]()
    for column, axis in enumerate(ANGLES):
        delays = [delay for log in logs if (delay := _estimate_delay(log, column)) is not None]
        if not delays:
            continue
        delay = float(np.median(delays))
        if delay == 0.0 and max(delays) == 0.0:
            prompt.add(axis)
        if delay > 0.0:
            corrected = [_shift_earlier(log, column, round(delay * log.rate_hz)) for log in corrected]
            defects.append(Defect(
                "late", axis, f"the voltages answer the {axis} {1e3 * delay:.3g} ms before the log has it; it was read "
                "so much earlier. Log all channels in the task that reads the encoders, without a filter or a buffer",
            ))  # fmt: skip
    return tuple(corrected), tuple(defects), frozenset(prompt)


def controller_samples(log: Log) -> tuple[NDArray[np.intp], int, int]:
    """Find the samples at which a controller, which may be slower than the log, renews the voltages.

    Returns also the number of samples from one to the next, and the number of changes of the voltages.
    """
    changes = np.flatnonzero(np.any(np.diff(log.voltages, axis=0) != 0.0, axis=1)) + 1
    hold = max(1, int(np.median(np.diff(changes)))) if len(changes) > 10 else 1
    first = int(np.bincount(changes % hold).argmax()) if len(changes) else 0
    return np.arange(first, log.samples, hold), hold, len(changes)


def _estimate_delay(log: Log, column: int) -> float | None:
    """Estimate the delay of an angle in a log [s]; None if no answer to it is visible."""
    rows, hold, changes = controller_samples(log)
    if changes < 100:
        return None
    sign, _, columns = next(channel for channel in CHANNELS.values() if column in channel[2])
    others = [other for other in columns if other != column]
    answer = np.diff(log.voltages[rows] @ np.array([1.0, sign]), 2)
    angles = np.diff(log.angles[rows], 2, axis=0)
    angle = angles[:, column]
    if not angle.any() or angle[1:] @ angle[:-1] > NOISY * (angle @ angle):
        return None
    longest = round(LONGEST * log.rate_hz / hold)
    k = np.arange(TAPS, len(answer) - longest)
    k = k[(np.abs(answer[k]) > 0.0) & (np.abs(answer[k]) <= np.quantile(np.abs(answer[k]), 0.9))]  # no steps of r
    k = k[:: max(1, len(k) // ROWS)]
    if len(k) < 20 * TAPS:
        return None
    other_angles = [angles[k - j, other] for other in others for j in range(TAPS)]
    R2 = np.array([
        _r_squared(answer[k], np.column_stack([*(angle[k + s - j] for j in range(TAPS)), *other_angles]))
        for s in range(longest + 1)
    ])  # fmt: skip
    without_angle = _r_squared(answer[k], np.column_stack(other_angles)) if other_angles else 0.0
    if R2.max() - without_angle < VISIBLE:
        return None
    delay = int(np.argmax(R2 >= R2.max() - EQUAL))
    if 0 < delay and R2[delay] - R2[0] < IMPROVED:
        return None
    return float(delay * hold * log.step)


def _r_squared(y: Array, X: Array) -> float:
    """Return R2 of a regression of y (n,) on X (n, k)."""
    residual = y - X @ np.linalg.lstsq(X, y, rcond=None)[0]
    return 1.0 - float(residual @ residual) / float(y @ y)


def _shift_earlier(log: Log, column: int, samples: int) -> Log:
    """Shift one angle by so many samples; the log becomes shorter by as many."""
    length = log.samples - samples
    angles = log.angles[:length].copy()
    angles[:, column] = log.angles[samples:, column]
    references = {name: values[:length] for name, values in log.references.items()}
    return replace(log, angles=angles, voltages=log.voltages[:length], references=references)
