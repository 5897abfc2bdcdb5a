"""The catalogue: every physical effect that the simplified model may lack, one entry per name and axis.

The plant adds an effect when its coefficient is not zero; an identifier tries them one by one. The names are a
contract: they stand in parameter sets, FMU variables and reports. The laws themselves are in
:mod:`heli_plant.neglected` (axes), :mod:`heli_plant.rotors` and :mod:`heli_plant.bending`.
Sources: section 2.3 of the paper (neglects) and its footnote on thrust asymmetry; eq. (1); LAAS report 18040.
"""

from typing import NamedTuple

AXES = ("pitch", "elevation", "travel")


class Shape(NamedTuple):
    """A parameter of an effect's law beside its coefficient: its range, and a grid that a search may start from."""

    name: str
    field: str
    unit: str
    default: float
    lower: float
    upper: float
    grid: tuple[float, ...]
    description: str


class Effect(NamedTuple):
    """One effect on one axis (or on the rotors).

    ``field`` is the coefficient's name in :class:`heli_plant.parameters.PlantParameters`; ``lower`` and ``upper``
    bound what is physically plausible (the sign rule among them); ``axes`` are the axes whose motion it changes;
    ``grid`` lists coefficients from which a search starts where the law is not linear in c.
    """

    name: str
    axis: str
    field: str
    law: str
    unit: str
    lower: float
    upper: float
    axes: tuple[str, ...]
    source: str
    shapes: tuple[Shape, ...] = ()
    grid: tuple[float, ...] = ()


_NEGLECTS = "paper, section 2.3 (neglected)"
_OMEGA_K = "paper, eq. (1), omega x K"


def _on_axis(
    name: str,
    axis: str,
    law: str,
    unit: str,
    upper: float,
    source: str,
    lower: float = 0.0,
    shapes: tuple[Shape, ...] = (),
) -> Effect:
    return Effect(name, axis, f"{name}_{axis}", law, unit, lower, upper, (axis,), source, shapes)


def _on_rotors(
    name: str, law: str, unit: str, lower: float, upper: float, source: str, grid: tuple[float, ...] = ()
) -> Effect:
    return Effect(name, "rotors", f"{name}_rotors", law, unit, lower, upper, AXES, source, (), grid)


def _stribeck(axis: str) -> Shape:
    return Shape(
        "stribeck_rate", f"stribeck_rate_{axis}", "rad/s", 0.05, 0.005, 1.0, (0.02, 0.06, 0.18),
        "rate over which the breakaway friction fades",
    )  # fmt: skip


_HORIZONTAL = Shape(
    "horizontal_offset", "horizontal_offset", "rad", 0.0, -1.0, 1.0, (),
    "elevation from the horizontal arm when the encoder reads zero",
)  # fmt: skip

