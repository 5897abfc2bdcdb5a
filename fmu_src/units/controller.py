"""What controllers share as units: angles and an excitation in, voltages out, references with a step at a time."""

from __future__ import annotations

from heli_plant.control import risen

from ..slave_base import SlaveBase
from ..variables import Variable, for_each, parameter, real_input
from .signals import ANGLE_INPUTS, AXES, EARLY, ROTORS, VOLTAGE_BOUND, voltage_outputs


def controller_variables(*voltages_depend_on: str) -> tuple[Variable, ...]:
    """Return the first variables of a controller; a voltage (``{}``: its rotor) depends on parameters at the start."""
    return (
        *ANGLE_INPUTS,
        *for_each(ROTORS, real_input, "excitation_{}", "V", VOLTAGE_BOUND, 1.0, "added to the {} voltage"),
        *voltage_outputs(*voltages_depend_on),
        *for_each(AXES, parameter, "reference.{}", 0.0, "reference of the {}", "rad", -1e4, 1e4, tunable=True),
        *for_each(AXES, parameter, "reference.step_{}", 0.0, "step of the {} reference", "rad", -1e4, 1e4),
        parameter("reference.step_time", 5.0, "time of the reference step", "s", 0.0, 1e9),
    )


class Controller(SlaveBase):
    """A sampled controller."""

    def initialise(self, time: float) -> None:
        """Read the step of the references."""
        to_pitch, to_elevation, to_travel = (self.value(f"reference.step_{axis}") for axis in AXES)
        self.rises = (to_pitch, to_elevation, to_travel)
        self.step_time = self.value("reference.step_time") - EARLY

    def references_at(self, time: float) -> tuple[float, float, float]:
        """Return the references of pitch, elevation and travel [rad] at ``time`` [s]."""
        pitch, elevation, travel = self.values[7:10]
        return risen((pitch, elevation, travel), self.rises, time - self.start_time, self.step_time)
