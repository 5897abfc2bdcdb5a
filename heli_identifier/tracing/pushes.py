r"""Pushes: passages of logs in which something else than the plant turns the rig, found in the innovations of a fit.

A hand, an obstacle or a stop adds a torque g from t to t + w. The innovations e of its axis change by g s, with s the
response of the filter's error dynamics, so the generalised likelihood ratio of a push is

    S(t, w) = u^2 / (2 I phi) [nats],    u = sum_k e_k s_k / sigma,    I = sum_k s_k^2.

A pulse is the difference of two steps, so one run of a filter in reverse gives u for all t and w. phi is what u^2/I
shows beyond 1 in these logs, as the air is not quite what the filter takes it for. It grows with the fastest change
v' [V/s] of the voltages during the pulse, phi = phi_0 + tau^2 v'^2: what a law misses of one step of the voltages is
compared with what it misses of others.

A push is a pulse of :data:`.settings.UNKNOWN` nats. The largest one of every log is taken out and the fit goes on
without that passage: a controller answers a push, so what is estimated of its log may be wrong by both. The fit has to
know the effects of the plant first, since a dead zone that no law describes looks like pushes.

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
    likelihood, axes, count = fitted.likelihood, fitted.likelihood.rig.axes, len(fitted.e)
    logged = records_of(logs, likelihood.rig, settled=True)
    whole, raw = [without(likelihood.faults, own) for own in logged], logged[:count] if likelihood.faults else ()
    events, found = [log.events for log in logs], list[Event]()
    while True:
        records = tuple(own.mark(of_log, axes) for own, of_log in zip(whole, events, strict=True))
        if {push.log for push in found} & {log.name for log in logs[:count]}:
            before = tuple(own.mark(of_log, axes) for own, of_log in zip(raw, events, strict=False))
            fitted = fit(replace(likelihood, records=records[:count], logged=before), fitted.names, fitted)
        errors = list(fitted.e)
        if beside := records[count:]:
            others = replace(likelihood, records=beside, faults={}, logged=())
            own = fit_own(others, others.resting(fitted.parameters, fitted.point.z), fitted.sigma)
            errors += [without_own(fitted, record, e)[1] for record, e in zip(beside, own.e, strict=True)]
        clear = [np.where(own.weights > 0.0, e, 0.0) for own, e in zip(whole, errors, strict=True)]
        settled = [own.mark(of_log, axes, settled=True) for own, of_log in zip(whole, events, strict=True)]
        new = _largest(fitted, logs, settled, clear, events)
        if not any(new):
            return tuple(found)
        found += [push for push in new if push]
        events = [(*of_log, push) if push else of_log for of_log, push in zip(events, new, strict=True)]


def _largest(
    fitted: Fit, logs: Sequence[Log], records: Sequence[Record], errors: Sequence[Array],
    events: Sequence[Sequence[Event]],
) -> list[Event | None]:  # fmt: skip
    """Find the largest push of every log, outside of what the records leave out, in innovations (N, a) of a fit.

    What the filter does not know of the pushes among their ``events`` is taken out of these first.
    """
    best, found = np.full(len(logs), UNKNOWN), list[Event | None]([None] * len(logs))
    for i, axis in enumerate(fitted.likelihood.rig.axes):
        known = [[own for own in of_log if own.kind == "force" and own.axis == axis] for of_log in events]
        on_axis = [_Axis.of(fitted, record, e, i, pulses)
                   for record, e, pulses in zip(records, errors, known, strict=True)]  # fmt: skip
        least, tau_squared = _dispersion(on_axis)
        for j, (log, own) in enumerate(zip(logs, on_axis, strict=True)):
            S = 0.5 * own.u**2 / (least + tau_squared * own.change**2)
            k, first = map(int, np.unravel_index(S.argmax(), S.shape))
            if S[k, first] > best[j]:
                start, end = first * own.period, (first + WIDTHS[k]) * own.period
                size = -float(own.u[k, first] / own.root[k])  # e is what was measured less what was predicted
                best[j] = S[k, first]
                found[j] = Event(log.name, axis, start, end, log.start + start, log.start + end, "force", size)
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
    change: NDArray[np.float32]
    """v' [V/s] by width and start, shape (W, n)."""

    @classmethod
    def of(cls, fitted: Fit, record: Record, e: Array, axis: int, found: Sequence[Event]) -> "_Axis":
        """Match innovations (N, a) of a record with pulses of one axis, beside its start and pulses that are known."""
        own, held, sigma = fitted.likelihood.filters(record, fitted.point)[axis], record.held, fitted.sigma[axis]
        inputs, w, period = record.slower.inputs, record.weights[:, axis], record.held * record.step
        rate = np.abs(np.diff(inputs, axis=0, prepend=inputs[:1])).sum(1) / period
        on = [(record.time >= pulse.start) & (record.time < pulse.end) for pulse in found]
        torques = np.vstack((np.zeros((2, record.samples)), np.array(on, dtype=float).reshape(-1, record.samples)))
        begun = np.vstack((start_memory(own), np.zeros((len(found), 5))))
        s = lfilter(*error_dynamics(own), torques, axis=1, zi=begun)[0].T * (e[:, axis, None] != 0.0)
        left = e[:, axis] - s @ np.linalg.lstsq(s, e[:, axis], rcond=None)[0]
        step = lfilter(*error_dynamics(own), np.ones(round(4.0 * SETTLING / record.step))) / sigma
        root = [np.linalg.norm(step - np.pad(step, (width * held, 0))[: len(step)]) for width in WIDTHS]
        counts, n = w[::held] > 0.0, len(rate)
        sums = np.pad(match_steps(own, w * left)[::held] / sigma**2, (0, WIDTHS[-1]))
        u, change = np.empty((2, len(WIDTHS), n), dtype=np.float32)  # of long logs these are large
        for k, width in enumerate(WIDTHS):
            u[k] = counts * (sums[:n] - sums[width : width + n]) / root[k]
            change[k] = maximum_filter1d(rate, width + LAG, origin=(LAG - width + 1) // 2)
        return cls(period, u, np.array(root), counts, change)


def _dispersion(logs: Sequence[_Axis]) -> tuple[Array, Array]:
    """Give phi_0 and tau^2 (W, 1) of one axis in all logs; a tenth of the samples may lie in pushes."""
    least, tau_squared = np.ones((len(WIDTHS), 1)), np.zeros((len(WIDTHS), 1))
    for w in range(len(WIDTHS)):
        u, rate = (np.concatenate([part[w, own.counts] for own, part in parts])
                   for parts in ([(own, own.u) for own in logs], [(own, own.change) for own in logs]))  # fmt: skip
        if not len(u):
            break
        least[w] = max(1.0, float(np.quantile(u**2, 1.0 - PUSHED)) / ndtri(1.0 - 0.5 * PUSHED) ** 2)
        fastest = (rate >= np.quantile(rate, 1.0 - PUSHED)) & (rate > 0.0)
        if fastest.any():
            beyond = (u[fastest] / ndtri(0.75)) ** 2 - least[w]  # the median of a squared normal deviate is .675^2
            tau_squared[w] = max(0.0, float(np.median(beyond / rate[fastest] ** 2)))
    return least, tau_squared
