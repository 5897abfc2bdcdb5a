"""The plant over a record, compiled: alone, under the corrections of a filter, and its accelerations.

The filter's loop runs over the samples of a record with the plant's own step,

    x+ = RK4(x, v; p) + G d + (h^2/2, h) b,    d+ = F d,    n+ = phi n,    y = angle + n,    e = y - y_hat,

and corrects state, torque d and the encoder's error n by the innovation e. b are further torques: a constant one and
sines. With gains of zero the plant runs alone.

A record has ``time`` (N,) [s], ``inputs`` (N, 2) [V], ``angles`` (N, 3) [rad], ``step`` [s] and ``start`` (12,), the
state at its first sample.
"""

from collections.abc import Sequence
from math import cos, sin
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .compiled import PARAMETER_DTYPE, compile_function, parameter_record, read_only
from .laws import motor_input, motor_time_constant, switched_on, thrust_voltages
from .motor import approach, decay_factor
from .parameters import PlantParameters
from .plant import accelerations, advance, delayed_input, measured_angles, rigid_start
from .state import PlantState, shift_motion

Array = NDArray[np.float64]

STATES = len(PlantState._fields)
ALONE = np.zeros((3, 14))  # gains of a filter that corrects nothing, in calm air


def _filter(
    time: Any, inputs: Any, angles: Any, first: int, last: int, carry: Any, h: float, p: Any, gains: Any, local: Any,
    harmonics: Any, innovations: Any, motion: Any,
) -> None:  # fmt: skip
    """Fill ``innovations`` (last - first, 3) and ``motion`` (same or 0, m): the first m states after the correction."""
    state = PlantState(
        carry[0], carry[1], carry[2], carry[3], carry[4], carry[5],
        carry[6], carry[7], carry[8], carry[9], carry[10], carry[11],
    )  # fmt: skip
    d, c, n = carry[12:15], carry[15:18], carry[18:21]  # changed in place
    b, x, w = np.empty(3), np.empty(3), np.empty(3)
    for k in range(first, last):
        i, row = k - first, min(k, len(local) - 1)
        e, predicted = innovations[i], measured_angles(state)
        for a in range(3):
            e[a] = angles[k, a] - predicted[a] - n[a]
            x[a], w[a] = gains[a, 0] * e[a], gains[a, 1] * e[a]
            d[a], c[a] = d[a] + gains[a, 2] * e[a], c[a] + gains[a, 3] * e[a]
            b[a] = local[row, a]
        state = shift_motion(state, x, w)
        if i < len(motion):
            for j in range(motion.shape[1]):
                motion[i, j] = state[j]
        for j in range(len(harmonics)):
            phase = harmonics[j, 1] * time[k]
            b[int(harmonics[j, 0])] += harmonics[j, 2] * sin(phase) + harmonics[j, 3] * cos(phase)
        state = advance(state, time, inputs, k, 0.0, h, p)
        for a in range(3):
            x[a] = gains[a, 10] * d[a] + gains[a, 11] * c[a] + 0.5 * h * h * b[a]
            w[a] = gains[a, 12] * d[a] + gains[a, 13] * c[a] + h * b[a]
            d[a], c[a] = gains[a, 4] * d[a] + gains[a, 5] * c[a], gains[a, 6] * d[a] + gains[a, 7] * c[a]
            n[a] = gains[a, 9] * (n[a] + gains[a, 8] * e[a])
        state = shift_motion(state, x, w)
    for i in range(STATES):
        carry[i] = state[i]


