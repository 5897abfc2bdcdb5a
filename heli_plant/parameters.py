"""The plant's parameters: a table that describes each of them, and a set of their values.

The fields have the paper's symbols (Table 2), so that the equations look as printed. Parameter sets, FMU variables and
command lines use the structured names (``pitch.damping``).
"""

from collections import namedtuple
from collections.abc import Iterator, Mapping
from math import isfinite, radians
from typing import Any, NamedTuple

from .effects import AXES, CATALOGUE
from .errors import PlantError, did_you_mean
from .laws import motor_time_constant
from .tabulated_torque import KNOTS, VARIABLES


class Parameter(NamedTuple):
    """One field of :class:`PlantParameters`; ``symbol`` as in the paper's Table 2, subscript after an underscore."""

    field: str
    name: str
    symbol: str
    unit: str
    default: float
    minimum: float
    maximum: float
    description: str


_Row = tuple[str, str, str, str, float, float, float, str]

_ROWS: tuple[_Row, ...] = (
    # pitch, eq. (2); elevation, eq. (10); travel, eq. (12): values of Table 2
    ("a_wx", "pitch.damping", "a_ωx", "1/s", 0.060, -10.0, 10.0, "pitch damping"),
    ("a_th", "pitch.stiffness", "a_θ", "1/s^2", 0.664, -100.0, 100.0, "pendulum stiffness of the pitch"),
    ("k_x", "pitch.gain", "k_x", "rad/s^2/V", 0.293, -50.0, 50.0, "pitch acceleration per volt of v_f - v_r"),
    ("theta0", "pitch.rest_angle", "θ_0", "rad", radians(-7.8), -3.2, 3.2, "pitch at rest"),
    ("a_wz", "elevation.damping", "a_ωz", "1/s", 0.032, -10.0, 10.0, "elevation damping"),
    ("a_e", "elevation.stiffness", "a_ε", "1/s^2", 2.59, -100.0, 100.0, "elevation stiffness"),
    ("a_1", "elevation.offset", "a_1", "rad/s^2", -0.142, -100.0, 100.0, "elevation offset torque per inertia"),
    ("a_lt", "elevation.coupling", "a_λθ", "1", 0.026, -10.0, 10.0, "coupling of theta' lambda' into elevation"),
    ("k_z", "elevation.gain", "k_z", "rad/s^2/V", 0.157, -50.0, 50.0, "elevation acceleration per volt of v_f + v_r"),
    ("a_wy", "travel.damping", "a_ωy", "1/s", 0.114, -10.0, 10.0, "travel damping"),
    ("k_y", "travel.gain", "k_y", "rad/s^2/V", -0.112, -50.0, 50.0, "travel acceleration per volt and sine of pitch"),
    ("T_m", "motor.time_constant", "T_m", "s", 0.08, 0.0, 5.0, "lag of both motors, eq. (9)"),
    ("v_max", "motor.voltage_limit", "v_max", "V", 5.0, 1e-6, 1000.0, "saturation of both voltages"),
    ("share_front", "rotor.front", "", "1", 1.0, 0.0, 10.0, "share of its thrust that the front rotor gives"),
    ("share_rear", "rotor.rear", "", "1", 1.0, 0.0, 10.0, "the same of the rear rotor, which may be damaged as well"),
    ("ado_offset", "ado.offset_per_metre", "", "rad/s^2/m", 0.5, -100.0, 100.0,
     "shift of a_1 per metre of mass travel"),
    ("ado_stiffness", "ado.stiffness_per_metre", "", "1/s^2/m", 0.1, -100.0, 100.0, "shift of a_e per metre"),
    ("ado_speed", "ado.speed", "", "m/s", 0.05, 0.0, 10.0, "speed limit of the lead screw"),
    ("ado_travel", "ado.travel", "", "m", 0.26, 0.0, 10.0, "the mass moves between plus and minus this"),
    # the general model, eq. (1), in place of the simplified one: values of LAAS report 18040
    ("general_model", "general.enabled", "", "1", 0.0, 0.0, 1.0, "1: eq. (1) from four point masses; 0: simplified"),
    ("m2", "general.mass_arm", "m2", "kg", 1.00, 1e-6, 100.0, "mass at the end of the arm"),
    ("m3", "general.mass_body", "m3", "kg", 0.771, 1e-6, 100.0, "mass of both rotors together"),
    ("l1", "general.length_counterweight", "l1", "m", 0.520, 1e-3, 10.0, "pivot to counterweight"),
    ("l2", "general.length_arm", "l2", "m", 0.650, 1e-3, 10.0, "pivot to helicopter body"),
    ("l3", "general.length_rotor", "l3", "m", 0.180, 1e-3, 10.0, "arm axis to rotor"),
    ("d1", "general.drop_counterweight", "d1", "m", 0.192, -10.0, 10.0, "counterweight below the arm"),
    ("d2", "general.drop_body", "d2", "m", 0.003, -10.0, 10.0, "rotors' mass below the arm axis"),
    ("viscous_travel", "general.viscous_travel", "", "N.m.s", 0.250, 0.0, 100.0, "viscous friction of the travel"),
    ("viscous_elevation", "general.viscous_elevation", "", "N.m.s", 0.050, 0.0, 100.0,
     "viscous friction of the elevation"),
    ("viscous_pitch", "general.viscous_pitch", "", "N.m.s", 0.003, 0.0, 100.0, "viscous friction of the pitch"),
    ("k_gf", "general.drag_torque", "k_gf", "m", -0.067, -10.0, 10.0, "propeller drag torque per newton of thrust"),
    ("k_f", "general.thrust_gain", "k_f", "N/V", 0.217, 0.0, 100.0, "thrust per volt of one rotor"),
)  # fmt: skip


