"""Parameters of the plant: one flat set of floats, and for each its name, unit and range.

The fields carry the paper's symbols (Table 2) so that the equations read as printed; the structured names
(``pitch.damping``) are what parameter sets, FMU variables and command lines use. Both the interpreted step (inside
an FMU) and the compiled one (over a NumPy record with the same fields) read them as ``p.field``.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace
from math import isfinite, radians
from typing import ClassVar, NamedTuple

from .effects import CATALOGUE
from .errors import ParameterError, did_you_mean


@dataclass(frozen=True, slots=True)
class PlantParameters:
    """Every number that the plant's right-hand side reads; the defaults are Table 2 with all effects off.

    It speaks a named tuple's vocabulary (iteration, ``_fields``, ``_replace``, ``_asdict``) but keeps its values in
    slots: the interpreter reads a slot about five times faster than a tuple's named field, and an FMU's step reads
    some two hundred of them.
    """

    _fields: ClassVar[tuple[str, ...]]

    # pitch, eq. (2): theta'' = -a_wx theta' - a_th sin(theta - theta0) + k_x mu_d
    a_wx: float = 0.060
    a_th: float = 0.664
    k_x: float = 0.293
    theta0: float = radians(-7.8)
    # elevation, eq. (10)
    a_wz: float = 0.032
    a_e: float = 2.59
    a_1: float = -0.142
    a_lt: float = 0.026
    k_z: float = 0.157
    # travel, eq. (12)
    a_wy: float = 0.114
    k_y: float = -0.112
    # rotors, eq. (9)
    T_m: float = 0.08
    v_max: float = 5.0
    # ADO: the moving mass's position shifts a_1 and a_e
    ado_offset: float = 0.5
    ado_stiffness: float = 0.1
    ado_speed: float = 0.05
    ado_travel: float = 0.26
    # the effects of the catalogue, in its order
    dry_friction_pitch: float = 0.0
    dry_friction_elevation: float = 0.0
    dry_friction_travel: float = 0.0
    breakaway_friction_pitch: float = 0.0
    breakaway_friction_elevation: float = 0.0
    breakaway_friction_travel: float = 0.0
    quadratic_drag_pitch: float = 0.0
    quadratic_drag_elevation: float = 0.0
    quadratic_drag_travel: float = 0.0
    constant_torque_pitch: float = 0.0
    constant_torque_travel: float = 0.0
    rotor_mismatch_pitch: float = 0.0
    quadratic_thrust_rotors: float = 0.0
    reverse_thrust_loss_rotors: float = 0.0
    dead_zone_rotors: float = 0.0
    motor_lag_rotors: float = 0.0
    input_delay_rotors: float = 0.0
    thrust_fade_rotors: float = 0.0
    airspeed_thrust_loss_pitch: float = 0.0
    airspeed_thrust_loss_elevation: float = 0.0
    gyroscopic_coupling_pitch: float = 0.0
    gyroscopic_coupling_elevation: float = 0.0
    rotor_drag_torque_travel: float = 0.0
    cable_stiffness_travel: float = 0.0
    inertial_coupling_elevation: float = 0.0
    inertial_coupling_travel: float = 0.0
    large_angle_gravity_elevation: float = 0.0
    pitch_gravity_coupling_pitch: float = 0.0
    ground_effect_elevation: float = 0.0
    arm_bending_elevation: float = 0.0
    moving_mass_elevation: float = 0.0
    # their shapes
    stribeck_rate_pitch: float = 0.05
    stribeck_rate_elevation: float = 0.05
    stribeck_rate_travel: float = 0.05
    horizontal_offset: float = 0.0
    ground_elevation: float = -0.5
    ground_height: float = 0.15
    bending_frequency: float = 3.0
    bending_damping: float = 0.05
    moving_mass_time: float = 0.0
    # the general model, eq. (1), in place of the simplified one; values of LAAS report 18040
    general_model: float = 0.0
    m2: float = 1.00
    m3: float = 0.771
    l1: float = 0.520
    l2: float = 0.650
    l3: float = 0.180
    d1: float = 0.192
    d2: float = 0.003
    viscous_travel: float = 0.250
    viscous_elevation: float = 0.050
    viscous_pitch: float = 0.003
    k_gf: float = -0.067
    k_f: float = 0.217

    def __iter__(self) -> Iterator[float]:
        return (getattr(self, field) for field in self._fields)

    def _replace(self, **values: float) -> "PlantParameters":
        """Return a copy with some fields set; the values are not checked (:func:`checked`)."""
        return replace(self, **values)

    def _asdict(self) -> dict[str, float]:
        """Return every value by its field, in order."""
        return dict(zip(self._fields, self, strict=True))


PlantParameters._fields = tuple(field.name for field in fields(PlantParameters))

TABLE_2 = PlantParameters()
"""The paper's Table 2 with every effect off."""


