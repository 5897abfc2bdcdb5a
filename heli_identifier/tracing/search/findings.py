"""What the tracer says of one effect: the words of its verdict, an effect that was found, an entry that was not."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from heli_identifier.online import Estimate

SHOWN, AMBIGUOUS, NOT_SHOWN, NOT_TESTABLE, UNKNOWN = "shown", "ambiguous", "not shown", "not testable", "unknown effect"
"""Verdicts on one effect."""


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
        "amplitude" with "amplitude_standard_error" [rad/s^2].
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
