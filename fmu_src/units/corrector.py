"""Corrector: the twin that follows a rig, as a unit; it tells HelicopterPlant what to correct."""

from __future__ import annotations

from typing import ClassVar

from heli_identifier.errors import ConfigurationError
from heli_identifier.following import (
    DEFAULT_EFFECTS,
    HEARD,
    WHAT,
    WHY,
    CorrectorOutput,
    CorrectorState,
    Event,
    FollowSettings,
    IdentifierReport,
    Sample,
    correct,
    prepare_following,
    start_correcting,
)
from heli_plant.errors import ParameterError
from heli_plant.observer import CORRECTED
from heli_plant.parameter_table import PARAMETERS
from heli_plant.parameters import PlantParameters, checked

from ..errors import Refusal
from ..slave_base import MOST_SUBSTEPS, SlaveBase
from ..variables import Variable, boolean_parameter, real_input, real_output, real_parameter
from .signals import AXES, angle_inputs, voltage_inputs

_SLOTS = tuple(
    (axis, slot) for axis in AXES for slot, _ in enumerate([name for name, own in DEFAULT_EFFECTS if own == axis], 1)
)
"""Places of the watched effects in the identifier's lists, in the order of its axes."""

_EARLY = 1e-6
"""A sample is due this fraction of its period early, because communication points k H have rounding errors."""

_UNITS = {row.field: row.unit for row in PARAMETERS}
_WATCHED = tuple((name, own) for axis in AXES for name, own in DEFAULT_EFFECTS if own == axis)
_INPUTS = (
    *voltage_inputs(),
    *angle_inputs(),
    real_input("fresh", "1", 1.0, 1.0, "1: the inputs are of this instant, 0: nothing came in", 1.0),
    *(real_input(f"excitation.{axis}", "1", 1.0, 1.0, f"excitation level of the {axis}", 1.0) for axis in AXES),
    *(
        real_input(f"score.{axis}[{slot}]", "1", 1e9, 1.0, f"score of the effect at place {slot} of watch.{axis}")
        for axis, slot in _SLOTS
    ),
    *(real_input(f"estimate.{name}", _UNITS[name], 1e9, 1.0, f"the identifier's estimate of {name}") for name in HEARD),
    *(
        real_input(f"estimate_error.{name}", _UNITS[name], 1e9, 1.0, f"standard error of that of {name}, 0 if none")
        for name in HEARD
    ),
)


def _output(name: str, unit: str, description: str) -> Variable:
    return real_output(name, unit, None, description, (), variability="discrete")


_OUTPUTS = (
    *(_output(f"correction.{name}", unit, f"what is to be added to {name}") for name, unit in CORRECTED),
    *(_output(f"standard_error.{name}", unit, f"of an adopted {name}, else 0") for name, unit in CORRECTED),
    *(_output(f"predicted.{axis}", "rad", f"{axis} that the following twin predicted 1 s before") for axis in AXES),
    *(_output(f"predicted_alone.{axis}", "rad", f"the same of the twin that is left alone, {axis}") for axis in AXES),
    *(_output(f"error.{axis}", "rad", f"rms error 1 s ahead over the window, {axis}") for axis in AXES),
    *(_output(f"error_alone.{axis}", "rad", f"the same of the twin that is left alone, {axis}") for axis in AXES),
    *(_output(f"torque.{axis}", "rad/s^2", f"unmodelled acceleration of the {axis}") for axis in AXES),
    _output("compared", "1", "1: predictions were compared in this step"),
    _output("observer.bandwidth", "rad/s", "for the plant's observer"),
    _output("alarm", "1", "largest sum of Page's tests over its threshold; 1 is an alarm"),
    _output("suspect", "1", "number of the likeliest change, 0 for none (see the documentation)"),
    _output("mode", "1", "0 starting, 1 following, 2 alarmed, 3 on trial, 4 adopted, 5 suspended"),
    _output("event.count", "1", "number of reports so far"),
    _output("event.what", "1", "last report: 1 alarm, 2 adopted, 3 held, 4 rolled back, 5 stream; 0 none"),
    _output("event.change", "1", "its change by number, 0 for none"),
    _output("event.why", "1", "its reason by number, from 1"),
    _output("event.value", "1", "value of the parameter after the change, in the parameter's unit"),
    _output("event.standard_error", "1", "its standard error"),
    _output("event.since", "s", "when the change took place, as estimated"),
)
_DEFAULT = FollowSettings()
_SETTINGS = (
    real_parameter("sample.time", "s", _DEFAULT.sample_time, 1e-4, 0.1, "time between two samples"),
    real_parameter("window", "s", _DEFAULT.window, 4.0, 60.0, "time over which errors 1 s ahead are compared"),
    real_parameter("false_alarm.time", "s", _DEFAULT.false_alarm_time, 60.0, 1e9, "mean time between false alarms"),
    real_parameter("keeping.bandwidth", "rad/s", _DEFAULT.observer_bandwidth, 2.0, 30.0, "poles of the observers"),
    boolean_parameter("keeping.enabled", True, "whether the plant's observer is switched on"),
    boolean_parameter("correcting", True, "adopt changes; if not, only report them"),
)
_PHYSICS = tuple(
    real_parameter(row.name, row.unit, row.default, row.minimum, row.maximum, row.description) for row in PARAMETERS
)


