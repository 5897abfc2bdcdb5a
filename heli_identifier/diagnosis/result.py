"""What a diagnosis says, as frozen values: verdicts, effects, parameters, errors, and the series behind the figures."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_plant.parameters import PlantParameters

SHOWN, AMBIGUOUS, NOT_SHOWN, NOT_TESTABLE, UNKNOWN = "shown", "ambiguous", "not shown", "not testable", "unknown effect"
"""Verdicts on one effect."""

EFFECTS_SHOWN, MODEL_ADEQUATE, UNKNOWN_EFFECT = "effects shown", "model adequate", "unknown effect"
"""Verdicts on a rig."""


@dataclass(frozen=True)
class Estimate:
    """A value with its standard error, both in ``unit``; an error of None means that the value was given."""

    value: float
    standard_error: float | None
    unit: str

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval."""
        half = 1.96 * (self.standard_error or 0.0)
        return self.value - half, self.value + half


@dataclass(frozen=True, eq=False)
class FoundEffect:
    """An effect that was found and added to the model, or an unknown one that was found and described.

    Attributes
    ----------
    name, axis : str
        Of the catalogue; name "unknown" for what no entry explains.
    coefficient : Estimate or None
        None for an unknown effect.
    verdict : str
        "shown", "ambiguous" or "unknown effect".
    alternatives : tuple of (name, axis)
        Entries that explain the data about as well.
    shape : mapping
        Shape parameters by name as {"value", "standard_error", "unit"}; of an unknown effect "variable",
        "description", "unit" and "curve" [[x, y], ...] with "band" [[x, low, high], ...], or "frequency_hz" and
        "amplitude" [rad/s^2].
    score : float
        Coefficient over standard error; of an unknown effect the square root of its surplus.
    agreement : mapping of float to Estimate
        The coefficient at other filter frequencies [rad/s].
    experiment : str
        What to measure to settle an ambiguity; empty if there is none.
    """

    name: str
    axis: str
    coefficient: Estimate | None
    verdict: str
    alternatives: tuple[tuple[str, str], ...]
    shape: Mapping[str, Any]
    score: float
    agreement: Mapping[float, Estimate] = field(default_factory=dict)
    experiment: str = ""


@dataclass(frozen=True)
class CatalogueVerdict:
    """The verdict on one entry of the catalogue.

    Attributes
    ----------
    verdict : str
        "shown", "ambiguous", "not shown" or "not testable".
    estimate : Estimate
        Linear estimate of the coefficient at the final model.
    score : float
    visibility : float
        Share of the effect's signature that the fitted parameters cannot imitate.
    upper_bound : float or None
        Largest abs(coefficient) that the data allow at 95 %; None where it says nothing.
    why : str
        Reason, in a clause.
    experiment : str
        What would make it visible; empty if nothing is needed.
    """

    name: str
    axis: str
    verdict: str
    estimate: Estimate
    score: float
    visibility: float
    upper_bound: float | None
    why: str
    experiment: str


@dataclass(frozen=True)
class ErrorFigure:
    """A root-mean-square error with its 95 % interval from a bootstrap over segments."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class AxisError:
    """Errors of one axis on the held-out logs.

    ``prediction_1s`` and ``prediction_2s`` [rad], ``free_run`` [rad] or None where the axis is not stable,
    ``acceleration`` [rad/s^2].
    """

    prediction_1s: ErrorFigure
    prediction_2s: ErrorFigure
    free_run: ErrorFigure | None
    acceleration: ErrorFigure


@dataclass(frozen=True, eq=False)
class AxisReport:
    """Before, after and noise floor of one axis, with residual tests of the innovations after.

    ``whiteness_p`` maps "before"/"after" to the Ljung-Box p value, ``input_correlation`` to the largest absolute
    cross-correlation with past inputs in units of its 95 % bound.
    """

    before: AxisError
    after: AxisError
    noise_floor: AxisError
    whiteness_p: Mapping[str, float]
    input_correlation: Mapping[str, float]


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
    """One held-out log on the observer's grid, for figures and for the master.

    Attributes
    ----------
    name : str
    step : float
        [s].
    voltages : NDArray, shape (N, 2)
    measured : NDArray, shape (N, 3)
        Angles [rad].
    free_run_before, free_run_after : NDArray, shape (N, 3)
        Simulated from ``start`` under the voltages [rad].
    start : mapping
        Start state by the fields of :class:`heli_plant.state.PlantState`, so that the FMU repeats the run.
    residual_before, residual_after : NDArray, shape (n, 3)
        Reduced innovations [rad/s^2] every ``residual_step`` [s].
    white_before, white_after : NDArray, shape (m, 3)
        The same behind the whitening that the training logs taught, of unit variance if the model is right.
    residual_step : float
    """

    name: str
    step: float
    voltages: NDArray[np.float64]
    measured: NDArray[np.float64]
    free_run_before: NDArray[np.float64]
    free_run_after: NDArray[np.float64]
    start: Mapping[str, float]
    residual_before: NDArray[np.float64]
    residual_after: NDArray[np.float64]
    white_before: NDArray[np.float64]
    white_after: NDArray[np.float64]
    residual_step: float


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


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Everything that one diagnosis found.

    Attributes
    ----------
    verdict : str
    effects : tuple of FoundEffect
        Strongest evidence first.
    withdrawn : tuple of (name, axis, why)
        Effects that the training logs showed and the held-out logs did not bear out.
    catalogue : tuple of CatalogueVerdict
    parameters_before, parameters_after : mapping of str to Estimate
        By the paper's symbols.
    plant_before, plant_after : PlantParameters
        The complete parameter sets.
    axes : mapping of str to AxisReport
    correlation_names : tuple of str
        Labels "name axis" of the rows of ``correlation``.
    correlation : NDArray, shape (K, K)
        Correlations between the catalogue's projected signatures.
    """

    verdict: str
    effects: tuple[FoundEffect, ...]
    withdrawn: tuple[tuple[str, str, str], ...]
    catalogue: tuple[CatalogueVerdict, ...]
    parameters_before: Mapping[str, Estimate]
    parameters_after: Mapping[str, Estimate]
    plant_before: PlantParameters
    plant_after: PlantParameters
    axes: Mapping[str, AxisReport]
    series: tuple[HeldOutSeries, ...]
    curves: tuple[EffectCurve, ...]
    correlation_names: tuple[str, ...]
    correlation: NDArray[np.float64]
    data: tuple[DataEntry, ...]
    settings: Mapping[str, Any]
    notes: tuple[str, ...]
    seconds: float

    def __repr__(self) -> str:
        effects = ", ".join(f"{effect.name} on {effect.axis}" for effect in self.effects)
        return f"<Diagnosis: {self.verdict}{f': {effects}' if effects else ''}>"

    def _repr_html_(self) -> str:
        """Show the diagnosis in a notebook."""
        from heli_identifier.report.notebook import notebook_view

        return notebook_view(self)
