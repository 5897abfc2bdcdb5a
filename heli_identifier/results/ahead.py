"""Errors ahead of a plant without a fit, on logs of its rig, compared with limits."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from heli_identifier.records import Log
from heli_identifier.results.bootstrap import rms_figures
from heli_identifier.results.diagnosis import ErrorFigure
from heli_identifier.results.prediction import HORIZONS, SPACING, Model, Run
from heli_identifier.tracing.helicopter import helicopter
from heli_identifier.tracing.rig import Parameters, record_of


@dataclass(frozen=True)
class Outcome:
    """One axis of one log: its error ahead [rad] and the limit [rad] of this error."""

    log: str
    axis: str
    error: ErrorFigure
    limit: float

    @property
    def passed(self) -> bool:
        """Whether the error is within the limit."""
        return self.error.value <= self.limit


def errors_ahead(
    parameters: Parameters, logs: Sequence[Log], figure: str = "prediction_1s"
) -> list[tuple[str, str, ErrorFigure]]:
    """Predict ``logs`` with ``parameters`` alone; give log, axis and error [rad], log by log.

    ``figure`` is one of :data:`.prediction.HORIZONS`. If it starts from the filter's state, it is larger than that of a
    fit, which knows the air. Samples within the events of the logs do not count.
    """
    rig, errors = helicopter(logs), list[tuple[str, str, ErrorFigure]]()
    for log in logs:
        run = Run.along(Model.alone(rig, parameters), record_of(log, rig), np.zeros(len(rig.axes)))
        what = f"log {log.name}, error over {HORIZONS[figure]:g} s"
        figures = rms_figures([run.errors()[figure]], SPACING, what)
        errors += [(log.name, axis, error) for axis, error in zip(rig.axes, figures, strict=True)]
    return errors


def compare_to_limits(
    parameters: Parameters, limits: Mapping[str, float], logs: Sequence[Log], figure: str = "prediction_1s"
) -> list[Outcome]:
    """Compare the :func:`errors_ahead` of every axis named in ``limits`` [rad] with its limit."""
    errors = errors_ahead(parameters, logs, figure)
    return [Outcome(log, axis, error, limits[axis]) for log, axis, error in errors if axis in limits]
