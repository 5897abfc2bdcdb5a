"""Errors of a plant ahead on one record, their intervals, and what a perfect plant would err.

From every start t_i, :data:`SPACING` apart, the plant runs on under the measured inputs; its error is

    e_ij = y_j(t_i + H) - y_hat_j(t_i + H | t_i),    j an axis.

For H = .1 and .2 s it starts from the state of the filter, the torque of the air included, which then decays by its own
dynamics. For H = 1 and 2 s it starts from angles and rates of a local cubic over .4 s (Savitzky and Golay 1964), which
knows no model, and the air is left out. Where a controller flies, the measured inputs answer the air within 1 s: these
two figures are no predictions there, and decide nothing.

One compiled loop serves all: a filter whose gains are zero is the plant alone, and its innovations are its errors.

Intervals come from a bootstrap over segments (Kuensch 1989). The noise floor is the error of the plant on records that
it made itself, with the air and the encoders' noise of its fit.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from heli_identifier.chain import local_cubic
from heli_identifier.errors import LogError

from .fit import Fit, fit
from .helicopter import Rig
from .noise import SHAPES, AxisFilter, filters, gains, physical
from .references import CHANNELS, Controller
from .result import ErrorFigure
from .rig import Array, Parameters, Record
from .settings import BLOCK, DRAWS, ROUND, SETTLED, SETTLING, SMOOTHING, SPACING

HORIZONS: Mapping[str, float] = {"ahead_100ms": 0.1, "ahead_200ms": 0.2, "prediction_1s": 1.0, "prediction_2s": 2.0}
"""How far ahead [s] each figure looks."""

FROM_FILTER = 2
"""So many figures start from the filter's state, the others from the smoothed motion."""

Stretch = tuple[int, Array]
"""First sample of a prediction, and its errors (n, a) [rad] from there on."""

_NONE, _NO_MOTION = np.empty((0, 4)), np.empty((0, 6))


@dataclass(frozen=True, eq=False)
class Model:
    """A plant with the noise of its training logs: air z (s, a), r (a,) [rad], tau (a,) [rad/s^2]."""

    rig: Rig
    parameters: Parameters
    z: Array
    encoder_noise: Array
    torque_width: Array

    @classmethod
    def of(cls, fitted: Fit) -> "Model":
        """Take plant and noise from a fit; the encoder's resolution is the noise where no sample of an axis counted.

        A torque that is periodic in time is no part of the plant, as its phase in another log is not known: the air is
        fitted once more without it.
        """
        likelihood = fitted.likelihood
        if fitted.point.harmonics:
            fitted = fit(likelihood, (), replace(fitted, point=replace(fitted.point, harmonics=())))
        counted = sum(record.weights.sum(0) for record in likelihood.records) > 0
        r = np.where(counted, fitted.encoder_noise(), likelihood.rig.resolution / np.sqrt(12.0))
        return cls(likelihood.rig, fitted.parameters, fitted.point.z, r, likelihood.widths[: len(r)])

    @classmethod
    def alone(cls, rig: Rig, parameters: Parameters) -> "Model":
        """Take a plant without a fit: the air is that of any rig before a log is seen."""
        a = len(rig.axes)
        return cls(rig, parameters, np.zeros((SHAPES, a)), rig.resolution / np.sqrt(12.0), np.zeros(a))

    def filters(self, step: float) -> list[AxisFilter]:
        """Give the axes' filters at a sampling interval [s]."""
        return filters(step, self.rig.linear(self.parameters), physical(self.z))

    def scales(self, step: float) -> Array:
        """Give the standard deviations (a,) [rad] of the innovations at a sampling interval [s]."""
        return self.encoder_noise * np.sqrt([axis.S for axis in self.filters(step)])

    def torque(self, step: float, count: int, random: np.random.Generator) -> Array:
        """Draw the torque of the air (count, a) [rad/s^2]: x+ = F x + w, stationary from its first sample."""
        columns = []
        for axis, level in zip(self.filters(step), physical(self.z)[0] * self.encoder_noise, strict=True):
            F = axis.F
            values, vectors = np.linalg.eigh(np.eye(2) - F @ F.T)
            w = random.standard_normal((count, 2))
            w[1:] = w[1:] * np.sqrt(np.maximum(values, 0.0)) @ vectors.T
            poles = [1.0, -np.trace(F), np.linalg.det(F)]
            d = lfilter([1.0, -F[1, 1]], poles, w[:, 0]) + lfilter([0.0, F[0, 1]], poles, w[:, 1])
            columns.append(level * d)
        return np.column_stack(columns)

    def encoder_errors(self, step: float, count: int, random: np.random.Generator) -> Array:
        """Draw the errors of the encoders (count, a) [rad]."""
        drawn = [axis.encoder_error(count, random) for axis in self.filters(step)]
        return np.asarray(self.encoder_noise * np.column_stack(drawn))


