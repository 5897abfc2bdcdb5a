"""What to measure so that an effect becomes visible, one sentence per effect of the catalogue."""

EXPERIMENTS = {
    "dry_friction": "Let the axis swing out freely from a large angle, and move it slowly back and forth through rest.",
    "breakaway_friction": "Let the axis start from rest many times: small square waves that just make it move.",
    "quadratic_drag": "Swing the axis at twice the amplitude and half of it, so that drag and damping part.",
    "constant_torque": "Hold several steady pitch angles on either side of rest, with the rotors at several sums.",
    "rotor_mismatch": "Change the sum v_f + v_r in steps of 1 V while the difference stays zero.",
    "quadratic_thrust": "Raise the voltage sum in steps from 0 to 5 V, each held until the elevation rests.",
    "reverse_thrust_loss": "Drive the rotors below 0 V for several seconds, both together and one alone.",
    "dead_zone": "Let the rotors' voltages cross zero slowly, both together and one alone.",
    "motor_lag": "Excite the pitch between 1 and 3 Hz, where the motors' phase shows.",
    "input_delay": "Excite the pitch between 1 and 3 Hz, where a delay and a lag differ in gain.",
    "thrust_fade": "Repeat the same excitation at the beginning and at the end of a run of several minutes.",
    "airspeed_thrust_loss": "Swing the axis at a large voltage sum and at a small one.",
    "gyroscopic_coupling": "Swing pitch and elevation at different frequencies under a large voltage sum.",
    "rotor_drag_torque": "Change the voltage sum in steps while the pitch rests at zero.",
    "cable_stiffness": "Turn the arm slowly by several turns either way and let it come to rest.",
    "inertial_coupling": "Turn the travel fast (above .5 rad/s) while the elevation moves far from the horizontal arm.",
    "large_angle_gravity": "Let the elevation visit angles above .5 rad on either side.",
    "pitch_gravity_coupling": "Swing the pitch at elevations above .5 rad and at zero.",
    "ground_effect": "Hover at several heights just above the table.",
    "arm_bending": "Excite the voltage sum with a chirp from 1 to 6 Hz.",
    "moving_mass": "Note when the mass moves, and hold everything else still for 10 s before and after.",
}
"""By effect name."""


def experiment_for(name: str) -> str:
    """Sentence for an effect of the catalogue."""
    return EXPERIMENTS[name]


def separating(first: str, second: str) -> str:
    """Sentence on how to tell two effects apart."""
    return f"Measure what shows either alone. For {first}: {EXPERIMENTS[first]} For {second}: {EXPERIMENTS[second]}"
