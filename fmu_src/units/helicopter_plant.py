"""HelicopterPlant: the bench helicopter under two motor voltages, as a unit."""

from __future__ import annotations

from functools import partial
from typing import ClassVar

from heli_plant.communication import EncoderCounts, PlantMemory, begin, communicate, is_finite, shown
from heli_plant.laws import input_delay
from heli_plant.parameters import PARAMETERS, TABLE_2, PlantParameters, checked, in_slots
from heli_plant.state import rest_state, start_state

from ..errors import Refusal
from ..slave_base import MOST_SUBSTEPS, SlaveBase
from ..variables import Variable, for_each, output, parameter, real_input
from .signals import ANGLE_BOUND, AXES, RATE_BOUND, ROTORS, VOLTAGE_BOUND, VOLTAGE_INPUTS

_motion = partial(output, nominal=1.0, variability="continuous")
_REST = rest_state(TABLE_2)
_COUNTS = EncoderCounts()
_INPUTS_AND_OUTPUTS = (
    *VOLTAGE_INPUTS,
    real_input("mass_position", "m", 10.0, 0.1, "commanded position of the moving mass (ADO), a known disturbance"),
    *for_each(
        AXES, _motion, "{}", "rad", "{} angle, as the encoder reads it if encoders are on",
        ("initial.{}", "encoder.enabled", "encoder.counts_{}"),
    ),
    *for_each(AXES, _motion, "{}_rate", "rad/s", "{} rate", ("initial.{}_rate",)),
)  # fmt: skip
_SETTINGS = (
    *(
        parameter(f"initial.{axis}", getattr(_REST, axis), f"{axis} at start", "rad", -ANGLE_BOUND, ANGLE_BOUND)
        for axis in AXES
    ),
    *for_each(AXES, parameter, "initial.{}_rate", 0.0, "{} rate at the start", "rad/s", -RATE_BOUND, RATE_BOUND),
    *for_each(
        ROTORS, parameter, "initial.v_{}", 0.0, "voltage at which the {} motor has settled at the start",
        "V", -VOLTAGE_BOUND, VOLTAGE_BOUND,
    ),
    parameter("solver.step", 0.01, "longest step of the Runge-Kutta method inside", "s", 1e-5, 1.0),
    parameter("encoder.enabled", False, "round the angles to encoder counts"),
    *(
        parameter(f"encoder.counts_{axis}", count, f"{axis} counts per turn; 0: no rounding", None, 0, 1 << 24)
        for axis, count in _COUNTS._asdict().items()
    ),
)  # fmt: skip
PHYSICS = tuple(
    parameter(row.name, row.default, row.description, row.unit, row.minimum, row.maximum, True, row.field)
    for row in PARAMETERS
)
"""The physical parameters, tunable."""


class HelicopterPlant(SlaveBase):
    """The plant: ceil(H/h) equal Runge-Kutta steps over a communication step H, voltages held."""

    variables: ClassVar[tuple[Variable, ...]] = (*_INPUTS_AND_OUTPUTS, *_SETTINGS, *PHYSICS)
    hidden = {"memory": PlantMemory}
    summary = "Bench helicopter (pitch, elevation, travel) driven by two motor voltages"

    def initialise(self, time: float) -> None:
        """Collect the parameters, place the plant at its initial state."""
        self._take_parameters()
        self.inner_step = self.value("solver.step")
        pitch, elevation, travel = (self.value(f"initial.{axis}") for axis in AXES)
        pitch_rate, elevation_rate, travel_rate = (self.value(f"initial.{axis}_rate") for axis in AXES)
        v_front, v_rear = (self.value(f"initial.v_{rotor}") for rotor in ROTORS)
        rates = (pitch_rate, elevation_rate, travel_rate)
        self.memory = begin(start_state(pitch, elevation, travel, v_front, v_rear, rates), self.parameters)
        enabled = self.value("encoder.enabled")
        self.counts = EncoderCounts(*(self.value(f"encoder.counts_{axis}") if enabled else 0 for axis in AXES))
        self.show(shown(self.memory.state, self.counts))

    def _take_parameters(self) -> None:
        """Read the parameters."""
        self.tuned = True  # until they are taken: they may be refused
        self.parameters = in_slots(checked(self._corrected(self.settings(PlantParameters()))))
        self.delay, self.tuned = input_delay(self.parameters), False

    def _corrected(self, parameters: PlantParameters) -> PlantParameters:
        """Return the parameters with their corrections, of which this unit has none."""
        return parameters

    def advance(self, time: float, step_size: float) -> None:
        """Step the physics over [time, time + step_size] [s]."""
        if self.tuned:
            self._take_parameters()
        v_front, v_rear = self.values[:2]
        self.memory = self._flown(self.memory, v_front, v_rear, time, step_size)
        self.show(shown(self.memory.state, self.counts))

    def _flown(self, memory: PlantMemory, v_front: float, v_rear: float, time: float, step_size: float) -> PlantMemory:
        """Return the memory one communication step later."""
        if step_size > MOST_SUBSTEPS * self.inner_step:
            raise Refusal(
                f"the step of {step_size:g} s from t = {time:g} s needs {step_size / self.inner_step:.3g} steps of "
                f"solver.step = {self.inner_step:g} s; at most {MOST_SUBSTEPS} are taken, take a shorter step"
            )
        try:
            later = communicate(
                memory, v_front, v_rear, self.values[2], time, self.start_time, step_size, self.inner_step, self.delay,
                self.parameters,
            )  # fmt: skip
            if is_finite(later.state):
                return later
        except (ValueError, OverflowError):  # the sine of an infinite angle
            pass
        raise Refusal(f"the plant leaves the finite range in the step from t = {time:g} s")
