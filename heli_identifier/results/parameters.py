"""parameters.json: parameters of a unit by structured name, and the error that is expected of them.

``heli build --parameters`` takes the values as start values of the unit. ``heli check`` compares the prediction error
of a new log with the expected one. Plants are drawn with the covariance. Functions that need parameters take them in
every form: as a file, a parameter set, or a diagnosis.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import exp
from os import PathLike
from pathlib import Path
from typing import Any, Literal

import numpy as np

from heli_identifier import tracing
from heli_identifier.errors import ConfigurationError, refuse, require_positive
from heli_identifier.files import write_atomically
from heli_identifier.online import GAINS, Estimate, ModelParameters
from heli_identifier.records import Array, Log
from heli_identifier.results.diagnosis import Diagnosis, ErrorFigure, Use
from heli_identifier.results.documents import damage_error, document_text, read_document
from heli_identifier.results.statements import Determination
from heli_identifier.results.tables import Table, Tabular
from heli_identifier.results.words import join_words, unit_text, uses_text, with_interval
from heli_plant.effects import AXES, CATALOGUE
from heli_plant.errors import PlantError
from heli_plant.parameters import BY_FIELD, BY_NAME, PARAMETERS, PlantParameters, from_names

PLANT = "HelicopterPlant"

REQUIRED = (*(BY_FIELD[name].name for name in ModelParameters._fields), "motor.time_constant", "motor.voltage_limit")
"""Structured names of the parameters that every plant must state; their defaults belong to another rig."""


@dataclass(frozen=True)
class Expectation:
    """The expected errors of one axis."""

    prediction_1s_rad: ErrorFigure
    """Root-mean-square error of the 1 s prediction on the held-out logs."""
    noise_floor_rad: float
    """That of a perfect model; 0 where none could be computed."""
    use: Use | None = None
    """What the axis may be used for, as in diagnosis.json; None where no diagnosis says it."""
    ahead_200ms_rad: float | None = None
    """Where a controller flew, so that 1 s ahead decides nothing: largest error .2 s ahead on one log, training logs
    included, in air of which nothing is known."""


@dataclass(frozen=True, eq=False)
class Covariance:
    """Joint covariance of the estimates of a diagnosis."""

    names: tuple[str, ...]
    """Structured names, n of them: what was estimated, parameters and coefficients."""
    operating_point_v: float
    """Voltage [V]. A gain counts with the logarithm of its slope there, which hardly depends on how the thrust bends;
    the elevation's offset counts with what it is beyond the lift by the thrust there."""
    matrix: Array
    """Shape (n, n): in the squares and products of the parameters' units, of a logarithm 1."""
    not_determined: tuple[str, ...] = ()
    """Those of them that the logs do not determine: the matrix has what is plausible for any rig of this kind."""


