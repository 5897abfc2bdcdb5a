"""PidController: three sampled PID loops, as a unit."""

from __future__ import annotations

from typing import ClassVar

from heli_plant.control import PidSettings, PidState, clip, pid_step, risen, start_pid

from ..slave_base import SlaveBase
from ..variables import Variable, boolean_parameter, real_input, real_parameter
from .signals import AXES, PAPER, VOLTAGE_BOUND, angle_inputs, voltage_outputs

_DEFAULT = PidSettings()
_GAINS = ("proportional", "integral", "derivative")
_GAIN_UNITS = {
    "pitch": ("V/rad", "V/(rad s)", "V s/rad"),
    "elevation": ("V/rad", "V/(rad s)", "V s/rad"),
    "travel": ("1", "1/s", "s"),
}
_EARLY = 1e-9
"""The reference steps this much before its time [s], because communication points k H have rounding errors."""


class PidController(SlaveBase):
    """Reads the angles at each communication point and shows the resulting voltages at the next one."""

    variables: ClassVar[tuple[Variable, ...]] = (
        *angle_inputs(),
        *(
            real_input(f"excitation_{rotor}", "V", VOLTAGE_BOUND, 1.0, f"added to the {rotor} voltage")
            for rotor in ("front", "rear")
        ),
        *(variable._replace(initial_dependencies=("trim", "voltage_limit")) for variable in voltage_outputs()),
        *(
            real_parameter(f"reference.{axis}", "rad", 0.0, -1e4, 1e4, f"reference of the {axis}", tunable=True)
            for axis in AXES
        ),
        *(
            real_parameter(f"reference.step_{axis}", "rad", 0.0, -1e4, 1e4, f"step of the {axis} reference")
            for axis in AXES
        ),
        real_parameter("reference.step_time", "s", 5.0, 0.0, 1e9, "time of the reference step"),
        *(
            real_parameter(
                f"{axis}.{gain}", _GAIN_UNITS[axis][k], getattr(_DEFAULT, axis)[k], -1e4, 1e4, f"{gain} gain, {axis}"
            )
            for axis in AXES
            for k, gain in enumerate(_GAINS)
        ),
        boolean_parameter("travel.enabled", _DEFAULT.travel_enabled, "the travel loop sets the pitch reference"),
        real_parameter("travel.pitch_limit", "rad", _DEFAULT.pitch_limit, 0.0, 1.6, "bound of that pitch reference"),
        real_parameter("trim", "V", _DEFAULT.trim, -60.0, 60.0, "sum of both voltages at zero error"),
        real_parameter("rate.time_constant", "s", _DEFAULT.rate_time_constant, 1e-4, 10.0, "lag of the rate's filter"),
        real_parameter("voltage_limit", "V", _DEFAULT.voltage_limit, 1e-6, VOLTAGE_BOUND, "bound of each voltage"),
    )  # fmt: skip
    hidden = {"state": PidState}
    summary = "PID control of pitch, elevation and travel through two motor voltages"
    equations = """
<pre>
v_front - v_rear = -(P (pitch - reference) + I integral + D pitch')
v_front + v_rear = trim - (P (elevation - reference) + I integral + D elevation')
travel.enabled:   pitch reference = P (travel - reference) + I integral + D travel', within travel.pitch_limit
</pre>
<p>Rates are differences of the angles, filtered with rate.time_constant. An integral stops while its output is at the
limit. The angles of one communication point act on the voltages of the next one, the delay of a sampled controller;
at the start both voltages are trim/2.</p>"""
    source = f"{PAPER}, PID law with gains 8.35, 4.25, 8.76 on pitch; its sign is reversed, as printed it is unstable"

    def initialise(self, time: float) -> None:
        """Read the settings; show the trim voltages."""
        at = self.references
        value = {name: self.values[reference] for name, reference in at.items()}
        axis_gains = type(_DEFAULT.pitch)
        self.settings = PidSettings(
            **{axis: axis_gains(*(value[f"{axis}.{gain}"] for gain in _GAINS)) for axis in AXES},
            travel_enabled=value["travel.enabled"],
            trim=value["trim"],
            pitch_limit=value["travel.pitch_limit"],
            rate_time_constant=value["rate.time_constant"],
            voltage_limit=value["voltage_limit"],
        )
        to_pitch, to_elevation, to_travel = (value[f"reference.step_{axis}"] for axis in AXES)
        self.rises = (to_pitch, to_elevation, to_travel)
        self.step_time = value["reference.step_time"] - _EARLY
        self.state: PidState | None = None
        self._show(0.5 * self.settings.trim, 0.5 * self.settings.trim)

    def advance(self, time: float, step_size: float) -> None:
        """Read the angles at ``time`` [s]; show the voltages of ``time + step_size``."""
        # in the order of ``variables``: angles, excitation, the two voltages, references
        pitch, elevation, travel, more_front, more_rear, _, _, to_pitch, to_elevation, to_travel = self.values[:10]
        references = risen((to_pitch, to_elevation, to_travel), self.rises, time - self.start_time, self.step_time)
        state = start_pid(pitch, elevation, travel) if self.state is None else self.state
        self.state, (front, rear) = pid_step(state, pitch, elevation, travel, references, step_size, self.settings)
        self._show(front + more_front, rear + more_rear)

    def _show(self, v_front: float, v_rear: float) -> None:
        limit = self.settings.voltage_limit
        self.values[5:7] = clip(v_front, limit), clip(v_rear, limit)
