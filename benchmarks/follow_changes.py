"""What changes on a rig in flight, with its size, and the values that a twin begins with or is told."""

import numpy as np

from benchmarks.follow_rigs import Rig, Stage
from heli_plant.parameters import PlantParameters
from tests.blind.coefficients import Coefficients

GAIN, MASS, SHARE, WARM, SLOW = 0.2, 0.08, 0.8, 0.85, 60.0
"""Change of a gain [1], of the offset [rad/s^2], thrust left of a rotor and of warm motors [1], time of warming [s]."""

NAMES = {
    "k_x": "pitch.gain",
    "k_z": "elevation.gain",
    "k_y": "travel.gain",
    "friction_pitch": "effects.dry_friction.pitch",
    "friction_elevation": "effects.dry_friction.elevation",
    "friction_travel": "effects.dry_friction.travel",
    "mass": "elevation.offset",
    "front": "rotor.front",
    "rear": "rotor.rear",
    "cable": "effects.cable_stiffness.travel",
    "warming": "rotors.thrust",
}
"""Kinds of change, and what the twin should call them."""

FRICTION = {"pitch": 0.03, "elevation": 0.03, "travel": 0.03}
"""Added dry friction [rad/s^2]."""

CABLE = 0.06
"""Stiffness of a cable that is hung on [1/s^2]."""


def known(rig: Rig, rng: np.random.Generator) -> PlantParameters:
    """Return the values that a twin begins with: they err as those of a diagnosis do."""
    c = rig.coefficients
    share = (1.0 + 0.01 * rng.standard_normal(7)).tolist()
    damping = (0.01 * rng.standard_normal(3)).tolist()
    balance = (0.003 * rng.standard_normal(2)).tolist()
    a_e, k_z, a_th = c.a_e * share[0], c.k_z * share[1], c.a_th * share[2]
    elevation, thrust = rig.hover
    return PlantParameters(
        a_wx=c.a_wx + damping[0], a_th=a_th, k_x=c.k_x * share[3], theta0=c.theta0 + balance[0] / c.a_th,
        a_wz=c.a_wz + damping[1], a_e=a_e, a_1=k_z * thrust - a_e * elevation + balance[1], a_lt=c.a_lt * share[4],
        k_z=k_z, a_wy=c.a_wy + damping[2], k_y=c.k_y * share[5], T_m=c.t_m,
    )  # fmt: skip


def changed(kind: str, stage: Stage, start: float, sign: float) -> Stage:
    """Return the stage that follows after a change of one kind at ``start`` [s]."""
    c, shares, slow = stage.coefficients, stage.shares, 0.0
    if kind in ("k_x", "k_z", "k_y"):
        c = c._replace(**{kind: getattr(c, kind) * (1.0 + sign * GAIN)})
    elif kind.startswith("friction_"):
        axis = kind.removeprefix("friction_")
        c = c._replace(**{f"dry_friction_{axis}": getattr(c, f"dry_friction_{axis}") + FRICTION[axis]})
    elif kind == "mass":
        c = c._replace(a_1=c.a_1 + sign * MASS)
    elif kind == "cable":
        c = c._replace(cable_stiffness=CABLE)
    elif kind == "front":
        shares = (SHARE * shares[0], shares[1])
    elif kind == "rear":
        shares = (shares[0], SHARE * shares[1])
    elif kind == "warming":
        shares, slow = (WARM * shares[0], WARM * shares[1]), SLOW
    return Stage(start, c, shares, slow)


def told(values: PlantParameters, before: Coefficients, stage: Stage) -> tuple[PlantParameters, tuple[float, float]]:
    """Return the values of a twin that is given the change, and the rotors' shares."""
    c, same = stage.coefficients, {}
    for name in ("k_x", "k_z", "k_y"):
        same[name] = getattr(values, name) * getattr(c, name) / getattr(before, name)
    for axis in FRICTION:
        same[f"dry_friction_{axis}"] = getattr(c, f"dry_friction_{axis}")
    same["cable_stiffness_travel"] = c.cable_stiffness
    return values._replace(a_1=values.a_1 + c.a_1 - before.a_1, **same), stage.shares
