"""A parameters.json read back: every entry typed, and every value one that the unit takes."""

import json
from collections.abc import Mapping
from functools import reduce
from math import isfinite
from operator import getitem
from os import PathLike
from pathlib import Path
from reprlib import repr
from sys import float_info
from typing import Annotated, Any, TypeVar

import msgspec
import numpy as np

from heli_identifier.errors import ConfigurationError
from heli_identifier.files import regular_bytes
from heli_identifier.online import Estimate
from heli_identifier.results.parameters import SCHEMA, Covariance, Expectation, ParameterSet
from heli_identifier.tracing import ErrorFigure
from heli_plant.effects import AXES

Kind = TypeVar("Kind")

LARGEST_MB = 50.0
"""Size up to which a parameters.json is read [MB]; it has some kilobytes."""


def read_parameters(path: str | PathLike[str]) -> ParameterSet:
    """Read a parameters.json, and check that its values are parameters of the unit that it names.

    Parameters
    ----------
    path : path
        As `heli diagnose`, `heli identify` or `heli linearise` writes it.

    Raises
    ------
    ConfigurationError
        The file cannot be read, is no JSON or not of the schema, an entry is missing, there twice, of the wrong type or
        not finite, a plant's parameter is missing, or the unit has no such parameter, states it in another unit or does
        not take its value; file and entry are named.
    """
    file = Path(path)
    if file.is_dir():
        raise ConfigurationError(f"{path} is a folder; name the parameters.json in it.")
    try:
        content = json.loads(regular_bytes(file, LARGEST_MB).decode("utf-8"), object_pairs_hook=_once)
    except _Repeated as error:
        raise ConfigurationError(f"{path} is damaged: the key {str(error)!r} stands there twice; keep one.") from error
    except FileNotFoundError:
        raise ConfigurationError(f"{path} does not exist; `heli diagnose` writes a parameters.json.") from None
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be read: {error.strerror}.") from error
    except (ValueError, RecursionError) as error:
        raise ConfigurationError(f"{path} is no JSON: {error}.") from error
    schema = content.get("schema") if isinstance(content, dict) else None
    if schema != SCHEMA:
        raise ConfigurationError(f"{path} must hold an object of schema {SCHEMA!r}, its schema is {repr(schema)}.")
    try:
        parameters = _parameter_set(content)
    except ValueError as error:
        raise ConfigurationError(
            f"{path} is damaged: {error}; write it again with `heli diagnose` or `heli identify`."
        ) from error
    _check_unit(file, parameters)
    return parameters


Finite = Annotated[float, msgspec.Meta(ge=-float_info.max, le=float_info.max)]
NotNegative = Annotated[float, msgspec.Meta(ge=0.0, le=float_info.max)]
"""What Python reads as JSON may hold NaN and Infinity."""


class _Repeated(Exception):
    """A key stands twice in one object of the file."""


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Make an object of its entries.

    Raises
    ------
    _Repeated
        Two have the same key; JSON would keep the last without a word.
    """
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise _Repeated(key)
        found[key] = value
    return found


class _Document(msgspec.Struct):
    """The sections of a parameters.json; entries are read one by one, so that messages can name them."""

    unit: str
    values: dict[str, Any]
    expected: dict[str, Any]
    provenance: dict[str, Any]
    covariance: dict[str, Any] | None = None


class _Value(msgspec.Struct):
    value: Finite
    standard_error: NotNegative | None
    unit: str


class _Figure(msgspec.Struct):
    value: NotNegative
    low: NotNegative
    high: NotNegative


class _Expected(msgspec.Struct):
    prediction_1s_rad: _Figure
    noise_floor_rad: NotNegative


class _Covariance(msgspec.Struct):
    names: tuple[str, ...]
    logarithms: tuple[str, ...]
    operating_point_v: Finite
    matrix: tuple[tuple[Finite, ...], ...]


def _parameter_set(content: Mapping[str, Any]) -> ParameterSet:
    document = _typed(content, _Document, "")
    values = {}
    for name, entry in document.values.items():
        row = _typed(entry, _Value, f"values.{name}")
        values[name] = Estimate(row.value, row.standard_error, row.unit)
    expected = {}
    for axis, entry in document.expected.items():
        if axis not in AXES:
            raise ValueError(f"expected.{axis} is of no axis; there are {', '.join(AXES)}")
        judged = _typed(entry, _Expected, f"expected.{axis}")
        error = judged.prediction_1s_rad
        expected[axis] = Expectation(ErrorFigure(error.value, error.low, error.high), judged.noise_floor_rad)
    covariance = _covariance(document.covariance, values) if document.covariance is not None else None
    return ParameterSet(document.unit, values, expected, document.provenance, covariance)


def _covariance(content: Mapping[str, Any], values: Mapping[str, Estimate]) -> Covariance:
    """Give the covariance of some of the ``values``."""
    found = _typed(content, _Covariance, "covariance")
    if strange := [name for name in found.names if name not in values]:
        raise ValueError(f"covariance.names has {strange[0]!r}, which is none of the values")
    if strange := [name for name in found.logarithms if name not in found.names or values[name].value == 0.0]:
        raise ValueError(f"covariance.logarithms has {strange[0]!r}, which is none of the names or zero")
    count = len(found.names)
    if len(found.matrix) != count or any(len(row) != count for row in found.matrix):
        raise ValueError(f"covariance.matrix must have {count} rows of {count} numbers")
    matrix = np.array(found.matrix).reshape(count, count)
    return Covariance(found.names, found.logarithms, found.operating_point_v, matrix)


def _typed(content: Any, kind: type[Kind], place: str) -> Kind:
    """Give ``content`` as a ``kind``.

    Raises
    ------
    ValueError
        The entry that is of another type, its value, and what was expected.
    """
    try:
        return msgspec.convert(content, kind)
    except msgspec.ValidationError as error:
        said, _, path = str(error).partition(" - at `$")
        keys = [key for key in path.rstrip("`").split(".") if key]
        value = reduce(getitem, keys, content)
        where = ".".join([place, *keys] if place else keys)
        if isinstance(value, float) and not isfinite(value):
            said = "a finite number is expected"
        entry = f"{where} = {repr(value)}: " if where else ""
        raise ValueError(f"{entry}{said[:1].lower()}{said[1:]}") from error


def _check_unit(file: Path, parameters: ParameterSet) -> None:
    """Refuse values that are not parameters of the unit that the file names, or that the unit does not take.

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
        for name, value in parameters.values.items():
            unit = own[name].unit or "1"
            if (value.unit or "1") != unit:
                raise ConfigurationError(
                    f"{file}: {name} is stated in {value.unit!r}, the {parameters.unit} takes it in {unit!r}; convert "
                    "value and standard error."
                )
            if problem := problem_with(own[name], value.value):
                raise ConfigurationError(f"{file}: {problem}.")
        try:
            parameters.check_complete()
        except ConfigurationError as error:
            raise ConfigurationError(f"{file}: {error}") from error
        return
    owners = [unit for unit in UNITS if parameters.values.keys() <= names[unit].keys()]
    whose = f"; its values are of the {owners[0]}, name that as its unit" if owners else ""
    raise ConfigurationError(f"{file} is of the unit {parameters.unit}, which has no parameter {foreign[0]!r}{whose}.")
