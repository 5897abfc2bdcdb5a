r"""Pushes: passages of logs in which something else than the plant turns the rig, found in the innovations of a fit.

A hand, an obstacle or a stop adds a torque g from t to t + w. The innovations e of its axis change by g s, with s the
response of the filter's error dynamics, so the generalised likelihood ratio of a push is

    S(t, w) = u^2 / (2 I phi) [nats],    u = sum_k e_k s_k / sigma,    I = sum_k s_k^2.

A pulse is the difference of two steps, so one run of a filter in reverse gives u for all t and w. phi is what u^2/I
shows beyond 1 in these logs, as the air is not quite what the filter takes it for. It grows with the fastest change
v' [V/s] of the voltages during the pulse, phi = phi_0 + tau^2 v'^2: what a law misses of one step of the voltages is
compared with what it misses of others.

A push is a pulse of :data:`.settings.UNKNOWN` nats. The largest one of every log is taken out and the fit goes on
without that passage: a controller answers a push, so what is estimated of its log may be wrong by both. Then the push
is placed again, as the fit before took it for air and so gave it a wrong size and wrong edges, and the next one is
looked for. The fit has to know the effects of the plant first, since a dead zone that no law describes looks like
pushes.

Source: Willsky and Jones, IEEE Trans. Automatic Control 21 (1976) 108.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d
from scipy.signal import lfilter
from scipy.special import ndtri

from heli_identifier.chain import MARGIN
from heli_identifier.records import Event, Log

from .fit import Fit, fit, fit_own
from .likelihood import without
from .noise import error_dynamics, match_steps, start_memory
from .rig import Array, Record, records_of
from .settings import PUSHED, SEEN_AT, SETTLING, UNKNOWN
from .strangers import without_own

LAG = round(MARGIN * SEEN_AT)
WIDTHS = range(LAG, int(SETTLING * SEEN_AT) + 1)
"""Widths of the pulses, in periods of :data:`.settings.SEEN_AT`. What is shorter is left to Huber's loss, what lasts
longer is air to the filter. For a time LAG a step of the voltages acts through the motors."""


def find_pushes(fitted: Fit, logs: Sequence[Log]) -> tuple[Event, ...]:
    """Find the pushes in logs, the first of which are those of the fit, whatever was left out of it.

    The events of the logs do not count. A log may begin with a push: a rig takes off, or a hand lets go of it.
    """
    logged, axes = records_of(logs, fitted.likelihood.rig, settled=True), range(len(fitted.likelihood.rig.axes))
    found = [_Found(log.events) for log in logs]
    while True:
        fitted, told = _tell(fitted, logs, found, logged)
        searched = zip(*(_search_axis(fitted, i, told) for i in axes), strict=True)
        for i, of_log in enumerate(searched):
            placed = [push for push, _ in of_log if push]
            S, new = max((further for _, further in of_log), key=lambda further: further[0])
            found[i] = _Found((*found[i].events, *placed), new if S > UNKNOWN else None)
        if not any(own.newest for own in found):
            return tuple(push for log, own in zip(logs, found, strict=True) for push in own.events[len(log.events) :])


class _Found(NamedTuple):
    """What acts on a log beside the plant, as far as it is known."""

    events: tuple[Event, ...]
    newest: Event | None = None
    """The push that was found last, by a fit that took it for air."""

    @property
    def everything(self) -> tuple[Event, ...]:
        """All that is left out of the log."""
        return (*self.events, self.newest) if self.newest else self.events


class _Told(NamedTuple):
    """A log, its whole record, and the innovations e (N, a) [rad] of a filter that was told of what was found."""

    log: Log
    found: _Found
    record: Record
    e: Array
    sizes: Array
    """Of the torques of the pushes [rad/s^2], as :attr:`.Record.pushes` has them."""


def _tell(
    fitted: Fit, logs: Sequence[Log], found: Sequence[_Found], logged: Sequence[Record]
) -> tuple[Fit, list[_Told]]:
    """Let a fit go on without pushes, and run it along all logs."""
    likelihood, axes, count = fitted.likelihood, fitted.likelihood.rig.axes, len(fitted.point.own)
    whole = [without(likelihood.faults, own) for own in logged]
    marked = tuple(own.mark(of_log.everything, axes) for own, of_log in zip(logged, found, strict=True))
    if any(of_log.newest for of_log in found[:count]):
        again = replace(likelihood, records=marked[:count], faults={}, logged=()).undo_faults(likelihood.faults)
        fitted = fit(again, fitted.names, fitted)
    errors, own = list(fitted.e), list(fitted.point.own)
    if beside := tuple(without(likelihood.faults, record) for record in marked[count:]):
        others = replace(likelihood, records=beside, faults={}, logged=())
        kept = fit_own(others, others.resting(fitted.parameters, fitted.point.z), fitted.sigma)
        errors += [without_own(fitted, record, e)[1] for record, e in zip(beside, kept.e, strict=True)]
        own += list(kept.point.own)
    return fitted, [
        _Told(log, of_log, record, np.where(record.weights > 0.0, e, 0.0), b[5 * len(axes) :])
        for log, of_log, record, e, b in zip(logs, found, whole, errors, own, strict=True)
    ]


def _search_axis(fitted: Fit, i: int, logs: Sequence[_Told]) -> list[tuple[Event | None, tuple[float, Event]]]:
    """Place the newest push of every log again, if it is on this axis, and find the largest further one with its S."""
    axis, on_axis = fitted.likelihood.rig.axes[i], [_Axis.of(fitted, own, i) for own in logs]
    least, tau_squared = _dispersion(on_axis)

    def largest(log: Log, own: _Axis, merit: Array, S: Array) -> tuple[float, Event]:
        k, first = map(int, np.unravel_index(merit.argmax(), merit.shape))
        start, end = float(own.starts[first]), float(own.ends[k, first])
        size = -float(own.u[k, first] / own.root[k])  # e is what was measured less what was predicted
        push = Event(log.name, axis, start, end, log.start + start, log.start + end, "force", size)
        return float(S[k, first] * (merit[k, first] > 0.0)), push

    found = list[tuple[Event | None, tuple[float, Event]]]()
    for told, own in zip(logs, on_axis, strict=True):
        S = np.array([0.5 * u**2 / (least[w] + tau_squared[w] * own.change(w) ** 2) for w, u in enumerate(own.u)])
        placed, newest = None, told.found.newest
        if newest and newest.axis == axis:
            there = _Axis.of(fitted, told, i, untold=True)
            # where the voltages change fast tells whether it is a push, and not where it is
            near = np.asarray(there.u**2 * there.overlap(newest), dtype=float)
            S_there, push = largest(told.log, there, near, 0.5 * near / least)
            placed = push if S_there > UNKNOWN else newest
            S[own.overlap(placed)] = 0.0
        found.append((placed, largest(told.log, own, S, S)))
    return found


@dataclass(frozen=True, eq=False)
class _Axis:
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
        """Give v' [V/s] of the pulses of a width by start, shape (n,)."""
        return maximum_filter1d(self.rate, WIDTHS[w] + LAG, origin=(LAG - WIDTHS[w] + 1) // 2)

    def overlap(self, push: Event) -> NDArray[np.bool_]:
        """Which pulses overlap a push, shape (W, n)."""
        return np.asarray((self.starts < push.end) & (self.ends > push.start))

    @classmethod
    def of(cls, fitted: Fit, told: _Told, axis: int, untold: bool = False) -> "_Axis":
        """Match innovations of one axis with pulses, beside the log's start and the pushes that the filter knows of.

        The newest one may be ``untold``: it is as if the filter had not been told of it.
        """
        own, sigma = fitted.likelihood.filters(told.record, fitted.point)[axis], fitted.sigma[axis]
        names = fitted.likelihood.rig.axes
        known, everything = told.found.events, told.found.everything
        record = told.record.mark(known if untold else everything, names, settled=True)
        held, period, e, w = record.held, record.held * record.step, told.e[:, axis], record.weights[:, axis]
        inputs = record.slower.inputs
        rate = np.abs(np.diff(inputs, axis=0, prepend=inputs[:1])).sum(1) / period
        if untold:
            courses = [course for _, course in told.record.mark(everything[len(known) :], names).pushes]
            sizes = told.sizes[len(record.pushes) : len(record.pushes) + 2]
            e = e - lfilter(*error_dynamics(own), sizes @ courses) * (e != 0.0)
        courses = [course for of_axis, course in record.pushes if of_axis == axis]
        torques, begun = np.zeros((2 + len(courses), record.samples)), np.zeros((2 + len(courses), 5))
        begun[:2] = start_memory(own)
        for torque, course in zip(torques[2:], courses, strict=True):
            torque[:] = course
        s = lfilter(*error_dynamics(own), torques, axis=1, zi=begun)[0].T * (e[:, None] != 0.0)
        left = e - s @ np.linalg.lstsq(s, e, rcond=None)[0]
        step = lfilter(*error_dynamics(own), np.ones(round(4.0 * SETTLING / record.step))) / sigma
        root = [np.linalg.norm(step - np.pad(step, (width * held, 0))[: len(step)]) for width in WIDTHS]
        counts, n = w[::held] > 0.0, len(rate)
        sums = np.pad(match_steps(own, w * left)[::held] / sigma**2, (0, WIDTHS[-1]))
        u = np.empty((len(WIDTHS), n), dtype=np.float32)  # of long logs it is large
        for k, width in enumerate(WIDTHS):
            u[k] = counts * (sums[:n] - sums[width : width + n]) / root[k]
        return cls(period, u, np.array(root), counts, rate.astype(np.float32))


def _dispersion(logs: Sequence[_Axis]) -> tuple[Array, Array]:
    """Give phi_0 and tau^2 (W, 1) of one axis in all logs; a tenth of the samples may lie in pushes."""
    least, tau_squared = np.ones((len(WIDTHS), 1)), np.zeros((len(WIDTHS), 1))
    for w in range(len(WIDTHS)):
        u = np.concatenate([own.u[w, own.counts] for own in logs])
        rate = np.concatenate([own.change(w)[own.counts] for own in logs])
        if not len(u):
            break
        least[w] = max(1.0, float(np.quantile(u**2, 1.0 - PUSHED)) / ndtri(1.0 - 0.5 * PUSHED) ** 2)
        fastest = (rate >= np.quantile(rate, 1.0 - PUSHED)) & (rate > 0.0)
        if fastest.any():
            beyond = (u[fastest] / ndtri(0.75)) ** 2 - least[w]  # the median of a squared normal deviate is .675^2
            tau_squared[w] = max(0.0, float(np.median(beyond / rate[fastest] ** 2)))
    return least, tau_squared
