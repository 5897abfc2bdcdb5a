"""HelicopterPlant: the bench helicopter under two motor voltages, as a unit."""

from __future__ import annotations

from typing import ClassVar

from heli_plant.communication import EncoderCounts, PlantMemory, begin, communicate, is_finite, shown
from heli_plant.errors import ParameterError
from heli_plant.laws import input_delay
from heli_plant.observer import (
    CORRECTED,
    TRAVEL_BANDWIDTH,
    Correction,
    Torque,
    measured_against,
    observer_gains,
    predicted,
    with_correction,
    with_share,
)
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
_LARGEST_CORRECTION = 100.0
"""In the unit of what it corrects; the parameter's own range holds for the sum."""

_KEEPING = (
    *(
        real_input(
            f"measured.{axis}", "rad", ANGLE_BOUND, 1.0, f"{axis} of the rig that the observer keeps the plant on"
        )
        for axis in AXES
    ),
    real_input("measured.fresh", "1", 1.0, 1.0, "1: the measured angles are of this instant, 0: nothing came in", 1.0),
    real_input(
        "observer.bandwidth", "rad/s", 100.0, 10.0, "poles of the observer; 0: it is off and the plant runs free"
    ),
    *(
        real_input(f"correction.{name}", unit, _LARGEST_CORRECTION, 1.0, f"what is added to {name}")
        for name, unit in CORRECTED
    ),
)
"""Inputs by which a plant follows a rig; all of them at their start values change nothing."""
_FIELDS = tuple(row.field for row in PARAMETERS)
_FIRST_PHYSICS = len(_INPUTS) + len(_OUTPUTS) + len(_INITIAL) + len(_SETTINGS)
_FIRST_KEEPING = _FIRST_PHYSICS + len(_PHYSICS)
_FIRST_CORRECTION = _FIRST_KEEPING + len(_KEEPING) - len(CORRECTED)
_NO_CORRECTION = [0.0] * len(CORRECTED)


class HelicopterPlant(SlaveBase):
    """The plant: ceil(H/h) equal Runge-Kutta steps over a communication step H, voltages held."""

    variables: ClassVar[tuple[Variable, ...]] = (*_INPUTS, *_OUTPUTS, *_INITIAL, *_SETTINGS, *_PHYSICS, *_KEEPING)
    hidden = {"memory": PlantMemory, "torque": Torque}
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
<p>The physical parameters are tunable: they may be set between two steps. To follow a rig, connect its angles to
<code>measured.*</code> and set <code>observer.bandwidth</code> (6.6 rad/s): an observer keeps the state on the rig.
A sample with <code>measured.fresh</code> = 0 is not used. <code>correction.*</code> is added to the parameters of the
same name; <code>correction.rotor.front</code> = &minus;0.2 is a front rotor that has lost a fifth of its thrust.</p>"""
    source = (
        f"{PAPER}, eqs (1), (2), (9), (10), (12), Table 2; "
        "Brentari et al., Benchmark model of Quanser's 3 DOF Helicopter, LAAS report 18040, 2018"
    )

    def initialise(self, time: float) -> None:
        """Collect the parameters, place the plant at its initial state."""
        values, at = self.values, self.references
        self._take_parameters()
        self.torque = Torque()
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
        """Read the parameters with their corrections."""
        chosen, corrections = self.values[_FIRST_PHYSICS:_FIRST_KEEPING], self.values[_FIRST_CORRECTION:]
        parameters, correction = PlantParameters(**dict(zip(_FIELDS, chosen, strict=True))), Correction(*corrections)
        try:
            if corrections != _NO_CORRECTION:
                parameters = with_correction(parameters, correction)
            checked(parameters)
        except ParameterError as problem:
            raise Refusal(str(problem)) from problem
        self.parameters, self.chosen, self.corrections = parameters, chosen, corrections
        self.shares = 1.0 + correction.front, 1.0 + correction.rear
        self.delay = input_delay(parameters)

    def advance(self, time: float, step_size: float) -> None:
        """Step the physics over [time, time + step_size] [s]."""
        values = self.values
        v_front, v_rear, command = values[:3]  # the first three of ``variables``
        if values[_FIRST_PHYSICS:_FIRST_KEEPING] != self.chosen or values[_FIRST_CORRECTION:] != self.corrections:
            self._take_parameters()
        if step_size > MOST_SUBSTEPS * self.inner_step:
            raise Refusal(
                f"the step of {step_size:g} s from t = {time:g} s needs {step_size / self.inner_step:.3g} steps of "
                f"solver.step = {self.inner_step:g} s; at most {MOST_SUBSTEPS} are taken, take a shorter step"
            )
        pitch, elevation, travel, fresh, bandwidth = values[_FIRST_KEEPING:_FIRST_CORRECTION]
        front, rear = self.shares
        limit = self.parameters.v_max
        v_front, v_rear = with_share(v_front, front, limit), with_share(v_rear, rear, limit)
        try:
            memory, torque, gains = self.memory, self.torque, None
            if bandwidth > 0.0:
                gains = observer_gains(bandwidth, step_size)
                if fresh > 0.5:
                    on_travel = observer_gains(TRAVEL_BANDWIDTH * bandwidth, step_size)
                    kept = measured_against(memory.state, torque, pitch, elevation, travel, gains, gains, on_travel)
                    memory, torque = memory._replace(state=kept.state), kept.torque
            memory = communicate(
                memory, v_front, v_rear, command, time, self.start_time, step_size, self.inner_step, self.delay,
                self.parameters,
            )  # fmt: skip
            if gains is not None:
                kept = predicted(memory.state, torque, step_size, gains)
                memory, torque = memory._replace(state=kept.state), kept.torque
            finite = is_finite(memory.state)
        except (ValueError, OverflowError):  # the sine of an infinite angle
            finite = False
        if not finite:
            raise Refusal(f"the plant leaves the finite range in the step from t = {time:g} s")
        self.memory, self.torque = memory, torque
        self._publish()

    def _publish(self) -> None:
        """Set the outputs to what the encoders and rates show of the state."""
        self.values[3:9] = shown(self.memory.state, self.counts)  # behind the inputs
