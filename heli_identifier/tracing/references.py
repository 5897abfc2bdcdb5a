"""Which signals moved the rig from outside: references that are logged, rebuilt from the voltages, or the voltages.

A reference r is what a pilot or a plan asked for. It moves the rig and knows nothing of the air, so it can serve as an
instrument. Where a controller flies,

    v = r - C(y),      C(y) = k y + k' y'_f + k'' F y,      y'_f = p q/(p + q) y,      F = p/(p + beta)

with C without noise. Hence r is rebuilt from what is logged, channel by channel: v_f - v_r answers pitch and travel,
v_f + v_r the elevation. Steps, smoothed by a lag of rate c, are sparse under D = (1 - a/z)(1 - 1/z), a = exp(-c h), so

    min over k, q, c, beta of  sum |D (F v + C(y))|,       F = 1 for a controller without integral term

is exact however large the steps are (L1 regression). An integral term missed would leave feedback in r; the whole
equation filtered by F turns that term into k'' of y.

Symbols: h sampling interval [s], z shift by h, p = d/dt [1/s], y angles [rad], v voltages [V], q and c and beta [1/s].

Sources: C. W. J. Granger, Econometrica 37 (1969) 424, for "the past of y adds nothing to the own past"; E. J. Candes and
T. Tao, IEEE Trans. Inf. Theory 51 (2005) 4203, for exact recovery by L1 under sparse gross errors.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.signal import lfilter
from scipy.stats import f as f_distribution

from heli_identifier.records import Log

Array = NDArray[np.float64]
CHANNELS: Mapping[str, tuple[tuple[str, ...], tuple[int, ...]]] = {
    "v_front - v_rear": (("pitch", "travel"), (0, 2)),
    "v_front + v_rear": (("elevation",), (1,)),
}
"""Each channel of the voltages: the references that enter it and the columns of the angles that it answers."""

STILL_RATE = 0.05
"""A reference is still while it moves by less than this share of its range in a second: a smoothed step's tail."""
ADDED_R2 = 0.01
"""What the outputs' past may add to a reference's own past; feedback in disguise adds .1 to 1."""
LOOP_R2 = 0.02
"""What the angles' innovations must tell of the voltages where a controller flies; measured: .05 and more."""
OUTSIDE_SHARE = 0.2
"""Least share of the outside in a channel: below it a small error of the gains is a large one of r."""
SATURATED_SHARE = 0.1
"""Most samples at the voltages' limit for r to be rebuilt, since there it is interpolated."""
ROWS = 1500
"""Samples of a log used by the L1 regression: its equations are exact, more of them only cost time."""


@dataclass(frozen=True)
class Controller:
    """The law of one channel as recovered from one log.

    Attributes
    ----------
    channel : str
        Sum or difference of the voltages.
    gains : Mapping[str, float]
        Voltage for one unit of each term, as fed back (a minus sign taken out): angle [V/rad], rate [V s/rad] and,
        with an integral term, the integral of the angle [V/(rad s)].
    pole : float
        Pole q of the filtered derivative [1/s].
    smoothing : float
        Rate c of the reference's own lag [1/s]; infinite for plain steps.
    integral : float
        Rate beta [1/s] of the integral term; 0 without one.
    share : float
        Variance of the rebuilt reference over that of reference and feedback together.
    """

    channel: str
    gains: Mapping[str, float]
    pole: float
    smoothing: float
    integral: float
    share: float


@dataclass(frozen=True, eq=False)
class References:
    """What moved the rig from outside, log by log.

    Attributes
    ----------
    names : tuple[str, ...]
        The m signals: an axis [rad] where logged, a channel of the voltages [V] where rebuilt or in open loop.
    signals : tuple[NDArray, ...]
        For each log an array of shape (N, m); a column of zeros where a log does not have that signal.
    origins : tuple[str, ...]
        For each log "voltages" (open loop), "logged", "rebuilt", "logged and rebuilt" or "none".
    controllers : tuple[tuple[Controller, ...], ...]
        For each log the controllers recovered.
    closed_loop : bool
        Whether a controller flew in any of the logs.
    notes : tuple[str, ...]
        What was accepted and refused, and why, one sentence each.
    """

    names: tuple[str, ...]
    signals: tuple[Array, ...]
    origins: tuple[str, ...]
    controllers: tuple[tuple[Controller, ...], ...]
    closed_loop: bool
    notes: tuple[str, ...] = field(default=())


