"""Which signals moved the rig from outside: references that are logged, rebuilt from the voltages, or the voltages.

A reference r is what a pilot or a plan asked for. It moves the rig and knows nothing of the air, so it can serve as an
instrument. Where a controller flies,

    F v = r - C(y),     C(y) = F (k y + k' y'_q) + k'' y,     y'_q = p q/(p + q) y,     F = p/(p + beta)

with C without noise, so r is rebuilt from what is logged: v_f - v_r answers pitch and travel, v_f + v_r the elevation.
F = 1 for a controller without integral term; one that is missed would leave feedback in r. Steps, smoothed by a lag of
rate c, are sparse under D = (1 - a/z)(1 - 1/z), a = exp(-c h), so the L1 regression

    min over k, q, c, beta of  sum |D (F v + C(y))|

is exact however large the steps are. Symbols: h sampling interval [s], z shift by h, p = d/dt [1/s], y angles [rad],
v voltages [V], q, c, beta rates [1/s].

Sources: C. W. J. Granger, Econometrica 37 (1969) 424, for "the past of y adds nothing to the own past"; E. J. Candes
and T. Tao, IEEE Trans. Inf. Theory 51 (2005) 4203, for exact recovery by L1 under sparse gross errors.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.signal import lfilter
from scipy.special import fdtrc

from heli_identifier.records import Log

from .rig import Array
from .settings import ADDED_R2, AS_GOOD, EXACT, OUTSIDE_SHARE, POLES, ROWS, SATURATED_SHARE, STILL_RATE

CHANNELS: Mapping[str, tuple[float, tuple[str, ...], tuple[int, ...]]] = {
    "v_front - v_rear": (-1.0, ("pitch", "travel"), (0, 2)),
    "v_front + v_rear": (1.0, ("elevation",), (1,)),
}
"""Each channel of the voltages: sign of the rear one, the axes it answers, their columns among the angles."""


@dataclass(frozen=True)
class Controller:
    """The law of one channel as recovered from one log."""

    channel: str
    """Sum or difference of the voltages."""
    gains: Mapping[str, float]
    """Voltage taken away for one unit of an angle [V/rad], a rate [V s/rad] and, if any, an integral [V/(rad s)]."""
    poles: tuple[float, ...]
    """Rate q of each angle's derivative filter [1/s]."""
    smoothing: float
    integral: float
    """smoothing, integral: Rates c (infinite for plain steps) and beta (0 without integral term) [1/s]."""
    delay: float
    """From reading the angles to their voltages [s]: 0, or one period of the controller."""
    share: float
    """Variance of the rebuilt reference over the sum of that and of the feedback."""


@dataclass(frozen=True, eq=False)
class References:
    """What moved the rig from outside, log by log."""

    names: tuple[str, ...]
    """The m signals: an axis [rad] where logged, a channel of the voltages [V] where rebuilt or in open loop."""
    signals: tuple[Array, ...]
    """For each log an array of shape (N, m); a column of zeros where a log does not have that signal."""
    origins: tuple[str, ...]
    """For each log "voltages" (open loop), "logged", "rebuilt", "logged and rebuilt" or "none"."""
    controllers: tuple[tuple[Controller, ...], ...]
    """For each log the controllers recovered, those of too small a share among them."""
    closed_loop: bool
    """Whether a controller flew in any of the logs."""
    notes: tuple[str, ...] = ()
    """What was refused and why, one sentence each."""


