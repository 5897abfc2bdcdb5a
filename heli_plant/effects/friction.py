"""Torques on one axis alone: friction of its bearing, drag of the air on it, a constant."""

from math import exp, tanh

from .definition import AXES, PAPER_NEGLECTS, SISTER_RIGS, Shape, declared

SMOOTHING_RATE = 0.005  # w_0 [rad/s]: three encoder counts of 4096 per turn in a second


@declared(
    "-c sign(w)", *AXES, unit="rad/s^2", bounds=(0.0, 1.0),
    source=PAPER_NEGLECTS, family="friction of the {axis}", drawn_against="rate",
    experiment="Let the axis swing out freely from a large angle, and move it slowly back and forth through rest.",
)  # fmt: skip
def dry_friction(rate: float, c: float) -> float:
    """Dry friction of a bearing (Coulomb): a constant torque against the motion.

    The sign is smoothed, sign(w) ~ tanh(w / w_0), so that a fixed step integrates it; below w_0 the model creeps where
    a real rig sticks.
    """
    return -c * tanh(rate / SMOOTHING_RATE)


@declared(
    "-c sign(w) exp(-(w/w_s)^2)", *AXES, unit="rad/s^2", bounds=(0.0, 1.0),
    source="Stribeck 1902; Armstrong-Helouvry 1994", family="friction of the {axis}", drawn_against="rate",
    experiment="Let the axis start from rest many times: small square waves that just make it move.",
    shapes=(
        Shape("stribeck_rate", "stribeck_rate_{axis}", "w_s", "rad/s", 0.05, 0.02, 1.0,
              "rate over which the breakaway friction fades; below its least value encoders show no turn",
              grid=(0.02, 0.06, 0.18)),
    ),
)  # fmt: skip
def breakaway_friction(rate: float, c: float, stribeck_rate: float) -> float:
    """Breakaway friction: the excess of static over sliding friction, which fades over the Stribeck rate w_s."""
    return -c * tanh(rate / SMOOTHING_RATE) * exp(-(rate / stribeck_rate) * (rate / stribeck_rate))


@declared(
    "-c w abs(w)", *AXES, unit="1/rad", bounds=(0.0, 10.0),
    source=PAPER_NEGLECTS, family="friction of the {axis}", drawn_against="rate",
    experiment="Swing the axis at twice the amplitude and half of it, so that drag and damping part.",
)  # fmt: skip
def quadratic_drag(rate: float, c: float) -> float:
    """Drag of the air on a moving axis, quadratic in its rate."""
    return -c * rate * abs(rate)


@declared(
    "c", "pitch", "travel", unit="rad/s^2", bounds=(-1.0, 1.0),
    source=SISTER_RIGS, family="torque on the {axis}", drawn_against="time",
    experiment="Hold several steady pitch angles on either side of rest, with the rotors at several sums.",
)  # fmt: skip
def constant_torque(c: float) -> float:
    """Constant torque: a cable under tension, a table out of level, a rotor mounted askew."""
    return c
