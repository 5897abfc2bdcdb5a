"""A value that ``--set`` gives to a parameter of a unit: of the parameter's type and range, or refused in one sentence.

The sentence names the parameter, the value, what is wanted, the bounds and the unit:
``plant.pitch.damping = 'abc' must be a number in [-10, 10] 1/s``.
"""

from math import isfinite
from typing import Any

from heli_identifier.errors import ConfigurationError
from heli_plant.errors import did_you_mean

Value = float | str

_WANTED = {"Real": "a number", "Integer": "a whole number", "Boolean": "0 or 1"}


def unit_value(unit: str, name: str, text: str, said: str) -> Value:
    """Give ``text`` as a value of the parameter ``name`` of a unit.

    Parameters
    ----------
    unit : str
        A key of :data:`fmu_src.UNITS`.
    name : str
        Structured name of the parameter.
    text : str
        What stands behind the ``=``; true and false are 1 and 0.
    said : str
        What the parameter was called on the command line, with the unit's name in a scenario before it.

    Raises
    ------
    ConfigurationError
        The unit has no such parameter (the nearest one is proposed), or the value is of the wrong type or out of range.
    """
    from fmu_src import problem_with, unit_class

    known = {variable.name: variable for variable in unit_class(unit).variables if variable.causality == "parameter"}
    if name not in known:
        raise ConfigurationError(f"--set {said}: the {unit} has no parameter {name!r}{did_you_mean(name, known)}")
    variable = known[name]._replace(name=said)
    value = text if variable.type == "String" else number_or_text(text)
    if _is_other_type(variable.type, value):
        raise ConfigurationError(f"{said} = {value!r} must be {_wanted(variable)}.")
    problem = problem_with(variable, value)
    if problem is not None:
        raise ConfigurationError(f"{problem}.")
    return value


def _is_other_type(kind: str, value: Value) -> bool:
    """Whether a value is a text where a number is wanted, or a fraction where a whole number is."""
    if isinstance(value, str):
        return kind != "String"
    return kind == "Integer" and isfinite(value) and not value.is_integer()


def number_or_text(text: str) -> Value:
    """Give a text as a number if it is one, true and false as 1 and 0."""
    if text.lower() in ("true", "false"):
        return float(text.lower() == "true")
    try:
        return float(text)
    except ValueError:
        return text


def _wanted(variable: Any) -> str:
    """Say what a parameter (a :class:`fmu_src.Variable`) takes: type, bounds and unit, where it has any."""
    parts = [_WANTED[variable.type]]
    if variable.minimum is not None and variable.maximum is not None:
        parts.append(f"in [{variable.minimum:.6g}, {variable.maximum:.6g}]")
    if variable.unit:
        parts.append(variable.unit)
    return " ".join(parts)