def find_references(logs: Sequence[Log]) -> References:
    """Find in each log what came from outside: logged references by test, else rebuilt ones, else the voltages.

    There are no signals (m = 0) if nothing came from outside.

    Parameters
    ----------
    logs : sequence of Log
        Logs of one rig, of any rates, lengths and controllers.
    """
    closed = [feedback(log) for log in logs]
    found: list[dict[str, Array]] = [{} for _ in logs]
    laws: list[list[Controller]] = [[] for _ in logs]
    notes: list[str] = []
    for channel, (sign, axes, columns) in CHANNELS.items():
        answering: list[tuple[int, _Law]] = []
        for i, log in enumerate(logs):
            if not closed[i]:
                found[i][channel] = log.voltages[:, 0] + sign * log.voltages[:, 1]
                continue
            for axis in (axis for axis in axes if axis in log.references):
                reason = refusal(log.references[axis], log.angles, log.rate_hz)
                if reason:
                    notes.append(f"{log.name}: the {axis} reference is not used, since {reason}.")
                else:
                    found[i][axis] = log.references[axis]
            if not found[i].keys() & set(axes):
                answering.append((i, _Law(log, sign, columns)))
        for turn in range(2):  # a log that shows a law badly takes it from one that shows it well
            for _, law in answering:
                law.search([other for _, other in answering], again=turn > 0)
        for i, law in answering:
            controller, signal, reason = law.rebuilt(channel, axes)
            if signal is None:
                notes.append(f"{logs[i].name}: no reference behind {channel}, since {reason}.")
            else:
                found[i][channel] = signal
            if controller:
                laws[i].append(controller)
    origins = []
    for signals, loop in zip(found, closed, strict=True):
        kinds = ("logged" if signals.keys() - CHANNELS.keys() else "", "rebuilt" if signals.keys() & CHANNELS else "")
        origins.append(" and ".join(kind for kind in kinds if kind) or "none" if loop else "voltages")
    every = [name for channel, (_, axes, _) in CHANNELS.items() for name in (*axes, channel)]
    names = tuple(name for name in every if any(name in signals for signals in found))
    arrays = [np.zeros((len(log.angles), len(names))) for log in logs]
    for array, signals in zip(arrays, found, strict=True):
        for name, signal in signals.items():
            array[:, names.index(name)] = signal
    return References(names, tuple(arrays), tuple(origins), tuple(map(tuple, laws)), any(closed), tuple(notes))


def controllers_of(logs: Sequence[Log]) -> list[tuple[Controller, ...]]:
    """Recover the laws of both channels log by log, references logged or not; fewer where no law fits."""
    found: list[tuple[Controller, ...]] = [() for _ in logs]
    for channel, (sign, axes, columns) in CHANNELS.items():
        laws = [_Law(log, sign, columns) for log in logs]
        for i, law in enumerate(laws):
            law.search(laws, again=False)
            controller = law.rebuilt(channel, axes)[0]
            found[i] += (controller,) if controller else ()
    return found


def feedback(log: Log) -> bool:
    """Recognise a controller: the angles' innovations tell more of the voltages than the voltages' own past does.

    The innovations are what the past of angles and voltages does not tell of the angles, the air and the encoders. In
    open loop they know nothing of the voltages, however long the rig's memory is.
    """
    every, lags = max(1, round(log.rate_hz / 25.0)), 6  # 25 Hz: below a controller's rate, above the rig's motion
    angles = log.angles[::every]
    voltages = log.voltages[::every] @ np.array([[1.0, 1.0], [1.0, -1.0]])
    if len(angles) < 100:
        return False
    innovations = _residual(angles[lags:], _past(np.hstack([angles, voltages]), lags))
    told = np.hstack([innovations[lags:], _past(innovations, lags)])
    own, now = _past(voltages, lags)[lags:], voltages[2 * lags :]
    found = [_added_r2(now[:, i], own, told) for i in range(2)]
    return any(added > ADDED_R2 and chance < 1e-4 for added, chance in found)


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
    every, lags = max(1, round(rate_hz / 10.0)), 5  # 10 Hz and five samples: the loop's last half second
    slow, outputs = np.asarray(signal, dtype=float)[::every], _past(angles[::every], lags + 1)
    span = float(np.ptp(slow))
    if not span > 1e-9 * max(1.0, float(np.abs(slow).max())):
        return "it never moves"
    still = float(np.mean(np.abs(np.diff(slow)) * rate_hz / every < STILL_RATE * span))
    if steps and still < 0.5:
        return f"it is still in {100.0 * still:.0f} % of the samples, a reference in at least 50 %"
    own, target = np.column_stack([_past(np.diff(slow)[:, None], lags), slow[lags:-1]]), np.diff(slow)[lags:]
    added, chance = _added_r2(target, own, outputs)
    if added <= ADDED_R2 or chance > 1e-3:
        return None
    # a few steps are no normal noise: the scale is what outputs of other times, 2 s off and more, add by chance
    shifts = np.linspace(20, max(20, len(outputs) - 20), 99).astype(int)
    if added < max(_added_r2(target, own, np.roll(outputs, shift, axis=0))[0] for shift in shifts):
        return None
    return f"it is feedback (the outputs' past tells R2 = {added:.2f} of it, the bound is {ADDED_R2:g})"


