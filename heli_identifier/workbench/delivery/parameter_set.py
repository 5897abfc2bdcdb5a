"""parameters.json: the corrected parameters of a unit by structured name, and what a model with them should reach.

    {"schema": "heli-parameters/1", "unit": "HelicopterPlant",
     "values": {"pitch.damping": {"value", "standard_error", "unit"}, ...},
     "expected": {"pitch": {"prediction_1s_rad": {"value", "low", "high"}, "noise_floor_rad"}, ...},
     "provenance": {...}}

``heli build --parameters`` takes the values as start values of the unit, ``heli check`` compares a new log's
prediction error with what is expected.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

from heli_identifier.errors import ConfigurationError, require_positive
from heli_identifier.online import Estimate, ModelParameters
from heli_identifier.tracing import Diagnosis, ErrorFigure
from heli_identifier.workbench.delivery.diagnosis_document import plain
from heli_identifier.workbench.delivery.parameter_damage import damage
from heli_plant.effects import CATALOGUE
from heli_plant.errors import ParameterError
from heli_plant.parameters import BY_FIELD, PARAMETERS, PlantParameters, from_names

SCHEMA = "heli-parameters/1"
PLANT = "HelicopterPlant"

IDENTIFIED = tuple(BY_FIELD[field_].name for field_ in ModelParameters._fields)
"""Structured names of what a diagnosis identifies of every rig."""


@dataclass(frozen=True)
class Expectation:
    """Root-mean-square error [rad] of the 1 s prediction of one axis: on the held-out logs, and of a perfect model."""

    prediction: ErrorFigure
    noise_floor: float


@dataclass(frozen=True, eq=False)
class ParameterSet:
    """Parameters of one unit.

    Attributes
    ----------
    unit : str
        Name of the unit that takes them.
    values : mapping of str to Estimate
        By structured name; a standard error of None says that the value was given.
    expected : mapping of str to Expectation
        By axis; empty if no held-out log has judged them.
    provenance : mapping
        Where they come from.
    """

    unit: str
    values: Mapping[str, Estimate]
    expected: Mapping[str, Expectation] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)

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
        if self.unit != PLANT:
            raise ConfigurationError(f"these are parameters of the {self.unit}, those of the {PLANT} are needed.")
        missing = [name for name in IDENTIFIED if name not in self.values]
        if missing:
            raise ConfigurationError(
                f"the plant's parameters lack {', '.join(missing)}; another rig's values must not stand in for them."
            )
        try:
            return from_names(self.start_values)
        except ParameterError as error:
            raise ConfigurationError(f"{error}.") from error

    def limits(self, factor: float) -> dict[str, float]:
        """Give the largest error [rad] of the 1 s prediction that each axis may have.

        Parameters
        ----------
        factor : float
            Multiple of what is expected: the error on the held-out logs, or the noise floor if that is larger.

        Raises
        ------
        ConfigurationError
            No held-out log has judged these parameters, or the factor is not positive.
        """
        if not self.expected:
            raise ConfigurationError("these parameters were never judged on held-out logs; take those of a diagnosis.")
        require_positive("factor", factor, "1")
        return {
            axis: factor * max(expected.prediction.value, expected.noise_floor)
            for axis, expected in self.expected.items()
        }

    def document(self) -> dict[str, Any]:
        """Give the content of parameters.json."""
        return plain(
            {
                "schema": SCHEMA,
                "unit": self.unit,
                "values": {
                    name: {"value": value.value, "standard_error": value.standard_error, "unit": value.unit}
                    for name, value in self.values.items()
                },
                "expected": {
                    axis: {
                        "prediction_1s_rad": {
                            "value": expected.prediction.value,
                            "low": expected.prediction.low,
                            "high": expected.prediction.high,
                        },
                        "noise_floor_rad": expected.noise_floor,
                    }
                    for axis, expected in self.expected.items()
                },
                "provenance": self.provenance,
            }
        )


def plant_values(parameters: PlantParameters, estimates: Mapping[str, Estimate]) -> dict[str, Estimate]:
    """Give what makes up a plant by structured name: the base model, and the effects that are on with their shapes.

    Parameters
    ----------
    parameters : PlantParameters
    estimates : mapping
        Standard errors by field, of those that were estimated.
    """
    on = {
        field
        for effect in CATALOGUE
        if getattr(parameters, effect.field) != 0.0
        for field in (effect.field, *(shape.field for shape in effect.shapes))
    }
    general = parameters.general_model > 0.5
    values = {}
    for row in PARAMETERS:
        if row.name.startswith("effects.") and row.field not in on:
            continue
        if row.name.startswith("general.") and not general:
            continue
        found = estimates.get(row.field)
        error = found.standard_error if found else None
        values[row.name] = Estimate(getattr(parameters, row.field), error, row.unit)
    return values


def corrected_parameters(diagnosis: Diagnosis, provenance: Mapping[str, Any]) -> ParameterSet:
    """Give the parameters after a diagnosis, with the errors that its held-out logs found."""
    estimates = {**diagnosis.parameters_after, **diagnosis.effects_after}
    expected = {
        axis: Expectation(report.after.prediction_1s, report.noise_floor.prediction_1s.value)
        for axis, report in diagnosis.axes.items()
    }
    return ParameterSet(PLANT, plant_values(diagnosis.plant_after, estimates), expected, provenance)


def read_parameter_set(path: str | PathLike[str]) -> ParameterSet:
    """Read a parameters.json.

    Raises
    ------
    ConfigurationError
        The file cannot be read, is no JSON or not of the schema, or an entry is missing, of the wrong type or not
        finite; file and entry are named.
    """
    file = Path(path)
    if file.is_dir():
        raise ConfigurationError(f"{path} is a folder; name the parameters.json in it.")
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ConfigurationError(f"{path} does not exist; `heli diagnose` writes a parameters.json.") from None
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be read: {error.strerror}.") from error
    except (ValueError, RecursionError) as error:
        raise ConfigurationError(f"{path} is no JSON: {error}.") from error
    wrong = damage(content, SCHEMA)
    if wrong is not None:
        raise ConfigurationError(f"{path} {wrong}.")
    return _parameter_set(content)


def _parameter_set(content: Mapping[str, Any]) -> ParameterSet:
    values = {
        name: Estimate(
            float(entry["value"]),
            None if entry["standard_error"] is None else float(entry["standard_error"]),
            entry["unit"],
        )
        for name, entry in content["values"].items()
    }
    expected = {
        axis: Expectation(
            ErrorFigure(**{key: float(value) for key, value in entry["prediction_1s_rad"].items()}),
            float(entry["noise_floor_rad"]),
        )
        for axis, entry in content["expected"].items()
    }
    return ParameterSet(content["unit"], values, expected, content["provenance"])
