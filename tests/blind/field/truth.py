"""The truth of one field rig: base model, effects, what varies from log to log, air, controller and touches.

The elevation is counted from the encoder's zero of the rig; z = ``horizontal_offset`` is the elevation of the arm from
the horizontal where that zero is. The weight of the arm is A sin(e + z) + B cos(e + z), which is the catalogue's
a_e sin(e) + a_1 cos(e) with

    a_e = A cos(z) - B sin(z),    a_1 = A sin(z) + B cos(z).

One log reads e + its own encoder zero, and applies its own gain times the voltages that it writes down.
"""

import math
from dataclasses import dataclass, field

from tests.blind.coefficients import Coefficients
from tests.blind.field.control import Control
from tests.blind.rigs import SHAPE_FIELDS, Effect, Room


@dataclass(frozen=True)
class Touch:
    """A push by a hand.

    Attributes
    ----------
    axis
        pitch, elevation or travel.
    start, end
        Times since the log's first sample [s].
    acceleration
        Angular acceleration while the hand pushes, with its sign [rad/s^2].
    """

    axis: str
    start: float
    end: float
    acceleration: float


@dataclass(frozen=True)
class Air:
    """Torque of the rotors' own wash: Ornstein-Uhlenbeck on each axis, times mu_s over its value in hover.

    Attributes
    ----------
    torque_std
        Standard deviation in hover on pitch, elevation and travel [rad/s^2].
    torque_time
        Correlation time [s].
    """

    torque_std: tuple[float, float, float] = (0.0, 0.0, 0.0)
    torque_time: float = 1.0


@dataclass(frozen=True)
class LogTruth:
    """What one log must not tell.

    Attributes
    ----------
    seed
        Of the references, the start, the air, the room and the encoders.
    duration
        Length [s].
    zeros
        What the encoders read where pitch, elevation and travel are zero [rad].
    gain
        Applied voltage over written voltage, both rotors [1].
    trims
        Constant torque on pitch, elevation and travel, of this log alone [rad/s^2].
    touches
        Pushes by a hand.
    """

    seed: int
    duration: float
    zeros: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gain: float = 1.0
    trims: tuple[float, float, float] = (0.0, 0.0, 0.0)
    touches: tuple[Touch, ...] = ()


@dataclass(frozen=True)
class FieldTruth:
    """Everything that makes one field rig different from another.

    Attributes
    ----------
    kind
        As for `draw_field_rig`.
    base
        Base model in the catalogue's words: a_e and a_1 about the encoder's zero, t_m the assumed motor lag.
    effects
        All that acts beyond the base model, in the catalogue's words and units; the surplus of the motor lag, inertial
        coupling and trigonometric gravity among them.
    horizontal_offset
        Elevation of the arm from the horizontal where the encoder of the rig has its zero [rad].
    hover
        Elevation about which the rig is flown [rad] and the thrust it takes, as mu_s [V].
    presliding
        How far the bristles of dry friction bend before it slips; 0 for ideal sticking [rad].
    air, room
        Random torques, shake of the encoders.
    control
        The controller.
    closed_loop
        False where the voltages are those of an experiment in open loop.
    rate
        Sampling and control rate [Hz].
    liveliness
        Size of the pilot's references, 1 for the usual [1].
    logs
        What each log has of its own.
    """

    kind: str
    base: Coefficients
    effects: tuple[Effect, ...]
    horizontal_offset: float
    hover: tuple[float, float]
    presliding: float
    air: Air
    room: Room
    control: Control
    closed_loop: bool
    rate: float
    liveliness: float
    logs: tuple[LogTruth, ...] = field(default=())

    def coefficients(self) -> Coefficients:
        """Numbers for the integration, the weight of the arm turned to the horizontal."""
        z, a_e, a_1 = self.horizontal_offset, self.base.a_e, self.base.a_1
        numbers: dict[str, float] = {"presliding": self.presliding, "elevation_zero": z}
        for effect in self.effects:
            numbers[effect.field] = effect.coefficient
            numbers |= {SHAPE_FIELDS[name]: value for name, value in effect.shape.items()}
            if effect.name == "large_angle_gravity":
                from_horizontal = a_e * math.cos(z) + a_1 * math.sin(z)
                numbers["a_e"] = from_horizontal
                numbers["a_1"] = a_1 * math.cos(z) - a_e * math.sin(z) + from_horizontal * z
            if effect.name == "rotor_drag_torque":
                # The blind law has cos(e + z), the catalogue's cos(e): equal torques in hover.
                numbers[effect.field] *= math.cos(self.hover[0]) / math.cos(self.hover[0] + z)
        return self.base._replace(**numbers)
