"""Corrector: the twin that follows a rig, as a unit; its outputs correct FollowingPlant."""

from __future__ import annotations

from functools import partial
from typing import ClassVar

from heli_identifier import following
from heli_plant.observer import CORRECTED, FIELDS
from heli_plant.parameters import PARAMETERS, check_parameters

from ..slave_base import SlaveBase, check_substeps, time_tolerance
from ..variables import Variable, for_each, output, real_input, setting
from .signals import ANGLE_INPUTS, AXES, VOLTAGE_INPUTS

_INPUTS = (
    *VOLTAGE_INPUTS,
    *ANGLE_INPUTS,
    real_input("fresh", "1", 1.0, 1.0, "1: the inputs are of this instant, 0: nothing came in", 1.0),
)
_OUTPUTS = (
    *for_each(CORRECTED, output, "correction.{0}", "{1}", "what is to be added to {0}"),
    *for_each(CORRECTED, output, "standard_error.{0}", "{1}", "of an adopted {0}, else 0"),
    *for_each(AXES, output, "predicted.{}", "rad", "{} that the following twin predicted 1 s before"),
    *for_each(AXES, output, "predicted_alone.{}", "rad", "the same of the twin that is left alone, {}"),
    *for_each(AXES, output, "error.{}", "rad", "rms error 1 s ahead over the window, {}"),
    *for_each(AXES, output, "error_alone.{}", "rad", "the same of the twin that is left alone, {}"),
    *for_each(AXES, output, "torque.{}", "rad/s^2", "unmodelled acceleration of the {}"),
    output("compared", "1", "1: predictions were compared in this step"),
    output("observer.bandwidth", "rad/s", "for the plant's observer", ("keeping.bandwidth",)),
    output("alarm", "1", "largest sum of Page's tests over its threshold; 1 is an alarm"),
    output("suspect", "1", "number of the likeliest change, 0 for none (see the documentation)"),
    output("mode", "1", "0 starting, 1 following, 2 alarmed, 3 on trial, 4 adopted, 5 suspended"),
    output("event.count", "1", "number of reports so far"),
    output("event.what", "1", "last report: 1 alarm, 2 adopted, 3 held, 4 rolled back, 5 stream; 0 none"),
    output("event.change", "1", "its change by number, 0 for none"),
    output("event.why", "1", "its reason by number, from 1"),
    output("event.value", "1", "value of the parameter after the change, in the parameter's unit"),
    output("event.standard_error", "1", "its standard error"),
    output("event.since", "s", "when the change took place, as estimated"),
)
_DEFAULT = following.FollowSettings()
_setting = partial(setting, _DEFAULT)
_SETTINGS = (
    # errors of an encoder are alike within some 5 ms; the observer's poles of 7 rad/s need three samples in .14 s
    _setting("sample.time", "sample_time", "time between two samples", "s", 5e-3, 0.1),
    _setting("false_alarm.time", "false_alarm_time", "mean time between false alarms", "s", 60.0, 1e9),
    _setting("keeping.bandwidth", "observer_bandwidth", "poles of the observers", "rad/s", 2.0, 30.0),
    _setting("correcting", "correcting", "adopt changes; if not, only report them"),
    *(
        _setting(row.name, f"parameters.{row.field}", row.description, row.unit, row.minimum, row.maximum)
        for row in PARAMETERS
    ),
)


class Corrector(SlaveBase):
    """Takes a sample every ``sample.time`` and gives it to the following twin."""

    variables: ClassVar[tuple[Variable, ...]] = (*_INPUTS, *_OUTPUTS, *_SETTINGS)
    hidden = {"first": float, "state": following.CorrectorState, "reports": int, "last": following.TwinEvent}
    summary = "Notices in flight that a twin no longer fits its rig, names the change and corrects the twin"

    def initialise(self, time: float) -> None:
        """Read the settings; show the outputs at the start."""
        settings = self.settings(_DEFAULT)
        check_parameters(settings.parameters)
        self.plan = following.FollowPlan(settings)
        self.state: following.CorrectorState | None = None
        self.first = time
        self.reports = 0
        self.last: following.TwinEvent | None = None
        start = {"observer.bandwidth": settings.observer_bandwidth}
        self.show(start.get(variable.name, 0.0) for variable in _OUTPUTS)

    def advance(self, time: float, step_size: float) -> None:
        """Take the sample of ``time`` [s]; the outputs are of the end of the step."""
        now = following.Sample(*self.values[:6])
        period = self.plan.settings.sample_time
        if self.state is None:
            self.first = time
            self.state = following.start_correcting(self.plan, now)
            return
        elapsed, state = time - self.first, self.state
        check_substeps(elapsed - (state.instants + 1) * period, period, "sample.time", time)
        due = elapsed + time_tolerance(time, elapsed, min(step_size, period))
        while (state.instants + 1) * period <= due:
            is_last = (state.instants + 2) * period > due
            state, events = following.correct(state, now if is_last else now._replace(fresh=0.0), self.plan)
            self.reports += len(events)
            self.last = events[-1] if events else self.last
        if state.instants > self.state.instants:
            self.state = state
            self._show(state)

    def _show(self, state: following.CorrectorState) -> None:
        twins, window = state.predictions, self.plan.window
        if twins.compared:
            errors = [*twins.used.rms(window), *twins.alone.rms(window)]
        else:  # keep those of the last comparison
            errors = [self.value(f"{which}.{axis}") for which in ("error", "error_alone") for axis in AXES]
        outputs = [
            *[getattr(state.twin, field) - getattr(self.plan.alone, field) for field in FIELDS],
            *state.errors,
            *twins.used.predicted,
            *twins.alone.predicted,
            *errors,
            *state.observer.torque,
            float(twins.compared),
            self.plan.settings.observer_bandwidth,
            state.alarm,
            state.finding.change + 1.0,
            float(following.MODES.index(state.shown_mode)),
            float(self.reports),
        ]
        if self.last is not None:
            event = self.last
            names = ["", *(change.name for change in self.plan.changes)]
            why = list(following.REASONS.values()).index((event.what, event.why))
            outputs += [following.WHAT.index(event.what) + 1.0, float(names.index(event.name)), why + 1.0]
            outputs += [event.value, event.standard_error, self.start_time + event.since_s]
        self.show(outputs)