def _effect_rows() -> Iterator[_Row]:
    """Yield those of the catalogue: ``effects.<name>.<axis>`` and ``effects.<name>.<shape>[.<axis>]``, all off."""
    for effect in CATALOGUE:
        name, axis = f"effects.{effect.name}", f".{effect.axis}"
        yield effect.field, name + axis, "c", effect.unit, 0.0, effect.lower, effect.upper, effect.law
        for s in effect.shapes:  # several laws may share one
            name_of_shape = f"{name}.{s.name}{axis if s.field.endswith(f'_{effect.axis}') else ''}"
            yield s.field, name_of_shape, s.symbol, s.unit, s.default, s.lower, s.upper, s.description


def _table_rows() -> Iterator[_Row]:
    """Yield the parameters of the tabulated torques, ``table.<axis>.<what>``, all off."""
    numbers = ", ".join(f"{number}: {name}" for number, name in enumerate(VARIABLES, start=1))
    units = ", ".join(dict.fromkeys(VARIABLES.values()))
    for axis in AXES:
        yield from (
            (f"table_variable_{axis}", f"table.{axis}.variable", "", "1", 0.0, 0.0, float(len(VARIABLES)),
             f"what the {axis}'s table runs over; 0: no table, {numbers}"),
            (f"table_first_{axis}", f"table.{axis}.first", "x_1", "1", 0.0, -1e6, 1e6,
             f"first value of the variable in the table, in its unit ({units})"),
            (f"table_spacing_{axis}", f"table.{axis}.spacing", "", "1", 1.0, 1e-9, 1e6,
             "from one value of the variable in the table to the next, in its unit"),
            *((f"table_torque_{k}_{axis}", f"table.{axis}.torque_{k}", f"y_{k}", "rad/s^2", 0.0, -100.0, 100.0,
               f"acceleration of the {axis} at the value number {k}") for k in range(1, KNOTS + 1)),
        )  # fmt: skip


BY_FIELD: dict[str, Parameter] = {row[0]: Parameter(*row) for row in (*_ROWS, *_effect_rows(), *_table_rows())}
PARAMETERS = tuple(BY_FIELD.values())  # in the order of the fields
BY_NAME: dict[str, Parameter] = {row.name: row for row in PARAMETERS}

_named: Any = namedtuple  # a type checker only knows fields that are literals
_Values: Any = _named("_Values", BY_FIELD, defaults=[row.default for row in PARAMETERS])


class PlantParameters(_Values):
    """All parameters of the plant, in SI units; defaults: Table 2, all effects off."""

    __slots__ = ()

    def __repr__(self) -> str:
        changed = {field: value for field, value in self._asdict().items() if value != BY_FIELD[field].default}
        return f"PlantParameters({', '.join(f'{field}={value!r}' for field, value in changed.items())})"


_Slots: Any = type("_Slots", (), {"__slots__": PlantParameters._fields})


def in_slots(parameters: PlantParameters) -> PlantParameters:
    """Return the values in slots, which Python reads faster than the named fields of a tuple."""
    slots = _Slots()
    for field, value in parameters._asdict().items():
        setattr(slots, field, value)
    return slots


TABLE_2 = PlantParameters()  # the paper's Table 2 with every effect off


def check_parameters(parameters: PlantParameters) -> PlantParameters:
    """Return ``parameters`` unchanged if every value is finite and in its range; else PlantError names one."""
    for row in PARAMETERS:
        value = getattr(parameters, row.field)
        if not isfinite(value) or not row.minimum <= value <= row.maximum:
            unit = f" {row.unit}" if row.unit != "1" else ""
            raise PlantError(f"{row.name} = {value!r}{unit} must lie in [{row.minimum:g}, {row.maximum:g}]{unit}")
    time_constant = motor_time_constant(parameters)
    if time_constant < 0.0:
        raise PlantError(f"motor.time_constant + effects.motor_lag.rotors = {time_constant:g} s must not be negative")
    return parameters


def from_names(values: Mapping[str, float]) -> PlantParameters:
    """Return Table 2 with the parameters of structured names ``values`` set, checked.

    PlantError: a name does not exist (the nearest one is proposed) or a value is out of its range.
    """
    for name in values:
        if name not in BY_NAME:
            raise PlantError(f"unknown plant parameter {name!r}{did_you_mean(name, BY_NAME)}")
    return check_parameters(TABLE_2._replace(**{BY_NAME[name].field: float(value) for name, value in values.items()}))
