r"""Logs that share flight: found by their samples, whatever was done to one of them.

Two records of one flight differ by noise: digits that were cut, noise that was added, interpolation. Two flights differ
by their air, even where the same voltages were played: a torque tau(t) on each axis, which the rig integrates twice,

    S_d(f) = 2 S_tau(f) / |a_0 + 2 pi i a_1 f - (2 pi f)^2|^2 + 2 S_n.

The difference d of one flight is white, that of two flights is red. So a piece x of one log is laid on every place of
the other log y, and at the best of them, with an offset, a drift and a shift by less than a sample taken away,

    d(t) = y(t + lag) - x(t) - c_0 - c_1 t - c_2 x'(t),

the mean periodogram of d in :data:`LOW` is compared with that in :data:`HIGH`. Of white noise their ratio is F
distributed with 2 n_low and 2 n_high degrees of freedom. A piece is shared where no axis that moves exceeds
:data:`WHITE`; logs share flight where :data:`PIECES` pieces at the same lag are, and half of those between them.

Sources: Press et al., Numerical Recipes, 3rd ed., section 13.4 (periodograms of windowed pieces); Lewis, Fast
Normalized Cross-Correlation, 1995 (the difference at every lag from one transform and running sums).
"""

import numpy as np
from numpy.typing import NDArray
from scipy.signal import correlate, get_window

from .log import Log

Array = NDArray[np.float64]

RATE = 25.0  # of the common grid [Hz]: both bands lie below its half
PIECE = 8.0  # length of a piece [s]: six bins of a periodogram below 1 Hz
PIECES = 2  # that have to be shared: what one of them does by chance, another does not at the same lag
LOW, HIGH = (0.3, 1.0), (2.0, 10.0)  # bands [Hz] in which air and noise are the larger share of a difference
SAME_LAG = 0.2  # difference of lags [s] of pieces of one shared stretch: clocks differ by 1 in 1000 over minutes

WHITE = 5.0
"""Ratio of a difference's powers that noise does not reach: of six bins over 64, F(12, 128) exceeds it once in 10^6.
Interpolation and digits that were cut leave 3 to 5; in the calmest of the generated rooms two flights under the same
voltages leave more in all of 36 pairs."""

MOVES, LIKE = 1e-3, 0.2
"""Standard deviation [rad] of an angle that moves within a piece, and the share of its power in :data:`LOW` that a
difference may have."""


def shared_flight(one: Log, other: Log) -> tuple[float, float, float] | None:
    """Find a stretch of flight that two logs of any rates share, by their angles: voltages may be those of two flights.

    Gives when it begins in the one and in the other, since the first sample of either [s], and its length [s]; None
    where they share less than :data:`PIECES` pieces in which two axes move.
    """
    rate = min(RATE, one.rate_hz, other.rate_hz)
    short, long = sorted((one, other), key=lambda log: log.duration)
    x, y = _on_grid(short, rate), _on_grid(long, rate)
    n, found = round(PIECE * rate), list[tuple[float, float]]()
    if len(x) < PIECES * n:
        return None
    for start in range(0, len(x) - n + 1, n):
        piece = x[start : start + n]
        place = _best_place(piece, y)
        if _is_shared(piece, y[place : place + n], rate):
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


def _is_shared(x: Array, y: Array, rate: float) -> bool:
    """Whether the difference of two pieces (n, 3) is white on every axis that moves, and at least two move."""
    n, t = len(x), np.linspace(-1.0, 1.0, len(x))
    f, window = np.fft.rfftfreq(n, 1.0 / rate), get_window("hann", n)[:, None]
    low, high = ((f >= band[0]) & (f <= min(band[1], 0.45 * rate)) for band in (LOW, HIGH))
    d = np.empty_like(x)
    for k in range(x.shape[1]):
        beside = np.column_stack([np.ones(n), t, np.gradient(x[:, k])])
        d[:, k] = y[:, k] - x[:, k] - beside @ np.linalg.lstsq(beside, y[:, k] - x[:, k], rcond=None)[0]
    moves = (x - x.mean(0)).std(0) > MOVES
    power, own = (np.abs(np.fft.rfft(window * (s - s.mean(0)), axis=0)) ** 2 for s in (d, x))
    like = power[low].mean(0) <= LIKE * own[low].mean(0)
    white = power[low].mean(0) <= WHITE * power[high].mean(0) + 1e-12
    return bool(moves.sum() >= 2 and (like & white)[moves].all())
