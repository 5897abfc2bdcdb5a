"""Controllers as units: PidController, three sampled PID loops, and StateFeedback, LQR or LQI with a Kalman filter.

They read angles, and an excitation that is added to the voltages; their references may step at a given time.
"""

from __future__ import annotations

from functools import partial
from typing import Any, ClassVar

from heli_plant import control, state_feedback
from heli_plant.motor import saturate

from ..slave_base import SlaveBase, time_tolerance
from ..variables import Variable, for_each, parameter, real_input, setting
from .signals import ANGLE_INPUTS, AXES, ROTORS, VOLTAGE_BOUND, voltage_outputs


def controller_variables(*voltages_depend_on: str) -> tuple[Variable, ...]:
    """Return the first variables of a controller; at the start a voltage (``{}``: its rotor) depends on parameters."""
    return (
        *ANGLE_INPUTS,
        *for_each(ROTORS, real_input, "excitation_{}", "V", VOLTAGE_BOUND, 1.0, "added to the {} voltage"),
        *voltage_outputs(*voltages_depend_on),
        *for_each(AXES, parameter, "reference.{}", 0.0, "reference of the {}", "rad", -1e4, 1e4, tunable=True),
        *for_each(AXES, parameter, "reference.step_{}", 0.0, "step of the {} reference", "rad", -1e4, 1e4),
        parameter("reference.step_time", 5.0, "time of the reference step", "s", 0.0, 1e9),
    )


Five = tuple[float, float, float, float, float]
"""Pitch, elevation and travel [rad], and what is added to the front and the rear voltage [V]."""
Seven = tuple[float, float, float, float, float, float, float]
"""References of the three angles [rad], their steps [rad], and the time of these steps [s]."""


_PID = control.PidSettings()
_pid = partial(setting, _PID)
_VOLTAGE_GAINS = (("proportional", "V/rad"), ("integral", "V/(rad s)"), ("derivative", "V s/rad"))
_TRAVEL_GAINS = (("proportional", "1"), ("integral", "1/s"), ("derivative", "s"))
_GAINS = [(axis, *gain) for axis in AXES for gain in (_TRAVEL_GAINS if axis == "travel" else _VOLTAGE_GAINS)]


def pid_voltages(
    state: control.PidState | None, inputs: Five, given: Seven, time: float, since: float, step: float,
    s: control.PidSettings,
) -> tuple[control.PidState, tuple[float, float]]:  # fmt: skip
    """Return the state and the voltages (front, rear) [V] after a ``step`` from ``time``, ``since`` the start [s]."""
    pitch, elevation, travel, more_front, more_rear = inputs
    rise_time = given[6] - time_tolerance(time, since, step)
    references = control.step_references(given[:3], given[3:6], since, rise_time)
    before = control.start_pid(pitch, elevation, travel) if state is None else state
    after, (front, rear) = control.pid_step(before, pitch, elevation, travel, references, step, s)
    return after, (saturate(front + more_front, s.voltage_limit), saturate(rear + more_rear, s.voltage_limit))


class PidController(SlaveBase):
    """Reads the angles at each communication point and shows the resulting voltages at the next one."""

    variables: ClassVar[tuple[Variable, ...]] = (
        *controller_variables("trim", "voltage_limit"),
        *for_each(_GAINS, _pid, "{0}.{1}", "{0}.{1}", "{1} gain, {0}", "{2}", -1e4, 1e4),
        _pid("travel.enabled", "travel_enabled", "the travel loop sets the pitch reference"),
        _pid("travel.pitch_limit", "pitch_limit", "bound of that pitch reference", "rad", 0.0, 1.6),
        _pid("trim", "trim", "sum of both voltages at zero error", "V", -60.0, 60.0),
        _pid("rate.time_constant", "rate_time_constant", "lag of the rate's filter", "s", 1e-4, 10.0),
        _pid("voltage_limit", "voltage_limit", "bound of each voltage", "V", 1e-6, VOLTAGE_BOUND),
    )
    hidden = {"state": control.PidState}
    summary = "PID control of pitch, elevation and travel through two motor voltages"

    def initialise(self, time: float) -> None:
        """Read the settings; show the trim voltages."""
        self.pid = self.settings(_PID)
        self.state: control.PidState | None = None
        self.show(2 * [saturate(0.5 * self.pid.trim, self.pid.voltage_limit)])

    def advance(self, time: float, step_size: float) -> None:
        """Read the angles at ``time`` [s]; show the voltages of ``time + step_size``."""
        values: Any = self.values
        since = time - self.start_time
        self.state, voltages = pid_voltages(self.state, values[:5], values[7:14], time, since, step_size, self.pid)
        self.show(voltages)


