"""What the identifier remembers between two samples, as nested tuples of numbers, and what it says."""

from math import atan2, sqrt
from typing import NamedTuple, Optional

from .adaptation import AxisState
from .instruments import References, contradicts
from .linear_algebra import hypotenuse
from .loop import Feedback, feedback_score
from .prediction_error import PredictorState
from .settings import ModelParameters, Plan
from .signals import LagState, Signals


class Axis(NamedTuple):
    """One axis: its estimate, its predictor (None where the method is the adaptation), what is known of its loop."""

    estimate: AxisState
    predictor: Optional[PredictorState]  # noqa: UP045 - a host's Python may be 3.9, where types have no |
    loop: Feedback


class IdentifierState(NamedTuple):
    """Everything remembered between two samples."""

    samples: int  # after sample 0
    voltages: tuple[float, float]  # sums of front and rear voltage [V] since the last sample that was taken
    signals: Signals
    lag: Optional[LagState]  # noqa: UP045
    axes: tuple[Axis, Axis, Axis]  # pitch, elevation, travel
    references: References  # the instruments of all axes


_LEAST_ERROR = 1e-9  # least standard error of a lag [s], so that weights stay finite


class Lag(NamedTuple):
    """The motors' time constant T_m and its standard error, 0 where it is given [s]."""

    value: float
    standard_error: float


class IdentifierOutput(NamedTuple):
    """What is known after a sample; triples are of pitch, elevation, travel."""

    parameters: ModelParameters
    standard_errors: ModelParameters
    sigma: tuple[float, float, float]  # adaptation error [rad/s^2]
    excitation: tuple[float, float, float]  # level [1]
    feedback: tuple[float, float, float]  # score of a closed loop [1]
    lag: Lag
    instruments: tuple[float, float, float]  # k_x, k_z, k_y by the references [rad/s^2/V], 0 where none has moved
    instrument_errors: tuple[float, float, float]  # their standard errors
    contradicted: bool  # whether they exclude an estimate
    adapting: bool  # false while the adaptation rests


def output_of(state: IdentifierState, plan: Plan) -> IdentifierOutput:
    """Return what is known in ``state``, without a step."""
    pitch, elevation, travel = state.axes
    (omega_1, errors_1), (omega_2, errors_2), (omega_3, errors_3) = [
        (axis.estimate.omega[: own.gain + 1], axis.estimate.standard_errors[: own.gain + 1])
        for axis, own in zip(state.axes, plan.axes, strict=True)
    ]
    rest = plan.settings.rest_angle
    if rest is not None:
        a_wx, a_th, k_x = omega_1
        theta0 = rest
        errors_1 = (*errors_1, 0.0)
    else:
        a_wx, p, q, k_x = omega_1
        a_th, theta0 = hypotenuse(p, q), atan2(q, p)
    gains = k_x, omega_2[-1], omega_3[-1]
    instruments, instrument_errors, contradicted = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), False
    p_1, p_2, p_3 = pitch.predictor, elevation.predictor, travel.predictor
    if p_1 is not None and p_2 is not None and p_3 is not None:
        i_1, i_2, i_3 = p_1.instruments, p_2.instruments, p_3.instruments
        instruments = i_1.gain, i_2.gain, i_3.gain
        instrument_errors = i_1.standard_error, i_2.standard_error, i_3.standard_error
        contradicted = contradicts(i_1, gains[0]) or contradicts(i_2, gains[1]) or contradicts(i_3, gains[2])
    return IdentifierOutput(
        ModelParameters._make((a_wx, a_th, k_x, theta0, *omega_2, *omega_3)),
        ModelParameters._make((*errors_1, *errors_2, *errors_3)),
        (pitch.estimate.sigma, elevation.estimate.sigma, travel.estimate.sigma),
        (pitch.estimate.excitation, elevation.estimate.excitation, travel.estimate.excitation),
        (feedback_score(pitch.loop), feedback_score(elevation.loop), feedback_score(travel.loop)),
        lag_of(pitch.estimate, elevation.estimate, plan),
        instruments,
        instrument_errors,
        contradicted,
        state.samples // plan.every >= plan.hold_samples,
    )


def lag_of(pitch: AxisState, elevation: AxisState, plan: Plan) -> Lag:
    """Return the lag from pitch and elevation, each weighted by the inverse square of its standard error."""
    assumed = plan.settings.motor_time_constant
    if not plan.estimates_lag:
        return Lag(assumed, 0.0)
    weighted, weights = 0.0, 0.0
    for axis, own in ((pitch, plan.axes[0]), (elevation, plan.axes[1])):
        gain, product = axis.omega[own.gain], axis.omega[own.gain + 1]
        error = max(axis.standard_errors[-1], _LEAST_ERROR)
        weight = 1.0 / (error * error)
        weighted += weight * (product / gain if gain != 0.0 else 0.0)
        weights += weight
    return Lag(assumed + weighted / weights, 1.0 / sqrt(weights))
