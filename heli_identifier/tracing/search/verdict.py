"""The verdict on one effect as a value, and on one entry of the catalogue with its numbers."""

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from heli_identifier.online import Estimate


class Verdict(StrEnum):
    """What a search says of one effect; the value is the text that stands in diagnosis.json."""

    SHOWN = "shown"
    AMBIGUOUS = "ambiguous"
    NOT_SHOWN = "not shown"
    NOT_TESTABLE = "not testable"
    UNKNOWN = "unknown effect"


class Evidence(StrEnum):
    """What speaks for an effect; the value is the text that stands in diagnosis.json.

    SHOWN: the likelihood of one-step innovations detects it, with a level of false alarms that holds. PREDICTIVE: it
    improves the predictions steadily; its cause is not established.
    """

    SHOWN = "shown"
    PREDICTIVE = "predictive"


class Withdrawal(NamedTuple):
    """An effect that was found and removed again: its name ("unknown" of an unknown torque), its axis, the reason."""

    name: str
    axis: str
    why: str


@dataclass(frozen=True)
class CatalogueVerdict:
    """The verdict on one entry of the catalogue.

    Attributes
    ----------
    name, axis : str
    verdict : Verdict
        Never ``Verdict.UNKNOWN``.
    estimate : Estimate
        Linear estimate of the coefficient at the final model.
    score : float
        Estimate over its standard error.
    visibility : float
        Share of the effect's signature that the fitted parameters cannot imitate.
    upper_bound : float or None
        Largest abs(coefficient) that the data allow at 95 %; None for an effect that is not testable.
    why : str
        Reason, in a clause.
    experiment : str
        What would make the effect visible; empty if nothing is needed.
    suggestive : bool
        Whether the score of an effect that is not shown is between the suggestive level and what is needed.
    withdrawn : bool
        Whether the effect was found in the training logs and removed again.
    """

    name: str
    axis: str
    verdict: Verdict
    estimate: Estimate
    score: float
    visibility: float
    upper_bound: float | None
    why: str
    experiment: str
    suggestive: bool = False
    withdrawn: bool = False
