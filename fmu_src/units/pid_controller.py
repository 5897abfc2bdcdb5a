"""PidController: three sampled PID loops, as a unit."""

from __future__ import annotations

from functools import partial
from typing import ClassVar

from heli_plant.control import PidSettings, PidState, clip, pid_step, start_pid

from ..variables import Variable, setting
from .controller import Controller, controller_variables
from .signals import AXES, VOLTAGE_BOUND

_DEFAULT = PidSettings()
_setting = partial(setting, _DEFAULT)
_ANGLE_UNITS = {"proportional": "V/rad", "integral": "V/(rad s)", "derivative": "V s/rad"}
_GAINS = {
    "pitch": _ANGLE_UNITS,
    "elevation": _ANGLE_UNITS,
    "travel": {"proportional": "1", "integral": "1/s", "derivative": "s"},
}
"""Unit of each gain."""


class PidController(Controller):
    """Reads the angles at each communication point and shows the resulting voltages at the next one."""

    variables: ClassVar[tuple[Variable, ...]] = (
        *controller_variables("trim", "voltage_limit"),
        *(
            _setting(f"{axis}.{gain}", f"{axis}.{gain}", f"{gain} gain, {axis}", unit, -1e4, 1e4)
            for axis in AXES
            for gain, unit in _GAINS[axis].items()
        ),
        _setting("travel.enabled", "travel_enabled", "the travel loop sets the pitch reference"),
        _setting("travel.pitch_limit", "pitch_limit", "bound of that pitch reference", "rad", 0.0, 1.6),
        _setting("trim", "trim", "sum of both voltages at zero error", "V", -60.0, 60.0),
        _setting("rate.time_constant", "rate_time_constant", "lag of the rate's filter", "s", 1e-4, 10.0),
        _setting("voltage_limit", "voltage_limit", "bound of each voltage", "V", 1e-6, VOLTAGE_BOUND),
    )
    hidden = {"state": PidState}
    summary = "PID control of pitch, elevation and travel through two motor voltages"

    def initialise(self, time: float) -> None:
        """Read the settings; show the trim voltages."""
        super().initialise(time)
        self.pid = self.settings(_DEFAULT)
        self.state: PidState | None = None
        self._show(0.5 * self.pid.trim, 0.5 * self.pid.trim)

    def advance(self, time: float, step_size: float) -> None:
        """Read the angles at ``time`` [s]; show the voltages of ``time + step_size``."""
        pitch, elevation, travel, more_front, more_rear = self.values[:5]
        state = start_pid(pitch, elevation, travel) if self.state is None else self.state
        references = self.references_at(time)
        self.state, (front, rear) = pid_step(state, pitch, elevation, travel, references, step_size, self.pid)
        self._show(front + more_front, rear + more_rear)

    def _show(self, v_front: float, v_rear: float) -> None:
        limit = self.pid.voltage_limit
        self.show((clip(v_front, limit), clip(v_rear, limit)))