@dataclass(frozen=True, eq=False)
class Run:
    """A model's filter along a record."""

    model: Model
    record: Record
    offset: Array
    """Shape (a,)."""
    at: NDArray[np.intp]
    """Samples at which predictions start, shape (S,)."""
    ends: NDArray[np.intp]
    """Sample before which each of them has to end, shape (S,)."""
    carries: Array
    """State of the filter before the innovation at each start, shape (S, n)."""
    e: Array
    """Innovations [rad], shape (N, a)."""

    @cached_property
    def motion(self) -> Array:
        """Smoothed angles [rad] and rates [rad/s] at the starts, shape (S, 2a)."""
        y, h = self.record.angles, self.record.step
        return np.hstack([local_cubic(y, h, SMOOTHING, order)[self.at] for order in (0, 1)])

    def errors(self) -> dict[str, Array]:
        """Give the errors (S, a) [rad] of the figures; not a number where the passage ends before."""
        K, none = gains(self.model.filters(self.record.step)), np.zeros_like(self.offset)
        K[:, :4] = 0.0
        steps = [max(round(H / self.record.step), 1) for H in HORIZONS.values()]
        # the state before the innovation at t_i is one step ahead of the corrected state before it
        near = self._ahead(self.carries, K, self.offset, [n - 1 for n in steps[:FROM_FILTER]])
        states = [self.model.rig.placed(c, own) for c, own in zip(self.carries, self.motion, strict=True)]
        far = self._ahead(states, self.model.rig.still, none, steps[FROM_FILTER:])
        return dict(zip(HORIZONS, (*near, *far), strict=True))

    def measured_ahead(self, seconds: float) -> Array:
        """Angles (S, a) [rad] measured so many seconds after the starts; not a number where the passage ends before."""
        ends = self.at + round(seconds / self.record.step)
        inside = ends < self.ends
        found = np.full((len(self.at), self.record.angles.shape[1]), np.nan)
        found[inside] = self.record.angles[ends[inside]]
        return found

    def naive(self) -> tuple[Array, Array]:
        """Errors (S, a) [rad] 1 s ahead of "the smoothed angle stays" and of "the smoothed rate stays"."""
        angles, rates = np.hsplit(self.motion, 2)
        stays = self.measured_ahead(1.0) - angles
        return stays, stays - rates

    def still(self, name: str) -> Array:
        """Errors (S, a) [rad] of "the measured angle stays" over the horizon of a figure; no future sample is in it."""
        return self.measured_ahead(HORIZONS[name]) - self.record.angles[self.at]

    def flown_again(self, seconds: float, laws: Sequence[Controller] = ()) -> list[Stretch]:
        """Stretches of so many seconds that plant and controller fly, each begun at the measured motion.

        The simulated voltages are the measured ones less what the controller's laws answer to delta, the simulated less
        the measured angles: what came from outside stays, and feedback cannot flatter the plant. delta and the voltages
        of each block of :data:`.settings.ROUND` s are found in turns, which is exact after one more than it has
        samples, as a voltage moves later angles only, and close to it after a few. Without ``laws`` the voltages are
        the measured ones.
        """
        record, rig, length = self.record, self.model.rig, round(seconds / self.record.step)
        block = max(1, round(ROUND / record.step))
        local, found, free = np.zeros_like(self.offset), list[Stretch](), 0
        for first, end, carry, motion in zip(self.at, self.ends, self.carries, self.motion, strict=True):
            if first < free or end - first < length:
                continue
            free, state, e = first + length, rig.placed(carry, motion), np.zeros((length, len(rig.axes)))
            inputs = record.inputs.copy()
            flown = replace(record, inputs=inputs)
            for start in range(0, length, block):
                rows = slice(first + start, min(first + start + block, free))
                stop = rows.stop - first
                for _ in range(stop - start + 1):
                    after = state.copy()
                    rig.filter(flown, self.model.parameters, rig.still, local, _NONE, rows.start, rows.stop, after,
                               e[start:stop], _NO_MOTION)  # fmt: skip
                    asked = record.inputs[rows] - _answered(laws, -e[:stop], record.step, rig.axes)[start:]
                    changed = float(np.abs(asked - inputs[rows]).max())
                    inputs[rows] = asked
                    if not changed > SETTLED:
                        break
                state = after
            found.append((int(first), e))
        return found

    def _ahead(self, states: Sequence[Array] | Array, K: Array, local: Array, steps: Sequence[int]) -> list[Array]:
        """Run on from every start without corrections; errors (S, a) after each number of ``steps``, ascending."""
        record, p = self.record, self.model.parameters
        errors = np.full((len(steps), len(self.at), len(local)), np.nan)
        buffer = np.empty((steps[-1] + 1, len(local)))
        for i, first in enumerate(self.at):
            count = min(steps[-1] + 1, self.ends[i] - first)
            state = np.array(states[i])
            self.model.rig.filter(record, p, K, local, _NONE, first, first + count, state, buffer[:count], _NO_MOTION)
            for j, ahead in enumerate(steps):
                if ahead < count:
                    errors[j, i] = buffer[ahead]
        return list(errors)


