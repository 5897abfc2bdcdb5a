"""A parameters.json that a command was given: its values must be parameters of the unit that it names."""

from pathlib import Path
from typing import TYPE_CHECKING

from heli_identifier.errors import ConfigurationError

if TYPE_CHECKING:
    from heli_identifier.workbench.delivery.parameter_set import ParameterSet


def parameter_set(file: Path) -> "ParameterSet":
    """Read a parameters.json whose values are the parameters of the unit that it names.

    Raises
    ------
    ConfigurationError
        The file cannot be read, or an entry is missing, damaged, of another unit or out of range; file and entry are
        named.
    """
    from heli_identifier.workbench.delivery.parameter_set import read_parameter_set

    parameters = read_parameter_set(file)
    check_unit(file, parameters)
    return parameters


def check_unit(file: Path, parameters: "ParameterSet") -> None:
    """Refuse values that are not parameters of the unit that the file names, or that it does not take.

    Raises
    ------
    ConfigurationError
        The first value that is not, and the unit that has them if there is one; or its bounds and unit.
    """
    from fmu_src import UNITS, problem_with, unit_class

    if parameters.unit not in UNITS:
        raise ConfigurationError(f"{file} names the unit {parameters.unit!r}; there are {', '.join(UNITS)}.")
    names = {name: {v.name: v for v in unit_class(name).variables if v.causality == "parameter"} for name in UNITS}
    own = names[parameters.unit]
    foreign = [name for name in parameters.values if name not in own]
    if not foreign:
        for name, value in parameters.start_values.items():
            if problem := problem_with(own[name], value):
                raise ConfigurationError(f"{file}: {problem}.")
        return
    owners = [unit for unit in UNITS if parameters.values.keys() <= names[unit].keys()]
    whose = f"; its values are of the {owners[0]}, name that as its unit" if owners else ""
    raise ConfigurationError(f"{file} is of the unit {parameters.unit}, which has no parameter {foreign[0]!r}{whose}.")
