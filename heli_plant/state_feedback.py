"""Sampled state feedback with a Kalman filter: LQR, or LQI with integrals, of elevation and of travel or pitch.

About an operating point, with deviations y of the angles [rad] and u of the voltages [V], the period h and m whole
periods of input delay, the controller reads the angles of t_k while u_k is held, and finds the voltages of t_{k+1}:

    x_{k+1} = F x_k + G u_{k-m} + L (y_k - C x_k)                  the estimate, one period ahead
    z_{k+1} = z_k + h (s_k - r_k)                                  integrals of elevation and of travel or pitch
    x~      = x_{k+1} through F and G by u_{k+1-m} ... u_k         what these voltages still have to do
    u_{k+1} = N r_k - K x~ - K_z z_{k+1}                           clipped to the motors' limit

x holds pitch, elevation, travel, their rates, and the lagged voltages of both motors. The estimate is told the voltages
that the motors got, so nothing winds up in it where they saturate; an integral stops while it would drive a voltage
further beyond its limit. The period between reading and acting, and the input delay, are in the prediction.

Source: K. J. Astrom and B. Wittenmark, Computer-Controlled Systems, 1997, sections 4.5 (delays), 11.3 and 11.4.
"""

from typing import NamedTuple

from .motor import saturate

MOST_DELAY = 8
"""Most periods of input delay: the controller keeps the voltages of so many periods."""


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


class Transition(NamedTuple):
    """F, row by row."""

    pitch: Motion = Motion()
    elevation: Motion = Motion()
    travel: Motion = Motion()
    pitch_rate: Motion = Motion()
    elevation_rate: Motion = Motion()
    travel_rate: Motion = Motion()
    nu_front: Motion = Motion()
    nu_rear: Motion = Motion()


class Drive(NamedTuple):
    """G, row by row [1/V]."""

    pitch: Rotors = Rotors()
    elevation: Rotors = Rotors()
    travel: Rotors = Rotors()
    pitch_rate: Rotors = Rotors()
    elevation_rate: Rotors = Rotors()
    travel_rate: Rotors = Rotors()
    nu_front: Rotors = Rotors()
    nu_rear: Rotors = Rotors()


class Innovation(NamedTuple):
    """L, row by row."""

    pitch: Angles = Angles()
    elevation: Angles = Angles()
    travel: Angles = Angles()
    pitch_rate: Angles = Angles()
    elevation_rate: Angles = Angles()
    travel_rate: Angles = Angles()
    nu_front: Angles = Angles()
    nu_rear: Angles = Angles()


class Gain(NamedTuple):
    """K: what a state takes from each rotor's voltage."""

    front: Motion = Motion()
    rear: Motion = Motion()


class PairGain(NamedTuple):
    """K_z and N: what an integral takes from, and a reference adds to, each rotor's voltage."""

    front: Pair = Pair()
    rear: Pair = Pair()


class FeedbackSettings(NamedTuple):
    """The controller of this module's head; by default it holds both rotors at ``hover``.

    ``point`` are the angles [rad] and ``hover`` the voltages [V] of the operating point, ``period`` h [s], ``delay`` m,
    ``travel_enabled`` whether the travel is controlled and not the pitch, ``voltage_limit`` [V].
    """

    transition: Transition = Transition()
    drive: Drive = Drive()
    innovation: Innovation = Innovation()
    gain: Gain = Gain()
    integral: PairGain = PairGain()
    reference: PairGain = PairGain()
    point: Angles = Angles()
    hover: Rotors = Rotors()
    period: float = 0.01
    delay: int = 0
    travel_enabled: bool = False
    voltage_limit: float = 5.0


class FeedbackState(NamedTuple):
    """The estimate, the integrals [rad s], and the voltages' deviations [V] now and up to eight periods ago."""

    estimate: Motion
    integrals: Pair
    now: Rotors
    ago_1: Rotors
    ago_2: Rotors
    ago_3: Rotors
    ago_4: Rotors
    ago_5: Rotors
    ago_6: Rotors
    ago_7: Rotors
    ago_8: Rotors


class Held(NamedTuple):
    """A controller between its samples: its state, how many samples it took, the voltages that it shows [V]."""

    state: FeedbackState
    samples: int
    v_front: float
    v_rear: float


EARLY = 1e-6
"""A sample is due this share of a period before its instant, because communication points k H have rounding errors."""


