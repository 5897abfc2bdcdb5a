"""AdaptiveIdentifier: on-line estimation of the plant's parameters from voltages and angles, as a unit."""

from __future__ import annotations

from functools import partial
from math import isfinite
from typing import Any, ClassVar

from pythonfmu.enums import Fmi2Status

from heli_identifier import online
from heli_plant.parameters import BY_FIELD

from ..errors import Refusal
from ..slave_base import SlaveBase, check_substeps, time_tolerance
from ..variables import Variable, for_each, output, parameter, setting
from .signals import ANGLE_INPUTS, AXES, REFERENCE_INPUTS, VOLTAGE_INPUTS

_ESTIMATED = tuple((name, BY_FIELD[name].unit, BY_FIELD[name].description) for name in online.ModelParameters._fields)
"""Symbol, unit and description of each estimated parameter."""
_UNITS = tuple(unit for _, unit, _ in _ESTIMATED)
_DEFAULT = online.IdentifierSettings()
_setting = partial(setting, _DEFAULT)

_GAINS = [row for row in _ESTIMATED if row[0] in online.GAINS]
_ERRORS_DEPEND_ON = ("adaptation.initial_gain", "pitch.rest_angle_known")
_OUTPUTS = (
    *for_each(_ESTIMATED, output, "{0}", "{1}", "estimate: {2}", ("initial.{0}",)),
    *for_each(_ESTIMATED, output, "standard_error.{0}", "{1}", "standard error of {0}: {2}", _ERRORS_DEPEND_ON),
    *for_each(AXES, output, "sigma.{}", "rad/s^2", "adaptation error of the {}"),
    *for_each(
        _ESTIMATED, output, "determined.{0}", "1",
        "1: half the 95 % interval of {0} is at most a tenth of its value, else 0",
        ("initial.{0}", *_ERRORS_DEPEND_ON),
    ),
    output("motor_lag", "s", "lag of both motors: estimated or given", ("motor.time_constant",)),
    output(
        "standard_error.motor_lag", "s", "standard error of motor_lag, 0 where it is given",
        ("method", "adaptation.initial_gain", "motor.lag_known"),
    ),
    *for_each(AXES, output, "feedback.{}", "1", "score of a closed loop on the {}; beyond 3 there is one"),
    output("closed_loop", "1", "1: one of the three scores is beyond 3, a controller flies the rig, else 0"),
    *for_each(_GAINS, output, "instrument.{0}", "{1}", "{0} by the references alone, 0 where none has moved"),
    *for_each(_GAINS, output, "standard_error.instrument.{0}", "{1}", "standard error of instrument.{0}"),
    output("contradicted", "1", "1: the references exclude an estimated gain by 2.5 standard errors, else 0"),
)  # fmt: skip
_SETTINGS = (
    parameter("method", _DEFAULT.method, "adaptation: the paper's (7); prediction_error: holds in closed loop"),
    _setting("sample.time", "sample_time", "sampling period", "s", 1e-5, 1.0),
    _setting("filter.frequency", "filter_frequency", "bandwidth of the state filters", "rad/s", 1e-3, 1e3),
    _setting("filter.damping", "filter_damping", "damping ratio of the state filters", "1", 0.1, 10.0),
    _setting("adaptation.initial_gain", "initial_gain", "Gamma(0) = this times identity", "1", 1e-9, 1e12),
    _setting("adaptation.gain_limit", "gain_limit", "upper bound of Gamma", "1", 1e-9, 1e300),
    _setting("adaptation.forgetting", "forgetting", "forgetting rate alpha", "1/s", 0.0, 100.0),
    parameter("adaptation.hold_time", -1.0, "time before adaptation starts; -1: 10/bandwidth", "s", -1.0, 1e6),
    parameter("pitch.rest_angle_known", False, "use pitch.rest_angle in place of estimating it"),
    parameter("pitch.rest_angle", 0.0, "pitch at rest, if it is known", "rad", -3.14, 3.14),
    _setting("motor.time_constant", "motor_time_constant", "lag of both motors", "s", 0.0, 5.0),
    _setting("motor.lag_known", "lag_known", "prediction errors estimate no lag, it is motor.time_constant"),
    _setting("motor.voltage_limit", "voltage_limit", "saturation of both voltages", "V", 1e-6, 1e3),
    _setting("report.interval", "report_interval", "time between two standard errors", "s", 1e-5, 1e6),
    *for_each(_ESTIMATED, _setting, "initial.{0}", "initial.{0}", "initial estimate: {2}", "{1}", -1e6, 1e6),
)


