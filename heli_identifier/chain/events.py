"""Events: passages of a log in which something outside the plant acts, found, listed and left out.

A push by a hand, a landing, a stop is an acceleration that no term of the axis's equation explains. The acceleration y
of an axis, from local cubics, is regressed on X: the terms of eqs. (2), (10), (12) and of the catalogue that are
functions of the motion, so that what a plant could explain is no event. Coefficients b minimise Huber's loss of
r = y - X b; a weight never falls to zero, since the rare steps of a joystick determine the lag of the thrust. The scale
of r grows with the motion,

    sigma^2 = s^2 + tau^2 F'^2,

F' [V/s] the rate of change of the thrust that drives the axis: an imperfect lag is compared with what it leaves at like
motion. An event is where abs(r) / sigma exceeds :data:`THRESHOLD`, between the halves of the peak of r: a rectangle
that passed through a symmetric kernel has its edges there. A slip of an encoder is a step from one sample to the next
that lies outside the range of the rates before and after it, by more than resolution and acceleration allow.

Sources: Huber 1964; Savitzky and Golay 1964.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, median_filter
from scipy.signal import lfilter, savgol_filter
from scipy.special import ndtri

from heli_identifier.records import ANGLES, Array, Log

EventKind = Literal["force", "slip"]

SETTLING = 2.0
"""Start of a log [s] that its filter needs to settle, left out: five times the correlation time of the air."""

THRESHOLD = 7.5
"""Residual over its scale from which a passage is an event: between the largest value in 20 hours of generated logs
without a touch (6.3; with effects and without, in open and in closed loop) and the smallest among 95 pushes by a hand
(8.9); `benchmarks/events.py` of commit 88348cb measured both."""

WINDOW, RATE, EVALUATED_STEP = 0.3, 100.0, 0.04
"""Length [s] of the local cubics, the shortest push of a hand; rate [Hz] that faster logs are reduced to; time [s]
between the samples of the regression, a quarter of what the cubics resolve. As much as WINDOW is left out on either
side of an event: the residual that finds it is blurred by half of the window, and its edges are known to .2 s."""

LAGS, BREAK_RATE = (0.06, 0.15), 0.05
"""Time constants [s] of a fast lag of the voltages and of a slow one behind it: a combination of the two behaves to
first order like any lag and delay of together .06 to .21 s, as measured. Rate [rad/s] over which friction turns."""

HUBER_LOSS, ITERATIONS, RIDGE, FEWEST_SAMPLES = 1.345, 15, 1e-8, 4
"""Residual in standard deviations beyond which a sample loses weight (95 % efficient on Gaussian ones); steps until the
coefficients settle; ridge that keeps columns apart that one data set cannot; samples per regressor that are needed."""

FAST_SHARE, CORE, TAIL = 0.1, 0.5, 0.9
"""tau is estimated from this share of the samples, those with the fastest change of the thrust; s from the larger of
two quantiles of abs(r): stick and slip makes tails that are no events, and a tenth of the samples may lie in events."""

RATE_WINDOW, NOISE_QUANTILE, NOISE_FACTOR = 0.1, 0.995, 3.0
"""Time [s] before and after a sample over which its rate is a median of differences; a slip is this many times larger
than this quantile of what differences exceed their neighbours' range by."""


@dataclass(frozen=True)
class Event:
    """A passage of a log in which something acts that is not the plant."""

    log: str
    """Name of the log."""
    axis: str
    """Pitch, elevation or travel."""
    start: float
    """Since the log's first sample [s]."""
    end: float
    """Since the log's first sample [s]."""
    start_in_file: float
    """In the time of the log's file [s]."""
    end_in_file: float
    """In the time of the log's file [s]."""
    kind: EventKind
    """`force` for a force from outside, `slip` for a step of the encoder's reading."""
    size: float
    """Largest unexplained acceleration [rad/s^2], or the step of a slip [rad]."""


