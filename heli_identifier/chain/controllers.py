"""The laws of the controllers that flew a rig, recovered from its logs, and the references that they were given.

A reference r is the command of a pilot or a plan. Where a controller flies,

    F v = r - C(y),     C(y) = F (k y + k' y'_q) + k'' y,     y'_q = p q/(p + q) y,     F = p/(p + beta)

with C without noise, so r is rebuilt from what is logged: v_f - v_r answers pitch and travel, v_f + v_r the elevation.
F = 1 for a controller without integral term; one that is missed would leave feedback in r. Steps, smoothed by a lag of
rate c, are sparse under D = (1 - a/z)(1 - 1/z), a = exp(-c h), so the L1 regression

    min over k, q, c, beta of  sum |D (F v + C(y))|

is exact however large the steps are. Symbols: h sampling interval [s], z shift by h, p = d/dt [1/s], y angles [rad],
v voltages [V], q, c, beta rates [1/s].

Source: E. J. Candes and T. Tao, IEEE Trans. Inf. Theory 51 (2005) 4203, for exact recovery by L1 under sparse gross
errors.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.signal import lfilter

from heli_identifier.records import Array, Log

from .answers import CHANNELS, controller_samples
from .causality import refusal

OUTSIDE_SHARE = 0.2
"""Least share of a channel's variance that comes from outside; below it small errors of gains are large ones of r."""

EXACT = 0.0001
"""Mean innovation, without the largest tenth, over the voltages' mean step, below which a law is exact."""


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


def controllers_of(logs: Sequence[Log]) -> list[tuple[Controller, ...]]:
    """Recover the laws of both channels log by log, references logged or not; fewer where no law fits."""
    found: list[tuple[Controller, ...]] = [() for _ in logs]
    for channel in CHANNELS:
        laws = [LawRegression(log, channel) for log in logs]
        for i, law in enumerate(laws):
            law.search(laws)
            controller, _, _ = law.rebuild()
            found[i] += (controller,) if controller else ()
    return found


_Shape = tuple[int, Array]
"""The nonlinear part of a law: delay of the voltages in periods, 0 or 1; ln of the rates (q of each of n angles, c),
and of beta last with an integral term."""


class LawRegression:
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

    def search(self, laws: Sequence["LawRegression"]) -> None:
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
