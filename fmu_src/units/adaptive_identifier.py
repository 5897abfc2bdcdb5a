"""AdaptiveIdentifier: on-line estimation of the plant's parameters from voltages and angles, as a unit."""

from __future__ import annotations

from math import isfinite
from typing import ClassVar

from pythonfmu.enums import Fmi2Status

from heli_identifier.errors import ConfigurationError
from heli_identifier.online import (
    ADAPTATION,
    GAINS,
    IdentifierOutput,
    IdentifierSettings,
    ModelParameters,
    Sampled,
    before_samples,
    begin_sampling,
    determined,
    is_closed,
    prepare,
    take_samples,
    total,
)
from heli_plant.parameter_table import BY_FIELD

from ..errors import Refusal
from ..slave_base import MOST_SUBSTEPS, SlaveBase
from ..variables import Variable, boolean_parameter, real_output, real_parameter, string_parameter
from .signals import AXES, PAPER, angle_inputs, reference_inputs, voltage_inputs

_NAMES = ModelParameters._fields
_ESTIMATED = tuple((name, BY_FIELD[name].unit, BY_FIELD[name].description) for name in _NAMES)
"""Symbol, unit and description of each estimated parameter."""
_DEFAULT = IdentifierSettings()
SLOTS = 3
"""Number of effects of the catalogue that can be watched on each axis."""
_MEASURED, _INPUTS = 5, 8
"""Two voltages and three angles, the first of ``variables``; three references; the outputs follow them."""


_UNITS = tuple(unit for _, unit, _ in _ESTIMATED)


def _flag(value: float, standard_error: float, unit: str) -> float:
    return 1.0 if determined(value, standard_error, unit) else 0.0


def _output(name: str, unit: str, description: str, depends_on: tuple[str, ...] = ()) -> Variable:
    return real_output(name, unit, None, description, depends_on, variability="discrete")


_OUTPUTS = (
    *(_output(name, unit, f"estimate: {text}", (f"initial.{name}",)) for name, unit, text in _ESTIMATED),
    *(
        _output(f"standard_error.{name}", unit, f"standard error of {name}: {text}", ("adaptation.initial_gain",))
        for name, unit, text in _ESTIMATED
    ),
    *(_output(f"sigma.{axis}", "rad/s^2", f"adaptation error of the {axis}") for axis in AXES),
    *(_output(f"excitation.{axis}", "1", f"excitation level of the {axis}, 0 to 1") for axis in AXES),
    *(
        _output(
            f"determined.{name}", "1", f"1: half the 95 % interval of {name} is at most a tenth of its value, else 0"
        )
        for name, _, _ in _ESTIMATED
    ),
    _output("motor_lag", "s", "lag of both motors: estimated or given", ("motor.time_constant",)),
    _output("standard_error.motor_lag", "s", "standard error of motor_lag, 0 where it is given"),
    *(
        _output(f"feedback.{axis}", "1", f"score of a closed loop on the {axis}; beyond 3 there is one")
        for axis in AXES
    ),
    _output("closed_loop", "1", "1: one of the three scores is beyond 3, a controller flies the rig, else 0"),
    *(
        _output(f"instrument.{name}", BY_FIELD[name].unit, f"{name} by the references alone, 0 where none has moved")
        for name in GAINS
    ),
    *(
        _output(f"standard_error.instrument.{name}", BY_FIELD[name].unit, f"standard error of instrument.{name}")
        for name in GAINS
    ),
    _output("contradicted", "1", "1: the references exclude an estimated gain by 2.5 standard errors, else 0"),
    *(
        _output(f"score.{axis}[{slot}]", "1", f"score of the effect named at place {slot} of watch.{axis}")
        for axis in AXES
        for slot in range(1, SLOTS + 1)
    ),
)
_SETTINGS = (
    string_parameter("method", ADAPTATION, "adaptation: the paper's (7); prediction_error: holds in closed loop"),
    real_parameter("sample.time", "s", _DEFAULT.sample_time, 1e-5, 1.0, "sampling period"),
    real_parameter("filter.frequency", "rad/s", _DEFAULT.filter_frequency, 1e-3, 1e3, "bandwidth of the state filters"),
    real_parameter("filter.damping", "1", _DEFAULT.filter_damping, 0.1, 10.0, "damping ratio of the state filters"),
    real_parameter("adaptation.initial_gain", "1", _DEFAULT.initial_gain, 1e-9, 1e12, "Gamma(0) = this times identity"),
    real_parameter("adaptation.gain_limit", "1", _DEFAULT.gain_limit, 1e-9, 1e300, "upper bound of Gamma"),
    real_parameter("adaptation.forgetting", "1/s", _DEFAULT.forgetting, 0.0, 100.0, "forgetting rate alpha"),
    real_parameter("adaptation.hold_time", "s", -1.0, -1.0, 1e6, "time before adaptation starts; -1: 10/bandwidth"),
    boolean_parameter("pitch.rest_angle_known", False, "use pitch.rest_angle in place of estimating it"),
    real_parameter("pitch.rest_angle", "rad", 0.0, -3.14, 3.14, "pitch at rest, if it is known"),
    real_parameter("motor.time_constant", "s", _DEFAULT.motor_time_constant, 0.0, 5.0, "lag of both motors"),
    boolean_parameter("motor.lag_known", False, "prediction errors estimate no lag, it is motor.time_constant"),
    real_parameter("motor.voltage_limit", "V", _DEFAULT.voltage_limit, 1e-6, 1e3, "saturation of both voltages"),
    real_parameter("excitation.window", "s", _DEFAULT.excitation_window, 1e-3, 1e6, "window of the excitation level"),
    real_parameter("report.interval", "s", _DEFAULT.report_interval, 1e-5, 1e6, "time between two standard errors"),
    *(
        real_parameter(f"initial.{name}", unit, value, -1e6, 1e6, f"initial estimate: {text}")
        for (name, unit, text), value in zip(_ESTIMATED, _DEFAULT.initial, strict=True)
    ),
    *(
        string_parameter(f"watch.{axis}", "", f"up to {SLOTS} effects to watch, separated by commas: dry_friction, ...")
        for axis in AXES
    ),
)  # fmt: skip