@dataclass(frozen=True, eq=False, repr=False)
class ParameterSet(Tabular):
    """parameters.json: start values of a unit, and the error that is expected of them."""

    schema: Literal["heli-parameters/1"] = field(default="heli-parameters/1", kw_only=True)
    unit: str
    """Name of the unit that takes them."""
    values: Mapping[str, Estimate]
    """Start values by structured name; a standard error of None says that the value was given. Where an axis has a
    tabulated torque, `table.<axis>.variable` says what it runs over (1 pitch, 2 elevation, 3 travel, 4 to 6 their
    rates, 7 μ_s, 8 μ_d, 9 time; 0 or nothing: no table), `first` and `spacing` at which values, in the variable's unit,
    and `torque_1` to `torque_21` the acceleration at each of them."""
    expected: Mapping[str, Expectation] = field(default_factory=dict)
    """By axis: what `heli check` compares a new log with; empty if there was no held-out log."""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    """Where they come from."""
    covariance: Covariance | None = None
    """None where only standard errors are known."""

    @property
    def start_values(self) -> dict[str, float]:
        """Plain values by structured name, as a unit takes them."""
        return {name: estimate.value for name, estimate in self.values.items()}

    def plant(self) -> PlantParameters:
        """Return the plant with these parameters.

        ConfigurationError if they are another unit's, lack one of the simplified model's, or have a name or value that
        is none of the plant's.
        """
        self.check_unit(PLANT)
        try:
            return from_names(self.start_values)
        except PlantError as error:
            raise ConfigurationError(f"{error}.") from error

    def check_unit(self, unit: str) -> None:
        """Refuse parameters of another unit, and a plant without some of the :data:`REQUIRED`: a ConfigurationError."""
        refuse(self.unit != unit, f"these are parameters of the {self.unit}, those of the {unit} are needed.")
        missing = ", ".join(name for name in REQUIRED if name not in self.values and unit == PLANT)
        refuse(bool(missing), f"the plant's parameters lack {missing}; state them, as other rigs have other values.")

    def axes_for(self, *uses: Use) -> tuple[str, ...]:
        """Return the axes that have one of these uses."""
        return tuple(axis for axis, expected in self.expected.items() if expected.use in uses)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Warning for every result of these parameters: axes that the diagnosis does not call fit for control."""
        unfit = uses_text({axis: own.use for axis, own in self.expected.items() if own.use is not Use.CONTROL})
        return (f"use of this plant by axis: {unfit}; diagnosis.json says why and what to fly",) if unfit else ()

    @property
    def drawn_from_prior(self) -> str:
        """Note for plants that are drawn; empty if the logs determine every parameter."""
        unknown = join_words(self.covariance.not_determined) if self.covariance else ""
        return unknown and f"the logs do not determine {unknown}: drawn from what is plausible for any rig"

    @property
    def judged(self) -> str:
        """The error by which a new log is judged: .2 s ahead if a controller flew, else 1 s ahead."""
        closed = self.expected and all(expected.ahead_200ms_rad is not None for expected in self.expected.values())
        return "ahead_200ms" if closed else "prediction_1s"

    def limits(self, factor: float) -> dict[str, float]:
        """Return the largest allowed error [rad], of the kind :attr:`judged`, of every usable axis.

        1 s ahead it is ``factor`` times the error on the held-out logs, or times the noise floor if that is larger;
        .2 s ahead it is ``factor`` times the largest error on any log of the diagnosis. A ConfigurationError is raised
        if an axis has no such error, or no axis is usable.
        """
        require_positive("factor", factor, "1")
        missing = ", ".join(axis for axis in AXES if axis not in self.expected)
        remedy = "so nothing can be held to it; take the parameters.json of a diagnosis."
        refuse(bool(missing), f"these parameters state no expected error of {missing}, {remedy}")
        limits = {}
        for axis, expected in self.expected.items():
            error = max(expected.prediction_1s_rad.value, expected.noise_floor_rad)
            if self.judged == "ahead_200ms":
                error = expected.ahead_200ms_rad or 0.0
            if expected.use is not Use.NOTHING:
                limits[axis] = factor * error
        refuse(not limits, "the diagnosis calls no axis of these parameters usable; diagnosis.json says why.")
        return limits

    @property
    def table(self) -> Table:
        """Name, value with its 95 % interval, and unit of every parameter."""
        title = f"Parameters of the {self.unit} (± the half-width of the 95 % interval)"
        rows = [(name, with_interval(e, unit=False), unit_text(e.unit)) for name, e in self.values.items()]
        return Table(title, ("parameter", "value", "unit"), rows)

    def write(self, path: str | PathLike[str]) -> Path:
        """Write a parameters.json; give its path."""
        return write_atomically(path, document_text(self))


ParameterSource = ParameterSet | Diagnosis | str | PathLike[str]
PlantSource = ParameterSource | PlantParameters
"""What every function takes as the parameters of a plant; a path is that of a parameters.json."""


def plant_values(parameters: PlantParameters, estimates: Mapping[str, Estimate]) -> dict[str, Estimate]:
    """Return the parameters of a plant by structured name: base model, active effects with their shapes, tables.

    ``estimates`` has the standard errors by field of the parameters that were estimated.
    """
    on = {
        field
        for effect in CATALOGUE
        if getattr(parameters, effect.field) != 0.0
        for field in (effect.field, *(shape.field for shape in effect.shapes))
    }
    values = {}
    for parameter in PARAMETERS:
        group, _, name = parameter.name.partition(".")
        used = {
            "effects": parameter.field in on,
            "general": parameters.general_model > 0.5,
            "table": group == "table" and getattr(parameters, f"table_variable_{name.partition('.')[0]}") > 0.5,
        }
        if used.get(group, True):
            error = estimates[parameter.field].standard_error if parameter.field in estimates else None
            values[parameter.name] = Estimate(getattr(parameters, parameter.field), error, parameter.unit)
    return values


def corrected_parameters(diagnosis: Diagnosis) -> ParameterSet:
    """Return the parameters of the corrected plant of a diagnosis, with its errors on the held-out logs."""
    estimates = {**diagnosis.parameters_after, **diagnosis.effects_after}
    expected = {}
    for axis, report in diagnosis.axes.items():
        floor, ahead_200ms = report.noise_floor.prediction_1s.value, diagnosis.ahead_200ms.get(axis)
        expected[axis] = Expectation(report.after.prediction_1s, floor, report.use, ahead_200ms)
    values = plant_values(diagnosis.plant_after, estimates)
    return ParameterSet(PLANT, values, expected, diagnosis.provenance, _covariance(diagnosis, values))


def _covariance(diagnosis: Diagnosis, values: Mapping[str, Estimate]) -> Covariance:
    """Return the covariance, gains by logarithm; a motor lag that is no finding belongs to the time constant."""
    reports, fields = diagnosis.parameters, diagnosis.covariance_fields
    names = [BY_FIELD[name].name for name in fields]
    if (lag := BY_FIELD["motor_lag_rotors"].name) in names and lag not in values:
        names[names.index(lag)] = BY_FIELD["T_m"].name
    rows = [i for i, name in enumerate(names) if name in values]
    gains = {i: reports[name].estimate.value for i, name in enumerate(fields) if name in GAINS}
    scale = np.array([gains.get(i, 1.0) for i in rows])
    not_determined = {name for name, report in reports.items() if report.determination is Determination.NOT_DETERMINED}
    return Covariance(
        tuple(names[i] for i in rows),
        float(diagnosis.settings["operating_point"]),
        diagnosis.covariance[np.ix_(rows, rows)] / np.outer(scale, scale),
        tuple(names[i] for i in rows if fields[i] in not_determined),
    )


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


def draw_values(parameters: ParameterSet, count: int, seed: int = 0) -> list[dict[str, float]]:
    """Draw the parameters that have standard errors from a normal distribution, within their ranges, by name.

    Parameters of a diagnosis are drawn with their joint covariance: gains by the logarithm of their slope at the
    operating point, and the curve of the thrust in a coordinate in which the thrust is linear. Other parameters are
    drawn independently; intervals of figures that depend on several of them may then be too wide or too narrow.
    """
    plant, joint, random = parameters.plant(), parameters.covariance, np.random.default_rng(seed)
    if joint is None:
        errors = {name: e.standard_error for name, e in parameters.values.items() if e.standard_error}
        means = np.array([parameters.values[name].value for name in errors])
        rows = means + random.standard_normal((count, len(errors))) * list(errors.values())
        return [_clip(dict(zip(errors, row, strict=True))) for row in rows.tolist()]
    rig = tracing.helicopter([Log("hover", 1.0, np.full((2, 2), joint.operating_point_v), np.zeros((2, 3)))])
    variances, axes = np.linalg.eigh(joint.matrix)
    moves = random.standard_normal((count, len(joint.names))) @ (axes * np.sqrt(np.maximum(variances, 0.0))).T
    fields = [BY_NAME[name].field for name in joint.names]
    values = {field: rig.read(plant, field) for field in fields}
    curve = rig.coordinate(tracing.CURVE, plant)

    def moved_value(field: str, change: float) -> float:
        value = values[field]
        if field in GAINS:
            return value * exp(change)
        if field != tracing.CURVE:
            return value + change
        low, high = curve.bounds
        return curve.value(min(max(curve.coordinate(value) + change / curve.slope(value), low), high))

    drawn = []
    for move in moves.tolist():
        moved = {field: moved_value(field, change) for field, change in zip(fields, move, strict=True)}
        drawn_plant = rig.assign(plant, moved)
        drawn.append(_clip({name: getattr(drawn_plant, BY_NAME[name].field) for name in joint.names}))
    return drawn


def _clip(values: dict[str, float]) -> dict[str, float]:
    """Keep parameters in their ranges."""
    return {n: float(min(max(v, BY_NAME[n].minimum), BY_NAME[n].maximum)) for n, v in values.items()}