_FEEDBACK = state_feedback.FeedbackSettings()
_feedback = partial(setting, _FEEDBACK)
_MATRICES = {
    "transition": "of the prediction, F",
    "drive": "of the voltages on the prediction, G",
    "innovation": "of the Kalman filter, L",
    "gain": "of the feedback, K",
    "integral": "of the integrals, K_z",
    "reference": "of the references, N",
}
_LARGEST = 1e6


def _entries(matrix: str) -> tuple[Variable, ...]:
    """Return the parameters that are the entries of a matrix, which has a row for each state or each rotor."""
    rows = getattr(_FEEDBACK, matrix)
    kind = state_feedback.Rotors if len(rows) == 2 else state_feedback.Motion
    return tuple(
        _feedback(
            f"{matrix}.{row}.{column}", f"{matrix}.x{number}.{column}",
            f"entry {_MATRICES[matrix]}: {row.replace('_', ' ')} by {column.replace('_', ' ')}",
            _entry_unit(matrix, row, column), -_LARGEST, _LARGEST,
        )
        for number, (row, entries) in enumerate(zip(kind._fields, rows, strict=True))
        for column in entries._fields
    )  # fmt: skip


def _entry_unit(matrix: str, row: str, column: str) -> str:
    """Return the unit of a matrix entry: that of its row over that of its column; an integral has [rad s]."""
    row_unit, column_unit = _unit_of(row), "rad s" if matrix == "integral" else _unit_of(column)
    if row_unit == column_unit:
        return "1"
    short = {"rad/s/rad": "1/s", "rad/rad/s": "s", "V/rad/s": "V s/rad", "rad/s/V": "rad/(V s)", "V/rad s": "V/(rad s)"}
    return short.get(f"{row_unit}/{column_unit}", f"{row_unit}/{column_unit}")


def _unit_of(name: str) -> str:
    if name in ("front", "rear", "nu_front", "nu_rear"):
        return "V"
    return "rad/s" if name.endswith("_rate") else "rad"


def feedback_voltages(
    held: state_feedback.SampledFeedback | None, inputs: Five, given: Seven, time: float, since: float, step: float,
    s: state_feedback.FeedbackSettings,
) -> state_feedback.SampledFeedback:  # fmt: skip
    """Return the controller, with its voltages, after a ``step`` from ``time``, ``since`` the start [s]."""
    pitch, elevation, travel, more_front, more_rear = inputs
    early = time_tolerance(time, since, step)
    references = control.step_references(given[:3], given[3:6], since, given[6] - early)
    if held is None:  # before the first sample its voltages are those of the operating point
        start, limit = state_feedback.start_feedback(pitch, elevation, travel, s), s.voltage_limit
        held = state_feedback.SampledFeedback(start, 0, saturate(s.hover.front, limit), saturate(s.hover.rear, limit))
    angles, added = state_feedback.Angles(pitch, elevation, travel), state_feedback.Rotors(more_front, more_rear)
    return state_feedback.sample_and_hold(held, since, step, early, angles, references, added, s)


class StateFeedback(SlaveBase):
    """Reads the angles at its sampling instants and shows the resulting voltages one period later."""

    variables: ClassVar[tuple[Variable, ...]] = (
        *controller_variables("hover.{}", "voltage_limit"),
        *for_each(AXES, _feedback, "point.{}", "point.{}", "{} of the operating point", "rad", -1e4, 1e4),
        *for_each(
            ROTORS, _feedback, "hover.{}", "hover.{}", "{} voltage there", "V", -VOLTAGE_BOUND, VOLTAGE_BOUND
        ),
        _feedback("sample.time", "period", "sampling period; steps must not be longer", "s", 1e-4, 1.0),
        _feedback("sample.delay", "delay", "input delay of the plant in periods", None, 0, state_feedback.MOST_DELAY),
        _feedback("travel.enabled", "travel_enabled", "the travel is controlled and not the pitch"),
        _feedback("voltage_limit", "voltage_limit", "bound of each voltage", "V", 1e-6, VOLTAGE_BOUND),
        *(entry for matrix in _MATRICES for entry in _entries(matrix)),
    )  # fmt: skip
    hidden = {"held": state_feedback.SampledFeedback}
    summary = "State feedback with a Kalman filter, of elevation and of travel or pitch: LQR, or LQI with integrals"

    def initialise(self, time: float) -> None:
        """Read the settings; show the voltages of the operating point."""
        self.feedback = self.settings(_FEEDBACK)
        self.held: state_feedback.SampledFeedback | None = None
        self.show(saturate(voltage, self.feedback.voltage_limit) for voltage in self.feedback.hover)

    def advance(self, time: float, step_size: float) -> None:
        """Read the angles at ``time`` [s]; show the voltages of ``time + step_size``."""
        values: Any = self.values
        since = time - self.start_time
        self.held = feedback_voltages(self.held, values[:5], values[7:14], time, since, step_size, self.feedback)
        self.show((self.held.v_front, self.held.v_rear))
