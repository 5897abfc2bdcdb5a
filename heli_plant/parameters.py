"""The plant's parameters as a value: one flat set of floats, checked against their table.

Both the interpreted step (inside an FMU) and the compiled one (over a NumPy record with the same fields) read them as
``p.field``.
"""

from collections.abc import Iterator, Mapping
from math import isfinite
from operator import attrgetter
from typing import TYPE_CHECKING, Any, ClassVar

from .errors import ParameterError, did_you_mean
from .laws import motor_time_constant
from .parameter_table import BY_NAME, PARAMETERS

_DEFAULTS = {row.field: row.default for row in PARAMETERS}


class PlantParameters:
    """Every number that the plant's right-hand side reads, in SI units; the defaults are Table 2 with all effects off.

    An immutable value with a named tuple's vocabulary (iteration, ``_fields``, ``_replace``, ``_asdict``). Its values
    are in slots: the interpreter reads a slot about five times faster than a tuple's named field.
    """

    __slots__ = tuple(_DEFAULTS)
    _fields: ClassVar[tuple[str, ...]] = tuple(_DEFAULTS)

    if TYPE_CHECKING:

        def __getattr__(self, field: str) -> float: ...

    def __init__(self, **values: float) -> None:
        _fill(self, {**_DEFAULTS, **values})

    def __setattr__(self, field: str, value: float) -> None:
        raise AttributeError(f"a plant's parameters do not change; _replace({field}=...) gives a changed copy")

    def __iter__(self) -> Iterator[float]:
        return iter(_values(self))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PlantParameters) and _values(self) == _values(other)

    def __hash__(self) -> int:
        return hash(_values(self))

    def __repr__(self) -> str:
        changed = (f"{field}={value!r}" for field, value in self._asdict().items() if value != _DEFAULTS[field])
        return f"PlantParameters({', '.join(changed)})"

    def __reduce__(self) -> tuple[Any, ...]:
        return _from_dict, (self._asdict(),)

    def _replace(self, **values: float) -> "PlantParameters":
        """Return a copy with some fields set; the values are not checked (:func:`checked`)."""
        copy = object.__new__(PlantParameters)
        _fill(copy, {**self._asdict(), **values})
        return copy

    def _asdict(self) -> dict[str, float]:
        """Return every value by its field, in order."""
        return dict(zip(self._fields, _values(self), strict=True))


_values = attrgetter(*_DEFAULTS)
_PUT = tuple(getattr(PlantParameters, field).__set__ for field in _DEFAULTS)
"""Sets each slot, past the class's own refusal: a fit makes thousands of parameter sets."""


def _fill(parameters: PlantParameters, values: dict[str, float]) -> None:
    """Set every field, in order; refuse names that are none."""
    if len(values) > len(_DEFAULTS):
        raise TypeError(f"no fields of a plant's parameters: {', '.join(values.keys() - _DEFAULTS.keys())}")
    for put, value in zip(_PUT, values.values(), strict=True):
        put(parameters, value)


def _from_dict(values: dict[str, float]) -> PlantParameters:
    return PlantParameters(**values)


TABLE_2 = PlantParameters()
"""The paper's Table 2 with every effect off."""


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
    time_constant = motor_time_constant(parameters)
    if time_constant < 0.0:
        raise ParameterError(
            f"motor.time_constant + effects.motor_lag.rotors = {time_constant:g} s must not be negative"
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
