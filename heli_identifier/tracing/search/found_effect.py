"""An effect that the search found, as a value: coefficient, verdict, rivals and shape."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import Estimate
from heli_identifier.tracing.search.verdict import Evidence, Verdict


@dataclass(frozen=True)
class NamedShape:
    """Shape parameters of an effect of the catalogue.

    Attributes
    ----------
    parameters : mapping of str to Estimate
        By the name of the shape parameter; one that was not estimated has no standard error.
    """

    parameters: Mapping[str, Estimate] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Give the shape as it stands in diagnosis.json."""
        return {
            name: {"value": value.value, "standard_error": value.standard_error, "unit": value.unit}
            for name, value in self.parameters.items()
        }


@dataclass(frozen=True, eq=False)
class CurveShape:
    """An unknown torque as a curve of one variable, where records have been.

    Attributes
    ----------
    variable, unit : str
        What the torque depends on, and the unit of its values.
    description : str
        What kind of curve it is.
    curve : NDArray, shape (n, 2)
        Values of the variable and the torque per inertia [rad/s^2].
    band : NDArray, shape (n, 3)
        The same values of the variable, and the lower and upper end of the 95 % band [rad/s^2].
    """

    variable: str
    unit: str
    description: str
    curve: NDArray[np.float64]
    band: NDArray[np.float64]

    def to_dict(self) -> dict[str, Any]:
        """Give the shape as it stands in diagnosis.json."""
        return {
            "variable": self.variable,
            "unit": self.unit,
            "description": self.description,
            "curve": self.curve.tolist(),
            "band": self.band.tolist(),
        }


@dataclass(frozen=True)
class PeriodicShape:
    """An unknown torque that is periodic in time.

    Attributes
    ----------
    frequency_hz : float
        [Hz].
    amplitude, amplitude_standard_error : float
        Mean amplitude over the records and its standard error [rad/s^2].
    description : str
    """

    frequency_hz: float
    amplitude: float
    amplitude_standard_error: float
    description: str
    variable: str = field(default="time", init=False)
    unit: str = field(default="s", init=False)

    def to_dict(self) -> dict[str, Any]:
        """Give the shape as it stands in diagnosis.json."""
        return {
            "variable": self.variable,
            "unit": self.unit,
            "description": self.description,
            "frequency_hz": self.frequency_hz,
            "amplitude": self.amplitude,
            "amplitude_standard_error": self.amplitude_standard_error,
        }


EffectShape = NamedShape | CurveShape | PeriodicShape
"""Shape of an effect: named parameters for an entry of the catalogue, a curve or a period for an unknown torque."""


@dataclass(frozen=True, eq=False)
class FoundEffect:
    """An effect of the catalogue, or an unknown torque, that the simplified model lacks.

    Attributes
    ----------
    name, axis : str
        Of the catalogue; name "unknown" for an unknown torque.
    coefficient : Estimate or None
        None for an unknown torque.
    verdict : Verdict
        SHOWN, AMBIGUOUS or UNKNOWN; NOT_SHOWN for a predictive effect.
    alternatives : tuple of (name, axis)
        Entries that explain the data about as well.
    shape : NamedShape, CurveShape or PeriodicShape
        NamedShape for an effect of the catalogue, one of the others for an unknown torque.
    score : float
        Coefficient over standard error: by likelihood of an effect that is shown, by multi-step errors of a
        predictive one. Of an unknown torque the square root of its likelihood-ratio statistic on the scale of one
        degree of freedom.
    agreement : mapping of float to Estimate
        The coefficient at other filter frequencies [rad/s].
    experiment : str
        What to measure to settle an ambiguity; empty if there is none.
    evidence : Evidence
    stability : float
        Share of halves of the training data in which it is found, 0 to 1.
    together : str
        What the effect and its alternatives come to together, in words; empty where there is no such figure.
    worth : float or None
        Of a predictive effect: the share by which the error of the axis that needs it most grows without it.
    by_likelihood : Estimate or None
        Of a predictive effect: its coefficient by the likelihood of one step ahead, beside the effects shown; None
        where that sees nothing of it.
    in_plant : bool
        Whether the corrected plant has it; of an unknown torque, whether it has it as a table.
    """

    name: str
    axis: str
    coefficient: Estimate | None
    verdict: Verdict
    alternatives: tuple[tuple[str, str], ...]
    shape: EffectShape
    score: float
    agreement: Mapping[float, Estimate] = field(default_factory=dict)
    experiment: str = ""
    evidence: Evidence = Evidence.SHOWN
    stability: float = 1.0
    together: str = ""
    worth: float | None = None
    by_likelihood: Estimate | None = None
    in_plant: bool = True
