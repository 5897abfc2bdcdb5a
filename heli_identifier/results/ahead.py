"""Errors ahead of a plant without a fit, on logs of its rig."""

from collections.abc import Sequence

import numpy as np

from heli_identifier.records import Log
from heli_identifier.results.bootstrap import rms_figures
from heli_identifier.results.diagnosis import ErrorFigure
from heli_identifier.results.prediction import HORIZONS, SPACING, Model, Run
from heli_identifier.tracing.helicopter import helicopter
from heli_identifier.tracing.rig import Parameters, record_of


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