def find_references(logs: Sequence[Log]) -> References:
    """Find in each log the signals that come from outside: logged ones by test, else rebuilt ones, else the voltages.

    Parameters
    ----------
    logs : sequence of Log
        Logs of one rig, of any rates, lengths and controllers.

    Returns
    -------
    References
        Empty (m = 0) if nothing came from outside.
    """
    found: list[dict[str, Array]] = []
    origins, controllers, notes = [], [], []
    loops = [feedback(log) for log in logs]
    for log, closed in zip(logs, loops, strict=True):
        signals: dict[str, Array] = {}
        laws: list[Controller] = []
        for channel, (axes, columns) in CHANNELS.items():
            voltage = channel_voltage(log, channel)
            if not closed:
                signals[channel] = voltage
                continue
            for axis in axes:
                if axis in log.references:
                    reason = refusal(log.references[axis], log.angles, log.rate_hz)
                    if reason is None:
                        signals[axis] = np.asarray(log.references[axis])
                    else:
                        notes.append(f"{log.name}: the {axis} reference is not used, {reason}.")
            if not signals.keys() & set(axes):
                law, result = rebuild(log, channel, axes, columns)
                if law is None or isinstance(result, str):
                    notes.append(f"{log.name}: what moved {channel} from outside cannot be rebuilt, {result}.")
                else:
                    signals[channel] = result
                    laws.append(law)
        kinds = [kind for kind, any_of in (("logged", signals.keys() - CHANNELS.keys()), ("rebuilt", laws)) if any_of]
        origins.append(" and ".join(kinds) or "none" if closed else "voltages")
        found.append(signals)
        controllers.append(tuple(laws))
    every = [name for channel, (axes, _) in CHANNELS.items() for name in (*axes, channel)]
    names = tuple(name for name in every if any(name in signals for signals in found))
    arrays = tuple(
        np.column_stack([signals.get(name, np.zeros(len(log.angles))) for name in names])
        if names
        else np.zeros((len(log.angles), 0))
        for log, signals in zip(logs, found, strict=True)
    )
    return References(names, arrays, tuple(origins), tuple(controllers), any(loops), tuple(notes))


def channel_voltage(log: Log, channel: str) -> Array:
    """Sum or difference of a log's voltages [V], shape (N,)."""
    return log.voltages[:, 0] + (1.0 if "+" in channel else -1.0) * log.voltages[:, 1]


def feedback(log: Log) -> bool:
    """Recognise a controller: do the angles' innovations tell more of the voltages than the voltages' own past?

    The innovations are what the past of angles and voltages does not tell of the angles: the air and the encoders. In
    open loop they know nothing of the voltages, however long the rig's memory is.

    Returns
    -------
    bool
        True where voltages answer angles.
    """
    every = max(1, round(log.rate_hz / 25.0))  # 25 Hz: below any controller's rate, above the rig's motion
    angles, lags = log.angles[::every], 6
    voltages = np.column_stack([channel_voltage(log, channel) for channel in CHANNELS])[::every]
    innovations = _residual(angles[lags:], _past(np.hstack([angles, voltages]), lags))
    later = _past(voltages, lags)[lags:]
    told = np.hstack([innovations[lags:], _past(innovations, lags)])
    for column in range(2):
        target = voltages[2 * lags :, column]
        added, chance = _added_r2(target, later, told)
        if added > LOOP_R2 and chance < 1e-4:  # both channels of ten logs: one false alarm in 500 sets
            return True
    return False


def refusal(signal: Array, angles: Array, rate_hz: float, *, steps: bool = True) -> str | None:
    """Test a candidate: still in at least half of the samples, and not told by the outputs' past.

    Parameters
    ----------
    signal : NDArray, shape (N,)
        The candidate, any unit.
    angles : NDArray, shape (N, 3)
        Pitch, elevation and travel [rad].
    rate_hz : float
        Sampling rate [Hz].
    steps : bool
        Whether the signal has to be still in half of the samples.

    Returns
    -------
    str or None
        Why it is no reference; None if it is one.
    """
    signal = np.asarray(signal, dtype=float)
    span = float(np.ptp(signal))
    if not np.isfinite(span) or span <= 1e-9 * max(1.0, float(np.abs(signal).max())):
        return "it never moves"
    every = max(1, round(rate_hz / 10.0))  # 10 Hz, ten samples: what the loop did within a second
    still = float(np.mean(np.abs(np.diff(signal[::every])) * rate_hz / every < STILL_RATE * span))
    if steps and still < 0.5:
        return f"it is still in {still:.0%} of the samples, a reference in at least 50 %"
    lags, slow = 5, signal[::every]
    own = np.column_stack([_past(np.diff(slow)[:, None], lags), slow[lags:-1]])
    outputs = _past(angles[::every], lags + 1)
    target = np.diff(slow)[lags:]
    added, chance = _added_r2(target, own, outputs)
    if added > ADDED_R2 and chance < 1e-3:
        # few steps are no normal noise: what outputs of other times add by chance is the scale
        shifts = np.linspace(20, len(outputs) - 20, 99).astype(int) if len(outputs) > 60 else ()
        by_chance = [_added_r2(target, own, np.roll(outputs, shift, axis=0))[0] for shift in shifts]
        if by_chance and added < max(by_chance):
            return None
        return f"the outputs' past adds R2 {added:.2f} to its own past (bound {ADDED_R2:g}): it is feedback"
    return None