def find_events(logs: Sequence[Log], voltage_limit: float) -> tuple[Event, ...]:
    """Find the events in logs of one rig, which share coefficients and scale; ``voltage_limit`` is in [V].

    They are given log by log, axis by axis, in order of time.
    """
    records = [_reduce_log(log, voltage_limit) for log in logs]
    regressions = [_regress_axes(record) for record in records]
    found = [_standardise(own) for own in zip(*regressions, strict=True)]
    events = []
    for i, (log, record, slips) in enumerate(zip(logs, records, _find_slips(records), strict=True)):
        for axis, name in enumerate(ANGLES):
            own: list[tuple[float, float, EventKind, float]] = [(at, at, "slip", size) for at, size in slips[axis]]
            for start, end, size in _find_forces(record.step, *found[axis][i]):
                if not any(start - WINDOW <= at <= end + WINDOW for at, _ in slips[axis]):
                    own.append((start, end, "force", size))
            events += [Event(log.name, name, start, end, log.start + start, log.start + end, kind, size)
                       for start, end, kind, size in sorted(own)]  # fmt: skip
    return tuple(events)


def passages(events: Sequence[Event]) -> dict[str, list[tuple[float, float]]]:
    """Give what is left out of the logs: per log start and end [s] since its first sample, in order of time."""
    out: dict[str, list[tuple[float, float]]] = {}
    for event in sorted(events, key=lambda event: event.start):
        out.setdefault(event.log, []).append((event.start - WINDOW, event.end + WINDOW))
    return out


def undo_slips(logs: Sequence[Log], events: Sequence[Event]) -> tuple[tuple[Log, ...], tuple[str, ...]]:
    """Shift back what follows the slips of an encoder; give the logs, and a sentence for each slip."""
    found, notes = list[Log](), list[str]()
    for log in logs:
        angles = log.angles.copy()
        own = [event for event in events if event.kind == "slip" and event.log == log.name]
        for event in own:
            angles[round(event.start * log.rate_hz) :, ANGLES.index(event.axis)] -= event.size
            notes.append(
                f"{log.name}: the reading of its {event.axis} slips by {1e3 * event.size:.3g} mrad at "
                f"{event.start_in_file:.2f} s, and what follows was shifted back; fasten the encoder's coupling"
            )
        found.append(replace(log, angles=angles) if own else log)
    return tuple(found), tuple(notes)


def is_counted(time: Array, left_out: Sequence[tuple[float, float]]) -> NDArray[np.bool_]:
    """Whether instants [s] of a log count: outside of passages and of what the filter needs to settle behind them."""
    counts = time > SETTLING
    for start, end in left_out:
        counts &= (time < start) | (time > end + SETTLING)
    return counts


def event_notes(logs: Sequence[Log], events: Sequence[Event]) -> tuple[str, ...]:
    """Say what was left out of each log and how much of it is used, one sentence a log."""
    notes = []
    for log in logs:
        own = sorted((event for event in events if event.log == log.name), key=lambda event: event.start)
        if own:
            said = ", ".join(f"{e.axis} {e.start_in_file:.1f} to {e.end_in_file:.1f} s" for e in own)
            used = float(is_counted(log.time, passages(own)[log.name]).sum() * log.step)
            rest = f"{used:.1f} of {log.duration:.1f} s are used" if used else "nothing remains of it"
            notes.append(
                f"{log.name}: something other than the plant acted on it ({said}); {rest} (--keep-events keeps them)"
            )
    return tuple(notes)


def _reduce_log(log: Log, limit: float) -> Log:
    """Log at about :data:`RATE`: means of the voltages that reached the motors, angles at the start of each step."""
    factor = max(1, int(log.rate_hz / RATE + 0.5))
    count = log.samples // factor
    voltages = log.voltages[: count * factor].clip(-limit, limit).reshape(count, factor, 2).mean(axis=1)
    angles = log.angles[: count * factor : factor]
    return replace(log, rate_hz=log.rate_hz / factor, voltages=voltages, angles=angles, references={})


