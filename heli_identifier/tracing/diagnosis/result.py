"""What a diagnosis says, as frozen values: the verdict on a rig, and the series behind the figures."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import Estimate
from heli_identifier.records import Log
from heli_identifier.tracing.events.event import Event
from heli_identifier.tracing.search.found_effect import FoundEffect
from heli_identifier.tracing.search.verdict import CatalogueVerdict, Withdrawal
from heli_identifier.tracing.validation.figures import AxisReport
from heli_identifier.tracing.validation.log_values import LogValues
from heli_plant.parameters import PlantParameters


class RigVerdict(StrEnum):
    """The verdict on a rig; the value is the text that stands in diagnosis.json."""

    EFFECTS_SHOWN = "effects shown"
    MODEL_ADEQUATE = "model adequate"
    UNKNOWN_EFFECT = "unknown effect"


@dataclass(frozen=True)
class DataEntry:
    """One log of the data set and what it was used for ("training" or "held out")."""

    file: str
    sha256: str
    samples: int
    rate_hz: float
    used_for: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class HeldOutSeries:
    """One held-out log and what the models before and after make of it.

    Attributes
    ----------
    log : Log
        As it was read.
    free_run_before, free_run_after : NDArray, shape (N, 3)
        Angles [rad], simulated from ``start`` under the voltages.
    start : mapping
        Start state by the fields of :class:`heli_plant.state.PlantState`, so that the FMU repeats the run.
    residual_before, residual_after : NDArray, shape (n, 3)
        Reduced innovations [rad/s^2] every ``residual_step`` [s].
    white_before, white_after : NDArray, shape (m, 3)
        The same under the whitener of the model after, of unit variance if the model is right.
    residual_step : float
    events : tuple of Event
        Passages inside of the log, or just before or behind it where it is a piece of a longer log.
    """

    log: Log
    free_run_before: NDArray[np.float64]
    free_run_after: NDArray[np.float64]
    start: Mapping[str, float]
    residual_before: NDArray[np.float64]
    residual_after: NDArray[np.float64]
    white_before: NDArray[np.float64]
    white_after: NDArray[np.float64]
    residual_step: float
    events: tuple[Event, ...] = ()


@dataclass(frozen=True, eq=False)
class EffectCurve:
    """Partial residual torque of one found effect against its variable, with the fitted law and its band.

    ``points`` (n, 2) and ``curve`` (m, 4): x, y, low, high; x in ``unit``, y in rad/s^2.
    """

    name: str
    axis: str
    variable: str
    unit: str
    points: NDArray[np.float64]
    curve: NDArray[np.float64]


@dataclass(frozen=True)
class PossibleEffect:
    """An effect that only some halves of the training data show, or a family that they need for their predictions.

    Attributes
    ----------
    name, axis : str
        Of a family the member that stands best for it.
    alternatives : tuple of (name, axis)
        The family's other members.
    stability : float
        Share of the halves that find it, 0 to 1.
    worth : float or None
        Share by which the error of the axis that needs it most grows without it, on the training data; None for what
        the likelihood finds.
    """

    name: str
    axis: str
    alternatives: tuple[tuple[str, str], ...]
    stability: float
    worth: float | None


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Everything that one diagnosis found.

    Attributes
    ----------
    verdict : RigVerdict
    effects : tuple of FoundEffect
        Effects that are shown, strongest evidence first.
    predictive : tuple of FoundEffect
        Effects that improve the predictions beyond those shown, the most worth first; their cause is not established.
    possible : tuple of PossibleEffect
        Effects that only some of the training data find; they are no part of the corrected model.
    withdrawn : tuple of Withdrawal
        Effects that the training logs showed and that other filter frequencies or the held-out logs did not confirm.
    catalogue : tuple of CatalogueVerdict
    parameters_before, parameters_after : mapping of str to Estimate
        By the paper's symbols.
    effects_after : mapping of str to Estimate
        Coefficients and shapes of the effects of the corrected plant and the tables of its unknown torques, by its
        fields. They differ from those of ``effects``, which are the likelihood's.
    plant_before, plant_shown, plant_after : PlantParameters
        The complete parameter sets of the simplified model, that with the effects shown (unknown torques among them, as
        tables), and the corrected one.
    plant_everything : PlantParameters or None
        That of the whole catalogue at once; None where it could not be fitted.
    axes : mapping of str to AxisReport
    correlation_labels : tuple of (name, axis)
        Entries of the catalogue in the order of the rows of ``correlation``.
    correlation : NDArray, shape (K, K)
        Correlations between the catalogue's projected signatures.
    events : tuple of Event
        Passages in which something other than the plant acts, in training and held-out logs.
    logs : tuple of LogValues
        What each log has of its own under the corrected plant; a log that was cut at an event has several.
    """

    verdict: RigVerdict
    effects: tuple[FoundEffect, ...]
    withdrawn: tuple[Withdrawal, ...]
    catalogue: tuple[CatalogueVerdict, ...]
    parameters_before: Mapping[str, Estimate]
    parameters_after: Mapping[str, Estimate]
    effects_after: Mapping[str, Estimate]
    plant_before: PlantParameters
    plant_shown: PlantParameters
    plant_after: PlantParameters
    plant_everything: PlantParameters | None
    axes: Mapping[str, AxisReport]
    series: tuple[HeldOutSeries, ...]
    curves: tuple[EffectCurve, ...]
    correlation_labels: tuple[tuple[str, str], ...]
    correlation: NDArray[np.float64]
    data: tuple[DataEntry, ...]
    settings: Mapping[str, Any]
    notes: tuple[str, ...]
    seconds: float
    events: tuple[Event, ...] = ()
    predictive: tuple[FoundEffect, ...] = ()
    possible: tuple[PossibleEffect, ...] = ()
    logs: tuple[LogValues, ...] = ()

    def __repr__(self) -> str:
        effects = ", ".join(f"{effect.name} on {effect.axis}" for effect in self.effects)
        return f"<Diagnosis: {self.verdict}{f': {effects}' if effects else ''}>"
