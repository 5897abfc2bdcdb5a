"""Torque of the air on each axis, as measured rigs have it: a stationary Gaussian process of two states an axis.

    x+ = F x + L n,    L L' = P - F P F',    F = exp(A h),    x_0 ~ N(0, P),    torque = x_1 + x_2 or x_2

n are independent standard normals, P is the stationary covariance, so the steps are exact whatever h. With s the
level [rad/s^2] and c the rate [1/s]:

========  =====================================================================================================
`ou`      gusts that forget: A = -c, P = s^2
`slow`    the same and a drift of half the level beside it that forgets in 10 s: A = -(c, .1), P = (s^2, s^2/4)
`swirl`   air that goes round in the room: x_1'' + 2 zeta c x_1' + c^2 x_1 = noise and torque = x_2 = x_1',
          P = (s^2/c^2, s^2); the spectrum c^2 f^2 / ((c^2 - f^2)^2 + 4 zeta^2 c^2 f^2) has its peak at c, 2.5 rad/s
`calm`    as `ou`, at a tenth of the level of measured rigs
========  =====================================================================================================
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

COLOURS = ("ou", "slow", "swirl", "calm")

LEVELS = ((0.04, 0.38), (0.024, 0.063), (0.008, 0.021))
"""Standard deviations of the torque on pitch, elevation and travel of measured rigs [rad/s^2]."""

CORRELATION_TIME = (0.3, 0.6)
"""Of the torque on measured rigs [s]."""

SWIRL, SWIRL_DAMPING = (2.4, 2.6), 0.35
"""Where the swirl's spectrum has its peak [rad/s], and its damping ratio: one turn and it has died out."""

CALM = 0.1
"""Level of calm air over that of measured rigs."""

DRIFT_RATE, DRIFT_SHARE = 0.1, 0.5
"""Rate of the drift [1/s], and its level over that of the gusts."""


@dataclass(frozen=True)
class Noise:
    """Torque of the air.

    ``level`` [rad/s^2] is its standard deviation on pitch, elevation and travel, of `slow` that of the gusts alone;
    ``rate`` [1/s] the inverse of the correlation time, of `swirl` the peak of the spectrum [rad/s].
    """

    colour: str
    level: tuple[float, float, float]
    rate: float

    def model(self, axis: int, h: float) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Give F and P, shape (2, 2), and the weights of the states in the torque, shape (2,), at steps of h [s]."""
        s = self.level[axis]
        if self.colour == "swirl":
            w = self.rate
            a, b = SWIRL_DAMPING * w, w * math.sqrt(1.0 - SWIRL_DAMPING**2)
            cos, sin = math.cos(b * h), math.sin(b * h) / b
            F = math.exp(-a * h) * np.array([[cos + a * sin, sin], [-(w**2) * sin, cos - a * sin]])
            return F, np.diag([(s / w) ** 2, s**2]), np.array([0.0, 1.0])
        F = np.diag([math.exp(-self.rate * h), math.exp(-DRIFT_RATE * h)])
        share = DRIFT_SHARE if self.colour == "slow" else 0.0
        return F, np.diag([s**2, (share * s) ** 2]), np.array([1.0, 1.0])


def draw_noise(colour: str, rng: np.random.Generator) -> Noise:
    """Draw level and rate among those of measured rigs; of one seed they are the same whatever the colour.

    Calm air has a tenth of the level.
    """
    if colour not in COLOURS:
        raise ValueError(f"colour {colour!r} is not known; choose of {', '.join(COLOURS)}")
    share = CALM if colour == "calm" else 1.0
    pitch, elevation, travel = (share * float(np.exp(rng.uniform(*np.log(limits)))) for limits in LEVELS)
    time, peak = rng.uniform(*CORRELATION_TIME), rng.uniform(*SWIRL)
    return Noise(colour, (pitch, elevation, travel), float(peak if colour == "swirl" else 1.0 / time))


@njit(cache=True)
def _stepped(F, L, c, x, n, out):  # noqa: N803
    for k in range(n.shape[0]):
        out[k] = c[0] * x[0] + c[1] * x[1]
        first = F[0, 0] * x[0] + F[0, 1] * x[1] + L[0, 0] * n[k, 0]
        x[1] = F[1, 0] * x[0] + F[1, 1] * x[1] + L[1, 0] * n[k, 0] + L[1, 1] * n[k, 1]
        x[0] = first


def _root(Q: NDArray[np.float64]) -> NDArray[np.float64]:  # noqa: N803
    """Lower root of a covariance whose last variance may be zero."""
    a = math.sqrt(Q[0, 0])
    b = Q[1, 0] / a
    return np.array([[a, 0.0], [b, math.sqrt(max(Q[1, 1] - b * b, 0.0))]])


def torque(noise: Noise, steps: int, h: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Make the torque of a flight [rad/s^2], shape (steps, 3), from a stationary start, in steps of h [s]."""
    out = np.empty((3, steps))
    for axis in range(3):
        F, P, c = noise.model(axis, h)
        start = _root(P) @ rng.standard_normal(2)
        _stepped(F, _root(P - F @ P @ F.T), c, start, rng.standard_normal((steps, 2)), out[axis])
    return np.ascontiguousarray(out.T)
