"""The truth of one rig: its parameters, what it holds beyond the base model, its room; and how it is drawn.

A kind is a word, or several joined by ``+``: ``clean``, ``dry_friction`` (the axis is drawn), ``dry_friction:pitch``,
``quadratic_thrust+moving_mass``, ``unknown:periodic``, ``unknown:detent``, ``unknown:travel_angle``.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from tests.blind.coefficients import AXES, ON_AXES, Coefficients, Strange

DRAWN = ("a_wx", "a_th", "k_x", "a_wz", "a_e", "a_1", "a_lt", "k_z", "a_wy", "k_y")
"""Parameters that differ from rig to rig; theta0 and T_m are the same for all."""

SPREAD = 0.20
"""Each drawn parameter lies within this share of its nominal value, uniformly."""

ROOM_TORQUE, ROOM_TIME = 0.003, 1.0
"""Standard deviation of the random torque on each axis [rad/s^2] and its correlation time [s]."""

ENCODER_SHAKE = 0.25
"""Standard deviation of the position of an encoder's lines [counts]."""


class Effect(NamedTuple):
    """An effect of the catalogue, in its words and units; axis is pitch, elevation, travel or rotors.

    ``shape``: further numbers of its law, by their names in `Coefficients`.
    """

    name: str
    axis: str
    coefficient: float
    shape: Mapping[str, float] = MappingProxyType({})

    @property
    def field(self) -> str:
        """Name of the coefficient's field in `Coefficients`."""
        return f"{self.name}_{self.axis}" if self.name in ON_AXES else self.name


class Unknown(NamedTuple):
    """A torque that no catalogue names: its axis, the variable that it depends on, its largest value [rad/s^2].

    ``shape``: frequency [Hz]; or centre and width [rad]; or waves [1/turn] and phase [rad].
    """

    axis: str
    variable: str
    amplitude: float
    shape: Mapping[str, float]


class Rig(NamedTuple):
    """What makes one rig different from another: base model, effects, an unknown torque, and how far the bristles of
    dry friction bend before it slips [rad], 0 for ideal sticking."""

    base: Coefficients
    effects: tuple[Effect, ...] = ()
    unknown: Unknown | None = None
    presliding: float = 0.0

    def coefficients(self) -> Coefficients:
        """Numbers for the integration."""
        numbers = {"presliding": self.presliding}
        for effect in self.effects:
            numbers |= {effect.field: effect.coefficient, **effect.shape}
        return self.base._replace(**numbers)

    def strange(self, phase: float) -> Strange:
        """Numbers of the unknown torque in a log in which a torque in time starts at `phase` [rad]."""
        if self.unknown is None:
            return Strange()
        axis, amplitude, shape = AXES.index(self.unknown.axis), self.unknown.amplitude, self.unknown.shape
        if self.unknown.variable == "time":
            return Strange(axis, periodic=amplitude, phase=phase, **shape)
        return Strange(axis, **{"detent" if "centre" in shape else "by_travel": amplitude}, **shape)


def draw_base(rng: np.random.Generator) -> Coefficients:
    """Parameters within 20 % of their nominal values."""
    nominal = Coefficients()
    shares = rng.uniform(1 - SPREAD, 1 + SPREAD, len(DRAWN))
    return nominal._replace(
        **{name: float(share * getattr(nominal, name)) for name, share in zip(DRAWN, shares, strict=True)}
    )


# --- kinds of rig, and how strong each effect is in the battery ---------------------------------------------------

DURATION = 90.0
"""Length of a log [s]."""

_P, _E, _T, _R = (*AXES, "rotors")

STRENGTHS: Mapping[str, tuple[tuple[tuple[str, float], ...], ...]] = {
    # In the bars. One inner tuple is what acts together; of several, one is drawn.
    "dry_friction": (((_P, 0.02),), ((_E, 0.01),), ((_T, 0.03),)),
    "quadratic_drag": (((_P, 0.3),), ((_E, 0.5),), ((_T, 0.06),)),
    "gyroscopic_coupling": (((_P, 0.04), (_E, 0.02)),),
    "airspeed_thrust_loss": (((_P, 0.03), (_E, 0.03)),),
    "reverse_thrust_loss": (((_R, 0.6),),),
    "quadratic_thrust": (((_R, 0.12),),),
    "dead_zone": (((_R, 0.15),),),
    "input_delay": (((_R, 0.08),),),
    "motor_lag": (((_R, 0.07),),),
    "thrust_fade": (((_R, 0.12 / DURATION),),),
    "rotor_mismatch": (((_P, 0.012),),),
    "cable_stiffness": (((_T, 0.006),),),
    "arm_bending": (((_E, 0.004),),),
    "moving_mass": (((_E, 0.06),),),
    "inertial_coupling": (((_E, 1.0), (_T, 1.0)),),
    "large_angle_gravity": (((_E, 1.0),),),
    # In the catalogue, but in no bar.
    "breakaway_friction": (((_P, 0.03),), ((_E, 0.02),), ((_T, 0.04),)),
    "constant_torque": (((_P, 0.03),), ((_T, 0.02),)),
    "rotor_drag_torque": (((_T, 0.01),),),
    "pitch_gravity_coupling": (((_P, 1.0),),),
    "ground_effect": (((_E, 0.4),),),
    "product_of_inertia": (((_T, 0.01),),),
}

