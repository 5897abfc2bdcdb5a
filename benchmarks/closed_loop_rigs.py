"""Generated rigs flown in closed loop, with their truth: what the identifier of the unit is judged by.

Half of the rigs have the paper's coefficients, the other half coefficients within 20 % of them. Each hovers at an
elevation and a thrust of its own, under a controller of pitch and elevation (PID or state feedback on filtered rates,
tuned by poles with gains known to ten percent), while a joystick moves the references in steps. Every axis has a
random torque (Ornstein-Uhlenbeck, 1 s), encoders have a turn of 4096 counts. Nothing else acts. The physics are those
of the blind battery (:mod:`tests.blind`), which shares nothing with the packages that are judged.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from heli_identifier.records import Log
from tests.blind.coefficients import Coefficients
from tests.blind.field.control import Control
from tests.blind.field.flight import fly
from tests.blind.field.references import joystick
from tests.blind.rigs import draw_base

TORQUE_STD, TORQUE_TIME, SHAKE = 0.012, 1.0, 0.25
"""Random torque [rad/s^2], its correlation time [s], shake of the encoders' lines [counts]."""

LOGS, DURATIONS = 5, (22.0, 40.0)
_LEAD = 6.0
"""A flight begins this much before its log does [s]."""

_HOVER, _THRUST = (-0.2, 0.4), (4.4, 6.4)
_PITCH_POLES, _ELEVATION_POLES, _DAMPING = (1.6, 2.5), (1.9, 2.6), (0.65, 0.9)
_GAIN_ERROR = (0.9, 1.1)
_RATE_BANDWIDTH = (18.0, 35.0)


@dataclass(frozen=True)
class ClosedLoopRig:
    """A rig, its controller and the logs flown on it.

    ``outside`` holds, per log, the part of the voltages (front, rear) [V] that the joystick asks for: the controller's
    proportional gains times the references, shape (N, 2).
    """

    name: str
    truth: Coefficients
    control: Control
    hover: tuple[float, float]
    logs: tuple[Log, ...]
    outside: tuple[np.ndarray, ...]


def closed_loop_rig(
    seed: int,
    like_paper: bool,
    rate: float = 100.0,
    noise: float = 1.0,
    lag: float = 0.08,
    effects: Mapping[str, float] | None = None,
    durations: tuple[float, float] = DURATIONS,
    quiet_from: float | None = None,
) -> ClosedLoopRig:
    """Return one rig with five logs.

    Parameters
    ----------
    seed : int
        Of the rig, its pilot and its noise.
    like_paper : bool
        Coefficients of the paper's Table 2, or each drawn within 20 % of them.
    rate : float
        Of samples and controller [Hz].
    noise : float
        Times the standard deviation of the random torque.
    lag : float
        Time constant of the motors [s].
    effects : mapping, optional
        Fields of :class:`tests.blind.coefficients.Coefficients` that are not zero.
    durations : tuple of float
        Shortest and longest log [s].
    quiet_from : float, optional
        Time in a log from which nobody moves the joystick any more [s].
    """
    rng = np.random.default_rng([13, seed])
    base = Coefficients() if like_paper else draw_base(rng)
    hover = float(rng.uniform(*_HOVER)), float(rng.uniform(*_THRUST))
    base = base._replace(theta0=float(rng.uniform(-0.14, 0.06)), t_m=lag, a_1=base.k_z * hover[1] - base.a_e * hover[0])
    control = _tuned(base, hover, rng)
    base = base._replace(**(effects or {}))
    logs, outside = [], []
    for number in range(LOGS):
        samples = round((_LEAD + rng.uniform(*durations)) * rate)
        lead = round(_LEAD * rate)
        references = joystick(samples, rate, 1.0, False, rng)
        if quiet_from is not None:
            references[lead + round(quiet_from * rate) :] = 0.0
        at = np.array([0.0, hover[0], 0.0])
        at[:2] += rng.uniform(-0.03, 0.03, 2)
        read, _, _, voltages = fly(
            references,
            np.full((samples, 2), control.mu_s0 / 2),
            at,
            lead,
            True,
            base,
            control,
            hover,
            (noise * TORQUE_STD, TORQUE_TIME, SHAKE),
            ((0.0, 0.0, 0.0), 1.0),
            ((0.0, 0.0, 0.0), 1.0, (0.0, 0.0, 0.0)),
            np.zeros((0, 4)),
            rate,
            rng,
        )
        difference, total = control.k_pp * references[lead:, 0], control.k_pe * references[lead:, 1]
        logs.append(Log(f"log{number}", rate, voltages[lead:], read[lead:].round(6)))
        outside.append(np.column_stack([total + difference, total - difference]) / 2)
    name = f"{'paper' if like_paper else 'drawn'}-{seed}"
    return ClosedLoopRig(name, base, control, hover, tuple(logs), tuple(outside))


def _tuned(base: Coefficients, hover: tuple[float, float], rng: np.random.Generator) -> Control:
    """Loops by poles, no faster than the motors and the rate filter allow."""
    bandwidth = rng.uniform(*_RATE_BANDWIDTH)
    fastest = 0.42 / (base.t_m + 1.0 / bandwidth)
    omega_p, omega_e = (min(rng.uniform(*poles), fastest) for poles in (_PITCH_POLES, _ELEVATION_POLES))
    zeta = rng.uniform(*_DAMPING)
    k_x, k_z = base.k_x * rng.uniform(*_GAIN_ERROR), base.k_z * rng.uniform(*_GAIN_ERROR)
    integral = rng.random() < 0.5
    k_pp, k_pe = max(omega_p**2 - base.a_th, 0.8) / k_x, max(omega_e**2 - base.a_e, 0.6) / k_z
    return Control(
        mu_d0=-base.a_th * math.sin(base.theta0) / k_x,
        k_pp=k_pp,
        k_dp=2.0 * zeta * omega_p / k_x,
        k_ip=0.25 * k_pp * integral,
        mu_s0=hover[1] * rng.uniform(0.98, 1.02),
        k_pe=k_pe,
        k_de=2.0 * zeta * math.sqrt(k_pe * k_z + base.a_e) / k_z,
        k_ie=0.5 * k_pe * integral,
        rate_bandwidth=bandwidth,
    )


def closed_loop_rigs(seed: int, **settings: Any) -> list[ClosedLoopRig]:
    """Return six rigs with the paper's coefficients and six drawn around them; ``settings`` as for one rig."""
    return [closed_loop_rig(100 * seed + number, number < 6, **settings) for number in range(12)]
