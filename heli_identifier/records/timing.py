"""Find the uniform rate behind the instants of a log.

Identification needs samples at i/rate. Instants that are uniform within a thousandth of a step are used unchanged.
Others are uneven by jitter, by lost samples, which leave steps that are whole multiples of the usual one, or because
they are printed with few digits. They are resampled to the rate at which most samples came: angles are interpolated
linearly. A voltage is constant between samples, so each new sample is the mean of the voltage over its step; this keeps
the impulse ∫ v dt that the motors received.

A gap of more than `GAP_STEPS` median steps is refused, because nothing is known of the rig during it.
"""

import numpy as np

from heli_identifier.errors import LogError

from .columns import Array

LOWEST_RATE_HZ = 50.0
HIGHEST_RATE_HZ = 2000.0
SHORTEST_S = 5.0
GAP_STEPS = 5
"""Longest gap that is interpolated, in median steps: .1 s at the lowest rate, short against a pitch period of 7.7 s."""
_RATE_TOLERANCE = 1e-3  # the clock of a 50 Hz logger may be .1 % slow
_UNIFORM_STEPS = 1e-3  # an angle that moves at 1 rad/s is off by 1e-5 rad at 100 Hz, 1/150 of an encoder count


def find_sampling(time: Array, file: str, row: int) -> tuple[float, Array | None, list[str]]:
    """Find the uniform rate [Hz] behind the instants [s] of a log, shape (N,); the first one is in ``row``.

    Returns the rate, the uniform instants, shape (M,), if those of the log are uneven, else None, and notes. A LogError
    names the row in which time does not increase or has too long a gap, or says that rate or length are out of bounds.
    """
    if len(time) < 2:
        raise LogError(f"{file}: {len(time)} sample is not a log; log at least 5 s.")
    intervals = np.diff(time)
    if (intervals <= 0.0).any():
        at = int((intervals <= 0.0).argmax()) + 1
        problem = f"runs back from {time[at - 1]:g} s to" if time[at] < time[at - 1] else "stands still at"
        advice = "it must increase from row to row, cut the log or correct its clock"
        raise LogError(f"{file}, row {row + at}: time {problem} {time[at]:g} s; {advice}.")
    median = float(np.median(intervals))
    gaps = intervals > (GAP_STEPS + 0.5) * median  # half a step more, because the instants on both sides jitter
    if gaps.any():
        at = int(gaps.argmax()) + 1
        raise LogError(
            f"{file}, row {row + at}: no samples for {intervals[at - 1]:.4g} s before {time[at]:g} s, at most "
            f"{GAP_STEPS} steps of {median:.4g} s are bridged; cut the log in two there with --from and --to."
        )
    duration = float(time[-1] - time[0])
    mean = duration / len(intervals)
    off_grid = float(np.abs(time - time[0] - mean * np.arange(len(time))).max())
    if off_grid <= _UNIFORM_STEPS * mean:
        rate = _rounded_rate(1.0 / mean, off_grid / duration)
        check_extent(rate, len(time), file)
        return rate, None, []
    # The median tells lost samples from jitter but jitters itself; the number of steps between the ends does not.
    steps = float(np.maximum(np.round(intervals / median), 1.0).sum())
    rate = _rounded_rate(steps / duration, 1.0 / steps)
    uneven = f"time is uneven (steps of {1e3 * intervals.min():.4g} to {1e3 * intervals.max():.4g} ms)"
    grid = time[0] + np.arange(int(np.floor(duration * rate + _UNIFORM_STEPS)) + 1) / rate
    check_extent(rate, len(grid), file)
    return rate, grid, [f"{uneven}: resampled to {rate:g} Hz, angles linearly, voltages as means of what was held"]


def _rounded_rate(rate: float, uncertainty: float) -> float:
    """Round a rate to whole hertz if that lies within its relative uncertainty."""
    rounded = round(rate)
    return float(rounded) if abs(rate - rounded) <= (uncertainty + 1e-9) * rate else rate


def check_extent(rate_hz: float, samples: int, file: str) -> None:
    """Raise a LogError for a rate outside of 50 Hz to 2 kHz, or less than 5 s of samples."""
    rate = f"the rate of {rate_hz:.4g} Hz is"
    if rate_hz < LOWEST_RATE_HZ * (1.0 - _RATE_TOLERANCE):
        problem = f"{rate} below {LOWEST_RATE_HZ:g} Hz; log faster, or check the unit of time"
    elif rate_hz > HIGHEST_RATE_HZ * (1.0 + _RATE_TOLERANCE):
        problem = f"{rate} above {HIGHEST_RATE_HZ:g} Hz; keep every n-th row, or check the unit of time"
    # Half a sample of tolerance: whether the interval after the last sample counts must not matter.
    elif samples < SHORTEST_S * rate_hz - 0.5:
        # Six digits tell 5 s from half a step less at the highest rate, 4.99975 s.
        problem = f"{samples / rate_hz:.6g} s of log are shorter than {SHORTEST_S:g} s; log longer or cut less"
    else:
        return
    raise LogError(f"{file}: {problem}.")


def mean_of_held(time: Array, values: Array, grid: Array) -> Array:
    """Average values (N,), constant from each instant [s] to the next, over steps of a uniform ``grid`` [s] (M,)."""
    step = grid[1] - grid[0]
    edges = np.append(grid, grid[-1] + step)
    knots = np.append(time, max(edges[-1], time[-1] + step))
    integral = np.concatenate(([0.0], np.cumsum(values * np.diff(knots))))
    return np.diff(np.interp(edges, knots, integral)) / np.diff(edges)