CATALOGUE: tuple[Effect, ...] = (
    *(_on_axis("dry_friction", a, "-c sign(w)", "rad/s^2", 1.0, _NEGLECTS) for a in AXES),
    *(
        _on_axis(
            "breakaway_friction", a, "-c sign(w) exp(-(w/w_s)^2)", "rad/s^2", 1.0,
            "Stribeck 1902; Armstrong-Helouvry 1994", shapes=(_stribeck(a),),
        )
        for a in AXES
    ),
    *(_on_axis("quadratic_drag", a, "-c w abs(w)", "1/rad", 10.0, _NEGLECTS) for a in AXES),
    _on_axis("constant_torque", "pitch", "c", "rad/s^2", 1.0, "reports on sister rigs", lower=-1.0),
    _on_axis("constant_torque", "travel", "c", "rad/s^2", 1.0, "reports on sister rigs", lower=-1.0),
    _on_axis("rotor_mismatch", "pitch", "c mu_s", "rad/s^2/V", 0.5, "paper, footnote on thrust", lower=-0.5),
    _on_rotors("quadratic_thrust", "nu -> nu + c nu abs(nu)", "1/V", -0.2, 1.0, "paper, footnote on thrust"),
    _on_rotors("reverse_thrust_loss", "nu < 0: nu -> (1 - c) nu", "1", 0.0, 1.0, "LAAS report 18040, thrust map"),
    _on_rotors(
        "dead_zone", "0 while abs(v) < c, v - c sign(v) beyond", "V", 0.0, 2.0, "LAAS report 18040, thrust map",
        grid=(0.06, 0.15, 0.3, 0.6),
    ),
    _on_rotors("motor_lag", "T_m -> T_m + c", "s", -0.08, 0.5, "paper, eq. (9)", grid=(-0.05, 0.05, 0.12)),
    _on_rotors("input_delay", "v(t) -> v(t - c)", "s", 0.0, 0.5, "sampled control", grid=(0.03, 0.08, 0.16)),
    _on_rotors("thrust_fade", "gain -> (1 - c t) gain", "1/s", -0.01, 0.01, "warming motors, reports"),
    _on_axis("airspeed_thrust_loss", "pitch", "-c mu_s theta'", "1/(V s)", 1.0, _NEGLECTS),
    _on_axis("airspeed_thrust_loss", "elevation", "-c mu_s eps' cos(theta)", "1/(V s)", 1.0, _NEGLECTS),
    _on_axis("gyroscopic_coupling", "pitch", "-c mu_s eps'", "1/(V s)", 1.0, _NEGLECTS, lower=-1.0),
    _on_axis("gyroscopic_coupling", "elevation", "+c mu_s theta'", "1/(V s)", 1.0, _NEGLECTS, lower=-1.0),
    _on_axis(
        "rotor_drag_torque", "travel", "c mu_s cos(theta) cos(eps)", "rad/s^2/V", 0.5, "LAAS report 18040, k_gf",
        lower=-0.5,
    ),
    _on_axis("cable_stiffness", "travel", "-c (lambda - lambda(0))", "1/s^2", 1.0, "reports on sister rigs"),
    _on_axis(
        "inertial_coupling", "elevation", "-c/2 sin(2 eps) lambda'^2", "1", 3.0, _OMEGA_K,
        shapes=(_HORIZONTAL,),
    ),
    _on_axis(
        "inertial_coupling", "travel", "+2 c tan(eps) eps' lambda'", "1", 3.0, _OMEGA_K,
        shapes=(_HORIZONTAL,),
    ),
    _on_axis(
        "large_angle_gravity", "elevation", "a_e eps + a_1 -> a_e sin(eps) + a_1 cos(eps)", "1", 1.0,
        "paper, small-angle step",
    ),
    _on_axis(
        "pitch_gravity_coupling", "pitch", "a_th sin(theta - theta0) -> times cos(eps)", "1", 1.0, "paper, eq. (1)"
    ),
    _on_axis(
        "ground_effect", "elevation", "lift times 1 + c exp(-(eps - eps_ground)/eps_g)", "1", 5.0, _NEGLECTS,
        shapes=(
            Shape(
                "ground_elevation", "ground_elevation", "rad", -0.5, -1.5, 1.0, (), "elevation of the arm on the ground"
            ),
            Shape(
                "ground_height", "ground_height", "rad", 0.15, 0.01, 2.0, (0.05, 0.15, 0.4),
                "elevation over which the ground effect falls to 1/e",
            ),
        ),
    ),
    _on_axis(
        "arm_bending", "elevation", "encoder reads rigid + q, q'' + 2 zeta w_b q' + w_b^2 q = c w_b^2 mu_s", "rad/V",
        0.2, "paper, section 2.3 (bending)", lower=-0.2,
        shapes=(
            Shape(
                "frequency", "bending_frequency", "Hz", 3.0, 0.8, 20.0,
                (1.2, 1.6, 2.0, 2.4, 2.8, 3.2, 3.7, 4.3, 5.0, 6.0, 8.0), "w_b / (2 pi)",
            ),
            Shape("damping", "bending_damping", "1", 0.05, 0.002, 1.0, (), "damping ratio zeta"),
        ),
    ),
    _on_axis(
        "moving_mass", "elevation", "a_1 steps by c at t_1", "rad/s^2", 1.0, "ADO, paper", lower=-1.0,
        shapes=(Shape("step_time", "moving_mass_time", "s", 0.0, 0.0, 1e6, (), "time of the step"),),
    ),
)  # fmt: skip


def effect(name: str, axis: str) -> Effect:
    """Return the catalogue entry of an effect.

    Raises
    ------
    KeyError
        No entry has this name and axis.
    """
    for entry in CATALOGUE:
        if entry.name == name and entry.axis == axis:
            return entry
    raise KeyError(f"no effect {name!r} on axis {axis!r} in the catalogue")
