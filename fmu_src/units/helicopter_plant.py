"""HelicopterPlant: the bench helicopter under two motor voltages, as a unit."""

from __future__ import annotations

from typing import ClassVar

from heli_plant.communication import EncoderCounts, PlantMemory, begin, communicate, is_finite, shown
from heli_plant.errors import ParameterError
from heli_plant.laws import input_delay
from heli_plant.parameter_table import PARAMETERS
from heli_plant.parameters import TABLE_2, PlantParameters, checked
from heli_plant.state import rest_state, start_state

from ..errors import Refusal
from ..slave_base import MOST_SUBSTEPS, SlaveBase
from ..variables import Variable, boolean_parameter, integer_parameter, real_input, real_output, real_parameter
from .signals import ANGLE_BOUND, AXES, PAPER, RATE_BOUND, VOLTAGE_BOUND, voltage_inputs

_INPUTS = (
    *voltage_inputs(),
    real_input("mass_position", "m", 10.0, 0.1, "commanded position of the moving mass (ADO), a known disturbance"),
)
_OUTPUTS = (
    *(
        real_output(
            axis, "rad", 1.0, f"{axis} angle, as the encoder reads it if encoders are on",
            (f"initial.{axis}", "encoder.enabled", f"encoder.counts_{axis}"),
        )
        for axis in AXES
    ),
    *(
        real_output(f"{axis}_rate", "rad/s", 1.0, f"{axis} rate", (f"initial.{axis}_rate",))
        for axis in AXES
    ),
)  # fmt: skip
_REST = rest_state(TABLE_2)
_INITIAL = (
    *(
        real_parameter(f"initial.{axis}", "rad", getattr(_REST, axis), -ANGLE_BOUND, ANGLE_BOUND, f"{axis} at start")
        for axis in AXES
    ),
    *(
        real_parameter(f"initial.{axis}_rate", "rad/s", 0.0, -RATE_BOUND, RATE_BOUND, f"{axis} rate at the start")
        for axis in AXES
    ),
    *(
        real_parameter(
            f"initial.v_{rotor}", "V", 0.0, -VOLTAGE_BOUND, VOLTAGE_BOUND,
            f"voltage at which the {rotor} motor has settled at the start",
        )
        for rotor in ("front", "rear")
    ),
)  # fmt: skip
_COUNTS = EncoderCounts()
_SETTINGS = (
    real_parameter("solver.step", "s", 0.01, 1e-5, 1.0, "longest step of the Runge-Kutta method inside"),
    boolean_parameter("encoder.enabled", False, "round the angles to encoder counts"),
    *(
        integer_parameter(
            f"encoder.counts_{axis}", getattr(_COUNTS, axis), 0, 1 << 24, f"{axis} counts per turn; 0: no rounding"
        )
        for axis in AXES
    ),
)  # fmt: skip
_PHYSICS = tuple(
    real_parameter(row.name, row.unit, row.default, row.minimum, row.maximum, row.description, tunable=True)
    for row in PARAMETERS
)
_FIELDS = tuple(row.field for row in PARAMETERS)
_FIRST_PHYSICS = len(_INPUTS) + len(_OUTPUTS) + len(_INITIAL) + len(_SETTINGS)


class HelicopterPlant(SlaveBase):
    """The plant: ceil(H/h) equal Runge-Kutta steps over a communication step H, voltages held."""

    variables: ClassVar[tuple[Variable, ...]] = (*_INPUTS, *_OUTPUTS, *_INITIAL, *_SETTINGS, *_PHYSICS)
    hidden = {"memory": PlantMemory}
    adjusted: ClassVar[slice] = slice(_FIRST_PHYSICS, None)
    """Values that may change between two steps: the physical parameters."""
    summary = "Bench helicopter (pitch, elevation, travel) driven by two motor voltages"
    equations = """
<p>Simplified model, with &mu;<sub>d</sub> = &nu;<sub>f</sub> &minus; &nu;<sub>r</sub> and
&mu;<sub>s</sub> = &nu;<sub>f</sub> + &nu;<sub>r</sub>:</p>
<pre>
pitch''     = -a_wx pitch' - a_th sin(pitch - theta0) + k_x mu_d
elevation'' = -a_wz elevation' - a_e elevation - a_1 - a_lt pitch' travel' + k_z mu_s cos(pitch)
travel''    = -a_wy travel' + k_y mu_s sin(pitch)
motors:        T_m nu_i' + nu_i = v_i, v_i limited to motor.voltage_limit
</pre>
<p>Each parameter <code>effects.*</code> adds one law that this model leaves out; it is off at 0.
The parameters <code>table.*</code> add to an axis a torque that a table over one variable gives; it is off where
<code>variable = 0</code>. <code>general.enabled = 1</code> takes the rigid-body model of four point masses instead.</p>
<p>Voltages are held over a communication step H. Inside, H is divided into ceil(H / solver.step) equal steps of the
classical Runge-Kutta method of order 4; the motors are advanced exactly.</p>
<p>The physical parameters are tunable: they may be set between two steps. FollowingPlant is the same plant with the
inputs by which it follows a rig.</p>"""
    source = (
        f"{PAPER}, eqs (1), (2), (9), (10), (12), Table 2; "
        "Brentari et al., Benchmark model of Quanser's 3 DOF Helicopter, LAAS report 18040, 2018"
    )

    def initialise(self, time: float) -> None:
        """Collect the parameters, place the plant at its initial state."""
        values, at = self.values, self.references
        self._take_parameters()
        self.inner_step = values[at["solver.step"]]
        pitch, elevation, travel = (values[at[f"initial.{axis}"]] for axis in AXES)
        pitch_rate, elevation_rate, travel_rate = (values[at[f"initial.{axis}_rate"]] for axis in AXES)
        v_front, v_rear = values[at["initial.v_front"]], values[at["initial.v_rear"]]
        rates = (pitch_rate, elevation_rate, travel_rate)
        first = start_state(pitch, elevation, travel, v_front, v_rear, rates)
        self.memory = begin(first, self.parameters)
        enabled = values[at["encoder.enabled"]]
        self.counts = EncoderCounts(*(values[at[f"encoder.counts_{axis}"]] if enabled else 0 for axis in AXES))
        self._publish()

    def _take_parameters(self) -> None:
        """Read the parameters."""
        chosen, count = self.values[self.adjusted], len(_FIELDS)
        parameters = PlantParameters(**dict(zip(_FIELDS, chosen[:count], strict=True)))
        try:
            self.parameters = checked(self._corrected(parameters, chosen[count:]))
        except ParameterError as problem:
            raise Refusal(str(problem)) from problem
        self.chosen, self.delay = chosen, input_delay(self.parameters)

    def _corrected(self, parameters: PlantParameters, corrections: list[float]) -> PlantParameters:
        """Return the parameters with their corrections, of which this unit has none."""
        return parameters

    def advance(self, time: float, step_size: float) -> None:
        """Step the physics over [time, time + step_size] [s]."""
        if self.values[self.adjusted] != self.chosen:
            self._take_parameters()
        v_front, v_rear = self.values[:2]
        self.memory = self._flown(self.memory, v_front, v_rear, time, step_size)
        self._publish()

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

    def _publish(self) -> None:
        """Set the outputs to what the encoders and rates show of the state."""
        self.values[3:9] = shown(self.memory.state, self.counts)  # behind the inputs
