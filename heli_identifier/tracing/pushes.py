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

from heli_identifier.chain import MARGIN, Event, is_counted, passages
from heli_identifier.records import Log

from .fit import Fit, fit, fit_own
from .likelihood import without
from .noise import error_dynamics, match_steps, start_memory
from .rig import Array, LeftOut, Record, records_of, torques_of
from .settings import PUSHED, SEEN_AT, SETTLING, UNKNOWN
from .strangers import without_own

LAG = round(MARGIN * SEEN_AT)
WIDTHS = range(LAG, int(SETTLING * SEEN_AT) + 1)
"""Widths of the pulses, in periods of :data:`.settings.SEEN_AT`. What is shorter is left to Huber's loss, what lasts
longer is air to the filter. For a time LAG a step of the voltages acts through the motors."""


def find_pushes(fitted: Fit, logs: Sequence[Log], left_out: LeftOut) -> tuple[Event, ...]:
    """Find the pushes in logs, the first of which are those of the fit, whatever was left out of it.

    Passages ``left_out`` do not count. A log may begin with a push: a rig takes off, or a hand lets go of it.
    """
    likelihood, count, found = fitted.likelihood, len(fitted.e), list[Event]()
    axes, order = likelihood.rig.axes, [log.name for log in logs]
    faults, logged = likelihood.faults, records_of(logs, likelihood.rig, left_out, settled=True)
    whole = [without(faults, record) for record in logged]
    while True:
        raw = [_without(record, found, axes) for record in logged]
        records = tuple(without(faults, record) for record in raw)
        if {push.log for push in found} & set(order[:count]):
            part = replace(likelihood, records=records[:count], logged=tuple(raw[:count]) if faults else ())
            fitted = fit(part, fitted.names, fitted)
        errors = list(fitted.e)
        if beside := records[count:]:
            others = replace(likelihood, records=beside, faults={}, logged=())
            own = fit_own(others, others.resting(fitted.parameters, fitted.point.z), fitted.sigma)
            errors += [without_own(fitted, record, e)[1] for record, e in zip(beside, own.e, strict=True)]
        clear = [np.where(own.weights > 0.0, e, 0.0) for own, e in zip(whole, errors, strict=True)]
        new = _largest(fitted, logs, [_without(own, found, axes, settled=True) for own in whole], clear, found)
        if not new:
            return tuple(found)
        found += new


def _without(record: Record, pushes: Sequence[Event], axes: Sequence[str], settled: bool = False) -> Record:
    """Leave the pushes of a record out of what counts, and let the filter know of them."""
    counted = is_counted(record.time, passages(pushes).get(record.name, ()), settled)
    pushed = torques_of(pushes, record.name, record.time, axes)
    return replace(record, weights=record.weights * counted[:, None], pushed=pushed)


def _largest(
    fitted: Fit, logs: Sequence[Log], records: Sequence[Record], errors: Sequence[Array], found: Sequence[Event]
) -> list[Event]:
    """Find the largest push of every log, outside of what the records leave out, in innovations (N, a) of a fit.

    What the filter does not know of pushes that are ``found`` is taken out of these first.
    """
    axes, new = fitted.likelihood.rig.axes, list[Event]()
    on_axes = [
        [_Axis.of(fitted, record, e, i, [own for own in found if (own.log, own.axis) == (log.name, axis)])
         for log, record, e in zip(logs, records, errors, strict=True)]
        for i, axis in enumerate(axes)
    ]  # fmt: skip
    phi = [_dispersions(on_axis) for on_axis in on_axes]
    for j, log in enumerate(logs):
        S = np.array([0.5 * own[j].u**2 / of_axis[j] for own, of_axis in zip(on_axes, phi, strict=True)])
        i, k, first = map(int, np.unravel_index(S.argmax(), S.shape))
        if S[i, k, first] > UNKNOWN:
            matched = on_axes[i][j]
            start, end = first * matched.period, (first + WIDTHS[k]) * matched.period
            size = -float(matched.u[k, first] / matched.root[k])  # e is what was measured less what was predicted
            new.append(Event(log.name, axes[i], start, end, log.start + start, log.start + end, "force", size))
    return new


@dataclass(frozen=True, eq=False)
class _Axis:
    """Pulses of one axis of one log."""

    period: float
    """Time [s] from one start to the next."""
    u: Array
    """u/sqrt(I) by width and start, standard normal in the air of the fit, zero where none may start, shape (W, n)."""
    root: Array
    """sqrt(I) by width for a torque of 1 rad/s^2, shape (W,)."""
    counts: NDArray[np.bool_]
    """Where a pulse may start, shape (n,)."""
    change: Array
    """v' [V/s] by width and start, shape (W, n)."""

    @classmethod
    def of(cls, fitted: Fit, record: Record, e: Array, axis: int, found: Sequence[Event]) -> "_Axis":
        """Match innovations (N, a) of a record with pulses of one axis, beside its start and pulses that are known."""
        own, held, sigma = fitted.likelihood.filters(record, fitted.point)[axis], record.held, fitted.sigma[axis]
        inputs, w, period = record.slower.inputs, record.weights[:, axis], record.held * record.step
        rate = np.abs(np.diff(inputs, axis=0, prepend=inputs[:1])).sum(1) / period
        change = [maximum_filter1d(rate, width + LAG, origin=(LAG - width + 1) // 2) for width in WIDTHS]
        on = [(record.time >= pulse.start) & (record.time < pulse.end) for pulse in found]
        torques = np.vstack((np.zeros((2, record.samples)), np.array(on, dtype=float).reshape(-1, record.samples)))
        begun = np.vstack((start_memory(own), np.zeros((len(found), 5))))
        s = lfilter(*error_dynamics(own), torques, axis=1, zi=begun)[0].T * (e[:, axis, None] != 0.0)
        left = e[:, axis] - s @ np.linalg.lstsq(s, e[:, axis], rcond=None)[0]
        step = lfilter(*error_dynamics(own), np.ones(round(4.0 * SETTLING / record.step))) / sigma
        root = [np.linalg.norm(step - np.pad(step, (width * held, 0))[: len(step)]) for width in WIDTHS]
        counts, n = w[::held] > 0.0, len(rate)
        sums = np.pad(match_steps(own, w * left)[::held] / sigma**2, (0, WIDTHS[-1]))
        u = [counts * (sums[:n] - sums[width : width + n]) / size for width, size in zip(WIDTHS, root, strict=True)]
        return cls(period, np.array(u), np.array(root), counts, np.array(change))


def _dispersions(logs: Sequence[_Axis]) -> list[Array]:
    """Give phi (W, n) of one axis in each log, from all of them; a tenth of the samples may lie in pushes."""
    u, change = (np.concatenate(parts, axis=1) for parts in
                 zip(*((own.u[:, own.counts], own.change[:, own.counts]) for own in logs), strict=True))
    if not u.shape[1]:
        return [np.ones_like(own.change) for own in logs]
    least = np.maximum(1.0, np.quantile(u**2, 1.0 - PUSHED, axis=1) / ndtri(1.0 - 0.5 * PUSHED) ** 2)
    tau_squared = np.zeros_like(least)
    for w, (own, rate) in enumerate(zip(u, change, strict=True)):
        fastest = (rate >= np.quantile(rate, 1.0 - PUSHED)) & (rate > 0.0)
        if fastest.any():
            beyond = (own[fastest] / ndtri(0.75)) ** 2 - least[w]  # the median of a squared normal deviate is .675^2
            tau_squared[w] = max(0.0, float(np.median(beyond / rate[fastest] ** 2)))
    return [least[:, None] + tau_squared[:, None] * own.change**2 for own in logs]
