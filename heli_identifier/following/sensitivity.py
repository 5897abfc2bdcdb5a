"""What a change makes of the innovations: its acceleration, through the dynamics of the observer's error.

An acceleration g that the plant lacks moves the errors of the observer (:mod:`heli_plant.observer`). With (x, w, d)
what g makes of them per unit, and the axis' own stiffness a and damping b,

    x += h w + h^2/2 (g + d - a x - b w),  w += h (g + d - a x - b w),  d *= exp(-gamma h)
    psi = x
    x -= l_1 psi,  w -= l_2 psi,  d -= l_3 psi

so that e = delta psi + white noise for a change of size delta along g. psi is known before the sample is.
Source: Gustafsson, Adaptive Filtering and Change Detection, 2000, section 8.3.
"""

from typing import NamedTuple

from heli_plant.observer import ObserverGains


class Sensitivity(NamedTuple):
    """What the regressors of one axis make of its errors: angles [rad], rates [rad/s], torques [rad/s^2] per unit."""

    angle: tuple[float, ...]
    rate: tuple[float, ...]
    torque: tuple[float, ...]


def no_sensitivity(size: int) -> Sensitivity:
    """Return the sensitivity of ``size`` regressors before anything has acted."""
    zeros = (0.0,) * size
    return Sensitivity(zeros, zeros, zeros)


def predicted_sensitivity(
    s: Sensitivity, acting: list[float], stiffness: float, damping: float, h: float, g: ObserverGains
) -> Sensitivity:
    """Return psi (as ``angle``) and the rest one sample later, before its correction.

    ``acting``: the accelerations g over the step [rad/s^2 per unit]; ``stiffness`` [1/s^2] and ``damping`` [1/s].
    """
    half = 0.5 * h * h
    total = [
        of + d - stiffness * x - damping * w for of, x, w, d in zip(acting, s.angle, s.rate, s.torque, strict=True)
    ]
    return Sensitivity(
        tuple([x + h * w + half * a for x, w, a in zip(s.angle, s.rate, total, strict=True)]),
        tuple([w + h * a for w, a in zip(s.rate, total, strict=True)]),
        tuple([g.kept * d for d in s.torque]),
    )


def corrected_sensitivity(s: Sensitivity, g: ObserverGains) -> Sensitivity:
    """Return the sensitivity after the sample's correction."""
    left = 1.0 - g.angle
    return Sensitivity(
        tuple([left * x for x in s.angle]),
        tuple([w - g.rate * x for x, w in zip(s.angle, s.rate, strict=True)]),
        tuple([d - g.torque * x for x, d in zip(s.angle, s.torque, strict=True)]),
    )
