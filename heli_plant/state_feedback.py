"""Sampled state feedback with a Kalman filter: LQR, or LQI with integrals, of elevation and of travel or pitch.

About an operating point, with deviations y of the angles [rad] and u of the voltages [V], the period h and m whole
periods of input delay, the controller reads the angles of t_k while u_k is held, and finds the voltages of t_{k+1}:

    x_{k+1} = F x_k + G u_{k-m} + L (y_k - C x_k)                  the estimate, one period ahead
    z_{k+1} = z_k + h (s_k - r_k)                                  integrals of elevation and of travel or pitch
    x~      = x_{k+1} through F and G by u_{k+1-m} ... u_k         the estimate when these voltages have arrived
    u_{k+1} = N r_k - K x~ - K_z z_{k+1}                           clipped to the motors' limit

x holds pitch, elevation, travel, their rates, and the lagged voltages of both motors. The estimate uses the voltages
after saturation, so it does not wind up. An integral stops while it would drive a voltage further beyond its limit. The
prediction includes the period between reading and acting, and the input delay.

Source: K. J. Astrom and B. Wittenmark, Computer-Controlled Systems, 1997, sections 4.5 (delays), 11.3 and 11.4.
"""

from math import isfinite
from typing import Any, NamedTuple, TypeVar

from .errors import PlantError
from .motor import saturate

MOST_DELAY = 8  # largest input delay in periods: the controller keeps the voltages of so many periods
LENGTH_TOLERANCE = 1e-6  # of a step, as a share of the period


class Motion(NamedTuple):
    """One number for each state of the plant's motion: deviations, or a row of a matrix."""

    pitch: float = 0.0
    elevation: float = 0.0
    travel: float = 0.0
    pitch_rate: float = 0.0
    elevation_rate: float = 0.0
    travel_rate: float = 0.0
    nu_front: float = 0.0
    nu_rear: float = 0.0


class Rotors(NamedTuple):
    """One number for each rotor: voltages [V], or a row of a matrix."""

    front: float = 0.0
    rear: float = 0.0


class Angles(NamedTuple):
    """One number for each measured angle: deviations [rad], or a row of a matrix."""

    pitch: float = 0.0
    elevation: float = 0.0
    travel: float = 0.0


class Pair(NamedTuple):
    """One number for the elevation, one for the other controlled angle: travel or pitch."""

    elevation: float = 0.0
    other: float = 0.0


_Row = TypeVar("_Row")
Eight = tuple[_Row, _Row, _Row, _Row, _Row, _Row, _Row, _Row]
"""A matrix of one row for each state, or the voltages of the last :data:`MOST_DELAY` periods."""
Two = tuple[_Row, _Row]  # a matrix of one row for each rotor


def repeat_row(row: _Row) -> Eight[_Row]:
    """Return the same row for each state."""
    return row, row, row, row, row, row, row, row


class FeedbackSettings(NamedTuple):
    """Settings of the controller above, with matrices row by row; by default it holds both rotors at ``hover``."""

    transition: Eight[Motion] = repeat_row(Motion())  # F
    drive: Eight[Rotors] = repeat_row(Rotors())  # G
    innovation: Eight[Angles] = repeat_row(Angles())  # L
    gain: Two[Motion] = (Motion(), Motion())  # K
    integral: Two[Pair] = (Pair(), Pair())  # K_z
    reference: Two[Pair] = (Pair(), Pair())  # N
    point: Angles = Angles()  # angles of the operating point [rad]
    hover: Rotors = Rotors()  # its voltages [V]
    period: float = 0.01  # h [s]
    delay: int = 0  # m
    travel_enabled: bool = False  # the travel is controlled and not the pitch
    voltage_limit: float = 5.0  # [V]


class FeedbackState(NamedTuple):
    """Deviations from the operating point."""

    estimate: Motion
    integrals: Pair  # [rad s]
    now: Rotors  # voltages [V]
    before: Eight[Rotors]  # those one to eight periods ago


class SampledFeedback(NamedTuple):
    """The controller between two samples."""

    state: FeedbackState
    samples: int  # number of samples so far
    v_front: float  # voltages at its outputs [V]
    v_rear: float


def start_feedback(pitch: float, elevation: float, travel: float, s: FeedbackSettings) -> FeedbackState:
    """Return the first state: the rig rests at these angles [rad] under the voltages of the operating point."""
    deviation = Motion(pitch - s.point.pitch, elevation - s.point.elevation, travel - s.point.travel)
    return FeedbackState(deviation, Pair(), Rotors(), repeat_row(Rotors()))


