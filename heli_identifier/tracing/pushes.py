r"""Pushes: passages of logs in which something other than the plant turns the rig, found in the innovations of a fit.

A hand, an obstacle or a stop adds a torque g from t to t + w. The innovations e of its axis change by g s, with s the
response of the filter's error dynamics, so the generalised likelihood ratio of a push is

    S(t, w) = u^2 / (2 I phi) [nats],    u = sum_k e_k s_k / sigma,    I = sum_k s_k^2.

A pulse is the difference of two steps, so one run of a filter in reverse gives u for all t and w. phi is the mean of
u^2/I in these logs, which exceeds 1 because the filter's model of the air is not exact. It grows with the fastest
change v' [V/s] of the voltages during the pulse, phi = phi_0 + tau^2 v'^2: the error of a law at one step of the
voltages is compared with its errors at other steps.

A push is a pulse of :data:`.settings.UNKNOWN` nats. The largest one of every log is left out and the fit is repeated
without that passage. Then the push is placed again, because the fit before took it for air and so gave it a wrong size
and wrong edges, and the next one is searched.

Source: Willsky and Jones, IEEE Trans. Automatic Control 21 (1976) 108.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d
from scipy.signal import lfilter
from scipy.special import ndtri

from heli_identifier.chain import MARGIN
from heli_identifier.records import Event, Log

from .fit import Fit, fit, fit_per_log
from .likelihood import undo_in_record
from .noise import error_dynamics, match_steps, start_memory
from .rig import Array, Record, records_of
from .settings import SEEN_AT, SETTLING, UNKNOWN

LAG = round(MARGIN * SEEN_AT)
WIDTHS = range(LAG, int(SETTLING * SEEN_AT) + 1)
"""Widths of the pulses, in periods of :data:`.settings.SEEN_AT`. Huber's loss bounds the harm of shorter ones, and the
filter takes longer ones for air. For a time LAG a step of the voltages acts through the motors."""


def find_pushes(fitted: Fit, logs: Sequence[Log]) -> tuple[Event, ...]:
    """Find the pushes in logs, the first of which are those of the fit; passages that it left out are searched as well.

    Passages of the logs' events are not searched. A log may begin with a push: a rig takes off, or a hand lets it go.
    """
    axes, records = range(len(fitted.likelihood.rig.axes)), records_of(logs, fitted.likelihood.rig, settled=True)
    searched = [_SearchedLog(log, record, log.events) for log, record in zip(logs, records, strict=True)]
    while True:
        fitted, filtered = _fit_beside_events(fitted, searched)
        for i, by_axis in enumerate(zip(*(_search_axis(fitted, axis, filtered) for axis in axes), strict=True)):
            placed = [push for push, _ in by_axis if push]
            S, new = max((further for _, further in by_axis), key=lambda further: further[0])
            known = (*searched[i].earlier, *placed)
            searched[i] = replace(searched[i], earlier=known, newest=(new,) if S > UNKNOWN else ())
        if not any(log.newest for log in searched):
            return tuple(push for own in searched for push in own.earlier[len(own.log.events) :])


@dataclass(frozen=True, eq=False)
class _SearchedLog:
    """A log, its whole record as logged, and the events that are known so far."""

    log: Log
    record: Record
    earlier: tuple[Event, ...]
    newest: tuple[Event, ...] = ()
    """The push that was found last, by a fit that took it for air."""
    e: Array = field(default_factory=lambda: np.empty((0, 0)))
    """Innovations (N, a) [rad] of a filter that knows these events."""
    sizes: Array = field(default_factory=lambda: np.empty(0))
    """Of the torques of the pushes [rad/s^2], as :attr:`.Record.pushes` has them."""


def _fit_beside_events(fitted: Fit, logs: Sequence[_SearchedLog]) -> tuple[Fit, list[_SearchedLog]]:
    """Repeat a fit without the passages of new pushes, and run its filter along all logs, their faults undone."""
    likelihood, axes, count = fitted.likelihood, fitted.likelihood.rig.axes, len(fitted.point.per_log)
    undone = [undo_in_record(likelihood.faults, log.record) for log in logs]
    marked = tuple(log.record.mark((*log.earlier, *log.newest), axes) for log in logs)
    if any(log.newest for log in logs[:count]):
        again = replace(likelihood, records=marked[:count], faults={}, logged=()).undo_faults(likelihood.faults)
        fitted = fit(again, fitted.names, fitted)
    errors, per_log = list(fitted.e), list(fitted.point.per_log)
    if held_out := tuple(undo_in_record(likelihood.faults, record) for record in marked[count:]):
        others = replace(likelihood, records=held_out, faults={}, logged=())
        filtered = fit_per_log(others, others.neutral_point(fitted.parameters, fitted.point.z), fitted.sigma)
        errors += filtered.e
        per_log += list(filtered.point.per_log)
    return fitted, [
        replace(log, record=record, e=np.where(record.weights > 0.0, e, 0.0), sizes=b[5 * len(axes) :])
        for log, record, e, b in zip(logs, undone, errors, per_log, strict=True)
    ]


def _search_axis(fitted: Fit, i: int, logs: Sequence[_SearchedLog]) -> list[tuple[Event | None, tuple[float, Event]]]:
    """Place the newest push of every log again, if it is on this axis, and find the largest further one with its S."""
    axis, on_axis = fitted.likelihood.rig.axes[i], [_Pulses.of(fitted, log, i) for log in logs]
    least, tau_squared = _dispersion(on_axis)

    def largest(log: Log, pulses: _Pulses, merit: Array, S: Array) -> tuple[float, Event]:
        k, first = map(int, np.unravel_index(merit.argmax(), merit.shape))
        start, end = float(pulses.starts[first]), float(pulses.ends[k, first])
        size = -float(pulses.u[k, first] / pulses.root[k])  # e is measured minus predicted
        push = Event(log.name, axis, start, end, log.start + start, log.start + end, "force", size)
        return float(S[k, first] * (merit[k, first] > 0.0)), push

    found = list[tuple[Event | None, tuple[float, Event]]]()
    for filtered, pulses in zip(logs, on_axis, strict=True):
        changes = [pulses.change(w) for w in range(len(WIDTHS))]
        S = np.array([0.5 * u**2 / (least[w] + tau_squared[w] * changes[w] ** 2) for w, u in enumerate(pulses.u)])
        placed = None
        for newest in (push for push in filtered.newest if push.axis == axis):
            unknown = _Pulses.of(fitted, filtered, i, newest_known=False)
            # the change of the voltages decides whether it is a push, and not where it is
            near = np.asarray(unknown.u**2 * unknown.overlap(newest), dtype=float)
            S_near, push = largest(filtered.log, unknown, near, 0.5 * near / least)
            placed = push if S_near > UNKNOWN else newest
            S[pulses.overlap(placed)] = 0.0
        found.append((placed, largest(filtered.log, pulses, S, S)))
    return found


@dataclass(frozen=True, eq=False)
class _Pulses:
    """Pulses of one axis of one log."""

    period: float
    """Time [s] from one start to the next."""
    u: NDArray[np.float32]
    """u/sqrt(I) by width and start, standard normal in the air of the fit, zero where none may start, shape (W, n)."""
    root: Array
    """sqrt(I) by width for a torque of 1 rad/s^2, shape (W,)."""
    counts: NDArray[np.bool_]
    """Where a pulse may start, shape (n,)."""
    rate: NDArray[np.float32]
    """How fast the voltages change [V/s] at these starts, shape (n,)."""

    @property
    def starts(self) -> Array:
        """Instants [s] at which pulses start, shape (n,)."""
        return np.asarray(self.period * np.arange(self.u.shape[1]))

    @property
    def ends(self) -> Array:
        """Instants [s] at which they end, shape (W, n)."""
        return np.asarray(self.starts + self.period * np.array(WIDTHS)[:, None])

    def change(self, w: int) -> NDArray[np.float32]:
        """Return v' [V/s] of the pulses of a width by start, shape (n,)."""
        return maximum_filter1d(self.rate, WIDTHS[w] + LAG, origin=(LAG - WIDTHS[w] + 1) // 2)

    def overlap(self, push: Event) -> NDArray[np.bool_]:
        """Which pulses overlap a push, shape (W, n)."""
        return np.asarray((self.starts < push.end) & (self.ends > push.start))

    @classmethod
    def of(cls, fitted: Fit, log: _SearchedLog, axis: int, newest_known: bool = True) -> "_Pulses":
        """Match innovations of one axis with pulses, beside the log's start and the pushes that the filter knows.

        Without ``newest_known`` the innovations are those of a filter that does not know the newest push.
        """
        dynamics, sigma = fitted.likelihood.filters(log.record, fitted.point)[axis], fitted.sigma[axis]
        names = fitted.likelihood.rig.axes
        record = log.record.mark((*log.earlier, *log.newest * newest_known), names, settled=True)
        held, period, e, w = record.held, record.held * record.step, log.e[:, axis], record.weights[:, axis]
        inputs = record.slower.inputs
        rate = np.abs(np.diff(inputs, axis=0, prepend=inputs[:1])).sum(1) / period
        if not newest_known:
            courses = [course for _, course in log.record.mark(log.newest, names).pushes]
            sizes = log.sizes[len(record.pushes) : len(record.pushes) + 2]
            e = e - lfilter(*error_dynamics(dynamics), sizes @ courses) * (e != 0.0)
        courses = [course for push_axis, course in record.pushes if push_axis == axis]
        torques, memory = np.zeros((2 + len(courses), record.samples)), np.zeros((2 + len(courses), 5))
        memory[:2] = start_memory(dynamics)
        for torque, course in zip(torques[2:], courses, strict=True):
            torque[:] = course
        s = lfilter(*error_dynamics(dynamics), torques, axis=1, zi=memory)[0].T * (e[:, None] != 0.0)
        rest = e - s @ np.linalg.lstsq(s, e, rcond=None)[0]
        step = lfilter(*error_dynamics(dynamics), np.ones(round(4.0 * SETTLING / record.step))) / sigma
        root = [np.linalg.norm(step - np.pad(step, (width * held, 0))[: len(step)]) for width in WIDTHS]
        counts, n = w[::held] > 0.0, len(rate)
        sums = np.pad(match_steps(dynamics, w * rest)[::held] / sigma**2, (0, WIDTHS[-1]))
        u = np.empty((len(WIDTHS), n), dtype=np.float32)  # it is large for long logs
        for k, width in enumerate(WIDTHS):
            u[k] = counts * (sums[:n] - sums[width : width + n]) / root[k]
        return cls(period, u, np.array(root), counts, rate.astype(np.float32))


def _dispersion(logs: Sequence[_Pulses]) -> tuple[Array, Array]:
    """Return phi_0 and tau^2 (W, 1) of one axis in all logs.

    A tenth of the samples may lie in pushes; tau is that of the tenth with the fastest voltages.
    """
    least, tau_squared = np.ones((len(WIDTHS), 1)), np.zeros((len(WIDTHS), 1))
    for w in range(len(WIDTHS)):
        u = np.concatenate([pulses.u[w, pulses.counts] for pulses in logs])
        rate = np.concatenate([pulses.change(w)[pulses.counts] for pulses in logs])
        if not len(u):
            break
        least[w] = max(1.0, float(np.quantile(u**2, 0.9)) / ndtri(0.95) ** 2)
        fastest = (rate >= np.quantile(rate, 0.9)) & (rate > 0.0)
        if fastest.any():
            beyond = (u[fastest] / ndtri(0.75)) ** 2 - least[w]  # the median of a squared normal deviate is .675^2
            tau_squared[w] = max(0.0, float(np.median(beyond / rate[fastest] ** 2)))
    return least, tau_squared
