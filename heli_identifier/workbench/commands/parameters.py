"""Parameters that a command was given: ``--set name=value`` and ``--parameters FILE``."""

from collections.abc import Collection, Sequence
from pathlib import Path

from heli_identifier.errors import ConfigurationError
from heli_identifier.workbench.commands.unit_value import Value, number_or_text, unit_value


def assignments(words: Sequence[str]) -> dict[str, str]:
    """Give ``name=value`` words as a mapping.

    Raises
    ------
    ConfigurationError
        A word has no ``=``.
    """
    values: dict[str, str] = {}
    for word in words:
        name, mark, text = word.partition("=")
        if not mark or not name.strip():
            raise ConfigurationError(f"--set {word} must read NAME=VALUE, as plant.effects.dry_friction.pitch=0.02.")
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
    from heli_identifier.workbench.commands.parameter_file import parameter_set

    parameters = parameter_set(file)
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
        Names of units that come as FMU files: what those take is theirs to say.

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
        if not names:
            raise ConfigurationError(f"{file} holds parameters of {kind}, which scenario {scenario} does not have.")
        values |= {f"{name}.{key}": value for name in names for key, value in start_values.items()}
    for said, text in assignments(words).items():
        unit, _, name = said.partition(".")
        if not name:
            raise ConfigurationError(f"--set {said}={text} must name unit and parameter, as plant.pitch.damping=0.1.")
        known = unit in units and unit not in foreign
        values[said] = unit_value(units[unit], name, text, said) if known else number_or_text(text)
    return values
