"""Inputs and outputs that several units share: each name has one physical unit, range and description."""

from __future__ import annotations

from ..variables import Variable, real_input, real_output

VOLTAGE_BOUND = 30.0
"""Bound of a voltage [V], above the output of any rig's amplifier; the motors saturate at ``motor.voltage_limit``."""

ANGLE_BOUND = 1e4
"""Bound of an angle [rad]; angles count turns and may be large."""

RATE_BOUND = 1e3
"""Bound of an angular rate [rad/s]."""

PAPER = "Adaptive Parameter Identification for Simplified 3D-Motion Model of 'LAAS Helicopter Benchmark'"

AXES = ("pitch", "elevation", "travel")


def voltage_inputs() -> tuple[Variable, ...]:
    """Return ``v_front`` and ``v_rear`` as inputs."""
    return tuple(
        real_input(f"v_{rotor}", "V", VOLTAGE_BOUND, 5.0, f"voltage of the {rotor} motor, held over the step")
        for rotor in ("front", "rear")
    )


def voltage_outputs() -> tuple[Variable, ...]:
    """Return ``v_front`` and ``v_rear`` as outputs."""
    return tuple(
        real_output(f"v_{rotor}", "V", 5.0, f"voltage of the {rotor} motor", variability="discrete")
        for rotor in ("front", "rear")
    )


def reference_inputs() -> tuple[Variable, ...]:
    """Return the three references as inputs that need not be connected."""
    return tuple(
        real_input(f"{axis}_reference", "rad", ANGLE_BOUND, 1.0, f"{axis} that is asked for; may stay unconnected")
        for axis in AXES
    )


def angle_inputs() -> tuple[Variable, ...]:
    """Return the three angles as inputs."""
    return tuple(real_input(axis, "rad", ANGLE_BOUND, 1.0, f"measured {axis} angle") for axis in AXES)
