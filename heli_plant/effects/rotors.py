"""Motors and rotors: from a voltage to the thrust, and what thrust and spin do besides lift and pitching."""

from functools import partial
from math import cos, sin

from .definition import DELAY, LAG, PAPER_NEGLECTS, ROTORS, THRUST, THRUST_MAP, VOLTAGE, declared


@declared(
    "c mu_s", "pitch", unit="rad/s^2/V", bounds=(-0.5, 0.5),
    source="paper, footnote on thrust", family="torque on the pitch", drawn_against="mu_sum",
    experiment="Change the sum v_f + v_r in steps of 1 V while the difference stays zero.",
)  # fmt: skip
def rotor_mismatch(mu_sum: float, c: float) -> float:
    """Rotor mismatch: one rotor pulls more than the other, so that their sum turns the pitch."""
    return c * mu_sum


@declared(
    "nu -> nu + c nu abs(nu)", ROTORS, unit="1/V", bounds=(-0.2, 10.0),
    source="paper, footnote on thrust", family="curve of the thrust", place=THRUST, drawn_against="mu_sum",
    experiment="Raise the voltage sum in steps from 0 to 5 V, each held until the elevation rests.",
)  # fmt: skip
def quadratic_thrust(nu: float, c: float) -> float:
    """Quadratic thrust: the thrust of a rotor grows faster than its voltage."""
    return nu + c * nu * abs(nu)


@declared(
    "nu < 0: nu -> (1 - c) nu", ROTORS, unit="1", bounds=(0.0, 1.0),
    source=THRUST_MAP, family="curve of the thrust", place=THRUST, drawn_against="mu_sum",
    experiment="Drive the rotors below 0 V for several seconds, both together and one alone.",
)  # fmt: skip
def reverse_thrust_loss(nu: float, c: float) -> float:
    """Reverse thrust loss: a propeller that turns backwards pulls less, by the share c."""
    return (1.0 - c) * nu if nu < 0.0 else nu


@declared(
    "abs(v) < c: v -> 0, else v - c sign(v)", ROTORS, unit="V", bounds=(0.0, 2.0),
    source=THRUST_MAP, family="curve of the thrust", place=VOLTAGE, drawn_against="mu_sum",
    experiment="Let the rotors' voltages cross zero slowly, both together and one alone.",
)  # fmt: skip
def dead_zone(voltage: float, c: float) -> float:
    """Dead zone: the rotors do not turn at small voltages."""
    return voltage - c if voltage > c else voltage + c if voltage < -c else 0.0


@declared(
    "T_m -> T_m + c", ROTORS, unit="s", bounds=(-0.5, 0.5),
    source="paper, eq. (9)", family="lag or delay of the rotors", place=LAG, drawn_against="mu_rate",
    experiment="Excite the pitch between 1 and 3 Hz, where the motors' phase shows.",
)  # fmt: skip
def motor_lag(time_constant: float, c: float) -> float:
    """Motor lag: motors and propellers are slower than the time constant of eq. (9) that is assumed."""
    return time_constant + c


@declared(
    "tau -> tau + c", ROTORS, unit="s", bounds=(0.0, 0.5),
    source="sampled control", family="lag or delay of the rotors", place=DELAY, drawn_against="mu_rate",
    experiment="Excite the pitch between 1 and 3 Hz, where a delay and a lag differ in gain.",
)  # fmt: skip
def input_delay(delay: float, c: float) -> float:
    """Input delay: a voltage takes time from the controller to the motor."""
    return delay + c


@declared(
    "nu -> (1 - c t) nu", ROTORS, unit="1/s", bounds=(-0.01, 0.01),
    source="warming motors, reports",
    place=THRUST, drawn_against="time",
    experiment="Repeat the same excitation at the beginning and at the end of a run of several minutes.",
)  # fmt: skip
def thrust_fade(nu: float, time: float, c: float) -> float:
    """Thrust fade: motors that warm up pull less and less."""
    return (1.0 - c * time) * nu


_airspeed = partial(
    declared, unit="1/(V s)", bounds=(0.0, 1.0),
    source=PAPER_NEGLECTS, family="thrust lost by airspeed", drawn_against="rate",
    experiment="Swing the axis at a large voltage sum and at a small one.",
)  # fmt: skip


