"""Inputs and outputs that several units share: each name has one physical unit, range and description."""

from __future__ import annotations

from ..variables import Variable, for_each, output, real_input

VOLTAGE_BOUND = 30.0  # [V], above the output of any rig's amplifier; the motors saturate at ``motor.voltage_limit``

ANGLE_BOUND = 1e4  # [rad]; angles count turns and may be large
RATE_BOUND = 1e3  # [rad/s]

AXES = ("pitch", "elevation", "travel")
ROTORS = ("front", "rear")

TIME_TOLERANCE = 1e-9  # events may come this much early [s], because communication points k H have rounding errors

VOLTAGE_INPUTS = for_each(
    ROTORS, real_input, "v_{}", "V", VOLTAGE_BOUND, 5.0, "voltage of the {} motor, held over the step"
)
ANGLE_INPUTS = for_each(AXES, real_input, "{}", "rad", ANGLE_BOUND, 1.0, "measured {} angle")
REFERENCE_INPUTS = for_each(
    AXES, real_input, "{}_reference", "rad", ANGLE_BOUND, 1.0, "{} that is asked for; may stay unconnected"
)


def voltage_outputs(*depends_on: str) -> tuple[Variable, ...]:
    """Return ``v_front`` and ``v_rear`` as outputs, whose values at the start depend on these parameters."""
    return for_each(ROTORS, output, "v_{}", "V", "voltage of the {} motor", depends_on, 5.0)


def measured_outputs(*depends_on: str) -> tuple[Variable, ...]:
    """Return the voltages and angles of a rig as outputs, whose values at the start depend on these parameters."""
    return (
        *voltage_outputs(*depends_on),
        *for_each(AXES, output, "{}", "rad", "measured {} angle", depends_on, 1.0),
    )  # fmt: skip