class Corrector(SlaveBase):
    """Takes a sample every ``sample.time``; the pure step is that of the following twin."""

    variables: ClassVar[tuple[Variable, ...]] = (*_INPUTS, *_OUTPUTS, *_SETTINGS, *_PHYSICS)
    hidden = {"first": float, "state": CorrectorState, "reports": int, "last": Event}
    summary = "Notices in flight that a twin no longer fits its rig, names the change and corrects the twin"
    equations = """
<pre>
innovations:  e = y - y_hat of an observer around the twin;  a change of size delta makes e = delta psi + white noise
Page's test:  S = max(0, S + delta sum psi e - delta^2/2 sum psi^2),  alarm beyond ln(tests * false_alarm.time / 1 s)
</pre>
<p>A change is named by its likelihood, put on trial as a second twin beside the one in use, adopted if its errors 1 s
ahead are smaller over the window, ramped in over 2 s, and taken back if the values before predict better.</p>
<p>Numbers of the changes: 1 pitch.gain, 2 elevation.gain, 3 travel.gain, 4 elevation.offset, 5 pitch.damping,
6 elevation.damping, 7 travel.damping, 8 rotor.front, 9 rotor.rear, 10 rotors.thrust, 11 to 13 dry friction on pitch,
elevation and travel, 14 and 15 constant torque on pitch and travel, 16 cable stiffness.</p>
<p>The parameters are those of the twin at the start, as HelicopterPlant has them. The communication step should be
<code>sample.time</code>: of a longer one the samples in between count as lost, of a shorter one those that are due are
taken.</p>"""
    source = "Page 1954; Willsky and Jones 1976; Basseville and Nikiforov, Detection of Abrupt Changes, 1993"

    def initialise(self, time: float) -> None:
        """Read the settings; show the start."""
        at, values = self.references, self.values
        try:
            parameters = checked(PlantParameters(**{row.field: values[at[row.name]] for row in PARAMETERS}))
            self.plan = prepare_following(
                FollowSettings(
                    sample_time=values[at["sample.time"]],
                    parameters=parameters,
                    window=values[at["window"]],
                    false_alarm_time=values[at["false_alarm.time"]],
                    observer_bandwidth=values[at["keeping.bandwidth"]],
                    correcting=values[at["correcting"]],
                )
            )
        except (ConfigurationError, ParameterError) as problem:
            raise Refusal(str(problem)) from problem
        self.state: CorrectorState | None = None
        self.first = time
        self.reports = 0
        self.last: Event | None = None
        for variable in _OUTPUTS:
            values[at[variable.name]] = 0.0
        bandwidth = values[at["keeping.bandwidth"]] if values[at["keeping.enabled"]] else 0.0
        values[at["observer.bandwidth"]] = bandwidth
        self.bandwidth = bandwidth

    def advance(self, time: float, step_size: float) -> None:
        """Take the sample of ``time`` [s]; the outputs are of the end of the step."""
        v_front, v_rear, pitch, elevation, travel, fresh = self.values[:6]
        now = Sample(v_front, v_rear, pitch, elevation, travel, fresh)
        period = self.plan.settings.sample_time
        if self.state is None:
            self.first = time
            self.state = start_correcting(self.plan, now)
            return
        late = time - self.first - (self.state.samples + 1) * period
        if late > MOST_SUBSTEPS * period:
            raise Refusal(
                f"{late / period:.3g} samples of sample.time = {period:g} s are due at t = {time:g} s; at most "
                f"{MOST_SUBSTEPS} are taken in one step, take shorter ones"
            )
        scores = self.values[9 : 9 + len(_SLOTS)]
        ordered = tuple([scores[_WATCHED.index(effect)] for effect in DEFAULT_EFFECTS])
        first = 9 + len(_SLOTS)
        last = first + len(HEARD)
        estimates = tuple(self.values[first:last])
        errors = tuple(self.values[last : last + len(HEARD)])
        report = IdentifierReport((self.values[6], self.values[7], self.values[8]), ordered, estimates, errors)
        state, output = self.state, None
        events: list[Event] = []
        while self.first + (state.samples + 1) * period <= time + _EARLY * period:
            due_again = self.first + (state.samples + 2) * period <= time + _EARLY * period
            state, output = correct(state, now._replace(fresh=0.0) if due_again else now, report, self.plan)
            events.extend(output.events)
        self.state = state
        if output is not None:
            self._show(output, events)

    def _show(self, output: CorrectorOutput, events: list[Event]) -> None:
        first = self.plan.first_values
        for event in events:
            self.reports += 1
            self.last = event
        shown = [
            *[value - start for value, start in zip(output.values, first, strict=True)],
            *output.standard_errors,
            *output.predicted,
            *output.predicted_alone,
            *(output.error if output.compared else self.values[_ERROR : _ERROR + 3]),
            *(output.error_alone if output.compared else self.values[_ERROR + 3 : _ERROR + 6]),
            *output.torque,
            1.0 if output.compared else 0.0,
            self.bandwidth,
            output.alarm,
            output.suspect + 1.0,
            float(output.mode),
            float(self.reports),
        ]
        if self.last is not None:
            event = self.last
            names = [change.name for change in self.plan.changes]
            number = names.index(event.name) + 1.0 if event.name else 0.0
            shown += [WHAT.index(event.what) + 1.0, number, WHY.index(event.why) + 1.0]
            shown += [event.value, event.standard_error, self.start_time + event.since]
        self.values[len(_INPUTS) : len(_INPUTS) + len(shown)] = shown


_ERROR = len(_INPUTS) + 2 * len(CORRECTED) + 2 * len(AXES)
"""Place of ``error.pitch``."""