EITHER_SIGN = frozenset({"rotor_mismatch", "moving_mass", "constant_torque", "rotor_drag_torque", "product_of_inertia"})
"""Effects whose sign is drawn."""

SHAPES: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "breakaway_friction": {"stribeck_rate": (0.03, 0.08)},
    "arm_bending": {"bending_frequency": (3.0, 3.0), "bending_damping": (0.03, 0.08)},
    "moving_mass": {"mass_time": (20.0, 70.0)},
    "ground_effect": {"ground_angle": (-0.25, -0.1), "ground_length": (0.1, 0.2)},
}
"""Ranges from which the further numbers of a law are drawn, once for all logs of a rig."""

UNKNOWN_AMPLITUDES: Mapping[str, float] = {"periodic": 0.05, "detent": 0.06, "travel_angle": 0.05}

_BRISTLE_SHARE, _BRISTLE_BENDS = 1 / 3, (0.0003, 0.001)
"""How many rigs with friction have bristles, and how far those bend [rad]."""

_NOTCH_WIDTHS = {"pitch": (0.04, 0.08), "elevation": (0.02, 0.04)}
"""Of a detent: a small part of what the axis visits, else it is a spring [rad]."""

_FREQUENCIES, _NEAR_RESONANCE = (0.15, 1.5), 0.25
"""Of a periodic torque [Hz]; closer to the axis's own frequency than this share, it would fling the arm about."""


def _draw_effects(word: str, scale: float, rng: np.random.Generator) -> tuple[Effect, ...]:
    name, _, axis = word.partition(":")
    if name not in STRENGTHS:
        raise ValueError(f"kind {word!r} is not known; choose clean, unknown:..., or of {', '.join(STRENGTHS)}")
    options = [option for option in STRENGTHS[name] if not axis or axis in dict(option)]
    if not options:
        raise ValueError(f"kind {word!r}: {name} does not act on {axis!r}")
    option = options[rng.integers(len(options))]
    sign = rng.choice([-1.0, 1.0]) if name in EITHER_SIGN else 1.0
    shape = {key: float(rng.uniform(*ends)) for key, ends in SHAPES.get(name, {}).items()}
    return tuple(Effect(name, where, float(sign * scale * strength), shape) for where, strength in option)


def _draw_unknown(word: str, scale: float, rig: Rig, rng: np.random.Generator) -> Unknown:
    if word not in UNKNOWN_AMPLITUDES:
        raise ValueError(f"unknown torque {word!r}: choose of {', '.join(UNKNOWN_AMPLITUDES)}")
    amplitude = scale * UNKNOWN_AMPLITUDES[word]
    if word == "periodic":
        axis = AXES[rng.integers(3)]
        own = {"pitch": rig.base.a_th, "elevation": rig.base.a_e, "travel": 0.0}[axis] ** 0.5 / (2 * np.pi)
        while True:
            frequency = float(np.exp(rng.uniform(*np.log(_FREQUENCIES))))
            if abs(frequency - own) > _NEAR_RESONANCE * own:
                return Unknown(axis, "time", amplitude, {"frequency": frequency})
    if word == "detent":
        axis = AXES[rng.integers(2)]
        # Where the axis passes often: about the middle of what the excitation makes it visit.
        middle = {"pitch": rig.base.theta0, "elevation": (2 * rig.base.k_z - rig.base.a_1) / rig.base.a_e}[axis]
        centre = float(middle + rng.uniform(-0.1, 0.1))
        width = float(rng.uniform(*_NOTCH_WIDTHS[axis]))
        return Unknown(axis, axis, amplitude, {"centre": centre, "width": width})
    shape = {"waves": float(rng.integers(1, 4)), "phase": float(rng.uniform(0, 2 * np.pi))}
    return Unknown(AXES[rng.integers(3)], "travel", amplitude, shape)


def draw_rig(seed: int | np.random.SeedSequence, kind: str = "clean", scale: float = 1.0) -> Rig:
    """Draw a rig of a kind, its effects at a share ``scale`` of the battery's strength.

    The same seed gives the same base parameters whatever the kind.
    """
    base_seed, kind_seed = np.random.default_rng(seed).integers(2**63, size=2)
    rng = np.random.default_rng(kind_seed)
    bristles = float(rng.uniform(*_BRISTLE_BENDS)) if rng.random() < _BRISTLE_SHARE else 0.0
    rig = Rig(draw_base(np.random.default_rng(base_seed)), presliding=bristles)
    for word in kind.split("+"):
        if word.startswith("unknown:"):
            rig = rig._replace(unknown=_draw_unknown(word.partition(":")[2], scale, rig, rng))
        elif word != "clean":
            rig = rig._replace(effects=rig.effects + _draw_effects(word, scale, rng))
    return rig