def _answered(laws: Sequence[Controller], delta: Array, h: float, axes: Sequence[str]) -> Array:
    """Voltages (n, 2) [V] that laws take away for angles that differ by ``delta`` (n, a) [rad]."""
    channels = np.zeros((len(delta), 2))
    for law in laws:
        sign, named, _ = CHANNELS[law.channel]
        late = np.vstack((np.zeros((round(law.delay / h), delta.shape[1])), delta))[: len(delta)]
        for axis, pole in zip(named, law.poles, strict=True):
            y, a = late[:, axes.index(axis)], float(np.exp(-pole * h))
            rate = lfilter([1.0, -1.0], [1.0, -a], y) * (1.0 - a) / h
            channels[:, int(sign < 0.0)] += law.gains[axis] * y + law.gains[f"{axis} rate"] * rate
            channels[:, int(sign < 0.0)] += law.gains.get(f"{axis} integral", 0.0) * h * np.cumsum(y)
    total, difference = channels.T
    return 0.5 * np.column_stack((total + difference, total - difference))


def run_along(
    model: Model, record: Record, offset: Array, passages: Sequence[tuple[int, int]] | None = None,
    states: Sequence[Array] = (),
) -> Run:  # fmt: skip
    """Run the filter of a model along a record and keep its state at the starts of predictions.

    Predictions lie within ``passages`` (first, last) [samples], by default the whole record; the filter settles in each
    of them before the first starts. ``states`` (n,) of the filter begin each passage; by default the filter runs on
    from the record's start. ``offset`` (a,) is the constant torque of the log [rad/s^2].
    """
    h, N = record.step, record.samples
    settle, shortest, apart = round(SETTLING / h), round(1.0 / h), max(1, round(SPACING / h))
    passages = [(0, N)] if passages is None else passages
    parts = [np.arange(a + settle, b - shortest, apart) for a, b in passages]
    at = np.array([k for own in parts for k in own], dtype=np.intp)
    ends = np.array([b for own, (_, b) in zip(parts, passages, strict=True) for _ in own], dtype=np.intp)
    e = np.zeros_like(record.angles)
    if states:
        kept = [_states(model, record, offset, own, e, state, first)
                for own, state, (first, _) in zip(parts, states, passages, strict=True)]  # fmt: skip
    else:
        kept = [_states(model, record, offset, np.append(at, N), e)[:-1]]
    return Run(model, record, offset, at, ends, np.concatenate(kept), e)