def start_feedback(pitch: float, elevation: float, travel: float, s: FeedbackSettings) -> FeedbackState:
    """State without a history: the rig rests at the angles [rad], its voltages are those of the operating point."""
    still = Motion(pitch - s.point.pitch, elevation - s.point.elevation, travel - s.point.travel)
    o = Rotors(0.0, 0.0)
    return FeedbackState(still, Pair(0.0, 0.0), o, o, o, o, o, o, o, o, o)


def start_holding(pitch: float, elevation: float, travel: float, s: FeedbackSettings) -> Held:
    """State before the first sample; the voltages are those of the operating point."""
    v_front, v_rear = saturate(s.hover.front, s.voltage_limit), saturate(s.hover.rear, s.voltage_limit)
    return Held(start_feedback(pitch, elevation, travel, s), 0, v_front, v_rear)


def hold(
    held: Held,
    time: float,
    step: float,
    angles: Angles,
    references: tuple[float, float, float],
    added: Rotors,
    s: FeedbackSettings,
) -> Held:
    """Take a sample if one is due at ``time`` [s] since the start; show at its end what a step of ``step`` [s] reaches.

    Voltages wait until the sampling instant after that of their angles, however short the step is.
    """
    state, samples = held.state, held.samples
    if time >= (samples - EARLY) * s.period:
        state = feedback_step(state, angles.pitch, angles.elevation, angles.travel, references, added, s)
        samples = samples + 1
    if time + step >= (samples - EARLY) * s.period:
        return Held(state, samples, s.hover.front + state.now.front, s.hover.rear + state.now.rear)
    return Held(state, samples, held.v_front, held.v_rear)


def feedback_step(
    state: FeedbackState,
    pitch: float,
    elevation: float,
    travel: float,
    references: tuple[float, float, float],
    added: Rotors,
    s: FeedbackSettings,
) -> FeedbackState:
    """Return the state after a period; ``now`` in it is what the voltages of the next one are beside ``hover`` [V].

    Parameters
    ----------
    state : FeedbackState
    pitch, elevation, travel : float
        Measured angles [rad].
    references : tuple of float
        Pitch, elevation, travel [rad]; of pitch and travel the one that is controlled counts.
    added : Rotors
        Voltages [V] of an excitation, which come on top.
    s : FeedbackSettings
    """
    x, now = state.estimate, state.now
    wrong = Angles(
        pitch - s.point.pitch - x.pitch, elevation - s.point.elevation - x.elevation, travel - s.point.travel - x.travel
    )
    ahead = corrected(moved(x, arrived(state, s.delay), s), wrong, s)
    late = predicted(ahead, state, s)
    asked = Pair(references[1] - s.point.elevation, _other(references[0], references[2], s))
    errors = Pair(elevation - references[1], _other(pitch, travel, s) - asked.other)
    grown = Pair(
        state.integrals.elevation + s.period * errors.elevation, state.integrals.other + s.period * errors.other
    )
    kept = state.integrals
    before = Rotors(
        added.front + _row(s.reference.front, asked) - _state_row(s.gain.front, late) - _row(s.integral.front, kept),
        added.rear + _row(s.reference.rear, asked) - _state_row(s.gain.rear, late) - _row(s.integral.rear, kept),
    )
    elevation_kept = _drives_beyond(before, s.integral.front.elevation, s.integral.rear.elevation, errors.elevation, s)
    other_kept = _drives_beyond(before, s.integral.front.other, s.integral.rear.other, errors.other, s)
    integrals = Pair(kept.elevation if elevation_kept else grown.elevation, kept.other if other_kept else grown.other)
    change = Pair(integrals.elevation - kept.elevation, integrals.other - kept.other)
    v_front = saturate(s.hover.front + before.front - _row(s.integral.front, change), s.voltage_limit)
    v_rear = saturate(s.hover.rear + before.rear - _row(s.integral.rear, change), s.voltage_limit)
    return FeedbackState(
        ahead,
        integrals,
        Rotors(v_front - s.hover.front, v_rear - s.hover.rear),
        now,
        state.ago_1,
        state.ago_2,
        state.ago_3,
        state.ago_4,
        state.ago_5,
        state.ago_6,
        state.ago_7,
    )