def _accelerations(
    time: Any, inputs: Any, motion: Any, first: int, carry: Any, h: float, plants: Any, out: Any
) -> None:  # fmt: skip
    """Fill ``out`` (3, m, n); the arguments are those of :func:`run_accelerations`."""
    half = 0.5 * h
    for j in range(len(plants)):
        p, front, rear = plants[j], carry[j, 0], carry[j, 1]
        switches, decay = switched_on(p), decay_factor(half, motor_time_constant(p))
        for i in range(len(motion)):
            k = first + i
            v_front, v_rear = delayed_input(time, inputs, k, time[k], h, p)
            u_front, u_rear = motor_input(v_front, p), motor_input(v_rear, p)
            front, rear = approach(front, u_front, decay), approach(rear, u_rear, decay)
            mu_diff, mu_sum = thrust_voltages(front, rear, time[k] + half, p)
            w1, w2, w3 = motion[i, 3], motion[i, 4], motion[i, 5]
            out[0, j, i], out[1, j, i], out[2, j, i] = accelerations(
                time[k] + half, motion[i, 0] + half * w1, motion[i, 1] + half * w2, motion[i, 2] + half * w3,
                w1, w2, w3, mu_diff, mu_sum, 0.0, carry[j, 2], switches, p,
            )  # fmt: skip
            front, rear = approach(front, u_front, decay), approach(rear, u_rear, decay)
        carry[j, 0], carry[j, 1] = front, rear


def run_filter(
    record: Any, parameters: PlantParameters, gains: Array, local: Array, harmonics: Array, first: int, last: int,
    carry: Array | None, innovations: Array, motion: Array,
) -> Array:  # fmt: skip
    """Run the filter over samples ``first`` to ``last`` of a record; return ``carry``, changed in place.

    ``carry``, shape (21,), is the state after the last sample: that of the plant, then d, its companion and n of all
    axes; None at the record's beginning. Each row of ``gains``, shape (3, 14), holds for one axis: K of angle, rate, d
    and companion, F, K of n, phi, and G, matrices row by row. ``local`` are further torques [rad/s^2], shape (3,), or
    (N, 3) with one row for each sample.
    """
    if carry is None:
        start = rigid_start(PlantState(*(float(value) for value in record.start)), parameters)
        carry = np.concatenate((np.array(start, dtype=float), np.zeros(9)))
    compile_function(_filter, parameters)(
        read_only(record.time), read_only(record.inputs), read_only(record.angles), first, last, carry, record.step,
        parameter_record(parameters), read_only(gains), read_only(np.atleast_2d(local)), read_only(harmonics),
        innovations, motion,
    )  # fmt: skip
    return carry


def simulate(
    voltages: ArrayLike, h: float, start: ArrayLike, parameters: PlantParameters, torque: Array | None = None
) -> tuple[Array, Array]:
    """Simulate the plant alone under ``voltages`` (N, 2) [V], held ``h`` [s] each, and a further ``torque`` [rad/s^2].

    ``start`` is the state at t = 0 with the elevation that the encoder reads. Returns states (N, 12) and angles (N, 3)
    [rad] of the encoders' shafts, without quantisation. ValueError: shapes do not fit.
    """
    voltages = read_only(voltages)
    count = len(voltages)
    if voltages.shape != (count, 2):
        raise ValueError(f"voltages of shape {voltages.shape} must be (N, 2)")
    time, angles = np.arange(count) * float(h), np.zeros((count, 3))
    record = SimpleNamespace(step=float(h), time=time, inputs=voltages, angles=angles, start=start)
    torque = np.zeros(3) if torque is None else torque
    errors, states = np.empty((count, 3)), np.empty((count, STATES))
    run_filter(record, parameters, ALONE, torque, np.empty((0, 4)), 0, count, None, errors, states)
    return states, 0.0 - errors


def run_accelerations(
    record: Any, plants: Sequence[PlantParameters], motion: Array, first: int = 0, carry: Array | None = None
) -> tuple[Array, Array]:
    """Return the accelerations (3, m, n) [rad/s^2] of m plants at the middle of each step along a motion (n, 6).

    The second result is ``carry`` (m, 3), changed in place: the lagged voltages [V] after the last step, and the travel
    at which the cable is slack [rad]; None at the record's beginning.
    """
    if carry is None:
        carry = np.tile([record.start[6], record.start[7], record.start[11]], (len(plants), 1))
    out = np.empty((3, len(plants), len(motion)))
    compile_function(_accelerations, *plants)(
        read_only(record.time), read_only(record.inputs), read_only(motion), first, carry, record.step,
        np.array([tuple(p) for p in plants], dtype=PARAMETER_DTYPE), out,
    )  # fmt: skip
    return out, carry