def local_cubic(values: Array, step: float, window: float, order: int = 0) -> Array:
    """Give the derivative of ``order`` of a signal (N, ...) by local cubics over ``window`` [s]."""
    length = min(_window_length(step, window), (len(values) - 1) // 2 * 2 + 1)
    return np.asarray(savgol_filter(values, length, 3, order, step, axis=0))


def _window_length(step: float, window: float = WINDOW) -> int:
    """Count the samples of a local cubic, an odd number."""
    return max(int(window / step) | 1, 5)


def _grid(step: float) -> tuple[int, int]:
    """Count the samples at either end whose polynomials are not centred, and those from one evaluation to the next."""
    return _window_length(step) // 2 + 1, max(1, round(EVALUATED_STEP / step))


def _regress_axes(record: Log) -> list[tuple[Array, Array, Array]]:
    """Regression of each axis of a log, from smoothed signals.

    Gives the regressors (n, k), the acceleration (n,) [rad/s^2], and the change of the thrust that drives the axis (n,)
    [V/s]. The thrusts are linear twice, behind a fast lag and a slow one, then of second and third degree.
    """
    h, length, (edge, stride) = record.step, _window_length(record.step), _grid(record.step)
    voltages, angles, inner = record.voltages, record.angles, slice(edge, record.samples - edge, stride)
    if record.samples <= 2 * edge + 1:  # shorter than a polynomial: no sample of it is used
        voltages, angles, inner = np.zeros((length, 2)), np.zeros((length, 3)), slice(0)

    def lagged(values: Array, time_constant: float) -> Array:
        kept = float(np.exp(-h / time_constant))
        return np.asarray(lfilter([0.0, 1.0 - kept], [1.0, -kept], values - values[0], axis=0) + values[0])

    angle, rate, acceleration = (local_cubic(angles, h, WINDOW, order).T for order in range(3))
    fast = lagged(voltages, LAGS[0])
    slow = lagged(fast, LAGS[1])
    thrusts = [local_cubic(nu, h, WINDOW).T for nu in (fast, slow, slow * abs(slow), slow**3)]
    front, rear = local_cubic(slow, h, WINDOW, 1).T
    sine, cosine, turning = np.sin(angle[0]), np.cos(angle[0]), thrusts[1].sum(axis=0) * np.cos(angle[0]) * rate[0]
    changes = (front - rear, (front + rear) * cosine, (front + rear) * sine + turning)
    reach = edge // 2 | 1  # a quarter of the polynomial: wider, and the answer of a controller would excuse a push
    widest = [maximum_filter1d(abs(f), reach)[inner] for f in changes]

    (pitch, elevation, travel), (wx, wz, wy), y = angle[:, inner], rate[:, inner], acceleration[:, inner]
    sine, cosine, one = sine[inner], cosine[inner], np.ones_like(pitch)
    differences, sums = ([front[inner] + sign * rear[inner] for front, rear in thrusts] for sign in (-1.0, 1.0))
    diff, total = differences[1], sums[1]
    turned_x, turned_z, turned_y = (np.tanh(own / BREAK_RATE) for own in (wx, wz, wy))
    of_pitch = (
        one, wx, sine, cosine, *differences, turned_x, wx * abs(wx), wy, wy * abs(wy), wz, sine * wy**2, wy * wz,
        total, wy * total, wy * diff, wz * diff,
    )  # fmt: skip
    of_elevation = (
        one, wz, elevation, elevation**2, *(nu * cosine for nu in sums), turned_z, wz * abs(wz), wx * wy, wy**2,
        wy**2 * elevation, wz * total, wx * total, wy * total, sine, cosine, diff, wx,
    )  # fmt: skip
    of_travel = (
        one, wy, travel, *(nu * sine for nu in sums), total * cosine, turned_y, wy * abs(wy), wz * wy,
        wz * wy * elevation, wy * total, diff, wx * wz, wx, sine, wx * total,
    )  # fmt: skip
    regressors = [np.column_stack(X) for X in (of_pitch, of_elevation, of_travel)]
    return [*zip(regressors, y, widest, strict=True)]


def _standardise(logs: Sequence[tuple[Array, Array, Array]]) -> list[tuple[Array, Array]]:
    """Residuals of one axis (n,) [rad/s^2] in each log, and the same over the scale of all logs at like motion."""
    X, y, change = (np.concatenate(parts) for parts in zip(*logs, strict=True))
    if len(y) < FEWEST_SAMPLES * X.shape[1]:
        return [(np.zeros_like(own), np.zeros_like(own)) for _, own, _ in logs]
    r = huber_residuals(X, y)
    s = max(float(np.quantile(abs(r), share)) / float(ndtri(0.5 + 0.5 * share)) for share in (CORE, TAIL))
    fastest = (change >= np.quantile(change, 1.0 - FAST_SHARE)) & (change > 0.0)
    tau_squared = 0.0
    if fastest.any():
        squares = (r[fastest] / ndtri(0.75)) ** 2  # their median is the variance
        tau_squared = max(float(np.median((squares - s**2) / change[fastest] ** 2)), 0.0)
    standardised = r / np.sqrt(s**2 + tau_squared * change**2 + np.finfo(float).tiny)
    ends = np.cumsum([len(own) for _, own, _ in logs])[:-1]
    return list(zip(np.split(r, ends), np.split(standardised, ends), strict=True))


def huber_residuals(X: Array, y: Array) -> Array:
    """Residuals (n,) of ``y`` (n,) after a fit of the columns of ``X`` (n, k) by Huber's loss."""
    length = np.sqrt((X**2).mean(axis=0))
    X = X / np.where(length > 0.0, length, 1.0)
    weights, r = np.ones_like(y), y
    for _ in range(ITERATIONS):
        normal = X.T @ (X * weights[:, None]) + RIDGE * len(y) * np.eye(X.shape[1])
        r = y - X @ np.linalg.solve(normal, X.T @ (weights * y))
        scale = float(np.median(abs(r))) / float(ndtri(0.75))
        weights = np.minimum(1.0, HUBER_LOSS * scale / np.maximum(abs(r), np.finfo(float).tiny))
    return r


def _find_forces(step: float, r: Array, standardised: Array) -> Iterator[tuple[float, float, float]]:
    """Start and end [s] and largest residual [rad/s^2] of the passages of one log and axis, WINDOW apart."""
    reach = 2 * round(WINDOW / EVALUATED_STEP) + 1
    edge, stride = _grid(step)
    if not len(r):
        return
    near = maximum_filter1d(abs(standardised), reach) > THRESHOLD
    inside = np.flatnonzero(near & (abs(r) >= 0.5 * maximum_filter1d(abs(r), reach)))
    for part in np.split(inside, np.flatnonzero(np.diff(inside) * stride * step > WINDOW) + 1):
        if len(part):
            yield (edge + part[0] * stride) * step, (edge + part[-1] * stride) * step, float(abs(r[part]).max())


def _find_slips(records: Sequence[Log]) -> list[list[list[tuple[float, float]]]]:
    """Instants [s] and sizes [rad] of the slips, per record and axis."""
    excesses = [_beyond_neighbours(record) for record in records]
    noise = NOISE_FACTOR * np.quantile(np.concatenate([abs(e) for e in excesses]), NOISE_QUANTILE, axis=0)
    curvatures = [
        abs(local_cubic(r.angles, r.step, WINDOW, 2)).max(axis=0)
        for r in records
        if r.samples > 2 * _window_length(r.step)
    ]
    largest = np.max(curvatures, axis=0) if curvatures else np.inf
    return [[[((int(i) + 1) * record.step, float(e[i])) for i in np.flatnonzero(abs(e) > allowed)]
             for e, allowed in zip(excess.T, noise + largest * record.step * RATE_WINDOW, strict=True)]
            for record, excess in zip(records, excesses, strict=True)]  # fmt: skip


def _beyond_neighbours(record: Log) -> Array:
    """Differences of successive angles [rad] less the nearest of what lies between the rates before and after."""
    width, difference = int(RATE_WINDOW / record.step) | 1, np.diff(record.angles, axis=0)
    excess = np.zeros_like(difference)
    if len(difference) > 2 * width:
        rate, by = median_filter(difference, (width, 1)), width // 2 + 1  # to the medians' centres on either side
        before, behind = rate[width - by : len(rate) - width - by], rate[width + by : len(rate) - width + by]
        own = difference[width:-width]
        excess[width:-width] = own - own.clip(np.minimum(before, behind), np.maximum(before, behind))
    return excess