# Any: from an annotation as a tuple the translator would make a list, but it must know the length here
def output_values(estimate: online.IdentifierOutput, is_in_closed_loop: bool) -> Any:
    """Return the outputs in the order of the variables."""
    triples = zip(estimate.parameters, estimate.standard_errors, _UNITS, strict=True)
    return (
        *estimate.parameters,
        *estimate.standard_errors,
        *estimate.sigma,
        *[float(online.is_determined(value, error, unit)) for value, error, unit in triples],
        *estimate.lag,
        *estimate.feedback,
        float(is_in_closed_loop),
        *estimate.instruments,
        *estimate.instrument_errors,
        float(estimate.contradicted),
    )


def take_samples(
    sampled: online.Sampled, time: float, step: float, measured: tuple[float, float, float, float, float],
    references: tuple[float, float, float], plan: online.Plan,
) -> tuple[online.Sampled, online.IdentifierOutput | None]:  # fmt: skip
    """Take the samples that are due by ``time`` [s], from which a ``step`` [s] is taken; refuse too many samples.

    Voltages [V] and angles [rad] are ``measured``. An estimate that is not finite is refused as well.
    """
    period, due = plan.settings.sample_time, online.next_due(sampled.first, sampled.state.samples, plan)
    check_substeps(time - due, period, "sample.time", time)
    early = time_tolerance(time, time - sampled.first, min(step, period))
    after, estimate = online.take_samples(sampled, time, early, measured, plan, references)
    if estimate is not None and not isfinite(online.total([*estimate.parameters])):
        v_front, v_rear, pitch, elevation, travel = measured
        raise Refusal(
            f"the estimate is no longer finite in the step from t = {time:g} s; the inputs (voltages [V] and angles "
            f"[rad]) were [{v_front}, {v_rear}, {pitch}, {elevation}, {travel}]"
        )
    return after, estimate


class AdaptiveIdentifier(SlaveBase):
    """Samples its inputs every ``sample.time`` [s], independently of the communication step."""

    variables: ClassVar[tuple[Variable, ...]] = (
        *VOLTAGE_INPUTS, *ANGLE_INPUTS, *REFERENCE_INPUTS, *_OUTPUTS, *_SETTINGS,
    )  # fmt: skip
    hidden = {"sampled": online.Sampled, "warned": bool}
    summary = "Adaptive identification of pitch, elevation and travel from voltages and angles"

    def initialise(self, time: float) -> None:
        """Read the settings; show the initial estimate."""
        hold, known = self.value("adaptation.hold_time"), self.value("pitch.rest_angle_known")
        self.plan = online.prepare(
            self.settings(
                _DEFAULT,
                hold_time=None if hold < 0.0 else hold,
                rest_angle=self.value("pitch.rest_angle") if known else None,
                method=self.value("method"),
            )
        )
        self.sampled: online.Sampled | None = None
        self.warned = False
        self._show(online.before_samples(self.plan))

    def advance(self, time: float, step_size: float) -> None:
        """Process the samples that are due up to ``time`` [s]; the inputs belong to ``time``."""
        v_front, v_rear, pitch, elevation, travel, of_pitch, of_elevation, of_travel = self.values[:8]
        measured, references = (v_front, v_rear, pitch, elevation, travel), (of_pitch, of_elevation, of_travel)
        if self.sampled is None:
            self.sampled = online.begin_sampling(time, measured, self.plan, references)
            return
        self.sampled, estimate = take_samples(self.sampled, time, step_size, measured, references, self.plan)
        if estimate is not None:
            self._show(estimate)

    def _show(self, estimate: online.IdentifierOutput) -> None:
        closed = online.is_closed(estimate.feedback)
        self.show(output_values(estimate, closed))
        if closed and not self.warned and not self.plan.predicting:
            self.warned = True
            self.log(
                "the voltages follow the measured angles: a controller closes the loop. The paper's adaptation is "
                "wrong there by more than its standard errors say; set method to prediction_error",
                Fmi2Status.warning,
            )
