"""The declaration of an effect, and the vocabulary of the laws.

A law is a function of plain floats with a docstring and one ``return``, under :func:`declared`. It has the name of its
effect, followed by ``_<axis>`` if each axis has its own law. Its arguments are ``c``, the names of the effect's shapes,
names of :data:`VOCABULARY` and fields of the plant's parameters (``a_e``, ``horizontal_offset``, ...).

At the place ACCELERATION it returns what is added to the axis [rad/s^2], at BENDING to the bending mode. At VOLTAGE,
THRUST, LAG, DELAY it returns the new value of its argument ``voltage``, ``nu``, ``time_constant``, ``delay``.

A published law writes the symbols of the vocabulary and of the shapes, a product without a sign between the factors,
``condition: law, else law`` if it has two branches, and ``x -> law`` if it replaces x.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

AXES = ("pitch", "elevation", "travel")
ROTORS = "rotors"

ACCELERATION, VOLTAGE, THRUST, LAG, DELAY, BENDING = "acceleration", "voltage", "thrust", "lag", "delay", "bending"
"""Places at which a law enters the plant."""

VOCABULARY = {
    "time": ("t", "s", "since the record began"),
    "pitch": ("theta", "rad", "angle of the pitch"),
    "elevation": ("eps", "rad", "angle of the elevation, as its encoder counts it"),
    "travel": ("lambda", "rad", "angle of the travel"),
    "horizontal_elevation": ("eps_h", "rad", "elevation from the horizontal arm, eps + eps_0"),
    "travel_rest": ("lambda(0)", "rad", "travel at the record's start"),
    "pitch_rate": ("theta'", "rad/s", "rate of the pitch"),
    "elevation_rate": ("eps'", "rad/s", "rate of the elevation"),
    "travel_rate": ("lambda'", "rad/s", "rate of the travel"),
    "rate": ("w", "rad/s", "rate of the axis that the effect acts on"),
    "mu_sum": ("mu_s", "V", "sum of the rotors' thrust voltages"),
    "mu_diff": ("mu_d", "V", "difference of the rotors' thrust voltages, front less rear"),
    "voltage": ("v", "V", "one rotor's voltage between saturation and motor lag, at the place VOLTAGE"),
    "nu": ("nu", "V", "one rotor's voltage behind the motor lag, at the place THRUST"),
    "time_constant": ("T_m", "s", "time constant of the motors, at the place LAG"),
    "delay": ("tau", "s", "delay of the voltages, at the place DELAY"),
    "bending": ("q", "rad", "deflection of the arm's bending mode, at the place BENDING"),
    "bending_rate": ("q'", "rad/s", "its rate"),
}
"""Names that the arguments of a law may have, with their symbol in the published law, unit and meaning."""

STEP_TIMES, LOWEST_ELEVATION = "step times", "lowest elevation"
"""Sources of a shape's first values in a search, if they are not on its grid: the times at which a step of the axis's
torque would explain most; the lowest elevation in the logs."""

PAPER_NEGLECTS = "paper, section 2.3 (neglected)"
SISTER_RIGS = "reports on sister rigs"
THRUST_MAP = "LAAS report 18040, thrust map"


@dataclass(frozen=True)
class Shape:
    """A parameter of a law other than its coefficient."""

    name: str
    field: str  # of the plant's parameters
    symbol: str  # in the published law
    unit: str
    default: float
    lower: float
    upper: float
    description: str
    grid: tuple[float, ...] = ()  # values that a search starts from; the default if it is empty
    start: str = "grid"  # source of these values
    estimated: bool = True  # False: it is given, or shared by several laws
    difference_step: float | None = None  # step of its numerical derivative if the response has corners


@dataclass(frozen=True)
class Effect:
    """One effect on one axis, or on the rotors; name and axis stand in parameter sets, FMU variables and reports."""

    name: str
    axis: str
    function: Callable[..., float]
    law: str  # the same in the published notation
    unit: str  # of the coefficient c
    lower: float  # plausible range of c, including its sign
    upper: float
    source: str
    family: str  # effects that usual logs of a bench hardly distinguish; they are one finding
    experiment: str  # measurement that shows the effect
    drawn_against: str | None = None  # variable of its curve; "other_rate": of the axis that it couples with
    place: str = ACCELERATION
    shapes: tuple[Shape, ...] = ()
    certain: bool = False  # every rig has it, as a term of rigid-body mechanics with c = 1

    @property
    def field(self) -> str:
        """Name of the coefficient in :class:`heli_plant.parameters.PlantParameters`."""
        return f"{self.name}_{self.axis}"

    @property
    def arguments(self) -> tuple[str, ...]:
        """Names of the law's arguments, in order."""
        code = self.function.__code__
        return code.co_varnames[: code.co_argcount]


Law = TypeVar("Law", bound=Callable[..., float])

DECLARED: list[Effect] = []  # every effect on every axis, in the order of the files and in the files


def declared(
    published: str, *axes: str, bounds: tuple[float, float], shapes: tuple[Shape, ...] = (), family: str = "",
    **others: Any,
) -> Callable[[Law], Law]:  # fmt: skip
    """Enter the law below into the catalogue, on each of ``axes``, or on :data:`ROTORS`; ``bounds`` are those of c.

    ``{axis}`` in a family and in the field of a shape stands for the axis. Without a ``family`` the effect has one of
    its own. ``others`` are further fields of :class:`Effect`.
    """

    def enter(law: Law) -> Law:
        for axis in axes:
            name = law.__name__.removesuffix(f"_{axis}")
            of_axis = tuple(replace(shape, field=shape.field.format(axis=axis)) for shape in shapes)
            finding = (family or f"{name.replace('_', ' ')} of the {axis}").format(axis=axis)
            DECLARED.append(Effect(name, axis, law, published, lower=bounds[0], upper=bounds[1], shapes=of_axis,
                                   family=finding, **others))  # fmt: skip
        return law

    return enter