def _states(
    model: Model, record: Record, offset: Array, at: Iterable[int], e: Array, carry: Array | None = None, first: int = 0
) -> Array:
    """States (S, n) of the filter before the samples ``at``; fills the innovations ``e`` up to the last of them."""
    K = gains(model.filters(record.step))
    carry, carries = None if carry is None else carry.copy(), []
    for last in at:
        part = e[first:last]
        carry = model.rig.filter(record, model.parameters, K, offset, _NONE, first, last, carry, part, _NO_MOTION)
        carries.append(carry.copy())
        first = last
    return np.array(carries)


def made_by_itself(run: Run, seed: int = 0) -> Run | None:
    """Let a plant make a record of its own, and run its filter along it; None if it runs away everywhere.

    The record is made in pieces of SETTLING + BLOCK = 6 s under the measured inputs, each begun at the rig's own
    motion: in another air these inputs no longer hold the plant where it was, and the errors ahead depend on where it
    is. Pieces that run away from the rig by half a turn are left out.
    """
    model, record, offset = run.model, run.record, run.offset
    h, a, N = record.step, len(model.rig.axes), record.samples
    random = np.random.default_rng(seed)
    first, length = round(SETTLING / h), min(round((SETTLING + BLOCK) / h), N - round(SETTLING / h))
    firsts = range(first, N - length + 1, length)
    torque = offset + model.torque(h, N, random)
    minus, blank = np.zeros_like(record.angles), replace(record, angles=np.zeros_like(record.angles))
    passages, states = [], []
    for k, state in zip(firsts, _states(model, record, offset, firsts, np.empty_like(minus)), strict=True):
        rows = slice(k, k + length)
        state[-3 * a :] = 0.0
        own, last = state.copy(), k + length
        model.rig.filter(blank, model.parameters, model.rig.still, torque, _NONE, k, last, own, minus[rows], _NO_MOTION)
        if np.abs(minus[rows] + record.angles[rows]).max() < np.pi:
            passages.append((k, k + length))
            states.append(state)
    noise = model.encoder_errors(h, N, random)
    made = replace(record, angles=noise - minus)
    return run_along(model, made, offset, passages, states) if passages else None


def rms_figures(errors: Sequence[Array], spacing: float | Sequence[float], what: str = "errors") -> list[ErrorFigure]:
    """Root mean squares by column of errors (S_i, a) that lie ``spacing`` [s] apart, pooled over records.

    Rows that are not a number are left out.

    Raises
    ------
    LogError
        No row is left.
    """
    squares = [values[np.isfinite(values).all(1)] ** 2 for values in errors]
    spacings = [spacing] * len(squares) if isinstance(spacing, int | float) else list(spacing)
    if not sum(map(len, squares)):
        raise LogError(
            f"{what}: no passage of the logs is long enough for it, behind {SETTLING:g} s in which the filter settles "
            "and outside of what is left out; give longer logs, or keep the events."
        )
    low, high = np.sqrt(np.quantile(segment_means(squares, spacings), (0.025, 0.975), axis=0))
    centre = np.sqrt(np.concatenate(squares).mean(axis=0))
    return [ErrorFigure(float(c), float(a), float(b)) for c, a, b in zip(centre, low, high, strict=True)]


def segment_means(values: Sequence[Array], spacings: Sequence[float]) -> Array:
    """Means of values (S_i, ...), ``spacings`` [s] apart, over segments drawn at random, shape (DRAWS, ...)."""
    totals, lengths = [], []
    for own, apart in zip(values, spacings, strict=True):
        if len(own):
            starts = np.arange(0, len(own), max(1, round(BLOCK / apart)))
            totals.append(np.add.reduceat(own, starts, axis=0))
            lengths.append(np.diff([*starts, len(own)]).astype(float))
    total, length = np.concatenate(totals), np.concatenate(lengths)
    times = np.random.default_rng(0).multinomial(len(total), np.full(len(total), 1.0 / len(total)), DRAWS).astype(float)
    return (times @ total) / (times @ length).reshape(-1, *(1,) * (total.ndim - 1))
