r"""Logs that share flight: found by their samples, whatever was done to one of them.

Two records of one flight differ by noise: digits that were cut, noise that was added, interpolation. Two flights differ
by their air, even where the same voltages were played: a torque, which the rig integrates twice. So the difference of
one flight is white, that of two flights is red. A piece x of one log is laid on every place of the other log y. At the
best place, with an offset, a drift and a shift by less than a sample taken away, it leaves

    d_i = y(t_i + lag) - x(t_i) - c_0 - c_1 t_i - c_2 x'(t_i),    r = sum d_i d_{i+1} / sum d_i^2,

whose correlation r from sample to sample is 0 of white noise, with a standard error of 1/sqrt(N), and nearly 1 of what
the rig integrated. A piece is shared where r is at most :data:`WHITE` on every axis that moves; logs share flight where
:data:`PIECES` pieces at the same lag are, and half of those between them.

Source: Lewis, Fast Normalized Cross-Correlation, 1995 (the difference at every lag from one transform and running
sums).
"""

import numpy as np
from scipy.signal import correlate

from .columns import Array
from .log import Log

RATE = 25.0  # of the common grid [Hz]
PIECE = 8.0  # length of a piece [s]
PIECES = 2  # that have to be shared: what one of them does by chance, another does not at the same lag
SAME_LAG = 0.2  # difference of lags [s] of pieces of one shared stretch: clocks differ by 1 in 1000 over minutes
WHITE = 0.5
"""Correlation from sample to sample that noise does not reach: seven standard errors of 200 samples. Interpolation and
digits that were cut leave .2 at most; in the calmest of the generated rooms two flights under the same voltages leave
more than .9."""

ROUNDING = 1e-18  # power of a difference that is no more than rounding [rad^2]
MOVES = 1e-3  # standard deviation [rad] of an angle that moves within a piece
LIKE = 0.2  # share of an angle's power that a difference may have


def shared_flight(one: Log, other: Log) -> tuple[float, float, float] | None:
    """Find a stretch of flight that two logs of any rates share, by their angles: voltages may be those of two flights.

    Gives when it begins in the one and in the other, since the first sample of either [s], and its length [s]; None
    where they share less than :data:`PIECES` pieces in which two axes move, and are no stretches of the same bytes.
    """
    begin, end = max(one.start, other.start), min(one.start + one.duration, other.start + other.duration)
    if one.sha256 == other.sha256 != "" and end - begin > 0.5 * one.step:  # half a step is rounding
        return begin - one.start, begin - other.start, end - begin
    rate = min(RATE, one.rate_hz, other.rate_hz)
    short, long = sorted((one, other), key=lambda log: log.duration)
    x, y = _on_grid(short, rate), _on_grid(long, rate)
    n, found = round(PIECE * rate), list[tuple[float, float]]()
    if len(x) < PIECES * n:
        return None
    for start in range(0, len(x) - n + 1, n):
        piece = x[start : start + n]
        place = _best_place(piece, y)
        if _is_shared(piece, y[place : place + n]):
            found.append((start / rate, (place - start) / rate))
    for _, lag in found:
        same = [at for at, own in found if abs(own - lag) < SAME_LAG]
        length = same[-1] - same[0] + PIECE
        if len(same) >= max(PIECES, 0.5 * length / PIECE):
            begins = same[0], same[0] + lag
            return *(begins if short is one else begins[::-1]), length
    return None


def _on_grid(log: Log, rate: float) -> Array:
    """Angles (n, 3) at a common rate [Hz]."""
    time = np.arange(int((log.samples - 1) * log.step * rate) + 1) / rate
    return np.column_stack([np.interp(time, log.time, angle) for angle in log.angles.T])


def _best_place(piece: Array, y: Array) -> int:
    """Index of y (M, 3) from which a piece (n, 3) differs least from it, but for a constant on each axis."""
    n, misfit = len(piece), np.zeros(len(y) - len(piece) + 1)
    for x, z in zip((piece - piece.mean(0)).T, (y - y.mean(0)).T, strict=True):
        sums = np.concatenate((np.zeros((2, 1)), np.cumsum([z, z * z], axis=1)), axis=1)
        mean, square = sums[:, n:] - sums[:, :-n]
        own = square - mean**2 / n
        misfit += (own + x @ x - 2.0 * correlate(z, x, "valid")) / max(float(x @ x), 1e-9)
    return int(misfit.argmin())


def _is_shared(x: Array, y: Array) -> bool:
    """Whether the difference of two pieces (n, 3) is white on every axis that moves, and at least two move."""
    moving = np.flatnonzero(x.std(0) > MOVES)
    for k in moving:
        beside = np.column_stack([np.ones(len(x)), np.linspace(-1.0, 1.0, len(x)), np.gradient(x[:, k])])
        d = y[:, k] - x[:, k]
        d = d - beside @ np.linalg.lstsq(beside, d, rcond=None)[0]
        power = float(d @ d)
        if power > LIKE * len(x) * x[:, k].var() or d[1:] @ d[:-1] > WHITE * power + ROUNDING:
            return False
    return len(moving) >= 2
