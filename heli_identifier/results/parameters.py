"""parameters.json: parameters of a unit by structured name, and the error that is expected of them.

``heli build --parameters`` takes the values as start values of the unit, ``heli check`` compares a new log's prediction
error with what is expected, and what draws plants draws them with the covariance.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import exp
from os import PathLike
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from heli_identifier import tracing
from heli_identifier.errors import ConfigurationError, refuse, require_positive
from heli_identifier.files import write_atomically
from heli_identifier.online import GAINS, Estimate, ModelParameters
from heli_identifier.records import Log
from heli_identifier.results.diagnosis import Diagnosis, ErrorFigure, Use
from heli_identifier.results.documents import document_text
from heli_identifier.results.tables import Table, Tabular
from heli_identifier.results.words import join_words, unit_text, uses_text, with_interval
from heli_identifier.tracing import Determination
from heli_plant.effects import AXES, CATALOGUE
from heli_plant.errors import ParameterError
from heli_plant.parameters import BY_FIELD, BY_NAME, PARAMETERS, PlantParameters, from_names

PLANT = "HelicopterPlant"

REQUIRED = (*(BY_FIELD[own].name for own in ModelParameters._fields), "motor.time_constant", "motor.voltage_limit")
"""Structured names of what makes a plant of a rig; the plant's defaults for them are those of another rig."""


@dataclass(frozen=True)
class Expectation:
    """What to expect of one axis."""

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
    logarithms: tuple[str, ...]
    """Those of them, the gains, that count with the logarithm of their slope at the operating point."""
    operating_point_v: float
    """Voltage [V] of the slopes: there a gain hardly depends on how the thrust bends. The elevation's offset counts
    with what it is beyond the lift by the thrust there."""
    matrix: NDArray[np.float64]
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
        """Give the plant with these parameters.

        Raises
        ------
        ConfigurationError
            They are another unit's, one of the simplified model's parameters is not among them, or a name or value is
            none of the plant's.
        """
        self.check_unit(PLANT)
        try:
            return from_names(self.start_values)
        except ParameterError as error:
            raise ConfigurationError(f"{error}.") from error

    def check_unit(self, unit: str) -> None:
        """Refuse parameters of another unit, or of a plant that lack some: a ConfigurationError."""
        refuse(self.unit != unit, f"these are parameters of the {self.unit}, those of the {unit} are needed.")
        self.check_complete()

    def check_complete(self, where: str = "") -> None:
        """Refuse a plant some of whose :data:`REQUIRED` parameters would be defaults: a ConfigurationError."""
        missing = ", ".join(name for name in REQUIRED if name not in self.values) if self.unit == PLANT else ""
        said = f"{where}the plant's parameters lack {missing}; values of another rig are not taken for them."
        refuse(bool(missing), said)

    def axes_for(self, *uses: Use) -> tuple[str, ...]:
        """Give the axes of which the diagnosis says one of these uses."""
        return tuple(axis for axis, expected in self.expected.items() if expected.use in uses)

    @property
    def uses(self) -> str:
        """What the diagnosis says the axes may be used for; empty where none says it."""
        return uses_text({axis: expected.use for axis, expected in self.expected.items()})

    @property
    def doubts(self) -> tuple[str, ...]:
        """What every result from these parameters has to say: axes that the diagnosis does not call fit for control."""
        words = {Use.PREDICTION: "can be used for prediction only, not for control", Use.NOTHING: "cannot be used"}
        return tuple(
            f"the {', the '.join(axes)} of this plant {said}; diagnosis.json says why and what to fly"
            for use, said in words.items()
            if (axes := self.axes_for(use))
        )

    @property
    def drawn_from_prior(self) -> str:
        """What to say of plants that are drawn; empty where the logs determine every parameter."""
        free = self.covariance.not_determined if self.covariance else ()
        return f"the logs do not determine {join_words(free)}: drawn from what is plausible for any rig" if free else ""

    @property
    def judged(self) -> str:
        """The error by which a new log is judged: .2 s ahead where a controller flew, else 1 s ahead."""
        closed = self.expected and all(own.ahead_200ms_rad is not None for own in self.expected.values())
        return "ahead_200ms" if closed else "prediction_1s"

    def limits(self, factor: float) -> dict[str, float]:
        """Give the largest error [rad] of the prediction :attr:`judged` that every usable axis may have.

        It is ``factor`` times the error on the held-out logs, or 1 s ahead times the noise floor if that is larger;
        .2 s ahead times the largest error on any log of the diagnosis.
        ConfigurationError if an axis has no such error, or no axis is usable.
        """
        require_positive("factor", factor, "1")
        missing = ", ".join(axis for axis in AXES if axis not in self.expected)
        wanted = "so nothing can be held to it; take the parameters.json of a diagnosis."
        refuse(bool(missing), f"these parameters state no expected error of {missing}, {wanted}")
        found = {}
        for axis, own in self.expected.items():
            far, near = max(own.prediction_1s_rad.value, own.noise_floor_rad), own.ahead_200ms_rad or 0.0
            if own.use is not Use.NOTHING:
                found[axis] = factor * (far if self.judged == "prediction_1s" else near)
        refuse(not found, "the diagnosis calls no axis of these parameters usable: nothing is held to it.")
        return found

    @property
    def table(self) -> Table:
        """Name, value with its 95 % interval, and unit of every parameter."""
        title = f"Parameters of the {self.unit} (± the half-width of the 95 % interval)"
        rows = [(name, with_interval(own, unit=False), unit_text(own.unit)) for name, own in self.values.items()]
        return Table(title, ("parameter", "value", "unit"), rows)

    def write(self, path: str | PathLike[str]) -> Path:
        """Write a parameters.json; gives its path."""
        return write_atomically(path, document_text(self))


