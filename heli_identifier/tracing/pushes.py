r"""Pushes: passages of logs in which something else than the plant turns the rig, found in the innovations of a fit.

A hand, an obstacle or a stop adds a torque g from t to t + w. The innovations e of its axis change by g s, with s the
response of the filter's error dynamics, so the generalised likelihood ratio of a push is

    S(t, w) = u^2 / (2 I phi) [nats],    u = sum_k e_k s_k / sigma,    I = sum_k s_k^2.

A pulse is the difference of two steps, so one run of a filter in reverse gives u for all t and w. phi is what u^2/I
shows beyond 1 in these logs, as the air is not quite what the filter takes it for. It grows with the fastest change
v' [V/s] of the voltages during the pulse, phi = phi_0 + tau^2 v'^2: what a law misses of one step of the voltages is
compared with what it misses of others.

A push is a pulse of :data:`.settings.UNKNOWN` nats. The largest one is taken out, then the rest is searched again. The
fit has to know the effects of the plant first, since a dead zone that no law describes looks like pushes.

Source: Willsky and Jones, IEEE Trans. Automatic Control 21 (1976) 108.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d
from scipy.signal import lfilter
from scipy.special import ndtri

from heli_identifier.chain import MARGIN, Event, is_counted, passages
from heli_identifier.records import Log

from .fit import Fit, fit
from .likelihood import without
from .noise import AxisFilter, error_dynamics, match_steps
from .rig import Array, LeftOut, Record, records_of
from .settings import PUSHED, SEEN_AT, SETTLING, UNKNOWN
from .strangers import own_offsets

WIDTHS = range(1, int(SETTLING * SEEN_AT) + 1)
"""Widths of the pulses, in periods of :data:`.settings.SEEN_AT`: what lasts longer is air to the filter."""


def find_pushes(fitted: Fit, logs: Sequence[Log], left_out: LeftOut) -> tuple[Event, ...]:
    """Find the pushes in logs, the first of which are those of the fit, whatever was left out of it.

    Passages ``left_out`` do not count. The fit goes on without the pushes that are found, until there are no more.
    """
    likelihood, count, found = fitted.likelihood, len(fitted.e), list[Event]()
    whole = records_of(logs, likelihood.rig, left_out)
    while True:
        pushed = passages(found)
        logged = tuple(_leave_out(record, pushed.get(record.name, ())) for record in whole)
        records = tuple(without(likelihood.faults, record) for record in logged) if likelihood.faults else logged
        if found:
            part = replace(likelihood, records=records[:count], logged=logged[:count] if likelihood.faults else ())
            fitted = fit(part, fitted.names, fitted)
        new = _pushes_of(fitted, logs, records)
        if not new:
            return tuple(found)
        found += new


def _leave_out(record: Record, left_out: Sequence[tuple[float, float]]) -> Record:
    return replace(record, weights=record.weights * is_counted(record.time, left_out)[:, None])


def _pushes_of(fitted: Fit, logs: Sequence[Log], records: Sequence[Record]) -> list[Event]:
    """Find the pushes beside one fit; the first of the records are its own."""
    found, errors = list[Event](), [*fitted.e, *(own_offsets(fitted, own)[1] for own in records[len(fitted.e) :])]
    for axis, name in enumerate(fitted.likelihood.rig.axes):
        on_axis = [_Axis.of(fitted, record, e, axis) for record, e in zip(records, errors, strict=True)]
        for log, own, phi in zip(logs, on_axis, _dispersions(on_axis), strict=True):
            for start, end, torque in _join(own.pulses(phi)):
                found.append(Event(log.name, name, start, end, log.start + start, log.start + end, "force", torque))
    return found


class _Pulse(NamedTuple):
    start: float
    end: float
    """start, end: Since the log's first sample [s]."""
    torque: float
    """Its size [rad/s^2]."""