@_airspeed("-c mu_s theta'", "pitch")
def airspeed_thrust_loss_pitch(mu_sum: float, pitch_rate: float, c: float) -> float:
    """Airspeed thrust loss: a rotor that moves along its own thrust meets faster air and pulls less."""
    return -c * mu_sum * pitch_rate


@_airspeed("-c mu_s eps' cos(theta)", "elevation")
def airspeed_thrust_loss_elevation(mu_sum: float, pitch: float, elevation_rate: float, c: float) -> float:
    """As on the pitch, for the rotors' motion with the arm."""
    return -c * mu_sum * elevation_rate * cos(pitch)


_gyroscopic = partial(
    declared, unit="1/(V s)", bounds=(-1.0, 1.0),
    source=PAPER_NEGLECTS, family="gyroscopic coupling", drawn_against="other_rate",
    experiment="Swing pitch and elevation at different frequencies under a large voltage sum.",
)  # fmt: skip


@_gyroscopic("-c mu_s eps'", "pitch")
def gyroscopic_coupling_pitch(mu_sum: float, elevation_rate: float, c: float) -> float:
    """Gyroscopic coupling: the rotors' spin, which grows with their voltage, turns pitch into elevation and back."""
    return -c * mu_sum * elevation_rate


@_gyroscopic("+c mu_s theta'", "elevation")
def gyroscopic_coupling_elevation(mu_sum: float, pitch_rate: float, c: float) -> float:
    """As on the pitch, with the other sign: no power is added."""
    return c * mu_sum * pitch_rate


@declared(
    "c mu_s cos(theta) cos(eps_h)", "travel", unit="rad/s^2/V", bounds=(-0.5, 0.5),
    source="LAAS report 18040, k_gf", family="torque on the travel", drawn_against="mu_sum",
    experiment="Change the voltage sum in steps while the pitch rests at zero.",
)  # fmt: skip
def rotor_drag_torque(mu_sum: float, pitch: float, horizontal_elevation: float, c: float) -> float:
    """Rotor drag torque: the air's drag on both propellers turns the arm round its post."""
    return c * mu_sum * cos(pitch) * cos(horizontal_elevation)


@declared(
    "c mu_s sin(theta)", "elevation", unit="rad/s^2/V", bounds=(-0.1, 0.1),
    source="paper, eq. (10) with rotors that lean", drawn_against="pitch",
    experiment="Hold the pitch at +20 and at -20 degrees at the same sum of the voltages.",
)  # fmt: skip
def thrust_tilt(mu_sum: float, pitch: float, c: float) -> float:
    """Thrust tilt: the rotors' axes lean towards the post, so that their lift is largest at another pitch than zero.

    If they lean by delta, the lift mu_s acts on the elevation with cos(theta + delta), which adds -delta sin(theta) to
    cos(theta). On the travel it acts with delta cos(theta), as the rotors' drag torque does.
    """
    return c * mu_sum * sin(pitch)


_translation = partial(
    declared, unit="s^2/rad^2", bounds=(-0.5, 0.5),
    source="Padfield, Helicopter Flight Dynamics (induced inflow in forward flight)", family="thrust in translation",
    drawn_against="travel_rate",
    experiment="Let the arm travel fast and slowly either way, rocking the pitch at a constant sum of the voltages.",
)  # fmt: skip


@_translation("c k_z mu_s lambda'^2 cos(theta)", "elevation")
def translational_lift_elevation(mu_sum: float, pitch: float, travel_rate: float, k_z: float, c: float) -> float:
    """Lift in translation: the thrust changes with the square of the arm's speed along the travel.

    A rotor that flies through still air meets less of its own inflow and pulls more, c > 0; the rear one of two, or
    both where the arm comes round to its own wake, flies in air that moves down and pulls less, c < 0.
    """
    return c * k_z * mu_sum * travel_rate * travel_rate * cos(pitch)


@_translation("c k_y mu_s lambda'^2 sin(theta)", "travel")
def translational_lift_travel(mu_sum: float, pitch: float, travel_rate: float, k_y: float, c: float) -> float:
    """As on the elevation, for the part of the thrust that drives the travel."""
    return c * k_y * mu_sum * travel_rate * travel_rate * sin(pitch)
