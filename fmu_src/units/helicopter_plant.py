"""HelicopterPlant, the bench helicopter under two motor voltages, and FollowingPlant, which follows a rig, as units."""

from __future__ import annotations

from functools import partial
from typing import Any, ClassVar

from heli_plant import observer
from heli_plant.communication import EncoderCounts, PlantMemory, communicate, is_finite, read_sensors, start_memory
from heli_plant.laws import input_delay
from heli_plant.parameters import PARAMETERS, TABLE_2, PlantParameters, check_parameters, in_slots
from heli_plant.state import rest_state, start_state

from ..errors import Refusal
from ..slave_base import SlaveBase, check_substeps
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
_PHYSICAL_PARAMETERS = tuple(
    parameter(row.name, row.default, row.description, row.unit, row.minimum, row.maximum, True, row.field)
    for row in PARAMETERS
)


class HelicopterPlant(SlaveBase):
    """The plant: ceil(H/h) equal Runge-Kutta steps over a communication step H, voltages held."""

    variables: ClassVar[tuple[Variable, ...]] = (*_INPUTS_AND_OUTPUTS, *_SETTINGS, *_PHYSICAL_PARAMETERS)
    hidden = {"memory": PlantMemory}
    summary = "Bench helicopter (pitch, elevation, travel) driven by two motor voltages"
    _physical = slice(len(_INPUTS_AND_OUTPUTS) + len(_SETTINGS), None)  # values that the parameters depend on
    _corrections = slice(0, 0)  # values of the corrections; here there are none
    _used_values: list[float] | None = None

    def initialise(self, time: float) -> None:
        """Read the parameters and set the initial state."""
        self._update_parameters()
        self.inner_step = self.value("solver.step")
        names = (*AXES, "v_front", "v_rear")
        pitch, elevation, travel, v_front, v_rear = (self.value(f"initial.{name}") for name in names)
        rates: Any = tuple([self.value(f"initial.{axis}_rate") for axis in AXES])
        first = start_state(pitch, elevation, travel, v_front, v_rear, rates)
        self.memory = start_memory(first, self.parameters)
        enabled = self.value("encoder.enabled")
        self.counts = EncoderCounts(*(self.value(f"encoder.counts_{axis}") if enabled else 0 for axis in AXES))
        self.show(read_sensors(self.memory.state, self.counts))

    def _update_parameters(self) -> None:
        """Read the parameters if their values have changed; they may be refused."""
        values = self.values[self._physical]
        if values != self._used_values:
            parameters, corrections = self.settings(PlantParameters()), self.values[self._corrections]
            if any(corrections):
                pairs = zip(observer.FIELDS, corrections, strict=True)
                parameters = parameters._replace(**{field: getattr(parameters, field) + c for field, c in pairs})
            self.parameters = in_slots(check_parameters(parameters))
            self.delay, self._used_values = input_delay(self.parameters), values

    def advance(self, time: float, step_size: float) -> None:
        """Step the physics over [time, time + step_size] [s]."""
        self._update_parameters()
        v_front, v_rear = self.values[:2]
        self.memory = self._step(self.memory, v_front, v_rear, time, step_size)
        self.show(read_sensors(self.memory.state, self.counts))

    def _step(self, memory: PlantMemory, v_front: float, v_rear: float, time: float, step_size: float) -> PlantMemory:
        """Return the memory after a communication step."""
        check_substeps(step_size, self.inner_step, "solver.step", time)
        try:
            new_memory = communicate(
                memory, v_front, v_rear, self.values[2], time, self.start_time, step_size, self.inner_step, self.delay,
                self.parameters,
            )  # fmt: skip
            if is_finite(new_memory.state):
                return new_memory
        except (ValueError, OverflowError):  # the sine of an infinite angle
            pass
        raise Refusal(f"the plant leaves the finite range in the step from t = {time:g} s")


# their bound is wide: the sum has to lie in the range of the parameter
_CORRECTIONS = for_each(observer.CORRECTED, real_input, "correction.{0}", "{1}", 100.0, 1.0, "what is added to {0}")
_OBSERVER_INPUTS = (
    *for_each(
        AXES, real_input, "measured.{}", "rad", ANGLE_BOUND, 1.0, "{} of the rig that the observer keeps the plant on"
    ),
    real_input("measured.fresh", "1", 1.0, 1.0, "1: the measured angles are of this instant, 0: nothing came in", 1.0),
    real_input(
        "observer.bandwidth", "rad/s", 100.0, 10.0, "poles of the observer; 0: it is off and the plant runs free"
    ),
)


class FollowingPlant(HelicopterPlant):
    """The plant with an observer that keeps its state on a rig, and corrections of its parameters."""

    variables: ClassVar[tuple[Variable, ...]] = (*HelicopterPlant.variables, *_CORRECTIONS, *_OBSERVER_INPUTS)
    hidden = {"memory": PlantMemory, "torque": observer.Torque}
    summary = "HelicopterPlant that follows a rig: an observer keeps its state there, a Corrector its parameters"
    _physical = slice(HelicopterPlant._physical.start, -len(_OBSERVER_INPUTS))
    _corrections = slice(-len(_CORRECTIONS) - len(_OBSERVER_INPUTS), -len(_OBSERVER_INPUTS))

    def initialise(self, time: float) -> None:
        """Start as HelicopterPlant does, without unmodelled torques."""
        super().initialise(time)
        self.torque = observer.Torque()

    def advance(self, time: float, step_size: float) -> None:
        """Correct the state by the measured angles of ``time`` [s]; step the physics to ``time + step_size``."""
        self._update_parameters()
        pitch, elevation, travel, fresh, bandwidth = self.values[-len(_OBSERVER_INPUTS) :]
        memory, torque, (v_front, v_rear) = self.memory, self.torque, self.values[:2]
        if bandwidth > 0.0:
            gains = observer.observer_gains(bandwidth, step_size)
            if fresh > 0.5:
                travel_gains = observer.observer_gains(observer.TRAVEL_BANDWIDTH * bandwidth, step_size)
                angles = (pitch, elevation, travel)
                state, torque = observer.correct_state(memory.state, torque, angles, (gains, gains, travel_gains))
                memory = memory._replace(state=state)
        memory = self._step(memory, v_front, v_rear, time, step_size)
        if bandwidth > 0.0:
            state, torque = observer.predict_state(memory.state, torque, step_size, gains)
            memory = memory._replace(state=state)
        self.memory, self.torque = memory, torque
        self.show(read_sensors(memory.state, self.counts))