@dataclass(frozen=True, eq=False)
class _Axis:
    """One axis of one log."""

    own: AxisFilter
    held: int
    """Samples of the record from one start of a pulse to the next."""
    e: Array
    """Innovations [rad], zero where they do not count, shape (N,)."""
    sigma: float
    """Their scale [rad]."""
    counts: NDArray[np.bool_]
    """Where a pulse may start, shape (n,)."""
    change: Array
    """v' [V/s] by width and start, shape (W, n)."""
    responses: Sequence[Array]
    """s of every width [rad] for 1 rad/s^2."""

    @classmethod
    def of(cls, fitted: Fit, record: Record, e: Array, axis: int) -> "_Axis":
        """Read the innovations (N, a) of a record under a fit."""
        own, held = fitted.likelihood.filters(record, fitted.point)[axis], record.held
        inputs, weights = record.slower.inputs, record.weights[:, axis]
        rate = np.abs(np.diff(inputs, axis=0, prepend=inputs[:1])).sum(1) / (held * record.step)
        lag = round(MARGIN * SEEN_AT)  # for so long a step of the voltages acts through the motors
        change = [maximum_filter1d(rate, w + lag, origin=(lag - w + 1) // 2) for w in WIDTHS]
        step = lfilter(*error_dynamics(own), np.ones(round(4.0 * SETTLING / record.step)))
        responses = [step - np.concatenate((np.zeros(w * held), step[: -w * held])) for w in WIDTHS]
        e, counts = weights * e[:, axis], weights[::held] > 0.0
        return cls(own, held, e, float(fitted.sigma[axis]), counts, np.array(change), responses)

    @property
    def standardised(self) -> Array:
        """u/sqrt(I) by width and start, shape (W, n): standard normal in the air of the fit."""
        u, n = match_steps(self.own, self.e)[:: self.held], len(self.counts)
        u = np.concatenate((u, np.zeros(len(WIDTHS)))) / self.sigma
        return np.array([self.counts * (u[:n] - u[w : w + n]) / np.sqrt(s @ s)
                         for w, s in zip(WIDTHS, self.responses, strict=True)])  # fmt: skip

    def pulses(self, phi: Array) -> Iterator[_Pulse]:
        """Take out the largest pulse, beside ``phi`` (W, n), until none is a push any more."""
        own, period = self, self.held * self.own.h
        for _ in range(len(self.counts)):
            t = own.standardised
            k, start = map(int, np.unravel_index((t**2 / phi).argmax(), t.shape))
            if 0.5 * t[k, start] ** 2 / phi[k, start] < UNKNOWN:
                return
            s, e, first = self.responses[k], own.e.copy(), start * self.held
            g = t[k, start] * self.sigma / np.sqrt(s @ s)
            part = e[first : first + len(s)]
            part -= g * s[: len(part)] * (part != 0.0)
            own = replace(own, e=e)
            if WIDTHS[k] * period >= MARGIN:
                yield _Pulse(start * period, (start + WIDTHS[k]) * period, abs(float(g)))


def _join(pulses: Iterator[_Pulse]) -> Iterator[_Pulse]:
    """Give pulses in order of time, those that are less than :data:`.MARGIN` apart as one."""
    last: _Pulse | None = None
    for own in sorted(pulses):
        if last and own.start - last.end < MARGIN:
            last = _Pulse(last.start, max(last.end, own.end), max(last.torque, own.torque))
            continue
        if last:
            yield last
        last = own
    if last:
        yield last


def _dispersions(logs: Sequence[_Axis]) -> list[Array]:
    """Give phi (W, n) of one axis in each log, from all of them; a tenth of the samples may lie in pushes."""
    t, change = (np.concatenate(parts, axis=1) for parts in
                 zip(*((own.standardised[:, own.counts], own.change[:, own.counts]) for own in logs), strict=True))
    if not t.shape[1]:
        return [np.ones_like(own.change) for own in logs]
    least = np.maximum(1.0, np.quantile(t**2, 1.0 - PUSHED, axis=1) / ndtri(1.0 - 0.5 * PUSHED) ** 2)
    tau_squared = np.zeros_like(least)
    for w, (own, rate) in enumerate(zip(t, change, strict=True)):
        fastest = (rate >= np.quantile(rate, 1.0 - PUSHED)) & (rate > 0.0)
        if fastest.any():
            beyond = (own[fastest] / ndtri(0.75)) ** 2 - least[w]  # the median of a squared normal deviate is .675^2
            tau_squared[w] = max(0.0, float(np.median(beyond / rate[fastest] ** 2)))
    return [least[:, None] + tau_squared[:, None] * own.change**2 for own in logs]
