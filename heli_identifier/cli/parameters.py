"""Parameters that a command was given: ``--set name=value`` and ``--parameters FILE``.

A value of ``--set`` must be of its parameter's type and in its range. The refusal names the parameter, the value, what
is wanted, the bounds and the unit: ``plant.pitch.damping = 'abc' must be a number in [-10, 10] 1/s``.
"""

from collections.abc import Collection, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

from heli_identifier.errors import ConfigurationError
from heli_plant.errors import did_you_mean

Value = float | str

_WANTED = {"Real": "a number", "Integer": "a whole number", "Boolean": "0 or 1"}


def assignments(words: Sequence[str]) -> dict[str, str]:
    """Give ``name=value`` words as a mapping.

    Raises
    ------
    ConfigurationError
        A word has no ``=``, or two name the same parameter.
    """
    values: dict[str, str] = {}
    for word in words:
        name, mark, text = word.partition("=")
        if not mark or not name.strip():
            raise ConfigurationError(f"--set {word} must read NAME=VALUE, as plant.effects.dry_friction.pitch=0.02.")
        if name.strip() in values:
            raise ConfigurationError(f"--set {name.strip()} is given twice; keep one.")
        values[name.strip()] = text.strip()
    return values


def of_unit(unit: str, words: Sequence[str]) -> dict[str, Value]:
    """Give ``name=value`` words as parameters of one unit, checked.

    Raises
    ------
    ConfigurationError
        A word has no ``=``, or the unit does not take the parameter or its value.
    """
    return {name: unit_value(unit, name, text, name) for name, text in assignments(words).items()}


def by_unit(file: Path | None) -> dict[str, dict[str, float]]:
    """Give the start values of a parameters.json under the unit that it names.

    Raises
    ------
    ConfigurationError
        The file cannot be used.
    """
    if file is None:
        return {}
    from heli_identifier.results import read_parameters

    parameters = read_parameters(file)
    return {parameters.unit: parameters.start_values}


def in_scenario(
    scenario: str, file: Path | None, words: Sequence[str], foreign: Collection[str] = ()
) -> dict[str, Value]:
    """Give all parameters by unit name in a scenario; ``--set`` outranks the file.

    Parameters
    ----------
    scenario : str
    file : Path or None
        parameters.json.
    words : sequence of str
        ``unit.parameter=value``.
    foreign : collection of str
        Names of units that come as FMU files; their parameters are not checked here.

    Raises
    ------
    ConfigurationError, WiringError
        The file or a value cannot be used, the scenario is unknown or has no unit that takes the file's parameters.
    """
    from fmu_src import scenario as wiring

    values: dict[str, Value] = {}
    units = dict(wiring(scenario).units)
    for kind, start_values in by_unit(file).items():
        names = [name for name, unit in units.items() if unit == kind]
        # a corrector begins with the values of the plant that it corrects
        names += [name for name, unit in units.items() if names and (kind, unit) == ("HelicopterPlant", "Corrector")]
        if not names:
            raise ConfigurationError(f"{file} holds parameters of {kind}, which scenario {scenario} does not have.")
        values |= {f"{name}.{key}": value for name in names for key, value in start_values.items()}
    for label, text in assignments(words).items():
        unit, _, name = label.partition(".")
        if not name:
            raise ConfigurationError(f"--set {label}={text} must name unit and parameter, as plant.pitch.damping=0.1.")
        known = unit in units and unit not in foreign
        values[label] = unit_value(units[unit], name, text, label) if known else number_or_text(text)
    return values


def unit_value(unit: str, name: str, text: str, label: str) -> Value:
    """Give ``text`` as a value of the parameter ``name`` of a unit.

    Parameters
    ----------
    unit : str
        A key of :data:`fmu_src.UNITS`.
    name : str
        Structured name of the parameter.
    text : str
        The text after the ``=``; true and false are 1 and 0.
    label : str
        What the command line called the parameter: in a scenario, with the name of the unit before it.

    Raises
    ------
    ConfigurationError
        The unit has no such parameter (the nearest one is proposed), or the value is of the wrong type or out of range.
    """
    from fmu_src import problem_with, unit_class

    known = {variable.name: variable for variable in unit_class(unit).variables if variable.causality == "parameter"}
    if name not in known:
        raise ConfigurationError(f"--set {label}: the {unit} has no parameter {name!r}{did_you_mean(name, known)}")
    variable = known[name]._replace(name=label)
    value = text if variable.type == "String" else number_or_text(text)
    if _is_other_type(variable.type, value):
        raise ConfigurationError(f"{label} = {value!r} must be {_wanted(variable)}.")
    if isinstance(value, str) and not value.isprintable():
        raise ConfigurationError(
            f"{label} = {value!r} holds a character that is no text in XML; a model description cannot state it."
        )
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