def plant_values(parameters: PlantParameters, estimates: Mapping[str, Estimate]) -> dict[str, Estimate]:
    """Give what makes up a plant by structured name: the base model, the effects that are on with shapes, its tables.

    ``estimates`` has the standard errors by field, of those that were estimated.
    """
    on = {
        field
        for effect in CATALOGUE
        if getattr(parameters, effect.field) != 0.0
        for field in (effect.field, *(shape.field for shape in effect.shapes))
    }
    values = {}
    for row in PARAMETERS:
        group, _, name = row.name.partition(".")
        used = {
            "effects": row.field in on,
            "general": parameters.general_model > 0.5,
            "table": group == "table" and getattr(parameters, f"table_variable_{name.partition('.')[0]}") > 0.5,
        }
        if used.get(group, True):
            error = estimates[row.field].standard_error if row.field in estimates else None
            values[row.name] = Estimate(getattr(parameters, row.field), error, row.unit)
    return values


def corrected_parameters(diagnosis: Diagnosis) -> ParameterSet:
    """Give the parameters after a diagnosis, with the errors that its held-out logs found."""
    estimates = {**diagnosis.parameters_after, **diagnosis.effects_after}
    near, expected = diagnosis.ahead_200ms, {}
    for axis, own in diagnosis.axes.items():
        far, floor = own.after.prediction_1s, own.noise_floor.prediction_1s.value
        expected[axis] = Expectation(far, floor, own.use, near.get(axis))
    values = plant_values(diagnosis.plant_after, estimates)
    return ParameterSet(PLANT, values, expected, diagnosis.provenance, _covariance(diagnosis, values))


def _covariance(diagnosis: Diagnosis, values: Mapping[str, Estimate]) -> Covariance:
    """Give the covariance with gains by logarithm; a lag that is no finding is part of the time constant."""
    reports, fields = diagnosis.parameters, diagnosis.covariance_fields
    names = [BY_FIELD[own].name for own in fields]
    if (lag := BY_FIELD["motor_lag_rotors"].name) in names and lag not in values:
        names[names.index(lag)] = BY_FIELD["T_m"].name
    kept = [i for i, name in enumerate(names) if name in values]
    gains = {i: reports[own].estimate.value for i, own in enumerate(fields) if own in GAINS}
    scale = np.array([gains.get(i, 1.0) for i in kept])
    unknown = {own for own, report in reports.items() if report.determination is Determination.NOT_DETERMINED}
    return Covariance(
        tuple(names[i] for i in kept),
        tuple(names[i] for i in kept if i in gains),
        float(diagnosis.settings["operating_point"]),
        diagnosis.covariance[np.ix_(kept, kept)] / np.outer(scale, scale),
        tuple(names[i] for i in kept if fields[i] in unknown),
    )


def draw_values(parameters: ParameterSet, count: int, seed: int = 0) -> list[dict[str, float]]:
    """Draw a plant's parameters that have standard errors from a normal law, kept in their ranges, by structured name.

    Those of a diagnosis are drawn with their joint covariance, gains by the logarithm of their slope at its operating
    point and a curve of the thrust in what the thrust is linear in. Others are drawn independently, so that intervals
    of figures that depend on several of them may be too wide or too narrow.
    """
    plant, known, random = parameters.plant(), parameters.covariance, np.random.default_rng(seed)
    if known is None:
        errors = {name: e.standard_error for name, e in parameters.values.items() if e.standard_error}
        moves = random.standard_normal((count, len(errors))) * list(errors.values())
        return [_clip({n: parameters.values[n].value + d for n, d in zip(errors, move, strict=True)}) for move in moves]
    rig = tracing.helicopter([Log("hover", 1.0, np.full((2, 2), known.operating_point_v), np.zeros((2, 3)))])
    variances, axes = np.linalg.eigh(known.matrix)
    moves = random.standard_normal((count, len(known.names))) @ (axes * np.sqrt(np.maximum(variances, 0.0))).T
    now = {name: rig.read(plant, BY_NAME[name].field) for name in known.names}
    curve = rig.coordinate(tracing.CURVE, plant)

    def moved(name: str, d: float) -> float:
        value = now[name]
        if name in known.logarithms:
            return value * exp(d)
        if BY_NAME[name].field != tracing.CURVE:
            return value + d
        low, high = curve.bounds
        return curve.value(min(max(curve.coordinate(value) + d / curve.slope(value), low), high))

    drawn = []
    for move in moves.tolist():
        own = rig.assign(
            plant, {BY_NAME[name].field: moved(name, d) for name, d in zip(known.names, move, strict=True)}
        )
        drawn.append(_clip({name: getattr(own, BY_NAME[name].field) for name in known.names}))
    return drawn


def _clip(values: dict[str, float]) -> dict[str, float]:
    """Keep parameters in their ranges."""
    return {n: float(min(max(v, BY_NAME[n].minimum), BY_NAME[n].maximum)) for n, v in values.items()}
