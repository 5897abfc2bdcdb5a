"""The observer that keeps the plant on the rig: the plant's own step, corrected by the innovation of each axis.

Beside angle x and rate w every axis has the unmodelled acceleration d, which fades by gamma = 1 rad/s. With y the
measured angle,

    innovation     e = y - x
    correction     x += l_1 e,  w += l_2 e,  d += l_3 e
    prediction     x, w by the plant under the held voltages,  x += h^2/2 d,  w += h d,  d *= exp(-gamma h)

The gains place the poles of the error's dynamics, for a double integrator, at a Butterworth polynomial of third order
with the bandwidth omega_o. It balances the spectra of torque and encoder noise; there the observer is the Kalman filter
in its steady state, and the innovations are white. For a missing sample there is a prediction and no correction.
Source: Anderson and Moore, Optimal Filtering, 1979, chapters 4 and 9.

**Corrections** are added to the plant's parameters while it runs, the rotors' shares of thrust among them: a damaged
rotor loses a share of its thrust.
"""

from math import cos, exp, sqrt
from typing import NamedTuple

from .parameters import BY_FIELD
from .plant import measured_angles
from .state import PlantState, shift_motion

CORNER = 1.0  # gamma [rad/s]
TRAVEL_BANDWIDTH = 1.26
"""Bandwidth on the travel over that on the other axes: omega_o grows with the spectrum r of the encoder's noise as
r^(-1/6), and with twice the counts r is a quarter: 4^(1/6)."""


class Torque(NamedTuple):
    """Unmodelled accelerations d of the axes [rad/s^2]."""

    pitch: float = 0.0
    elevation: float = 0.0
    travel: float = 0.0


class ObserverGains(NamedTuple):
    """Gains on the innovation: ``angle`` [1], ``rate`` [1/s], ``torque`` [1/s^2]; ``decay`` = exp(-gamma h) [1]."""

    angle: float
    rate: float
    torque: float
    decay: float


def observer_gains(bandwidth: float, h: float) -> ObserverGains:
    """Return the gains for poles of ``bandwidth`` omega_o [rad/s] and samples every ``h`` [s].

    The error before a correction goes through F (I - l H), F = [[1, h, h^2/2], [0, 1, h], [0, 0, f]], H = [1, 0, 0],
    f = exp(-gamma h), in each sample. With its characteristic polynomial 1 + o_1 z^-1 + o_2 z^-2 + o_3 z^-3,

        l_1 = 1 + o_3/f
        l_2 = (2 f^2 + f (1 + o_1 - o_2 - o_3) - 2 o_3) / (f (1 + f) h)
        l_3 = 2 (f^3 + f^2 o_1 + f o_2 + o_3) / (f (1 + f) h^2)
    """
    x, f = bandwidth * h, exp(-CORNER * h)
    p, r = exp(-x), exp(-0.5 * x)
    c = 2.0 * r * cos(0.5 * sqrt(3.0) * x)
    o1, o2, o3 = -(p + c), p * c + r * r, -p * r * r
    return ObserverGains(
        1.0 + o3 / f,
        (2.0 * f * f + f * (1.0 + o1 - o2 - o3) - 2.0 * o3) / (f * (1.0 + f) * h),
        2.0 * (f * f * f + f * f * o1 + f * o2 + o3) / (f * (1.0 + f) * h * h),
        f,
    )


def predict_state(state: PlantState, torque: Torque, h: float, g: ObserverGains) -> tuple[PlantState, Torque]:
    """Return the plant's state after its step of ``h`` [s] with ``torque`` added, and ``torque`` after its decay."""
    predicted = shift_motion(state, [0.5 * h * h * d for d in torque], [h * d for d in torque])
    return predicted, Torque(*(g.decay * d for d in torque))


def correct_state(
    state: PlantState, torque: Torque, angles: tuple[float, float, float], gains: tuple[ObserverGains, ...]
) -> tuple[PlantState, Torque]:
    """Return state and unmodelled accelerations after a sample of the three angles [rad]; ``gains`` of each axis."""
    errors = [(y - x, g) for y, x, g in zip(angles, measured_angles(state), gains, strict=True)]
    torques = [d + g.torque * e for d, (e, g) in zip(torque, errors, strict=True)]
    return shift_motion(state, [g.angle * e for e, g in errors], [g.rate * e for e, g in errors]), Torque(*torques)


GAINS, DAMPINGS = ("k_x", "k_z", "k_y"), ("a_wx", "a_wz", "a_wy")
EFFECTS = (
    "dry_friction_pitch", "dry_friction_elevation", "dry_friction_travel", "constant_torque_pitch",
    "constant_torque_travel", "cable_stiffness_travel",
)  # fmt: skip
"""Effects that may be switched on: a bearing, a mass or a cable that moved."""
FIELDS = (*GAINS, "a_1", *DAMPINGS, *EFFECTS, "share_front", "share_rear")
CORRECTED = tuple((BY_FIELD[field].name, BY_FIELD[field].unit) for field in FIELDS)
"""Name and unit of what is corrected."""
