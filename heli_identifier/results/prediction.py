"""One model along one record: its filter, its predictions, and a record that it simulates itself.

From every start t_i, :data:`SPACING` apart, the plant is simulated under the measured inputs. Its error is

    e_ij = y_j(t_i + H) - y_hat_j(t_i + H | t_i),    j an axis.

For H = .1 and .2 s it starts from the state of the filter. This state includes the torque of the air, which then decays
by its own dynamics. For H = 1 and 2 s it starts from angles and rates of a local cubic over .4 s (Savitzky and Golay
1964), which needs no model, and without a torque of the air. Under a controller the measured inputs answer the air
within 1 s: the figures of 1 and 2 s are then no predictions, and decide nothing.

One compiled loop serves all cases: a filter with zero gains is the plant alone, and its innovations are its errors.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from heli_identifier.chain import CHANNELS, Controller, smooth_motion
from heli_identifier.tracing.fit import Fit, fit
from heli_identifier.tracing.helicopter import Rig
from heli_identifier.tracing.noise import SHAPES, AxisFilter, filter_gains, filters
from heli_identifier.tracing.rig import Array, Parameters, Record
from heli_identifier.tracing.settings import BLOCK, COLOURED, PER_LOG, SETTLING

SPACING = 0.25
"""Time [s] from one prediction's start to the next; errors of predictions that overlap are correlated."""

SMOOTHING = 0.4
"""Length [s] of the local cubics that a prediction starts from: they keep .99 of a motion at 1 Hz."""

STRETCH = 3.0
"""Length [s] of the stretches that plant and controller fly again."""

LOOP_BLOCK, LOOP_TOLERANCE = 0.2, 1e-4
"""Length [s] of the blocks in which the loop is solved, and the last change of the voltages [V] of a solved block."""

FROM_FILTER: Mapping[str, float] = {"ahead_100ms": 0.1, "ahead_200ms": 0.2}
FROM_MOTION: Mapping[str, float] = {"prediction_1s": 1.0, "prediction_2s": 2.0}
"""Horizon [s] of each figure: of those that start from the filter's state, and from the smoothed motion."""

HORIZONS = {**FROM_FILTER, **FROM_MOTION}

_NO_SINES, _NO_MOTION = np.empty((0, 4)), np.empty((0, 6))


@dataclass(frozen=True, eq=False)
class Model:
    """A plant with the noise of its training logs: air z (5, a), encoders (a,) [rad], the logs' spread tau (5a,)."""

    rig: Rig
    parameters: Parameters
    z: Array
    encoder_noise: Array
    widths: Array

    @classmethod
    def of(cls, fitted: Fit) -> "Model":
        """Take plant and noise from a fit; an axis without a counted sample has the noise of its encoder's resolution.

        A torque that is periodic in time does not belong to the plant, because its phase in another log is not known:
        the air is fitted once more without it.
        """
        likelihood = fitted.likelihood
        if fitted.point.harmonics:
            fitted = fit(likelihood, (), replace(fitted, point=replace(fitted.point, harmonics=())))
        r = np.where(fitted.likelihood.counts, fitted.encoder_noise(), likelihood.rig.resolution / np.sqrt(12.0))
        return cls(likelihood.rig, fitted.parameters, fitted.point.z, r, likelihood.widths)

    @classmethod
    def alone(cls, rig: Rig, parameters: Parameters) -> "Model":
        """Take a plant without a fit; its air is the prior's, which holds for any rig."""
        a = len(rig.axes)
        return cls(rig, parameters, np.zeros((SHAPES, a)), rig.resolution / np.sqrt(12.0), np.repeat(PER_LOG, a))

    def filters(self, step: float) -> list[AxisFilter]:
        """Return the axes' filters at a sampling interval [s]."""
        return filters(step, self.rig.linear(self.parameters), self.rig.air(self.z))

    def scales(self, step: float) -> Array:
        """Return the standard deviations (a,) [rad] of the innovations at a sampling interval [s]."""
        return self.encoder_noise * np.sqrt([axis.S for axis in self.filters(step)])

    def noise(self, record: Record, seed: int) -> tuple[Array, Array]:
        """Draw the torque of the air [rad/s^2] and the errors of the encoders [rad] of a simulated record, (N, a).

        The torque x+ = F x + w is stationary from its first sample.
        """
        random, axes, columns = np.random.default_rng(seed), self.filters(record.step), []
        for axis, level in zip(axes, self.rig.air(self.z)[0] * self.encoder_noise, strict=True):
            F = axis.F
            values, vectors = np.linalg.eigh(np.eye(2) - F @ F.T)
            w = random.standard_normal((record.samples, 2))
            w[1:] = w[1:] * np.sqrt(np.maximum(values, 0.0)) @ vectors.T
            poles = [1.0, -np.trace(F), np.linalg.det(F)]
            d = lfilter([1.0, -F[1, 1]], poles, w[:, 0]) + lfilter([0.0, F[0, 1]], poles, w[:, 1])
            columns.append(level * d)
        errors = np.column_stack([encoder_error(axis, record.samples, random) for axis in axes])
        return np.column_stack(columns), self.encoder_noise * errors

    def run(
        self, record: Record, K: Array, torque: Array, first: int, last: int, carry: Array | None
    ) -> tuple[Array, Array]:
        """Filter some samples of a record with gains ``K``; give the state after them, and the innovations.

        ``torque`` [rad/s^2] acts in addition to the air: constant (a,), or a row per sample (N, a).
        """
        e = np.empty((last - first, len(self.rig.axes)))
        state = None if carry is None else carry.copy()
        after = self.rig.filter(record, self.parameters, K, torque, _NO_SINES, first, last, state, e, _NO_MOTION)
        return after, e


