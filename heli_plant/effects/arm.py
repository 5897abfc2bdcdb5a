"""The arm: its cable, the table below it, gravity and inertia at large angles, bending, masses on it."""

from functools import partial
from math import cos, exp, pi, sin, tan

from .definition import BENDING, LOWEST_ELEVATION, PAPER_NEGLECTS, SISTER_RIGS, STEP_TIMES, Shape, declared


@declared(
    "-c (lambda - lambda(0))", "travel", unit="1/s^2", bounds=(0.0, 1.0),
    source=SISTER_RIGS, family="torque on the travel", drawn_against="travel",
    experiment="Turn the arm slowly by several turns either way and let it come to rest.",
)  # fmt: skip
def cable_stiffness(travel: float, travel_rest: float, c: float) -> float:
    """Cable stiffness: the cable to the rig pulls the arm back to where the record began."""
    return -c * (travel - travel_rest)


_inertial = partial(
    declared, unit="1", bounds=(0.0, 3.0),
    source="paper, eq. (1), omega x K", family="inertial coupling", drawn_against="other_rate", certain=True,
    experiment="Turn the travel fast (above .5 rad/s) while the elevation moves far from the horizontal arm.",
    shapes=(
        Shape("horizontal_offset", "horizontal_offset", "eps_0", "rad", 0.0, -1.0, 1.0,
              "elevation from the horizontal arm when the encoder reads zero, for every law with eps_h",
              grid=(-0.5, 0.0, 0.5), estimated=False),
    ),
)  # fmt: skip


@_inertial("-c/2 sin(2 eps_h) lambda'^2", "elevation")
def inertial_coupling_elevation(horizontal_elevation: float, travel_rate: float, c: float) -> float:
    """Inertial coupling of elevation and travel, the term omega x K of eq. (1): the centrifugal torque.

    In theory c = 1 on both axes. Like every law with a sine of the elevation it depends on where the horizontal is.
    """
    return -0.5 * c * sin(2.0 * horizontal_elevation) * travel_rate * travel_rate


@_inertial("+2 c tan(eps_h) eps' lambda'", "travel")
def inertial_coupling_travel(horizontal_elevation: float, elevation_rate: float, travel_rate: float, c: float) -> float:
    """As on the elevation: the Coriolis torque."""
    return 2.0 * c * tan(horizontal_elevation) * elevation_rate * travel_rate


@declared(
    "-c (sin(eps_h) (k_y mu_s sin(theta) - a_wy lambda') + (lambda'^2 cos(eps_h)^2 - eps'^2) sin(2 theta)/2"
    " + eps' lambda' cos(eps_h) (1 - cos(2 theta)))", "pitch", unit="1", bounds=(0.0, 3.0),
    source="paper, eq. (1), omega x K", family="inertial coupling", drawn_against="other_rate",
    experiment="Turn the travel fast (above .5 rad/s), back and forth, the elevation far from the horizontal arm.",
)  # fmt: skip
def inertial_coupling_pitch(
    pitch: float, horizontal_elevation: float, elevation_rate: float, travel_rate: float, mu_sum: float, k_y: float,
    a_wy: float, c: float,
) -> float:  # fmt: skip
    """Inertial coupling of the pitch: the body turns about its axis at theta' + lambda' sin(eps_h), not at theta'.

    The travel's acceleration turns it against a raised or lowered arm, and the centrifugal torque pulls the rotors into
    the plane in which the arm turns. In theory c = 1 for rotors on a thin beam, and less for a thick body.
    """
    return -c * (
        sin(horizontal_elevation) * (k_y * mu_sum * sin(pitch) - a_wy * travel_rate)
        + 0.5
        * sin(2.0 * pitch)
        * (travel_rate * cos(horizontal_elevation) - elevation_rate)
        * (travel_rate * cos(horizontal_elevation) + elevation_rate)
        + elevation_rate * travel_rate * cos(horizontal_elevation) * (1.0 - cos(2.0 * pitch))
    )


@declared(
    "c (a_e eps + a_1 - a_e sin(eps_h) - (a_1 - a_e eps_0) cos(eps_h))", "elevation", unit="1", bounds=(0.0, 1.0),
    source="paper, small-angle step",
    drawn_against="elevation", certain=True,
    experiment="Let the elevation visit angles above .5 rad on either side.",
)  # fmt: skip
def large_angle_gravity(
    elevation: float, horizontal_elevation: float, horizontal_offset: float, a_e: float, a_1: float, c: float
) -> float:
    """Gravity of the arm at large angles, in place of its linearisation a_e eps + a_1.

    With eps_h = eps + eps_0 from the horizontal, the arm's gravity is a_e sin(eps_h) + (a_1 - a_e eps_0) cos(eps_h),
    which for small eps_h is the simplified model's a_e eps + a_1. The law adds c times the difference.
    """
    return c * (
        a_e * (elevation - sin(horizontal_elevation))
        + a_1 * (1.0 - cos(horizontal_elevation))
        + a_e * horizontal_offset * cos(horizontal_elevation)
    )


