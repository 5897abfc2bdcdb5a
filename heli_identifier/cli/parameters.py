"""Parameters that a command was given: ``--set name=value`` and ``--parameters FILE``."""

from collections.abc import Sequence
from pathlib import Path

from heli_identifier.errors import ConfigurationError

Value = float | str


def assignments(words: Sequence[str]) -> dict[str, Value]:
    """Give ``name=value`` words as a mapping; a value that is no number stays text, true and false become 1 and 0.

    Raises
    ------
    ConfigurationError
        A word has no ``=``.
    """
    values: dict[str, Value] = {}
    for word in words:
        name, mark, text = word.partition("=")
        if not mark or not name.strip():
            raise ConfigurationError(f"--set {word} must read NAME=VALUE, as plant.effects.dry_friction.pitch=0.02.")
        values[name.strip()] = _value(text.strip())
    return values


def _value(text: str) -> Value:
    if text.lower() in ("true", "false"):
        return float(text.lower() == "true")
    try:
        return float(text)
    except ValueError:
        return text


def by_unit(file: Path | None) -> dict[str, dict[str, float]]:
    """Give the start values of a parameters.json under the unit that it names.

    Raises
    ------
    ConfigurationError
        The file cannot be used.
    """
    if file is None:
        return {}
    from heli_identifier.cli.parameter_file import parameter_set

    parameters = parameter_set(file)
    return {parameters.unit: parameters.start_values}


def in_scenario(scenario: str, file: Path | None, words: Sequence[str]) -> dict[str, Value]:
    """Give all parameters by unit name in a scenario; ``--set`` outranks the file.

    Raises
    ------
    ConfigurationError, WiringError
        The file cannot be used, the scenario is unknown or has no unit that takes the file's parameters.
    """
    from fmu_src.wiring import scenario as wiring

    values: dict[str, Value] = {}
    units = wiring(scenario).units
    for kind, start_values in by_unit(file).items():
        names = [name for name, unit in units if unit == kind]
        if not names:
            raise ConfigurationError(f"{file} holds parameters of {kind}, which scenario {scenario} does not have.")
        values |= {f"{name}.{key}": value for name in names for key, value in start_values.items()}
    return values | assignments(words)