def encoder_error(axis: AxisFilter, count: int, random: np.random.Generator) -> Array:
    """Draw the encoder's error over r, shape (count,), stationary from its first sample."""
    decay, w = axis.A[4, 4], random.standard_normal((count, 2)) * np.sqrt((COLOURED, 1.0 - COLOURED))
    w[1:, 0] *= np.sqrt(1.0 - decay * decay)
    return np.asarray(lfilter([1.0], [1.0, -decay], w[:, 0]) + w[:, 1])


def clear_passages(record: Record) -> list[tuple[int, int]]:
    """Return the passages of a record, in samples, outside of what is left out."""
    clear = np.ones(record.samples, dtype=bool)
    for start, end in record.left_out:
        clear[(record.time >= start) & (record.time <= end)] = False
    edges = np.flatnonzero(np.diff(np.concatenate(([False], clear, [False])))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


Answer = Callable[[Array, float], Array]
"""Takes deviations (n, a) [rad] and the time between them [s], gives the voltages (n, 2) [V] that answer them."""

Passage = tuple[int, int, Array | None]
"""First sample of a passage that holds predictions, the sample after it, and the filter's state (21,) before it."""


@dataclass(frozen=True, eq=False)
class Run:
    """A model's filter along a record, under the constant torque ``offset`` (a,) [rad/s^2]."""

    model: Model
    record: Record
    aligned: Record
    """The record with the log's own start and zeros, along which the filter runs."""
    offset: Array
    torque: Array
    """Torque [rad/s^2] in addition to the air: the offset (a,), or (N, a) if the record has pushes."""
    passages: Sequence[Passage]
    """In each of them the filter settles before the first prediction starts."""

    @classmethod
    def along(
        cls, model: Model, record: Record, offset: Array, aligned: Record | None = None, pushes: Sequence[float] = ()
    ) -> "Run":
        """Run a model's filter along a record; predictions lie in its clear passages.

        ``pushes`` are the sizes [rad/s^2] of the torques of :attr:`.Record.pushes`.
        """
        run = cls(model, record, aligned or record, offset, record.torque(offset, pushes), ())
        clear = clear_passages(record)
        states = run.states([first for first, _ in clear])
        passages = [(first, last, state) for (first, last), state in zip(clear, states, strict=True)]
        return replace(run, passages=passages)

    @cached_property
    def gains(self) -> Array:
        """Gains of the filter."""
        return filter_gains(self.model.filters(self.record.step))

    @cached_property
    def innovations(self) -> Array:
        """Innovations [rad] of the whole record, shape (N, a)."""
        return self.model.run(self.aligned, self.gains, self.torque, 0, self.record.samples, None)[1]

    def states(self, samples: Iterable[int], first: int = 0, state: Array | None = None) -> list[Array]:
        """Return the filter's states before samples in ascending order; ``state``: that before the ``first`` sample."""
        found = list[Array]()
        for sample in samples:
            state, _ = self.model.run(self.aligned, self.gains, self.torque, first, sample, state)
            first = sample
            found.append(state)
        return found

    @cached_property
    def starts(self) -> list[tuple[int, int, Array]]:
        """Of each prediction: its first sample, the end of its passage, and the filter's state before it."""
        h, found = self.record.step, list[tuple[int, int, Array]]()
        for first, last, state in self.passages:
            at = range(first + round(SETTLING / h), last - round(1.0 / h), max(1, round(SPACING / h)))
            found += [(k, last, before) for k, before in zip(at, self.states(at, first, state), strict=True)]
        return found

    @cached_property
    def at(self) -> NDArray[np.intp]:
        """Samples at which predictions start, shape (S,)."""
        return np.array([k for k, _, _ in self.starts], dtype=np.intp)

    @cached_property
    def motion(self) -> Array:
        """Smoothed angles [rad] and rates [rad/s] at the starts, shape (S, 2a)."""
        return smooth_motion(self.record.angles, self.record.step, SMOOTHING)[self.at]

    def measured(self, seconds: float) -> Array:
        """Return the measured angles (S, a) [rad] some ``seconds`` after the starts; NaN if the passage ends before."""
        n, unknown = round(seconds / self.record.step), np.full(len(self.offset), np.nan)
        later = [self.record.angles[k + n] if k + n < last else unknown for k, last, _ in self.starts]
        return np.array(later).reshape(-1, len(unknown))

    def errors(self) -> dict[str, Array]:
        """Return the errors (S, a) [rad] of every figure by its name; NaN if the passage ends before."""
        K, rig = self.gains.copy(), self.model.rig
        K[:, [0, 1, 2, 3, 8]] = 0.0  # no innovation corrects the state; the air and the encoder's error decay
        states = [state for _, _, state in self.starts]
        placed = [rig.state_in_motion(state, motion) for state, motion in zip(states, self.motion, strict=True)]
        # the filter's state before a sample is predicted from the sample before it: one step less is left
        near = self._ahead(self.aligned, states, K, self.offset, FROM_FILTER, -1)
        return near | self._ahead(self.record, placed, rig.still, np.zeros_like(self.offset), FROM_MOTION, 0)

    def _ahead(
        self, record: Record, states: Sequence[Array], K: Array, torque: Array, horizons: Mapping[str, float],
        shift: int,
    ) -> dict[str, Array]:  # fmt: skip
        """Simulate from every start; give the errors (S, a) at each horizon, ``shift`` samples later."""
        steps = {name: max(round(H / record.step), 1) + shift for name, H in horizons.items()}
        errors = {name: np.full((len(states), len(torque)), np.nan) for name in horizons}
        for i, ((k, last, _), state) in enumerate(zip(self.starts, states, strict=True)):
            _, e = self.model.run(record, K, torque, k, min(k + max(steps.values()) + 1, last), state)
            for name, ahead in steps.items():
                errors[name][i] = e[ahead] if ahead < len(e) else np.nan
        return errors

    def fly_again(self, seconds: float, answer: Answer | None = None) -> tuple[list[int], Array]:
        """Fly stretches of some ``seconds`` from the measured motion; return first samples and errors (S, n, a) [rad].

        The simulated voltages are the measured ones plus the controller's ``answer`` to delta, the simulated less the
        measured angles. What came from outside stays in the voltages, and feedback cannot flatter the plant.
        delta and the voltages of each block of :data:`LOOP_BLOCK` s are computed in turns. A voltage moves later angles
        only, so the result is exact after one turn more than the block has samples, and close after a few. Without an
        ``answer`` the voltages are the measured ones.
        """
        record, rig, length = self.record, self.model.rig, round(seconds / self.record.step)
        block, no_torque = max(1, round(LOOP_BLOCK / record.step)), np.zeros_like(self.offset)
        firsts, errors, end = list[int](), list[Array](), 0
        for (first, last, carry), motion in zip(self.starts, self.motion, strict=True):
            if first < end or last - first < length:
                continue
            end, state, e = first + length, rig.state_in_motion(carry, motion), np.zeros((length, len(no_torque)))
            flown = replace(record, inputs=record.inputs.copy())
            for done in range(0, length, block):
                rows = slice(first + done, min(first + done + block, end))
                for _ in range(block + 1):
                    after, e[done : done + block] = self.model.run(
                        flown, rig.still, no_torque, rows.start, rows.stop, state
                    )
                    answered = answer(-e[: done + block], record.step)[done:] if answer else 0.0
                    voltages = record.inputs[rows] + answered
                    change = float(np.abs(voltages - flown.inputs[rows]).max())
                    flown.inputs[rows] = voltages
                    if not change > LOOP_TOLERANCE:
                        break
                state = after
            firsts.append(first)
            errors.append(e)
        return firsts, np.array(errors).reshape(-1, length, len(no_torque))


def answer_deviation(laws: Sequence[Controller], delta: Array, h: float) -> Array:
    """Return the voltages (n, 2) [V] with which laws answer angles that differ by ``delta`` (n, a) [rad]."""
    volts = np.zeros((len(delta), 2))
    for law in laws:
        volts += 0.5 * law.answer(delta, h)[:, None] * np.array([1.0, CHANNELS[law.channel][0]])
    return volts


def simulate_record(run: Run, seed: int = 0) -> Run | None:
    """Let a plant simulate a record with drawn noise, and run its filter along it; None if the record is too short.

    The record is simulated in pieces of SETTLING + BLOCK = 6 s under the measured inputs. Each piece starts at the
    rig's measured motion: in another air these inputs do not keep the plant at its place, and the errors ahead depend
    on the place. A piece ends where it differs from the rig by half a turn.
    """
    model, record, settle = run.model, run.aligned, round(SETTLING / run.record.step)
    length = min(round((SETTLING + BLOCK) / record.step), record.samples - settle)
    (torque, noise), angles, passages = model.noise(record, seed), record.angles.copy(), list[Passage]()
    blank, firsts = replace(record, angles=np.zeros_like(angles)), range(settle, record.samples - length + 1, length)
    for k, state in zip(firsts, run.states(firsts), strict=True):
        state[-3 * len(run.offset) :] = 0.0  # the filter's air: another one is drawn
        _, minus_angles = model.run(blank, model.rig.still, run.offset + torque, k, k + length, state)
        away = ~(np.abs(minus_angles + record.angles[k : k + length]) < np.pi).all(1)  # not a number counts as away
        count = int(away.argmax()) if away.any() else length
        angles[k : k + count] = -minus_angles[:count]
        passages.append((k, k + count, state))
    simulated = replace(record, angles=angles + noise)
    return Run(model, simulated, simulated, run.offset, run.offset, passages) if passages else None
