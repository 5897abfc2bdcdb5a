"""From the instants a log states to a uniform rate.

Identification wants samples at i/rate. Three kinds of time column are told apart:

* uniform within a thousandth of a step: taken as it is;
* printed too coarsely for its step (300 Hz in whole milliseconds: 3, 3, 4 ms): the samples were uniform, the print is
  not, and the sampling interval is the mean;
* really uneven (jitter, or lost samples, which leave steps that are whole multiples of the usual one): resampled to
  the rate at which most samples came. Angles are interpolated linearly; a voltage is held between samples, so each
  new sample is the mean of the held voltage over its step, which keeps the impulse ∫ v dt that the motors saw.

A stretch without samples longer than `GAP_STEPS` median steps is no jitter; nothing is known of it: refused.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import LogError

GAP_STEPS = 5  # at the lowest rate .1 s, still short against a pitch period of 7.7 s
_UNIFORM_STEPS = 1e-3  # an angle moving at 1 rad/s is off by 1e-5 rad at 100 Hz, 1/150 of an encoder count
_OFTEN_DOUBLED = 0.24  # share of doubled steps from which a print to one step is coarse: up to 800 Hz (.25) in ms


@dataclass(frozen=True, eq=False)
class Sampling:
    """Uniform rate of a log, and whether its samples have to be interpolated to get there.

    Attributes
    ----------
    rate_hz : float
        Uniform rate [Hz].
    samples : int
        Number of uniform samples.
    resample : bool
        Whether the samples lie off the uniform grid.
    note : str or None
        What was done, if anything.
    """

    rate_hz: float
    samples: int
    resample: bool
    note: str | None


def check_forward(time: NDArray[np.float64], place: Callable[[int], str]) -> None:
    """Refuse a time that stands still or runs back.

    Parameters
    ----------
    time : NDArray, shape (N,)
        Instants [s].
    place : Callable[[int], str]
        Names the row of a sample.

    Raises
    ------
    LogError
        At the first sample that is not later than the one before.
    """
    wrong = np.diff(time) <= 0.0
    if wrong.any():
        at = int(wrong.argmax()) + 1
        now, before = time[at], time[at - 1]
        stuck = f"time stands still at {now:g} s"
        what = stuck if now == before else f"time runs back from {before:g} s to {now:g} s"
        raise LogError(f"{place(at)}: {what}; it must grow from row to row, cut the log or mend its clock.")


def find_sampling(time: NDArray[np.float64], place: Callable[[int], str]) -> Sampling:
    """Find the uniform rate behind a growing time column.

    Parameters
    ----------
    time : NDArray, shape (N,), N >= 2
        Growing instants [s].
    place : Callable[[int], str]
        Names the row of a sample.

    Raises
    ------
    LogError
        If a stretch longer than `GAP_STEPS` median steps holds no sample.
    """
    intervals = np.diff(time)
    median = float(np.median(intervals))
    # Half a step of tolerance, as the instants on both sides jitter too.
    gaps = intervals > (GAP_STEPS + 0.5) * median
    if gaps.any():
        at = int(gaps.argmax()) + 1
        raise LogError(
            f"{place(at)}: no samples for {intervals[at - 1]:.4g} s before {time[at]:g} s, at most "
            f"{GAP_STEPS} steps of {median:.4g} s are bridged; cut the log there into two with --from and --to."
        )
    duration = float(time[-1] - time[0])
    mean = duration / (len(time) - 1)
    off_grid = float(np.abs(time - time[0] - mean * np.arange(len(time))).max())
    if off_grid <= _UNIFORM_STEPS * mean:
        return Sampling(_rounded_rate(1.0 / mean, off_grid / duration), len(time), False, None)
    digit = _last_digit(time)
    # The end points may be rounded by half a digit each, which tilts the grid by up to half a digit more.
    if off_grid <= digit and not _samples_lost(intervals, median, digit):
        rate = _rounded_rate(1.0 / mean, digit / duration)
        note = (
            f"time column printed to {1e3 * digit:g} ms; sampling interval taken as the mean, "
            f"{1e3 / rate:.5g} ms ({rate:g} Hz)"
        )
        return Sampling(rate, len(time), False, note)
    # The median tells a lost sample from jitter, but jitters itself; the count of steps between the ends does not.
    steps = float(np.maximum(np.round(intervals / median), 1.0).sum())
    rate = _rounded_rate(steps / duration, 1.0 / steps)
    note = (
        f"time is uneven (steps of {1e3 * intervals.min():.4g} to {1e3 * intervals.max():.4g} ms): resampled to "
        f"{rate:g} Hz, angles linearly, voltages as means of what was held"
    )
    return Sampling(rate, int(np.floor(duration * rate + _UNIFORM_STEPS)) + 1, True, note)


def _samples_lost(intervals: NDArray[np.float64], median: float, digit: float) -> bool:
    """Whether all steps of instants on a line are the usual one or whole multiples of it: 10 and 20 ms, not 3 and 4 ms.

    Where the usual step is the print's own digit, both readings are open: 700 Hz in whole milliseconds shows 1 and 2 ms
    in turns, as would 1 kHz without every third sample. A logger that loses samples so evenly loses few of them.
    """
    steps = np.round(intervals / median)
    whole = bool(steps.min() == 1.0 and steps.max() > 1.0 and np.abs(intervals - steps * median).max() < 1e-3 * median)
    in_turns = steps.max() == 2.0 and abs(median - digit) < 1e-3 * digit and np.mean(steps == 2.0) >= _OFTEN_DOUBLED
    return whole and not in_turns


def _rounded_rate(rate: float, uncertainty: float) -> float:
    """Give the whole number of hertz within the relative uncertainty of a rate, else the rate."""
    whole = round(rate)
    return float(whole) if abs(rate - whole) <= (uncertainty + 1e-9) * rate else rate


def _last_digit(time: NDArray[np.float64]) -> float:
    """Give the coarsest digit (1, .1, ... 1e-6 s) of which all instants are multiples; 0 if none is."""
    for digits in range(7):
        scaled = time * 10.0**digits
        if np.abs(scaled - np.round(scaled)).max() < 1e-3:
            return 10.0**-digits
    return 0.0


def interpolated(
    time: NDArray[np.float64], values: NDArray[np.float64], grid: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Interpolate a sampled signal linearly.

    Parameters
    ----------
    time, values : NDArray, shape (N,)
        Instants [s] and samples.
    grid : NDArray, shape (M,)
        New instants [s].

    Returns
    -------
    NDArray, shape (M,)
    """
    return np.interp(grid, time, values)


def mean_of_held(
    time: NDArray[np.float64], values: NDArray[np.float64], grid: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Average a held signal over each step of a uniform grid, which keeps its integral.

    Parameters
    ----------
    time, values : NDArray, shape (N,)
        Instants [s] and the values held from each to the next.
    grid : NDArray, shape (M,), M >= 2
        New instants [s], uniform.

    Returns
    -------
    NDArray, shape (M,)
    """
    step = grid[1] - grid[0]
    edges = np.append(grid, grid[-1] + step)
    knots = np.append(time, max(edges[-1], time[-1] + step))
    integral = np.concatenate(([0.0], np.cumsum(values * np.diff(knots))))
    return np.diff(np.interp(edges, knots, integral)) / np.diff(edges)