def sample_and_hold(
    held: SampledFeedback, time: float, step: float, early: float, angles: Angles,
    references: tuple[float, float, float], added: Rotors, s: FeedbackSettings,
) -> SampledFeedback:  # fmt: skip
    """Return the controller after a step of ``step`` [s] from ``time`` [s] since the start, with a sample if it is due.

    It is due up to ``early`` [s] before its instant, because hosts round their times. New voltages appear at the
    sampling instant after that of their angles, however short the step is. PlantError if they are not finite, or if the
    step is longer than a period.
    """
    if step > (1.0 + LENGTH_TOLERANCE) * s.period:
        raise PlantError(
            f"a step of {step:g} s leaves out samples of sample.time = {s.period:g} s; take steps no longer"
        )
    state, samples = held.state, held.samples
    if time >= samples * s.period - early:
        state = feedback_step(state, angles.pitch, angles.elevation, angles.travel, references, added, s)
        samples = samples + 1
    if not isfinite(state.now.front + state.now.rear):
        raise PlantError(f"no finite voltages follow at {time:g} s; check the transition and innovation matrices")
    if time + step >= samples * s.period - early:
        return SampledFeedback(state, samples, s.hover.front + state.now.front, s.hover.rear + state.now.rear)
    return SampledFeedback(state, samples, held.v_front, held.v_rear)


def feedback_step(
    state: FeedbackState, pitch: float, elevation: float, travel: float, references: tuple[float, float, float],
    added: Rotors, s: FeedbackSettings,
) -> FeedbackState:  # fmt: skip
    """Return the state one period later; its ``now`` is what to add to ``hover`` in the next period [V].

    Angles and ``references`` [rad]; of pitch and travel only the controlled one counts. ``added`` is an excitation [V].
    """
    x, angles = state.estimate, (pitch, elevation, travel)
    innovation = Angles._make([y - point - angle for y, point, angle in zip(angles, s.point, x[:3], strict=True)])
    predicted = _advance_motion(x, _delayed_voltages(state, s.delay), s)
    estimate = Motion._make([x_i + _dot(L, innovation) for x_i, L in zip(predicted, s.innovation, strict=True)])
    delayed = estimate  # the estimate when the voltages on their way have arrived
    for k in range(s.delay):
        delayed = _advance_motion(delayed, _delayed_voltages(state, s.delay - 1 - k), s)
    reference = Pair(references[1] - s.point.elevation, _other_deviation(references[0], references[2], s))
    errors = Pair(elevation - references[1], _other_deviation(pitch, travel, s) - reference.other)
    old = state.integrals
    unlimited = Rotors._make(
        [
            excitation + _dot(N, reference) - _dot(K, delayed) - _dot(K_z, old)
            for excitation, N, K, K_z in zip(added, s.reference, s.gain, s.integral, strict=True)
        ]
    )
    integrals = Pair._make(
        [
            z if _drives_beyond(unlimited, Rotors(of_front, of_rear), error, s) else z + s.period * error
            for z, error, of_front, of_rear in zip(old, errors, s.integral[0], s.integral[1], strict=True)
        ]
    )
    change = Pair(integrals.elevation - old.elevation, integrals.other - old.other)
    now = Rotors._make(
        [
            saturate(hover + u - _dot(K_z, change), s.voltage_limit) - hover
            for hover, u, K_z in zip(s.hover, unlimited, s.integral, strict=True)
        ]
    )
    return FeedbackState(estimate, integrals, now, (state.now, *state.before[:-1]))


def _advance_motion(x: Motion, u: Rotors, s: FeedbackSettings) -> Motion:
    """F x + G u."""
    return Motion._make([_dot(F, x) + _dot(G, u) for F, G in zip(s.transition, s.drive, strict=True)])


def _delayed_voltages(state: FeedbackState, periods: int) -> Rotors:
    """Return the voltages [V] of so many periods ago."""
    for age, voltages in enumerate((state.now, *state.before)):
        if age >= periods:
            return voltages
    return state.before[-1]


def _other_deviation(of_pitch: float, of_travel: float, s: FeedbackSettings) -> float:
    """Return the deviation of the second controlled angle, travel or pitch [rad]."""
    return of_travel - s.point.travel if s.travel_enabled else of_pitch - s.point.pitch


def _drives_beyond(u: Rotors, gains: Rotors, error: float, s: FeedbackSettings) -> bool:
    """Return whether an integral that grows with ``error`` drives a voltage further beyond its limit."""
    front, rear = s.hover.front + u.front, s.hover.rear + u.rear
    beyond_front, beyond_rear = front - saturate(front, s.voltage_limit), rear - saturate(rear, s.voltage_limit)
    return -gains.front * error * beyond_front > 0.0 or -gains.rear * error * beyond_rear > 0.0


def _dot(row: Any, x: Any) -> float:
    """Return the product of a row and a vector, added from left to right."""
    total = 0.0
    for a, b in zip(row, x, strict=True):
        total = total + a * b
    return total
