r"""Find logs that share a stretch of flight, by their samples, even if one of them was processed.

Two records of one flight differ by noise: rounded digits, added noise, interpolation. Two flights differ by their air,
even with the same voltages: the rig integrates its torque twice. So the difference of two records of one flight is
white, that of two flights is red. A piece x of one log is compared with every place of the other log y. At the best
place, without an offset, a drift and a shift by less than a sample, their difference is

    d_i = y(t_i + lag) - x(t_i) - c_0 - c_1 t_i - c_2 x'(t_i),    r = sum d_i d_{i+1} / sum d_i^2,

Its correlation r from sample to sample is 0 for white noise, with a standard error of 1/sqrt(N), and nearly 1 for a
difference that the rig integrated. A piece is shared if r is at most :data:`WHITE` on every axis that moves. Logs share
flight if at least :data:`PIECES` pieces with the same lag are shared, and half of the pieces between them.

Source: Lewis, Fast Normalized Cross-Correlation, 1995 (the difference at every lag from one transform and running
sums).
"""

import numpy as np
from scipy.signal import correlate

from .columns import Array
from .log import Log

RATE = 25.0  # of the common grid [Hz]
PIECE = 8.0  # length of a piece [s]
PIECES = 2  # least number of shared pieces: by chance two do not fit at the same lag
SAME_LAG = 0.2  # largest difference of lags [s] within a shared stretch: clocks differ by 1 in 1000 over minutes
WHITE = 0.5
"""Correlation from sample to sample that noise does not reach: seven standard errors of 200 samples. Interpolation and
rounded digits give .2 at most; two flights with the same voltages in the calmest of the generated rooms give more than
.9."""

ROUNDING = 1e-18  # power of a difference by rounding [rad^2]
MOVES = 1e-3  # least standard deviation [rad] of an angle that moves within a piece
LARGEST_DIFFERENCE = 0.2  # share of an angle's power that the difference of a shared piece may have


def find_shared_flight(one: Log, other: Log) -> tuple[float, float, float] | None:
    """Find a stretch of flight that two logs share, by their angles: two flights may have the same voltages.

    Returns its start in either log since its first sample [s], and its length [s]; None if they share less than
    :data:`PIECES` pieces in which two axes move, and are not read from the same bytes.
    """
    begin, end = max(one.start, other.start), min(one.start + one.duration, other.start + other.duration)
    if one.sha256 == other.sha256 != "" and end - begin > 0.5 * one.step:  # half a step is rounding
        return begin - one.start, begin - other.start, end - begin
    rate = min(RATE, one.rate_hz, other.rate_hz)
    short, long = sorted((one, other), key=lambda log: log.duration)
    x, y = _on_grid(short, rate), _on_grid(long, rate)
    n, shared = round(PIECE * rate), list[tuple[float, float]]()  # start in the shorter log, and lag [s]
    if len(x) < PIECES * n:
        return None
    for start in range(0, len(x) - n + 1, n):
        piece = x[start : start + n]
        place = _best_place(piece, y)
        if _is_shared(piece, y[place : place + n]):
            shared.append((start / rate, (place - start) / rate))
    for _, lag in shared:
        starts = [start for start, other_lag in shared if abs(other_lag - lag) < SAME_LAG]
        length = starts[-1] - starts[0] + PIECE
        if len(starts) >= max(PIECES, 0.5 * length / PIECE):
            begins = starts[0], starts[0] + lag
            return *(begins if short is one else begins[::-1]), length
    return None


def _on_grid(log: Log, rate: float) -> Array:
    """Interpolate the angles to a common rate [Hz], shape (n, 3)."""
    time = np.arange(int((log.samples - 1) * log.step * rate) + 1) / rate
    return np.column_stack([np.interp(time, log.time, angle) for angle in log.angles.T])


def _best_place(piece: Array, y: Array) -> int:
    """Find the index in y (M, 3) at which it differs least from a piece (n, 3), but for a constant on each axis."""
    n, misfit = len(piece), np.zeros(len(y) - len(piece) + 1)
    for x, z in zip((piece - piece.mean(0)).T, (y - y.mean(0)).T, strict=True):
        sums = np.concatenate((np.zeros((2, 1)), np.cumsum([z, z * z], axis=1)), axis=1)
        total, square = sums[:, n:] - sums[:, :-n]
        misfit += (square - total**2 / n + x @ x - 2.0 * correlate(z, x, "valid")) / max(float(x @ x), 1e-9)
    return int(misfit.argmin())


def _is_shared(x: Array, y: Array) -> bool:
    """Whether the difference of two pieces (n, 3) is white on every axis that moves, and at least two move."""
    moving = np.flatnonzero(x.std(0) > MOVES)
    for k in moving:
        regressors = np.column_stack([np.ones(len(x)), np.linspace(-1.0, 1.0, len(x)), np.gradient(x[:, k])])
        d = y[:, k] - x[:, k]
        d = d - regressors @ np.linalg.lstsq(regressors, d, rcond=None)[0]
        power = float(d @ d)
        if power > LARGEST_DIFFERENCE * len(x) * x[:, k].var() or d[1:] @ d[:-1] > WHITE * power + ROUNDING:
            return False
    return len(moving) >= 2
