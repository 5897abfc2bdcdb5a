"""Moreau's midpoint rule, 1 ms: drift half a step, kick at the middle with the impulse of friction, drift again.

    q_m = q + h/2 w
    w_m = slip(w + h/2 a(t_m, q_m, w), h/2 F)
    w+  = slip(w + h   a(t_m, q_m, w_m), h F)
    q+  = q_m + h/2 w+

Second order where the rate keeps its sign, energy held where there is no damping, and w+ is exactly zero while
an axis sticks. The random torque of each axis is an Ornstein-Uhlenbeck process, r' = -r/tau + noise, stepped exactly.
"""

import hashlib
import math
from pathlib import Path

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tests.blind.coefficients import Coefficients, Strange
from tests.blind.friction import bent, level, slowed
from tests.blind.rotors import beyond_dead_zone, delayed, spun, thrust
from tests.blind.signals import SAMPLE
from tests.blind.torques import elevation_torque, pitch_torque, travel_torque
from tests.blind.unknown import strange_torque

STEPS_PER_SAMPLE = 10


@njit
def accelerations(t, q, w, mu_s, mu_d, p, u, room):
    """Smooth accelerations of the three axes, the unknown torque u and the added torques `room` among them."""
    a = np.empty(3)
    a[0] = pitch_torque(q[0], q[1], w[0], w[1], w[2], mu_s, mu_d, p)
    a[1] = elevation_torque(t, q[0], q[1], w[0], w[1], w[2], mu_s, p)
    a[2] = travel_torque(q[0], q[1], q[2], w[1], w[2], mu_s, p)
    for i in range(3):
        a[i] += room[i]
    if u.axis >= 0:
        a[u.axis] += strange_torque(t, q[u.axis], q[2], u)
    return a


@njit
def kicked(w, a, coulomb, breakaway, z, at_rate, h, p):
    """Rates after h of the accelerations a and of dry friction, whose level is that at `at_rate`."""
    w_next = w + h * a
    for i in range(3):
        if coulomb[i] == 0.0 and breakaway[i] == 0.0:
            continue
        friction = level(at_rate[i], coulomb[i], breakaway[i], p.stribeck_rate)
        if p.presliding > 0.0:
            w_next[i] -= h * friction * z[i] / p.presliding
        else:
            w_next[i] = slowed(w_next[i], h * friction)
    return w_next


def _make_loop(fingerprint: int):
    # numba's cache on disk looks at this file alone; capturing a fingerprint of all compiled files makes a new
    # entry when any law is edited.
    @njit(cache=True)
    def loop(voltages, start, noise, torque_std, torque_time, sample, steps, p, u):
        _ = fingerprint
        n = voltages.shape[0]
        h = sample / steps
        angles, rates = np.empty((n, 3)), np.empty((n, 3))
        q, w, z = start.copy(), np.zeros(3), np.zeros(3)
        coulomb = np.array([p.dry_friction_pitch, p.dry_friction_elevation, p.dry_friction_travel])
        breakaway = np.array([p.breakaway_friction_pitch, p.breakaway_friction_elevation, p.breakaway_friction_travel])
        nu = np.array([beyond_dead_zone(voltages[0, 0], p.dead_zone), beyond_dead_zone(voltages[0, 1], p.dead_zone)])
        time_constant = p.t_m + p.motor_lag
        stay = math.exp(-h / torque_time)
        kick = torque_std * math.sqrt(1.0 - stay * stay)
        room = torque_std * noise[0]
        stiffness = (2.0 * math.pi * p.bending_frequency) ** 2
        damping = 4.0 * math.pi * p.bending_damping * p.bending_frequency
        bend, bend_rate = p.arm_bending * (thrust(nu[0], 0.0, p) + thrust(nu[1], 0.0, p)), 0.0
        for k in range(n):
            angles[k], rates[k] = q, w
            angles[k, 1] += bend
            for j in range(steps):
                t = k * sample + j * h
                middle = t + h / 2
                nu_next = np.empty(2)
                for i in range(2):
                    v = delayed(voltages, i, t, h, sample, p.input_delay)
                    nu_next[i] = spun(nu[i], beyond_dead_zone(v, p.dead_zone), h, time_constant)
                f_front = thrust((nu[0] + nu_next[0]) / 2, middle, p)
                f_rear = thrust((nu[1] + nu_next[1]) / 2, middle, p)
                nu = nu_next
                mu_s, mu_d = f_front + f_rear, f_front - f_rear

                q_m = q + h / 2 * w
                z_m = z
                if p.presliding > 0.0:
                    z_m = np.array([bent(z[i], w[i], p.presliding, h / 2) for i in range(3)])
                a = accelerations(middle, q_m, w, mu_s, mu_d, p, u, room)
                w_m = kicked(w, a, coulomb, breakaway, z, w, h / 2, p)
                a = accelerations(middle, q_m, w_m, mu_s, mu_d, p, u, room)
                w = kicked(w, a, coulomb, breakaway, z_m, w_m, h, p)
                q = q_m + h / 2 * w
                if p.presliding > 0.0:
                    z = np.array([bent(z_m[i], w[i], p.presliding, h / 2) for i in range(3)])

                bend += h / 2 * bend_rate
                pull = stiffness * (p.arm_bending * mu_s - bend)
                bend_rate = ((1.0 - damping * h / 2) * bend_rate + h * pull) / (1.0 + damping * h / 2)
                bend += h / 2 * bend_rate

                room = stay * room + kick * noise[1 + k * steps + j]
        return angles, rates

    return loop


_COMPILED = ("coefficients", "friction", "integration", "rotors", "torques", "unknown")
_SOURCES = b"".join(Path(__file__).with_name(f"{name}.py").read_bytes() for name in _COMPILED)
_LOOP = _make_loop(int.from_bytes(hashlib.sha256(_SOURCES).digest()[:7], "big"))


def integrate(
    voltages: NDArray[np.floating],
    start: NDArray[np.float64],
    coefficients: Coefficients,
    strange: Strange,
    torque_std: float,
    torque_time: float,
    rng: np.random.Generator,
    steps: int = STEPS_PER_SAMPLE,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Integrate one log, from rest, motors in steady state for the first voltages.

    Parameters
    ----------
    voltages, shape (n, 2)
        Front and rear voltage, held over each sample [V].
    start, shape (3,)
        Pitch, elevation and travel at the first sample [rad].
    coefficients
        Numbers of the plant.
    strange
        Numbers of the unknown torque.
    torque_std
        Standard deviation of the room's random torque on each axis [rad/s^2].
    torque_time
        Correlation time of that torque [s].
    rng
        Its source.
    steps
        Steps per sample [1].

    Returns
    -------
    angles, rates : ndarray, shape (n, 3)
        Pitch, elevation (bending of the arm included) and travel at each sample [rad], and the rates of the
        rigid body [rad/s].
    """
    noise = rng.standard_normal((voltages.shape[0] * steps + 1, 3))
    return _LOOP(
        np.ascontiguousarray(voltages, dtype=float),
        np.array(start, dtype=float),
        noise,
        torque_std,
        torque_time,
        SAMPLE,
        steps,
        coefficients,
        strange,
    )