def rebuild(
    log: Log, channel: str, axes: Sequence[str], columns: Sequence[int]
) -> tuple[Controller, Array] | tuple[None, str]:
    """Rebuild what came from outside in one channel of the voltages.

    Parameters
    ----------
    log : Log
        Flown by a controller.
    channel : str
        Key of `CHANNELS`.
    axes : sequence of str, length n
        Names of the angles that the channel may answer.
    columns : sequence of int, length n
        Their columns.

    Returns
    -------
    tuple
        The controller and r [V], shape (N,); or None and the reason.
    """
    hold = _hold(log.voltages)
    h = hold / log.rate_hz
    rows = slice(_phase(log.voltages, hold), None, hold)
    voltage, angles = channel_voltage(log, channel)[rows], log.angles[rows][:, list(columns)]
    limit = np.abs(log.voltages).max()
    clipped = (np.abs(log.voltages[rows]) > 0.999 * limit).any(axis=1)
    if clipped.sum() <= 5:  # a largest value is no limit
        clipped[:] = False
    if clipped.mean() > SATURATED_SHARE:
        return None, f"{clipped.mean():.0%} of the samples are at the limit of {limit:.2f} V"
    touched = np.convolve(clipped, np.ones(3), "full")[2 : len(clipped)] > 0
    usable = np.flatnonzero(~touched)
    usable = usable[:: max(1, len(usable) // ROWS)]

    def terms(shape: Array) -> tuple[Array, Array]:
        """F v and the columns of C(y) for (ln q, ln c, ln beta), the last one left out without integral term."""
        rates = _derivative(angles, np.exp(shape[0]), h)
        if len(shape) < 3:
            return voltage, np.hstack([angles, rates])
        beta = np.exp(shape[2])
        return _washed(voltage, beta, h), np.hstack([_washed(np.hstack([angles, rates]), beta, h), angles])

    def loss(shape: Array, rounds: int = 15) -> tuple[float, Array]:
        """ln of the mean absolute innovation, and the gains that make it least."""
        a = np.exp(-np.exp(shape[1]) * h)
        target, bank = (lfilter([1.0, -a], [1.0], np.diff(x, axis=0), axis=0)[1:][usable] for x in terms(shape))
        scale = np.abs(bank).mean(axis=0) + 1e-12
        gains, size = _least_absolute(bank / scale, target, rounds)
        return float(np.log(size + 1e-12)), gains / scale

    # q from 5 to 100 1/s and plain differences; c from slow smoothing to plain steps; beta from .1 to 1 1/s
    starts = [np.log([q, c]) for q in (5.0, 8.0, 12.0, 20.0, 40.0, 100.0, 5.0 / h) for c in (1.0, 3.0, 10.0 / h)]
    best = _polished(loss, min(starts, key=lambda shape: loss(shape, 4)[0]))
    with_integral = [np.append(best, np.log(beta)) for beta in (0.1, 0.3, 1.0)]
    integral = _polished(loss, min(with_integral, key=lambda shape: loss(shape, 4)[0]))
    if loss(integral)[0] < loss(best)[0] - 0.2:
        best = integral
    gains = loss(best)[1]
    target, bank = terms(best)
    answer = bank @ gains
    outside = target - answer
    outside[clipped] = np.interp(np.flatnonzero(clipped), np.flatnonzero(~clipped), outside[~clipped])
    share = float(outside.var() / (outside.var() + answer.var() + 1e-30))
    if share < OUTSIDE_SHARE:
        return None, f"the outside has a share of {share:.2f} in it (at least {OUTSIDE_SHARE:g} is needed)"
    reason = refusal(outside, log.angles[rows], 1.0 / h, steps=False)
    if reason is not None:
        return None, f"no law of the usual form fits; in what remains {reason.split(': ')[0]}"
    n = len(axes)
    beta = float(np.exp(best[2])) if len(best) > 2 else 0.0
    named = {axis: -gains[i] - (gains[2 * n + i] if beta else 0.0) for i, axis in enumerate(axes)}
    named |= {f"{axis} rate": -gains[n + i] for i, axis in enumerate(axes)}
    if beta:
        named |= {f"{axis} integral": -beta * gains[2 * n + i] for i, axis in enumerate(axes)}
    smoothing = float(np.exp(best[1])) if np.exp(best[1]) * h < 3.0 else np.inf
    law = Controller(channel, {k: float(v) for k, v in named.items()}, float(np.exp(best[0])), smoothing, beta, share)
    full = np.interp(np.arange(log.angles.shape[0]), np.arange(len(log.angles))[rows], outside)
    return law, full


def _polished(loss, start: Array) -> Array:
    """Nelder and Mead from a start: the L1 loss has kinks at its least."""
    found = minimize(lambda shape: loss(shape, 8)[0], start, method="Nelder-Mead", options={"maxfev": 70, "xatol": 1e-3,
                     "fatol": 1e-2, "initial_simplex": np.vstack([start, start + 0.2 * np.eye(len(start))])})
    return np.asarray(found.x)


def _least_absolute(bank: Array, target: Array, rounds: int) -> tuple[Array, float]:
    """Coefficients of least mean absolute residual, and that mean, by iteratively reweighted least squares."""
    weight = np.ones(len(target))
    for _ in range(rounds):
        weighted = bank.T * weight
        normal = weighted @ bank
        normal[np.diag_indices_from(normal)] += 1e-12 * np.trace(normal) + 1e-300
        gains = np.linalg.solve(normal, weighted @ target)
        residual = np.abs(target - bank @ gains)
        weight = 1.0 / np.maximum(residual, 1e-3 * residual.mean() + 1e-15)
    return gains, float(residual.mean())


def _derivative(signal: Array, pole: float, h: float) -> Array:
    """p q/(p + q) of a sampled signal from rest at its first value."""
    kept = np.exp(-pole * h)
    return lfilter([(1.0 - kept) / h, -(1.0 - kept) / h], [1.0, -kept], signal - signal[:1], axis=0)


def _washed(signal: Array, beta: float, h: float) -> Array:
    """p/(p + beta) of a sampled signal from rest at its first value."""
    return lfilter([1.0, -1.0], [1.0, -np.exp(-beta * h)], signal - signal[:1], axis=0)


def _hold(voltages: Array) -> int:
    """Samples for which a controller slower than the log holds its voltages; 1 if it is as fast."""
    changes = np.flatnonzero(np.any(np.diff(voltages, axis=0) != 0.0, axis=1))
    return max(1, int(np.median(np.diff(changes)))) if len(changes) > 10 else 1


def _phase(voltages: Array, hold: int) -> int:
    """First sample of a hold."""
    changes = np.flatnonzero(np.any(np.diff(voltages, axis=0) != 0.0, axis=1)) + 1
    return int(np.bincount(changes % hold, minlength=hold).argmax()) if len(changes) else 0


def _past(signals: Array, lags: int) -> Array:
    """The samples 1 to ``lags`` before each, side by side, shape (N - lags, lags m)."""
    return np.hstack([signals[lags - i : len(signals) - i] for i in range(1, lags + 1)])


def _residual(target: Array, columns: Array) -> Array:
    """What a regression on columns and a constant leaves."""
    bank = np.column_stack([columns, np.ones(len(columns))])
    bank = bank / (np.linalg.norm(bank, axis=0) + 1e-30)
    return target - bank @ np.linalg.lstsq(bank, target, rcond=1e-9)[0]


def _added_r2(target: Array, own: Array, others: Array) -> tuple[float, float]:
    """Share of what ``own`` leaves that ``others`` tell, adjusted for their number, and its p value by an F test."""
    left = float(np.sum(_residual(target, own) ** 2))
    rest = float(np.sum(_residual(target, np.hstack([own, others])) ** 2))
    free = len(target) - own.shape[1] - others.shape[1] - 1
    if free < 10 or left <= 1e-12 * float(np.sum(target**2)):
        return 0.0, 1.0
    ratio = (left - rest) / others.shape[1] / (rest / free + 1e-300)
    adjusted = 1.0 - (rest / free) / (left / (free + others.shape[1]))
    return adjusted, float(f_distribution.sf(ratio, others.shape[1], free))