class AdaptiveIdentifier(SlaveBase):
    """Samples its inputs every ``sample.time`` [s], independent of the communication step."""

    variables: ClassVar[tuple[Variable, ...]] = (
        *voltage_inputs(), *angle_inputs(), *reference_inputs(), *_OUTPUTS, *_SETTINGS,
    )  # fmt: skip
    hidden = {"sampled": Sampled, "warned": bool}
    summary = "Adaptive identification of pitch, elevation and travel from voltages and angles"
    equations = """
<pre>
state filters:  s^2 F y = omega_f^2 (y - xi_1) - 2 rho omega_f xi_2,  the same F on every signal
regressions:    pitch''     = -a_wx pitch' - a_th sin(pitch - theta0) + k_x mu_d
                elevation'' = -a_wz elevation' - a_e elevation - a_1 - a_lt pitch' travel' + k_z mu_s cos(pitch)
                travel''    = -a_wy travel' + k_y mu_s sin(pitch)
prediction errors, with a noise model estimated along, or
adaptation:     Omega' = Gamma phi sigma,  Gamma' = alpha Gamma - Gamma phi phi^T Gamma,  sigma = y - phi^T Omega
</pre>
<p><code>method</code> = <code>adaptation</code> is the paper's, for excitation in open loop. Under a controller it is
wrong, and the unit says so in a warning: take <code>prediction_error</code>, which holds in both.
<code>closed_loop</code> is 1 where innovations are correlated with the voltages to come; <code>determined.*</code> is 0
where the motion so far does not determine a parameter.</p>
<p>The references need not be connected. Those that a pilot or a program gives (no output of an outer loop, which is
feedback) say with prediction errors what the gains are whatever the air does: <code>instrument.*</code>.
<code>contradicted</code> is 1 where they exclude an estimate; air that swirls does that to <code>k_x</code>.</p>
<p>Prediction errors estimate the lag of the motors along. With <code>motor.lag_known</code>, and with the adaptation,
it is <code>motor.time_constant</code>, and no standard error covers a wrong one: where the lag is .04 s longer than
given, a rig flown by a controller shows a <code>k_x</code> 9 % and a <code>k_z</code> 6 % too small.</p>
<p>The adaptation takes its exact step (least squares with forgetting on a factored gain), so that Gamma stays positive
definite. Angles are straight lines between samples, voltages are held. The outputs at a communication point use the
samples before it. A communication step may differ from the sampling period: a sample between two communication points
has the angles of the straight line between them and the held voltages.</p>
<p><code>watch.pitch</code>, <code>watch.elevation</code> and <code>watch.travel</code> name effects of the catalogue
that the model may lack. <code>score.*</code> is the evidence for each, with the sign of its coefficient; the score of
an absent effect exceeds 3 in about 1 % of the cases.</p>"""
    source = f"{PAPER}, eqs (7), (11); the last term of (11) is omega_f^2 theta, not omega_f theta"

    def initialise(self, time: float) -> None:
        """Read the settings; show the initial estimate."""
        at, values = self.references, self.values
        hold = values[at["adaptation.hold_time"]]
        known = values[at["pitch.rest_angle_known"]]
        self.slots = {axis: self._watched_on(axis) for axis in AXES}
        try:
            self.plan = prepare(
                IdentifierSettings(
                    sample_time=values[at["sample.time"]],
                    filter_frequency=values[at["filter.frequency"]],
                    filter_damping=values[at["filter.damping"]],
                    initial_gain=values[at["adaptation.initial_gain"]],
                    gain_limit=values[at["adaptation.gain_limit"]],
                    forgetting=values[at["adaptation.forgetting"]],
                    hold_time=None if hold < 0.0 else hold,
                    rest_angle=values[at["pitch.rest_angle"]] if known else None,
                    motor_time_constant=values[at["motor.time_constant"]],
                    voltage_limit=values[at["motor.voltage_limit"]],
                    excitation_window=values[at["excitation.window"]],
                    report_interval=values[at["report.interval"]],
                    initial=ModelParameters(*(values[at[f"initial.{name}"]] for name in _NAMES)),
                    watched=tuple((name, axis) for axis in AXES for name in self.slots[axis]),
                    method=values[at["method"]],
                    lag_known=values[at["motor.lag_known"]],
                )
            )
        except ConfigurationError as problem:
            raise Refusal(str(problem)) from problem
        self.sampled: Sampled | None = None
        self.warned = False
        self._show(before_samples(self.plan))

    def _watched_on(self, axis: str) -> list[str]:
        """Return the names listed in ``watch.<axis>``."""
        text = self.values[self.references[f"watch.{axis}"]]
        names = [name.strip() for name in text.split(",") if name.strip()]
        if len(names) > SLOTS:
            raise Refusal(f"watch.{axis} = {text!r} names {len(names)} effects; at most {SLOTS} can be watched")
        return names

    def advance(self, time: float, step_size: float) -> None:
        """Process the samples that are due up to ``time`` [s]; the inputs are those of ``time``."""
        v_front, v_rear, pitch, elevation, travel = now = tuple(self.values[:_MEASURED])
        of_pitch, of_elevation, of_travel = self.values[_MEASURED:_INPUTS]
        references = of_pitch, of_elevation, of_travel
        if self.sampled is None:
            self.sampled = begin_sampling(time, (v_front, v_rear, pitch, elevation, travel), self.plan, references)
            return
        period = self.plan.settings.sample_time
        due = self.sampled.first + (self.sampled.state.samples + 1) * period
        if time - due > MOST_SUBSTEPS * period:
            raise Refusal(
                f"{(time - due) / period:.3g} samples of sample.time = {period:g} s are due at t = {time:g} s; at most "
                f"{MOST_SUBSTEPS} are taken in one step, take shorter ones"
            )
        measured = v_front, v_rear, pitch, elevation, travel
        sampled, estimate = take_samples(self.sampled, time, measured, self.plan, references)
        if estimate is not None:
            if not isfinite(total(estimate.parameters)):
                raise Refusal(
                    f"the estimate is no longer finite in the step from t = {time:g} s; "
                    f"the inputs (voltages [V] and angles [rad]) were {list(now)}"
                )
            self._show(estimate)
        self.sampled = sampled

    def _show(self, estimate: IdentifierOutput) -> None:
        closed = is_closed(estimate.feedback)
        shown = (
            *estimate.parameters,
            *estimate.standard_errors,
            *estimate.sigma,
            *estimate.excitation,
            *map(_flag, estimate.parameters, estimate.standard_errors, _UNITS),
            *estimate.lag,
            *estimate.feedback,
            1.0 if closed else 0.0,
            *estimate.instruments,
            *estimate.instrument_errors,
            1.0 if estimate.contradicted else 0.0,
        )
        self.values[_INPUTS : _INPUTS + len(shown)] = shown
        if closed and not self.warned and self.plan.predictor is None:
            self.warned = True
            self.log(
                "the voltages follow the measured angles: a controller closes the loop. The paper's adaptation is "
                "wrong there by more than its standard errors say; set method to prediction_error",
                Fmi2Status.warning,
            )
        if estimate.scores:
            scores = iter(estimate.scores)
            for axis in AXES:
                for slot, _ in enumerate(self.slots[axis], 1):
                    self.values[self.references[f"score.{axis}[{slot}]"]] = next(scores).score
