"""The truth of one rig: its parameters, what it holds beyond the base model, and its room."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from tests.blind.coefficients import Coefficients, Strange

AXES = ("pitch", "elevation", "travel")

DRAWN = ("a_wx", "a_th", "k_x", "a_wz", "a_e", "a_1", "a_lt", "k_z", "a_wy", "k_y")
"""Parameters that differ from rig to rig; theta0 and T_m are the same for all."""

SPREAD = 0.20
"""Each drawn parameter lies within this share of its nominal value, uniformly."""

SHAPE_FIELDS = {
    "w_s": "stribeck_rate",
    "t_1": "mass_time",
    "w_b": "bending_frequency",
    "zeta": "bending_damping",
    "eps_ground": "ground_angle",
    "eps_g": "ground_length",
    "eps_0": "elevation_zero",
}


@dataclass(frozen=True)
class Effect:
    """One effect of the catalogue, as the rig holds it.

    Attributes
    ----------
    name, axis
        The catalogue's words; axis is pitch, elevation, travel or rotors.
    coefficient
        Its strength, in the catalogue's unit.
    shape
        Further numbers of its law: w_s [rad/s], t_1 [s], w_b [Hz], zeta [1], eps_ground, eps_g and
        eps_0 [rad].
    """

    name: str
    axis: str
    coefficient: float
    shape: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def field(self) -> str:
        """Name of the coefficient's field in `Coefficients`."""
        on_axis = f"{self.name}_{self.axis}"
        name = on_axis if on_axis in Coefficients._fields else self.name
        if name not in Coefficients._fields:
            raise ValueError(f"effect {self.name} on {self.axis} is not in the blind plant's table")
        return name


@dataclass(frozen=True)
class Unknown:
    """One torque that no catalogue names.

    Attributes
    ----------
    axis
        The axis that it acts on.
    variable
        What it depends on: time, pitch, elevation or travel.
    amplitude
        Its largest value [rad/s^2].
    shape
        frequency [Hz]; or centre and width [rad]; or waves [1/turn] and phase [rad].
    """

    axis: str
    variable: str
    amplitude: float
    shape: Mapping[str, float]


@dataclass(frozen=True)
class Room:
    """Where a rig stands and what reads it.

    Attributes
    ----------
    torque_std, torque_time
        Standard deviation [rad/s^2] and correlation time [s] of the random torque on each axis.
    encoder_shake
        Standard deviation of the position of an encoder's lines [counts].
    elevation_zero
        Elevation of the arm from the horizon where its encoder reads zero [rad].
    """

    torque_std: float = 0.003
    torque_time: float = 1.0
    encoder_shake: float = 0.25
    elevation_zero: float = 0.0


@dataclass(frozen=True)
class Rig:
    """Everything that makes one rig different from another.

    Attributes
    ----------
    base
        Parameters of the base model, every effect off.
    effects
        What it holds from the catalogue.
    unknown
        What it holds beyond the catalogue.
    presliding
        How far the bristles of dry friction bend before it slips; 0 for ideal sticking [rad].
    room
        Where it stands.
    """

    base: Coefficients
    effects: tuple[Effect, ...] = ()
    unknown: Unknown | None = None
    presliding: float = 0.0
    room: Room = Room()

    def coefficients(self) -> Coefficients:
        """Numbers for the integration."""
        numbers = {"presliding": self.presliding, "elevation_zero": self.room.elevation_zero}
        for effect in self.effects:
            numbers[effect.field] = effect.coefficient
            numbers |= {SHAPE_FIELDS[name]: value for name, value in effect.shape.items()}
        return self.base._replace(**numbers)

    def strange(self, phase: float) -> Strange:
        """Numbers of the unknown torque in a log in which a torque in time starts at `phase` [rad]."""
        if self.unknown is None:
            return Strange()
        axis, amplitude, shape = AXES.index(self.unknown.axis), self.unknown.amplitude, self.unknown.shape
        if self.unknown.variable == "time":
            return Strange(axis=axis, periodic=amplitude, frequency=shape["frequency"], phase=phase)
        if "centre" in shape:
            return Strange(axis=axis, detent=amplitude, centre=shape["centre"], width=shape["width"])
        return Strange(axis=axis, by_travel=amplitude, waves=shape["waves"], phase=shape["phase"])


def draw_base(rng: np.random.Generator) -> Coefficients:
    """Parameters within 20 % of their nominal values."""
    nominal = Coefficients()
    shares = rng.uniform(1 - SPREAD, 1 + SPREAD, len(DRAWN))
    return nominal._replace(
        **{name: float(share * getattr(nominal, name)) for name, share in zip(DRAWN, shares, strict=True)}
    )