@declared(
    "c a_th sin(theta - theta0) (1 - cos(eps_h))", "pitch", unit="1", bounds=(0.0, 1.0),
    source="paper, eq. (1)", drawn_against="elevation",
    experiment="Swing the pitch at elevations above .5 rad and at zero.",
)  # fmt: skip
def pitch_gravity_coupling(pitch: float, horizontal_elevation: float, a_th: float, theta0: float, c: float) -> float:
    """Gravity of the body at large elevations: its lever about the pitch axis shrinks with their cosine."""
    return c * a_th * sin(pitch - theta0) * (1.0 - cos(horizontal_elevation))


@declared(
    "c (k_x mu_d - a_wx theta' - a_th sin(theta - theta0))", "travel", unit="1", bounds=(-0.1, 0.1),
    source="paper, eq. (1), the matrix M", drawn_against="mu_diff",
    experiment="Shake the pitch by 10 degrees at .5 to 1 Hz while the travel is free.",
)  # fmt: skip
def product_of_inertia(
    mu_diff: float, pitch: float, pitch_rate: float, k_x: float, a_wx: float, a_th: float, theta0: float, c: float
) -> float:
    """Product of inertia: a body whose centre of mass lies off the pitch axis swings the arm as it pitches.

    The law is c theta'', with the ratio c of m l d to the travel's inertia for a mass m at the distance d from the
    pitch axis and l from the post. On the pitch the arm's acceleration, which is small, acts alike and is left out.
    """
    return c * (k_x * mu_diff - a_wx * pitch_rate - a_th * sin(pitch - theta0))


@declared(
    "c lambda'", "pitch", unit="1/s", bounds=(-2.0, 2.0),
    source="Padfield, Helicopter Flight Dynamics (M_u)", drawn_against="travel_rate",
    experiment="Let the arm travel fast either way at a constant sum of the voltages, the pitch near rest.",
)  # fmt: skip
def speed_stability(travel_rate: float, c: float) -> float:
    """Speed stability: the airspeed along the travel tilts both rotors' thrust and turns the pitch.

    The derivative M_u of helicopter flight dynamics, the pitching moment by forward speed (Padfield, Helicopter Flight
    Dynamics). It has either sign: that depends on whether the rotors' discs lie above or below the axis.
    """
    return c * travel_rate


@declared(
    "c k_z mu_s cos(theta) exp(-max(eps - eps_ground, 0)/eps_g)", "elevation", unit="1", bounds=(0.0, 5.0),
    source=PAPER_NEGLECTS, drawn_against="elevation",
    experiment="Hover at several heights just above the table.",
    shapes=(
        Shape("ground_elevation", "ground_elevation", "eps_ground", "rad", -0.5, -1.5, 1.0,
              "elevation of the arm on the ground", start=LOWEST_ELEVATION, estimated=False),
        Shape("ground_height", "ground_height", "eps_g", "rad", 0.15, 0.01, 2.0,
              "elevation over which the ground effect falls to 1/e", grid=(0.05, 0.15, 0.4)),
    ),
)  # fmt: skip
def ground_effect(
    elevation: float, pitch: float, mu_sum: float, k_z: float, ground_elevation: float, ground_height: float, c: float
) -> float:
    """Ground effect: close to the table the rotors lift more, on the ground by the share c.

    A change of eps_ground has the same effect as a change of c, so eps_ground is not estimated. No arm is below the
    ground, but a prediction may be.
    """
    return c * k_z * mu_sum * cos(pitch) * exp(min(ground_elevation - elevation, 0.0) / ground_height)


@declared(
    "encoder reads rigid + q, q'' + 2 zeta w_b q' + w_b^2 q = c w_b^2 mu_s", "elevation",
    unit="rad/V", bounds=(-0.2, 0.2),
    source="paper, section 2.3 (bending)", place=BENDING,
    experiment="Excite the voltage sum with a chirp from 1 to 6 Hz.",
    shapes=(
        Shape("frequency", "bending_frequency", "f_b", "Hz", 3.0, 0.8, 8.0, "w_b / (2 pi)",
              grid=(1.2, 1.6, 2.0, 2.4, 2.8, 3.2, 3.7, 4.3, 5.0, 6.0, 8.0)),
        Shape("damping", "bending_damping", "zeta", "1", 0.05, 0.002, 0.2, "damping ratio zeta"),
    ),
)  # fmt: skip
def arm_bending(
    bending: float, bending_rate: float, mu_sum: float, c: float, frequency: float, damping: float
) -> float:
    """Bending of the arm: the elevation's encoder reads the rigid angle plus q [rad], a mode that the rotors drive.

    No bolted metal arm damps more than a fifth of critical. A mode above 8 Hz responds within some samples, like the
    reaction of a controller to the counts of the encoder.
    """
    return 2.0 * pi * frequency * (2.0 * pi * frequency * (c * mu_sum - bending) - 2.0 * damping * bending_rate)


@declared(
    "t >= t_1: -c", "elevation", unit="rad/s^2", bounds=(-1.0, 1.0),
    source="ADO, paper", drawn_against="time",
    experiment="Note when the mass moves, and hold everything else still for 10 s before and after.",
    shapes=(
        Shape("step_time", "moving_mass_time", "t_1", "s", 0.0, 0.0, 1e6, "time of the step", start=STEP_TIMES,
              difference_step=0.3),
    ),
)  # fmt: skip
def moving_mass(time: float, step_time: float, c: float) -> float:
    """Step of the elevation's offset a_1 by c: something on the arm shifts once."""
    return -c if time >= step_time else 0.0