class Parameter(NamedTuple):
    """What there is to know about one field of :class:`PlantParameters`."""

    field: str
    name: str
    symbol: str
    unit: str
    minimum: float
    maximum: float
    description: str

    @property
    def default(self) -> float:
        """Value in :data:`TABLE_2`."""
        return getattr(TABLE_2, self.field)


_BASE = (
    Parameter("a_wx", "pitch.damping", "a_wx", "1/s", -10.0, 10.0, "pitch damping"),
    Parameter("a_th", "pitch.stiffness", "a_th", "1/s^2", -100.0, 100.0, "pendulum stiffness of the pitch"),
    Parameter("k_x", "pitch.gain", "k_x", "rad/s^2/V", -50.0, 50.0, "pitch acceleration per volt of v_f - v_r"),
    Parameter("theta0", "pitch.rest_angle", "theta0", "rad", -3.2, 3.2, "pitch at rest"),
    Parameter("a_wz", "elevation.damping", "a_wz", "1/s", -10.0, 10.0, "elevation damping"),
    Parameter("a_e", "elevation.stiffness", "a_e", "1/s^2", -100.0, 100.0, "elevation stiffness"),
    Parameter("a_1", "elevation.offset", "a_1", "rad/s^2", -100.0, 100.0, "elevation offset torque per inertia"),
    Parameter("a_lt", "elevation.coupling", "a_lt", "1", -10.0, 10.0, "coupling of theta' lambda' into elevation"),
    Parameter("k_z", "elevation.gain", "k_z", "rad/s^2/V", -50.0, 50.0, "elevation acceleration per volt of v_f + v_r"),
    Parameter("a_wy", "travel.damping", "a_wy", "1/s", -10.0, 10.0, "travel damping"),
    Parameter("k_y", "travel.gain", "k_y", "rad/s^2/V", -50.0, 50.0, "travel acceleration per volt and sine of pitch"),
    Parameter("T_m", "motor.time_constant", "T_m", "s", 0.0, 5.0, "lag of both motors, eq. (9)"),
    Parameter("v_max", "motor.voltage_limit", "v_max", "V", 1e-6, 1000.0, "saturation of both voltages"),
    Parameter(
        "ado_offset", "ado.offset_per_metre", "", "rad/s^2/m", -100.0, 100.0, "shift of a_1 per metre of mass travel"
    ),
    Parameter("ado_stiffness", "ado.stiffness_per_metre", "", "1/s^2/m", -100.0, 100.0, "shift of a_e per metre"),
    Parameter("ado_speed", "ado.speed", "", "m/s", 0.0, 10.0, "speed limit of the lead screw"),
    Parameter("ado_travel", "ado.travel", "", "m", 0.0, 10.0, "the mass moves between plus and minus this"),
)

