"""The forms in which functions take parameters: a parameters.json, which is checked, a parameter set, a diagnosis."""

from os import PathLike
from pathlib import Path

from heli_identifier.errors import ConfigurationError, refuse
from heli_identifier.results.diagnosis import Diagnosis
from heli_identifier.results.documents import damage_error, read_document
from heli_identifier.results.parameters import ParameterSet, corrected_parameters
from heli_plant.parameters import PlantParameters

ParameterSource = ParameterSet | Diagnosis | str | PathLike[str]
PlantSource = ParameterSource | PlantParameters
"""What every function takes as the parameters of a plant; a path is that of a parameters.json."""


def parameter_set(parameters: ParameterSource) -> ParameterSet:
    """Return the parameters of a diagnosis or of a parameters.json, or a parameter set as it is."""
    if isinstance(parameters, str | PathLike):
        return read_parameters(parameters)
    if isinstance(parameters, Diagnosis):
        return corrected_parameters(parameters)
    return parameters


def to_plant(source: PlantSource) -> PlantParameters:
    """Return the plant of parameters in any form; raises as :func:`parameter_set` and :meth:`ParameterSet.plant` do."""
    return source if isinstance(source, PlantParameters) else parameter_set(source).plant()


def read_parameters(path: str | PathLike[str]) -> ParameterSet:
    """Read a parameters.json, and check that its values are parameters of the unit that it names.

    A ConfigurationError names file and entry: the file cannot be read, is no JSON or not of the schema, an entry is
    missing, of the wrong type or not finite, a plant's parameter is missing, or the unit has no such parameter, states
    it in another unit or does not take its value.
    """
    parameters = read_document(path, ParameterSet)
    if joint := parameters.covariance:
        names, count = {*joint.names, *joint.not_determined}, len(joint.names)
        if unknown := names - {*parameters.values}:
            raise damage_error(path, f"covariance names {min(unknown)!r}, which is none of the values")
        if joint.matrix.shape != (count, count):
            raise damage_error(path, f"covariance.matrix must have {count} rows of {count} numbers")
    _check_unit(Path(path), parameters)
    return parameters


def _check_unit(file: Path, given: ParameterSet) -> None:
    """Refuse values that are not parameters of the unit that the file names, or that the unit does not take."""
    from fmu_src import UNITS, parameters_of, problem_with, unit_class

    refuse(given.unit not in UNITS, f"{file} names the unit {given.unit!r}; there are {', '.join(UNITS)}.")
    variables = parameters_of(unit_class(given.unit))
    for name, value in given.values.items():
        refuse(name not in variables, f"{file} is of the unit {given.unit}, which has no parameter {name!r}.")
        unit = variables[name].unit or "1"
        mismatch = f"{name} is stated in {value.unit!r}, the {given.unit} takes it in {unit!r}"
        refuse((value.unit or "1") != unit, f"{file}: {mismatch}; convert value and standard error.")
        if problem := problem_with(variables[name], value.value):
            raise ConfigurationError(f"{file}: {problem}.")
    given.check_unit(given.unit)