def moved(x: Motion, u: Rotors, s: FeedbackSettings) -> Motion:
    """F x + G u."""
    F, G = s.transition, s.drive
    return Motion(
        _state_row(F.pitch, x) + _rotor_row(G.pitch, u),
        _state_row(F.elevation, x) + _rotor_row(G.elevation, u),
        _state_row(F.travel, x) + _rotor_row(G.travel, u),
        _state_row(F.pitch_rate, x) + _rotor_row(G.pitch_rate, u),
        _state_row(F.elevation_rate, x) + _rotor_row(G.elevation_rate, u),
        _state_row(F.travel_rate, x) + _rotor_row(G.travel_rate, u),
        _state_row(F.nu_front, x) + _rotor_row(G.nu_front, u),
        _state_row(F.nu_rear, x) + _rotor_row(G.nu_rear, u),
    )


def corrected(x: Motion, wrong: Angles, s: FeedbackSettings) -> Motion:
    """Add L times what the measured angles are beside their estimate."""
    L = s.innovation
    return Motion(
        x.pitch + _angle_row(L.pitch, wrong),
        x.elevation + _angle_row(L.elevation, wrong),
        x.travel + _angle_row(L.travel, wrong),
        x.pitch_rate + _angle_row(L.pitch_rate, wrong),
        x.elevation_rate + _angle_row(L.elevation_rate, wrong),
        x.travel_rate + _angle_row(L.travel_rate, wrong),
        x.nu_front + _angle_row(L.nu_front, wrong),
        x.nu_rear + _angle_row(L.nu_rear, wrong),
    )


def arrived(state: FeedbackState, periods: int) -> Rotors:
    """Voltages [V] of so many periods ago."""
    if periods <= 0:
        return state.now
    if periods == 1:
        return state.ago_1
    if periods == 2:
        return state.ago_2
    if periods == 3:
        return state.ago_3
    if periods == 4:
        return state.ago_4
    if periods == 5:
        return state.ago_5
    if periods == 6:
        return state.ago_6
    if periods == 7:
        return state.ago_7
    return state.ago_8


def predicted(x: Motion, state: FeedbackState, s: FeedbackSettings) -> Motion:
    """Predict the estimate at which the voltages that are under way have arrived."""
    for k in range(s.delay):
        x = moved(x, arrived(state, s.delay - 1 - k), s)
    return x


def _other(of_pitch: float, of_travel: float, s: FeedbackSettings) -> float:
    """Deviation of the other controlled angle [rad]."""
    return of_travel - s.point.travel if s.travel_enabled else of_pitch - s.point.pitch


def _drives_beyond(u: Rotors, by_front: float, by_rear: float, error: float, s: FeedbackSettings) -> bool:
    """Whether an integral that grows with ``error`` drives a voltage further beyond its limit."""
    front, rear = s.hover.front + u.front, s.hover.rear + u.rear
    beyond_front, beyond_rear = front - saturate(front, s.voltage_limit), rear - saturate(rear, s.voltage_limit)
    return -by_front * error * beyond_front > 0.0 or -by_rear * error * beyond_rear > 0.0


def _state_row(row: Motion, x: Motion) -> float:
    return (
        row.pitch * x.pitch
        + row.elevation * x.elevation
        + row.travel * x.travel
        + row.pitch_rate * x.pitch_rate
        + row.elevation_rate * x.elevation_rate
        + row.travel_rate * x.travel_rate
        + row.nu_front * x.nu_front
        + row.nu_rear * x.nu_rear
    )


def _rotor_row(row: Rotors, u: Rotors) -> float:
    return row.front * u.front + row.rear * u.rear


def _angle_row(row: Angles, y: Angles) -> float:
    return row.pitch * y.pitch + row.elevation * y.elevation + row.travel * y.travel


def _row(row: Pair, z: Pair) -> float:
    return row.elevation * z.elevation + row.other * z.other


def entry_unit(matrix: str, row: str, column: str) -> str:
    """Return the unit of an entry of a matrix: that of its row over that of its column; the integrals' is [rad s]."""
    above, below = _unit_of(row), "rad s" if matrix == "integral" else _unit_of(column)
    if above == below:
        return "1"
    known = {("rad/s", "rad"): "1/s", ("rad", "rad/s"): "s", ("V", "rad/s"): "V s/rad", ("rad/s", "V"): "rad/(V s)",
             ("V", "rad s"): "V/(rad s)"}  # fmt: skip
    return known.get((above, below), f"{above}/{below}")


def _unit_of(name: str) -> str:
    if name in ("front", "rear", "nu_front", "nu_rear"):
        return "V"
    return "rad/s" if name.endswith("_rate") else "rad"
