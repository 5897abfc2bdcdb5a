r"""Pushes: passages of logs in which something other than the plant turns the rig, found in the innovations of a fit.

A hand, an obstacle or a stop adds a torque g from t to t + w. The innovations e of its axis change by g s, with s the
response of the filter's error dynamics, so the generalised likelihood ratio of a push is

    S(t, w) = u^2 / (2 I phi) [nats],    u = sum_k e_k s_k / sigma,    I = sum_k s_k^2.

A pulse is the difference of two steps, so one run of a filter in reverse gives u for all t and w. phi is the mean of
u^2/I in these logs, which exceeds 1 because the filter's model of the air is not exact. It grows with the fastest
change v' [V/s] of the voltages during the pulse, phi = phi_0 + tau^2 v'^2: the error of a law at one step of the
voltages is compared with its errors at other steps.

A push is a pulse of :data:`.settings.UNKNOWN` nats. The largest one of every log is left out, and the search is
repeated around a fit without that passage, until none is left.

Source: Willsky and Jones, IEEE Trans. Automatic Control 21 (1976) 108.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

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
from .settings import SETTLING, SLOW_RATE, UNKNOWN

LAG = round(MARGIN * SLOW_RATE)
WIDTHS = range(LAG, int(SETTLING * SLOW_RATE) + 1)
"""Widths of the pulses, in periods of :data:`.settings.SLOW_RATE`. Huber's loss bounds the harm of shorter ones, and
the filter takes longer ones for air. For a time LAG a step of the voltages acts through the motors."""


def find_pushes(fitted: Fit, logs: Sequence[Log]) -> tuple[Event, ...]:
    """Find the pushes in logs, the first of which are those of the fit; passages that it left out are searched as well.

    Passages of the logs' events are not searched. A log may begin with a push: a rig takes off, or a hand lets it go.
    """
    rig, count, new = fitted.likelihood.rig, len(fitted.point.per_log), False
    records, events = records_of(logs, rig, settled=True), [log.events for log in logs]
    while True:
        marked = tuple(record.mark(own, rig.axes) for record, own in zip(records, events, strict=True))
        fitted = _fit_again(fitted, marked[:count]) if new else fitted
        errors = [*fitted.e, *_errors_beside(fitted, marked[count:])]
        known = [
            (record.mark(own, rig.axes, settled=True), np.where(record.weights > 0.0, e, 0.0))
            for record, own, e in zip(records, events, errors, strict=True)
        ]
        found, new = [_search_axis(fitted, axis, known) for axis in range(len(rig.axes))], False
        for i, (log, by_axis) in enumerate(zip(logs, zip(*found, strict=True), strict=True)):
            (S, start, end, size), axis = max(zip(by_axis, rig.axes, strict=True))
            if S > UNKNOWN:
                push = Event(log.name, axis, start, end, log.start + start, log.start + end, "force", size)
                events[i], new = (*events[i], push), True
        if not new:
            return tuple(push for log, own in zip(logs, events, strict=True) for push in own[len(log.events) :])


def _fit_again(fitted: Fit, records: tuple[Record, ...]) -> Fit:
    """Repeat a fit with its records as logged, marked otherwise."""
    again = replace(fitted.likelihood, records=records, faults={}, logged=())
    return fit(again.undo_faults(fitted.likelihood.faults), fitted.names, fitted)


def _errors_beside(fitted: Fit, records: Sequence[Record]) -> list[Array]:
    """Innovations (N, a) [rad] of records that are not those of a fit."""
    if not records:
        return []
    undone = tuple(undo_in_record(fitted.likelihood.faults, record) for record in records)
    others = replace(fitted.likelihood, records=undone, faults={}, logged=())
    return fit_per_log(others, others.neutral_point(fitted.parameters, fitted.point.z), fitted.sigma).e


def _search_axis(
    fitted: Fit, axis: int, known: Sequence[tuple[Record, Array]]
) -> list[tuple[float, float, float, float]]:
    """Find the largest push of every log on an axis beside the ``known`` ones: S, start, end [s], size [rad/s^2]."""
    logs = [_Pulses.of(fitted, record, e[:, axis], axis) for record, e in known]
    found = [(0.0, 0.0, 0.0, 0.0)] * len(logs)
    for w, width in enumerate(WIDTHS):
        every_u, rates = [pulses.standardised(w) for pulses in logs], [pulses.change(w) for pulses in logs]
        phi, tau_squared = _dispersion(np.concatenate(every_u), np.concatenate(rates))
        for i, (pulses, u, rate) in enumerate(zip(logs, every_u, rates, strict=True)):
            S = 0.5 * u**2 / (phi + tau_squared * rate**2)
            if len(S) and (most := float(S.max())) > found[i][0]:
                k = int(S.argmax())
                first, size = int(pulses.starts[k]), -float(u[k] / pulses.root[w])  # e is measured minus predicted
                found[i] = most, pulses.period * first, pulses.period * (first + width), size
    return found


@dataclass(frozen=True, eq=False)
class _Pulses:
    """Pulses of one axis of one log."""

    period: float
    """Time [s] from one start to the next."""
    sums: Array
    """sum_k e_k s_k / sigma^2 of a step by its start, shape (n + 50,): a pulse may end behind the log."""
    root: Array
    """sqrt(I) by width for a torque of 1 rad/s^2, shape (W,)."""
    starts: NDArray[np.intp]
    """Where a pulse may start, shape (m,), in periods."""
    rate: Array
    """How fast the voltages change [V/s], shape (n,)."""

    def standardised(self, w: int) -> Array:
        """Return u/sqrt(I) of the pulses of a width by start (m,), standard normal in the air of the fit."""
        return np.asarray((self.sums[self.starts] - self.sums[self.starts + WIDTHS[w]]) / self.root[w])

    def change(self, w: int) -> Array:
        """Return v' [V/s] of the pulses of a width by start, shape (m,)."""
        width = WIDTHS[w]
        return np.asarray(maximum_filter1d(self.rate, width + LAG, origin=(LAG - width + 1) // 2)[self.starts])

    @classmethod
    def of(cls, fitted: Fit, record: Record, e: Array, axis: int) -> "_Pulses":
        """Match innovations ``e`` (N,) of an axis with pulses, beside the log's start and the pushes of the record."""
        dynamics, sigma = fitted.likelihood.filters(record, fitted.point)[axis], fitted.sigma[axis]
        held, period, w = record.held, record.held * record.step, record.weights[:, axis]
        inputs = record.slower.inputs
        rate = np.abs(np.diff(inputs, axis=0, prepend=inputs[:1])).sum(1) / period
        courses = [course for push_axis, course in record.pushes if push_axis == axis]
        torques, memory = np.zeros((2 + len(courses), record.samples)), np.zeros((2 + len(courses), 5))
        memory[:2] = start_memory(dynamics)
        for torque, course in zip(torques[2:], courses, strict=True):
            torque[:] = course
        s = lfilter(*error_dynamics(dynamics), torques, axis=1, zi=memory)[0].T * (e[:, None] != 0.0)
        rest = e - s @ np.linalg.lstsq(s, e, rcond=None)[0]
        step = lfilter(*error_dynamics(dynamics), np.ones(round(4.0 * SETTLING / record.step))) / sigma
        root = [np.linalg.norm(step - np.pad(step, (width * held, 0))[: len(step)]) for width in WIDTHS]
        sums = np.pad(match_steps(dynamics, w * rest)[::held] / sigma**2, (0, WIDTHS[-1]))
        return cls(period, sums, np.array(root), np.flatnonzero(w[::held]), rate)


def _dispersion(u: Array, rate: Array) -> tuple[float, float]:
    """Return phi_0 and tau^2 of the pulses of one width in all logs: their u/sqrt(I) (m,) and v' (m,) [V/s]."""
    if not len(u):
        return 1.0, 0.0
    # a tenth of the samples may lie in pushes
    least = max(1.0, float(np.quantile(u**2, 0.9)) / ndtri(0.95) ** 2)
    fastest = (rate >= np.quantile(rate, 0.9)) & (rate > 0.0)
    if not fastest.any():
        return least, 0.0
    beyond = (u[fastest] / ndtri(0.75)) ** 2 - least  # the median of a squared normal deviate is .675^2
    return least, max(0.0, float(np.median(beyond / rate[fastest] ** 2)))
