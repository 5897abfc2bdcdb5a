"""Motors and rotors, from a voltage to the thrust: its size, its timing, its fading."""

from .definition import DELAY, LAG, ROTORS, THRUST, THRUST_MAP, VOLTAGE, declared


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
