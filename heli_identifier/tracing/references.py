"""Which signals moved the rig from outside: references that are logged, rebuilt from the voltages, or the voltages.

A reference r is the command of a pilot or a plan. It moves the rig and does not depend on the air, so it can serve as
an instrument. Where a controller flies,

    F v = r - C(y),     C(y) = F (k y + k' y'_q) + k'' y,     y'_q = p q/(p + q) y,     F = p/(p + beta)

with C without noise, so r is rebuilt from what is logged: v_f - v_r answers pitch and travel, v_f + v_r the elevation.
F = 1 for a controller without integral term; one that is missed would leave feedback in r. Steps, smoothed by a lag of
rate c, are sparse under D = (1 - a/z)(1 - 1/z), a = exp(-c h), so the L1 regression

    min over k, q, c, beta of  sum |D (F v + C(y))|

is exact however large the steps are. Symbols: h sampling interval [s], z shift by h, p = d/dt [1/s], y angles [rad],
v voltages [V], q, c, beta rates [1/s].

Sources: C. W. J. Granger, Econometrica 37 (1969) 424, for "the past of y adds nothing to the past of r"; E. J. Candes
and T. Tao, IEEE Trans. Inf. Theory 51 (2005) 4203, for exact recovery by L1 under sparse gross errors.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.signal import lfilter
from scipy.special import fdtrc

from heli_identifier.chain import controller_samples
from heli_identifier.records import Log

from .rig import Array
from .settings import ADDED_R2, EXACT, OUTSIDE_SHARE

CHANNELS: Mapping[str, tuple[float, tuple[str, ...], tuple[int, ...]]] = {
    "v_front - v_rear": (-1.0, ("pitch", "travel"), (0, 2)),
    "v_front + v_rear": (1.0, ("elevation",), (1,)),
}
"""Each channel of the voltages: sign of the rear one, the axes it answers, their columns among the angles."""


@dataclass(frozen=True, eq=False)
class Controller:
    """The law of one channel as recovered from one log."""

    channel: str
    """Sum or difference of the voltages."""
    gains: Array
    """Coefficients of the regression: -(k, k'), and -k'' with an integral term, n angles each [V/rad, V s/rad,
    V/rad]."""
    rates: Array
    """Ln of (q of each of n angles, c), and of beta last with an integral term."""
    delay: float
    """From reading the angles to their voltages [s]: 0, or one period of the controller."""

    def answer(self, angles: Array, h: float) -> Array:
        """Return the voltage (N,) [V] with which the law answers angles (N, 3) [rad]."""
        y = angles[:, CHANNELS[self.channel][2]].T
        late = round(self.delay / h)
        read = np.pad(y, ((0, 0), (late, 0)))[:, : len(angles)]
        answer = self.gains @ law_terms(np.vstack([read[:1], read]), self.rates, h)[1:]
        if len(self.rates) == len(y) + 1:
            return answer
        return lfilter([1.0, -np.exp(-np.exp(self.rates[-1]) * h)], [1.0, -1.0], answer)


@dataclass(frozen=True, eq=False)
class References:
    """The signals that moved the rig from outside, log by log."""

    names: tuple[str, ...]
    """The m signals: an axis [rad] where logged, a channel of the voltages [V] where rebuilt or in open loop."""
    signals: tuple[Array, ...]
    """For each log an array of shape (N, m); a column of zeros where a log does not have that signal."""
    origin: str
    """`voltages` (open loop), `logged`, `rebuilt`, several of them, or `none`."""
    closed_loop: bool
    """Whether a controller flew in any of the logs."""
    notes: tuple[str, ...] = ()
    """Which signals were refused and why, one sentence each."""


def find_references(logs: Sequence[Log]) -> References:
    """Find in each log what came from outside: logged references by test, else rebuilt ones, else the voltages.

    There are no signals (m = 0) if nothing came from outside.
    """
    closed, found, origins, notes = [feedback(log) for log in logs], dict[tuple[int, str], Array](), set(), list[str]()
    for channel, (sign, axes, _) in CHANNELS.items():
        answering: dict[int, _Law] = {}
        for i, log in enumerate(logs):
            if not closed[i]:
                found[i, channel] = log.voltages[:, 0] + sign * log.voltages[:, 1]
                origins.add("voltages")
                continue
            for axis in (axis for axis in axes if axis in log.references):
                if reason := refusal(log.references[axis], log.angles, log.rate_hz):
                    notes.append(f"{log.name}: the {axis} reference is not used, since {reason}.")
                else:
                    found[i, axis] = log.references[axis]
                    origins.add("logged")
            if not any((i, axis) in found for axis in axes):
                answering[i] = _Law(log, channel)
        for i, law in answering.items():
            law.search(list(answering.values()))
            _, signal, reason = law.rebuild()
            if signal is None:
                notes.append(f"{logs[i].name}: {channel} holds no reference: {reason}.")
            else:
                found[i, channel] = signal
                origins.add("rebuilt")
    every = [name for channel, (_, axes, _) in CHANNELS.items() for name in (*axes, channel)]
    names = tuple(name for name in every if any((i, name) in found for i in range(len(logs))))
    signals = tuple(np.zeros((len(log.angles), len(names))) for log in logs)
    for (i, name), signal in found.items():
        signals[i][:, names.index(name)] = signal
    return References(names, signals, " and ".join(sorted(origins)) or "none", any(closed), tuple(notes))


def controllers_of(logs: Sequence[Log]) -> list[tuple[Controller, ...]]:
    """Recover the laws of both channels log by log, references logged or not; fewer where no law fits."""
    found: list[tuple[Controller, ...]] = [() for _ in logs]
    for channel in CHANNELS:
        laws = [_Law(log, channel) for log in logs]
        for i, law in enumerate(laws):
            law.search(laws)
            controller, _, _ = law.rebuild()
            found[i] += (controller,) if controller else ()
    return found


def feedback(log: Log) -> bool:
    """Recognise a controller: the angles' innovations predict the voltages better than the past of the voltages does.

    The innovations are the part of the angles that the past of angles and voltages does not predict: air and encoder
    errors. In open loop the voltages do not depend on them, however long the rig's memory is. All voltages count, as an
    arm that bends answers those between two samples of 25 Hz.
    """
    every, lags = max(1, round(log.rate_hz / 25.0)), 6  # 25 Hz: below a controller's rate, above the rig's motion
    angles = log.angles[::every]
    every_voltage = log.voltages @ np.array([[1.0, 1.0], [1.0, -1.0]])
    voltages = every_voltage[::every]
    if len(angles) < 100:
        return False
    between = [np.roll(every_voltage, j, axis=0)[::every][lags:] for j in range(1, every)]
    innovations = _residual(angles[lags:], np.hstack([_past(np.hstack([angles, voltages]), lags), *between]))
    answered = np.hstack([innovations[lags:], _past(innovations, lags)])
    past, now = _past(voltages, lags)[lags:], voltages[2 * lags :]
    tests = [_added_r2(now[:, i], past, answered) for i in range(2)]
    return any(added > ADDED_R2 and p_value < 1e-4 for added, p_value in tests)


def refusal(signal: Array, angles: Array, rate_hz: float, *, planned: bool = True) -> str | None:
    """Say why a signal (N,) beside angles (N, 3) is no reference; None if it is one.

    It has to be ``planned``, as steps, ramps and sines are: in at least half of the samples its own past predicts it to
    a twentieth of its range in a second. And past outputs must not predict it.
    """
    every, lags = max(1, round(rate_hz / 10.0)), 5  # 10 Hz and five samples: the loop's last half second
    slow, outputs = np.asarray(signal, dtype=float)[::every], _past(angles[::every], lags + 1)
    span = float(np.ptp(slow))
    if not span > 1e-9 * max(1.0, float(np.abs(slow).max())):
        return "it never moves"
    past, target = np.column_stack([_past(np.diff(slow)[:, None], lags), slow[lags:-1]]), np.diff(slow)[lags:]
    predicted = float(np.mean(np.abs(_residual(target, past)) * rate_hz / every < 0.05 * span))
    if planned and predicted < 0.5:
        return f"its own past predicts {100.0 * predicted:.0f} % of its samples, that of a plan at least 50 %"
    added, p_value = _added_r2(target, past, outputs)
    if added <= ADDED_R2 or p_value > 1e-3:
        return None
    # a few steps are no normal noise, so outputs shifted by 2 s and more say how much is added by chance
    shifts = np.linspace(20, max(20, len(outputs) - 20), 99).astype(int)
    if added < max(_added_r2(target, past, np.roll(outputs, shift, axis=0))[0] for shift in shifts):
        return None
    return f"it is feedback (past angles explain {100.0 * added:.0f} % of it, {100.0 * ADDED_R2:g} % is allowed)"


def _past(signals: Array, lags: int) -> Array:
    """Put the ``lags`` samples before each sample side by side, shape (N - lags, lags m)."""
    return np.hstack([signals[lags - i : len(signals) - i] for i in range(1, lags + 1)])


def _residual(target: Array, columns: Array) -> Array:
    """Return the residual of a regression on columns and a constant."""
    bank = np.column_stack([columns, np.ones(len(columns))])
    bank = bank / (np.linalg.norm(bank, axis=0) + 1e-30)
    return target - bank @ np.linalg.lstsq(bank, target, rcond=1e-9)[0]


def _added_r2(target: Array, past: Array, others: Array) -> tuple[float, float]:
    """Return adjusted R2 of ``others`` for the residual of a regression on ``past``, and p value of an F test."""
    without = float(np.sum(_residual(target, past) ** 2))
    beside = float(np.sum(_residual(target, np.hstack([past, others])) ** 2))
    number, free = others.shape[1], len(target) - past.shape[1] - others.shape[1] - 1
    if free < 10 or without <= 1e-12 * float(np.sum(target**2)):
        return 0.0, 1.0
    p_value = float(fdtrc(number, free, max((without - beside) / number / (beside / free + 1e-300), 0.0)))
    return 1.0 - (beside / free) / (without / (free + number)), p_value


_Shape = tuple[int, Array]
"""The nonlinear part of a law: delay of the voltages in periods, 0 or 1; ln of the rates (q of each of n angles, c),
and of beta last with an integral term."""


class _Law:
    """The L1 regression of one channel of one log."""

    def __init__(self, log: Log, channel: str) -> None:
        sign, self.axes, columns = CHANNELS[channel]
        self.rows, hold, _ = controller_samples(log)
        self.h, self.log = hold / log.rate_hz, log
        voltages = log.voltages[self.rows]
        signals = np.vstack([voltages[:, 0] + sign * voltages[:, 1], log.angles[self.rows][:, list(columns)].T])
        prompt = signals - signals[:, :1]
        late = np.vstack([prompt[:1], np.pad(prompt[1:, :-1], ((0, 0), (1, 0)))])
        self.signals = (prompt, late)
        """For a delay of 0 and of 1 period: voltage and angles (1 + n, N) less their first values."""
        self.steps = tuple(np.diff(rows) for rows in self.signals)
        self.limit = float(np.abs(log.voltages).max())
        self.clipped = np.asarray((np.abs(voltages) > 0.999 * self.limit).any(axis=1))
        self.clipped &= self.clipped.sum() > 5  # a largest value is no limit
        usable = np.flatnonzero(np.convolve(~self.clipped, np.ones(3), "valid") == 3)
        self.usable = usable[:: max(1, len(usable) // 800)]  # the equations are exact, more of them only cost time
        self.channel, self.n, fast = channel, len(columns), 6.0 / self.h
        # beyond these bounds: no derivative, no steps, no integral
        self.bounds = np.log([[0.5] * self.n + [0.01, 0.02], [fast] * self.n + [fast, 3.0]])
        self.size = float(np.log(np.abs(self.steps[0][0]).mean() + 1e-12))
        self.shape: _Shape | None = None
        self.least = np.inf

    def gains(self, shape: _Shape, rounds: int = 15) -> tuple[float, Array]:
        """Ln of the mean absolute innovation without the largest tenth, and L1 gains by iteratively reweighted LS."""
        periods, rates = shape
        low, high = self.bounds[:, : len(rates)]
        if np.any(rates < low) or np.any(rates > high):
            return np.inf, np.array([])
        rows = law_terms(self.steps[periods], rates, self.h)
        rows = rows[:, self.usable + 1] - np.exp(-np.exp(rates[self.n]) * self.h) * rows[:, self.usable]
        scale = np.abs(rows[1:]).mean(axis=1) + 1e-12
        target, bank = rows[0], rows[1:] / scale[:, None]
        weight, most = np.ones(len(target)), int(0.9 * len(target))  # the tenth holds the steps of the reference
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
        """Return the first value of :meth:`gains`; few rounds are enough to compare starts."""
        return self.gains(shape, rounds)[0]

    def search(self, laws: Sequence["_Law"]) -> None:
        """Find the rates on a grid, or from the ``laws`` of other logs, and polish them.

        Where a tenth of the samples is at the voltages' limit, too much of r would be interpolated. In a log that the
        same controller flew the innovation may be three times as large.
        """
        if len(self.usable) < 100 or self.clipped.mean() > 0.1:
            return
        known = [(self.loss(law.shape), law.shape, law) for law in laws if law.shape is not None]
        loss, shape, other = min(known, key=lambda candidate: candidate[0], default=(np.inf, None, None))
        enough = np.log(EXACT) if other is None else max(np.log(EXACT), other.least - other.size + np.log(3.0))
        if shape is not None and loss - self.size <= enough:
            best = self.polish(shape)
        else:
            best = self.scan()
            if shape is not None and loss < self.loss(best):
                best = shape
        self.shape, self.least = best, self.loss(best)

    def scan(self) -> _Shape:
        """Polish the best shape of a grid, with an integral term if that lowers the loss."""
        n, fast = self.n, 5.0 / self.h
        poles = (2.0, 6.0, 12.0, 25.0, 50.0, fast)
        grid = [(periods, np.log([q] * n + [c]))
                for periods in (0, 1) for q in poles for c in (0.1, 1.0, 3.0, fast)]  # fmt: skip
        plain = min(grid, key=lambda shape: self.loss(shape, 4))
        for i in range(1, n):  # each angle may have a derivative filter of its own
            others = [_with_rate(plain, i, q) for q in poles]
            plain = min([*others, plain], key=lambda shape: self.loss(shape, 4))
        plain = self.polish(self.polish(plain))
        if self.loss(plain) - self.size <= np.log(EXACT):
            return plain
        starts = [*(_with_rate(plain, n, c) for c in (1.0, 3.0, fast)), plain]
        integral = [(start[0], np.append(start[1], np.log(beta))) for beta in (0.1, 0.3, 1.0) for start in starts]
        with_integral = self.polish(self.polish(min(integral, key=self.loss)))
        # an integral term that is not there lowers the loss a little by chance
        return with_integral if self.loss(plain) - self.loss(with_integral) > 0.25 else plain

    def polish(self, start: _Shape) -> _Shape:
        """Nelder and Mead's method from a start, since the loss has kinks near its minimum."""
        periods, rates = start
        corners = np.vstack([rates, rates + 0.15 * np.eye(len(rates))])
        options = {"maxfev": 40 * len(rates), "xatol": 1e-4, "fatol": 1e-3, "initial_simplex": corners}
        found = minimize(lambda x: self.loss((periods, x), 8), rates, method="Nelder-Mead", options=options)
        return periods, np.asarray(found.x)

    def rebuild(self) -> tuple[Controller | None, Array | None, str]:
        """Return the controller, and r of shape (N,) [V] at the log's rate or why it is refused."""
        if self.shape is None:
            clipped = f"{100.0 * self.clipped.mean():.0f} % of the samples are at the limit of {self.limit:.2f} V"
            return None, None, clipped if self.clipped.any() else "the log is too short or the voltages rest"
        periods, rates = self.shape
        gains, rows = self.gains(self.shape)[1], law_terms(self.signals[periods], rates, self.h)
        answer = gains @ rows[1:]
        free = np.flatnonzero(~self.clipped)
        outside = np.interp(np.arange(len(answer)), free, (rows[0] - answer)[free])
        share = float(outside.var() / (outside.var() + answer.var() + 1e-30))
        law = Controller(self.channel, gains, rates, periods * self.h)
        if share < OUTSIDE_SHARE:
            return law, None, f"{100.0 * share:.0f} % of it comes from outside, {100.0 * OUTSIDE_SHARE:g} % is needed"
        if reason := refusal(outside, self.log.angles[self.rows], 1.0 / self.h, planned=False):
            return None, None, f"no usual control law fits, and {reason.replace('it', 'what remains', 1)}"
        return law, np.interp(np.arange(len(self.log.angles)), self.rows, outside), ""


def law_terms(signals: Array, rates: Array, h: float) -> Array:
    """F v and the regressors of C, one row each, of a voltage and n angles (1 + n, N); ``rates`` as a controller's."""
    kept, n = np.exp(-np.exp(rates) * h), len(signals) - 1
    slopes = [lfilter([1.0, -1.0], [1.0, -a], y) * (1.0 - a) / h for a, y in zip(kept, signals[1:], strict=False)]
    rows = np.vstack([signals, *slopes])
    if len(rates) == n + 1:
        return rows
    return np.vstack([lfilter([1.0, -1.0], [1.0, -kept[-1]], rows), signals[1:]])


def _with_rate(shape: _Shape, index: int, rate: float) -> _Shape:
    return shape[0], np.where(np.arange(len(shape[1])) == index, np.log(rate), shape[1])
