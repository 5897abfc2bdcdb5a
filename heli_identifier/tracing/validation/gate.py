"""Whether a model still explains a log: the error of its 1 s prediction against a limit, axis by axis."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from heli_identifier.records import Log
from heli_identifier.tracing.prediction.ahead import SPACING
from heli_identifier.tracing.prediction.problem import reduce_log
from heli_identifier.tracing.validation.figures import ErrorFigure, rms_figures
from heli_identifier.tracing.validation.prediction import prediction_errors
from heli_plant.effects import AXES
from heli_plant.parameters import PlantParameters

HORIZON = 1.0
"""How far ahead [s] is predicted."""


@dataclass(frozen=True)
class Outcome:
    """One axis of one log: its error [rad] and the limit [rad] it is held to."""

    log: str
    axis: str
    error: ErrorFigure
    limit: float

    @property
    def passed(self) -> bool:
        """Whether the error keeps the limit."""
        return self.error.value <= self.limit


def hold_to(parameters: PlantParameters, limits: Mapping[str, float], logs: Sequence[Log]) -> list[Outcome]:
    """Predict ``logs`` with ``parameters`` and hold every axis named in ``limits`` [rad] to its limit."""
    outcomes = []
    for log in logs:
        figures = rms_figures([prediction_errors(reduce_log(log), parameters, HORIZON)], SPACING)
        outcomes += [Outcome(log.name, axis, figures[AXES.index(axis)], limit) for axis, limit in limits.items()]
    return outcomes
