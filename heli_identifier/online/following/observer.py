"""The observer that keeps the plant on the rig: the plant's own step, corrected by the innovation of each axis.

Beside angle x and rate w every axis has the unmodelled acceleration d, which fades by gamma. With y the measured angle

    prediction     x, w by the plant under the held voltages,  x += h^2/2 d,  w += h d,  d *= exp(-gamma h)
    innovation     e = y - x
    correction     x += l_1 e,  w += l_2 e,  d += l_3 e

The gains place the poles of the error's dynamics where the spectra of the torque and of the encoder's noise balance: at
a Butterworth polynomial of third order with the bandwidth omega_o (:mod:`heli_identifier.online.whitening`), for a
double integrator. There the innovations are white, and a Kalman filter's in its steady state. A sample that did not
come in is predicted and not corrected.

An acceleration g that the plant lacks moves the innovations through the same dynamics. With (x, w, d) now what g makes
of the errors, and the axis' own stiffness a and damping b,

    x += h w + h^2/2 (g + d - a x - b w),  w += h (g + d - a x - b w),  d *= exp(-gamma h)
    psi = x
    x -= l_1 psi,  w -= l_2 psi,  d -= l_3 psi

so that e = delta psi + white noise for a change of size delta along g. psi is known before the sample is.
Sources: Anderson and Moore, Optimal Filtering, 1979, chapters 4 and 9; Gustafsson, Adaptive Filtering and Change
Detection, 2000, section 8.3.
"""

from math import exp, log
from typing import NamedTuple

from heli_plant.state import PlantState

from ..noise_model import Noise
from ..whitening import whitening

Triple = tuple[float, float, float]


class Gains(NamedTuple):
    """Gains on the innovation: ``angle`` [1], ``rate`` [1/s], ``torque`` [1/s^2]; ``kept`` = exp(-gamma h) [1]."""

    angle: float
    rate: float
    torque: float
    kept: float


def observer_gains(bandwidth: float, h: float) -> Gains:
    """Return the gains for poles of ``bandwidth`` omega_o [rad/s] and samples every ``h`` [s].

    The error before a correction goes through F (I - l H), F = [[1, h, h^2/2], [0, 1, h], [0, 0, f]], H = [1, 0, 0],
    f = exp(-gamma h), in each sample. Its characteristic polynomial 1 + o_1 z^-1 + o_2 z^-2 + o_3 z^-3 gives

        l_1 = 1 + o_3/f
        l_2 = (2 f^2 + f (1 + o_1 - o_2 - o_3) - 2 o_3) / (f (1 + f) h)
        l_3 = 2 (f^3 + f^2 o_1 + f o_2 + o_3) / (f (1 + f) h^2)
    """
    corner = Noise().corner
    kept = exp(-corner * h)
    w = whitening(log(bandwidth), log(corner), 0.0, 0.0, h)
    f, o1, o2, o3 = kept, w.o1, w.o2, w.o3
    return Gains(
        1.0 + o3 / f,
        (2.0 * f * f + f * (1.0 + o1 - o2 - o3) - 2.0 * o3) / (f * (1.0 + f) * h),
        2.0 * (f * f * f + f * f * o1 + f * o2 + o3) / (f * (1.0 + f) * h * h),
        kept,
    )


def pushed(state: PlantState, torque: Triple, h: float) -> PlantState:
    """Return ``state`` after a step of ``h`` [s] with the unmodelled accelerations ``torque`` [rad/s^2] added."""
    half = 0.5 * h * h
    d1, d2, d3 = torque
    return state._replace(
        pitch=state.pitch + half * d1,
        elevation=state.elevation + half * d2,
        travel=state.travel + half * d3,
        pitch_rate=state.pitch_rate + h * d1,
        elevation_rate=state.elevation_rate + h * d2,
        travel_rate=state.travel_rate + h * d3,
    )


def corrected(state: PlantState, torque: Triple, innovation: Triple, g: Gains) -> tuple[PlantState, Triple]:
    """Return state and unmodelled accelerations [rad/s^2] after the innovations [rad] of the three axes."""
    e1, e2, e3 = innovation
    d1, d2, d3 = torque
    return state._replace(
        pitch=state.pitch + g.angle * e1,
        elevation=state.elevation + g.angle * e2,
        travel=state.travel + g.angle * e3,
        pitch_rate=state.pitch_rate + g.rate * e1,
        elevation_rate=state.elevation_rate + g.rate * e2,
        travel_rate=state.travel_rate + g.rate * e3,
    ), (d1 + g.torque * e1, d2 + g.torque * e2, d3 + g.torque * e3)


def faded(torque: Triple, g: Gains) -> Triple:
    """Return the unmodelled accelerations one sample later."""
    d1, d2, d3 = torque
    return g.kept * d1, g.kept * d2, g.kept * d3


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
    s: Sensitivity, acting: list[float], stiffness: float, damping: float, h: float, g: Gains
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


def corrected_sensitivity(s: Sensitivity, g: Gains) -> Sensitivity:
    """Return the sensitivity after the sample's correction."""
    left = 1.0 - g.angle
    return Sensitivity(
        tuple([left * x for x in s.angle]),
        tuple([w - g.rate * x for x, w in zip(s.angle, s.rate, strict=True)]),
        tuple([d - g.torque * x for x, d in zip(s.angle, s.torque, strict=True)]),
    )
