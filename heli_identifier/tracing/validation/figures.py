"""Errors of a model as values: one figure, an axis, an axis before and after."""

from collections.abc import Mapping
from dataclasses import dataclass


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