class _Shape(NamedTuple):
    """What a law is not linear in."""

    periods: int
    """The voltages answer the angles of so many of the controller's periods ago, 0 or 1."""
    rates: Array
    """Ln of (q of each of n angles, c), or of (..., c, beta)."""

    def with_rate(self, index: int, rate: float) -> "_Shape":
        """Give the same with another rate."""
        return _Shape(self.periods, np.where(np.arange(len(self.rates)) == index, np.log(rate), self.rates))

    def with_integral(self, rate: float) -> "_Shape":
        """Give the same with an integral term."""
        return _Shape(self.periods, np.append(self.rates, np.log(rate)))


class _Law:
    """The L1 regression of one channel of one log."""

    def __init__(self, log: Log, sign: float, columns: Sequence[int]) -> None:
        changes = np.flatnonzero(np.any(np.diff(log.voltages, axis=0) != 0.0, axis=1)) + 1
        hold = max(1, int(np.median(np.diff(changes)))) if len(changes) > 10 else 1  # a controller slower than its log
        first = int(np.bincount(changes % hold).argmax()) if len(changes) else 0
        self.rows, self.h, self.log = np.arange(first, len(log.angles), hold), hold / log.rate_hz, log
        voltages = log.voltages[self.rows]
        signals = np.vstack([voltages[:, 0] + sign * voltages[:, 1], log.angles[self.rows][:, list(columns)].T])
        prompt = signals - signals[:, :1]
        late = np.vstack([prompt[:1], np.pad(prompt[1:, :-1], ((0, 0), (1, 0)))])
        self.signals = (prompt, late)
        """By the periods of a shape: voltage and angles (1 + n, N) less their first values."""
        self.steps = tuple(np.diff(own) for own in self.signals)
        self.limit = float(np.abs(log.voltages).max())
        self.clipped = np.asarray((np.abs(voltages) > 0.999 * self.limit).any(axis=1))
        self.clipped &= self.clipped.sum() > 5  # a largest value is no limit
        usable = np.flatnonzero(np.convolve(~self.clipped, np.ones(3), "valid") == 3)
        self.usable = usable[:: max(1, len(usable) // ROWS)]
        self.n, fast = len(columns), 6.0 / self.h  # beyond these bounds: no derivative, no steps, no integral
        self.bounds = np.log([[0.5] * self.n + [0.01, 0.02], [fast] * self.n + [fast, 3.0]])
        self.size = float(np.log(np.abs(self.steps[0][0]).mean() + 1e-12))
        self.shape: _Shape | None = None
        self.least = np.inf

    def terms(self, signals: Array, rates: Array) -> Array:
        """F v and the regressors of C, one row each."""
        kept = np.exp(-np.exp(rates) * self.h)
        slopes = [
            lfilter([1.0, -1.0], [1.0, -a], y) * (1.0 - a) / self.h for a, y in zip(kept, signals[1:], strict=False)
        ]
        rows = np.vstack([signals, *slopes])
        if len(rates) == self.n + 1:
            return rows
        return np.vstack([lfilter([1.0, -1.0], [1.0, -kept[-1]], rows), signals[1:]])

    def gains(self, shape: _Shape, rounds: int = 15) -> tuple[float, Array]:
        """Ln of the mean absolute innovation but for the largest tenth, and L1 gains by iteratively reweighted LS."""
        low, high = self.bounds[:, : len(shape.rates)]
        if np.any(shape.rates < low) or np.any(shape.rates > high):
            return np.inf, np.array([])
        rows = self.terms(self.steps[shape.periods], shape.rates)
        rows = rows[:, self.usable + 1] - np.exp(-np.exp(shape.rates[self.n]) * self.h) * rows[:, self.usable]
        scale = np.abs(rows[1:]).mean(axis=1) + 1e-12
        target, bank = rows[0], rows[1:] / scale[:, None]
        weight, most = np.ones(len(target)), int(0.9 * len(target))  # steps are few: the rest shows if a law is exact
        for _ in range(rounds):
            weighted = bank * weight
            normal = weighted @ bank.T
            normal[np.diag_indices_from(normal)] += 1e-12 * np.trace(normal) + 1e-300
            gains = np.linalg.solve(normal, weighted @ target)
            residual = np.abs(target - gains @ bank)
            size = float(np.partition(residual, most)[:most].mean())
            weight = 1.0 / np.maximum(residual, 1e-2 * size + 1e-15)
        return float(np.log(size + 1e-12)), gains / scale

    def loss(self, shape: _Shape, rounds: int = 15) -> float:
        """Give the first of :meth:`gains`."""
        return self.gains(shape, rounds)[0]

    def search(self, laws: Sequence["_Law"], *, again: bool) -> None:
        """Scan and polish the rates, from the grid and from what is known of the ``laws`` of other logs."""
        if len(self.usable) < 100 or self.clipped.mean() > SATURATED_SHARE:
            return
        known = [(self.loss(law.shape), law.shape, law) for law in laws if law.shape is not None]
        loss, shape, other = min(known, key=lambda own: own[0], default=(np.inf, None, None))
        if again and (other is None or other is self or loss > self.least - 0.05):
            return
        enough = np.log(EXACT) if other is None else max(np.log(EXACT), other.least - other.size + np.log(AS_GOOD))
        if shape is not None and loss - self.size <= enough:
            best = self.polished(shape)
        else:
            best = self.scanned()
            if shape is not None and loss < self.loss(best):
                best = shape
        if self.loss(best) < self.least:
            self.shape, self.least = best, self.loss(best)

    def scanned(self) -> _Shape:
        """Polish the best shape of a grid, with an integral term where that tells more."""
        n, fast = self.n, 5.0 / self.h
        grid = [_Shape(periods, np.log([q] * n + [c]))
                for periods in (0, 1) for q in (*POLES, fast) for c in (0.1, 1.0, 3.0, fast)]  # fmt: skip
        plain = min(grid, key=self.roughly)
        for i in range(1, n):  # each angle may have a derivative filter of its own
            plain = min([plain.with_rate(i, q) for q in (*POLES, fast)] + [plain], key=self.roughly)
        plain = self.polished(self.polished(plain))
        if self.loss(plain) - self.size <= np.log(EXACT):
            return plain
        starts = [*(plain.with_rate(n, c) for c in (1.0, 3.0, fast)), plain]
        whole = min((own.with_integral(beta) for beta in (0.1, 0.3, 1.0) for own in starts), key=self.loss)
        whole = self.polished(self.polished(whole))
        gain = self.loss(plain) - self.loss(whole)
        return whole if gain > 0.25 else plain  # an integral term that is not there gains some by chance

    def roughly(self, shape: _Shape) -> float:
        """Loss after few rounds, which is enough to compare starts."""
        return self.loss(shape, 4)

    def polished(self, start: _Shape) -> _Shape:
        """Nelder and Mead from a start, since the loss has kinks where it is least."""
        corners = np.vstack([start.rates, start.rates + 0.15 * np.eye(len(start.rates))])
        options = {"maxfev": 40 * len(start.rates), "xatol": 1e-4, "fatol": 1e-3, "initial_simplex": corners}
        found = minimize(lambda x: self.loss(_Shape(start.periods, x), 8), start.rates, method="Nelder-Mead",
                         options=options)  # fmt: skip
        return _Shape(start.periods, np.asarray(found.x))

    def rebuilt(self, channel: str, axes: Sequence[str]) -> tuple[Controller | None, Array | None, str]:
        """Give the controller, and r of shape (N,) [V] at the log's rate or why it is refused."""
        if self.shape is None:
            clipped = f"{100.0 * self.clipped.mean():.0f} % of the samples are at the limit of {self.limit:.2f} V"
            return None, None, clipped if self.clipped.any() else "the log is too short or the voltages rest"
        gains, rates, n = self.gains(self.shape)[1], np.exp(self.shape.rates), self.n
        rows = self.terms(self.signals[self.shape.periods], self.shape.rates)
        answer = gains @ rows[1:]
        outside = rows[0] - answer
        free = np.flatnonzero(~self.clipped)
        outside = np.interp(np.arange(len(outside)), free, outside[free])
        share = float(outside.var() / (outside.var() + answer.var() + 1e-30))
        beta = float(rates[n + 1]) if len(rates) > n + 1 else 0.0
        slow = gains[2 * n :] if beta else np.zeros(n)
        named = {axis: -float(gains[i] + slow[i]) for i, axis in enumerate(axes)}
        named |= {f"{axis} rate": -float(gains[n + i]) for i, axis in enumerate(axes)}
        named |= {f"{axis} integral": -beta * float(slow[i]) for i, axis in enumerate(axes) if beta}
        smoothing = float(rates[n]) if rates[n] * self.h < 3.0 else np.inf
        delay = self.shape.periods * self.h
        law = Controller(channel, named, tuple(map(float, rates[:n])), smoothing, beta, delay, share)
        if share < OUTSIDE_SHARE:
            return law, None, f"the outside has a share of {share:.2f} ({OUTSIDE_SHARE:g} is needed)"
        reason = refusal(outside, self.log.angles[self.rows], 1.0 / self.h, steps=False)
        if reason:
            return None, None, f"no usual law fits and {reason.replace('it', 'what remains', 1)}"
        return law, np.interp(np.arange(len(self.log.angles)), self.rows, outside), ""


def _past(signals: Array, lags: int) -> Array:
    """Lay the samples 1 to ``lags`` before each side by side, shape (N - lags, lags m)."""
    return np.hstack([signals[lags - i : len(signals) - i] for i in range(1, lags + 1)])


def _residual(target: Array, columns: Array) -> Array:
    """Return what a regression on columns and a constant leaves."""
    bank = np.column_stack([columns, np.ones(len(columns))])
    bank = bank / (np.linalg.norm(bank, axis=0) + 1e-30)
    return target - bank @ np.linalg.lstsq(bank, target, rcond=1e-9)[0]


def _added_r2(target: Array, own: Array, others: Array) -> tuple[float, float]:
    """Share of what ``own`` leaves that ``others`` tell, adjusted for their number, and its p value by an F test."""
    left = float(np.sum(_residual(target, own) ** 2))
    rest = float(np.sum(_residual(target, np.hstack([own, others])) ** 2))
    number, free = others.shape[1], len(target) - own.shape[1] - others.shape[1] - 1
    if free < 10 or left <= 1e-12 * float(np.sum(target**2)):
        return 0.0, 1.0
    chance = float(fdtrc(number, free, max((left - rest) / number / (rest / free + 1e-300), 0.0)))
    return 1.0 - (rest / free) / (left / (free + number)), chance