_GENERAL = (
    Parameter(
        "general_model", "general.enabled", "", "1", 0.0, 1.0, "1: eq. (1) from four point masses; 0: simplified"
    ),
    Parameter("m2", "general.mass_arm", "m2", "kg", 1e-6, 100.0, "mass at the end of the arm"),
    Parameter("m3", "general.mass_body", "m3", "kg", 1e-6, 100.0, "mass of both rotors together"),
    Parameter("l1", "general.length_counterweight", "l1", "m", 1e-3, 10.0, "pivot to counterweight"),
    Parameter("l2", "general.length_arm", "l2", "m", 1e-3, 10.0, "pivot to helicopter body"),
    Parameter("l3", "general.length_rotor", "l3", "m", 1e-3, 10.0, "arm axis to rotor"),
    Parameter("d1", "general.drop_counterweight", "d1", "m", -10.0, 10.0, "counterweight below the arm"),
    Parameter("d2", "general.drop_body", "d2", "m", -10.0, 10.0, "rotors' mass below the arm axis"),
    Parameter("viscous_travel", "general.viscous_travel", "", "N.m.s", 0.0, 100.0, "viscous friction of the travel"),
    Parameter(
        "viscous_elevation", "general.viscous_elevation", "", "N.m.s", 0.0, 100.0, "viscous friction of the elevation"
    ),
    Parameter("viscous_pitch", "general.viscous_pitch", "", "N.m.s", 0.0, 100.0, "viscous friction of the pitch"),
    Parameter("k_gf", "general.drag_torque", "k_gf", "m", -10.0, 10.0, "propeller drag torque per newton of thrust"),
    Parameter("k_f", "general.thrust_gain", "k_f", "N/V", 0.0, 100.0, "thrust per volt of one rotor"),
)


def _of_effects():
    """Parameters of the catalogue: ``effects.<name>.<axis>`` and ``effects.<name>.<shape>[.<axis>]``."""
    rows, seen = [], set()
    for e in CATALOGUE:
        rows.append(Parameter(e.field, f"effects.{e.name}.{e.axis}", "c", e.unit, e.lower, e.upper, e.law))
        for s in e.shapes:
            per_axis = s.field.endswith(f"_{e.axis}")
            name = f"effects.{e.name}.{s.name}" + (f".{e.axis}" if per_axis else "")
            if s.field not in seen:
                seen.add(s.field)
                rows.append(Parameter(s.field, name, s.name, s.unit, s.lower, s.upper, s.description))
    return tuple(rows)


PARAMETERS: tuple[Parameter, ...] = (*_BASE, *_of_effects(), *_GENERAL)
"""Metadata of every field of :class:`PlantParameters`."""

BY_NAME: dict[str, Parameter] = {row.name: row for row in PARAMETERS}
BY_FIELD: dict[str, Parameter] = {row.field: row for row in PARAMETERS}


def checked(parameters: PlantParameters) -> PlantParameters:
    """Return ``parameters`` unchanged if every value is finite and in its range.

    Raises
    ------
    ParameterError
        Names the parameter, its value, its range and unit.
    """
    for row in PARAMETERS:
        value = getattr(parameters, row.field)
        if not isfinite(value) or not row.minimum <= value <= row.maximum:
            raise ParameterError(
                f"{row.name} = {value!r} {row.unit} must lie in [{row.minimum:g}, {row.maximum:g}] {row.unit}"
            )
    if parameters.T_m + parameters.motor_lag_rotors < 0.0:
        raise ParameterError(
            f"motor.time_constant + effects.motor_lag.rotors = {parameters.T_m + parameters.motor_lag_rotors:g} s "
            "must not be negative"
        )
    return parameters


def from_names(values: Mapping[str, float], start: PlantParameters = TABLE_2) -> PlantParameters:
    """Return ``start`` with the parameters of structured names ``values`` set, checked.

    Raises
    ------
    ParameterError
        A name does not exist (the nearest one is proposed) or a value is out of its range.
    """
    for name in values:
        if name not in BY_NAME:
            raise ParameterError(f"unknown plant parameter {name!r}{did_you_mean(name, BY_NAME)}")
    return checked(start._replace(**{BY_NAME[name].field: float(value) for name, value in values.items()}))


def to_names(parameters: PlantParameters) -> dict[str, float]:
    """Return every parameter by its structured name."""
    return {row.name: getattr(parameters, row.field) for row in PARAMETERS}
