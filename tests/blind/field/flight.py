"""One flight, stepped in time: encoders, controller, rotors, and the blind plant by Moreau's midpoint rule.

At each sample the encoders are read, the controller (or the experiment) gives two voltages, and both are written down;
the plant then gets `gain` times those voltages until the next sample, in steps of 1 ms. To the smooth accelerations
are added the random torque of the room, that of the air (times mu_s over its value in hover), the wind's, the log's
trims, and the touches: a push rises and falls within _EDGE at its ends. Torques of room and air are Ornstein-Uhlenbeck
processes; that of the wind is given.

A flight begins some seconds before its log does, so that a log starts in the air and not at rest. The rig's numbers may
change from sample to sample, and so may the share of thrust that each rotor has left.
"""

import hashlib
import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tests.blind.coefficients import Coefficients, Strange
from tests.blind.encoders import COUNTS_PER_TURN
from tests.blind.field.control import V_MAX, Control, clipped, pitch_reference
from tests.blind.friction import bent
from tests.blind.integration import accelerations, kicked
from tests.blind.rotors import beyond_dead_zone, delayed, spun, thrust

STEP = 0.001
"""Step of the integration [s]."""

_EDGE = 0.05
"""Time over which the force of a hand rises and falls [s]."""


class Changes(NamedTuple):
    """Numbers that a rig has in turn, the number of those at each sample (n,), and shares of thrust (n, 2) [1]."""

    tables: Sequence[Coefficients]
    which: NDArray[np.int64]
    shares: NDArray[np.float64]


@njit
def push(t: float, start: float, end: float) -> float:
    """Share of a touch's acceleration that acts at time t [1]."""
    inside = min(t - start, end - t)
    if inside <= 0.0:
        return 0.0
    if inside >= _EDGE:
        return 1.0
    return math.sin(0.5 * math.pi * inside / _EDGE) ** 2


def _make_loop(fingerprint: int):
    # As in tests/blind/integration.py: numba's cache on disk looks at this file alone.
    @njit(cache=True)
    def loop(
        references, voltages, start, lead, closed, noise, wind, room_std, room_time, air_std, air_time, shake,
        zeros, gain, trims, touches, sample, steps, hover_elevation, hover_thrust, resolution, c, tables, which, shares,
        u,
    ):  # fmt: skip
        _ = fingerprint
        n = references.shape[0]
        h = sample / steps
        read, angles, rates = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
        applied = gain * voltages
        q, w, z = start.copy(), np.zeros(3), np.zeros(3)
        p = tables[which[0]]
        nu = np.array([beyond_dead_zone(applied[0, 0], p.dead_zone), beyond_dead_zone(applied[0, 1], p.dead_zone)])
        room_stay, air_stay = math.exp(-h / room_time), math.exp(-h / air_time)
        room_kick = room_std * math.sqrt(1.0 - room_stay * room_stay)
        air_kick = air_std * math.sqrt(1.0 - air_stay * air_stay)
        room, air = room_std * noise[0, :3], air_std * noise[0, 3:]
        smoothing = 1.0 - math.exp(-c.rate_bandwidth * sample)
        r, integral, before = np.zeros(3), np.zeros(2), np.zeros(3)
        torque, nu_next, cable_rest = np.empty(3), np.empty(2), q[2]
        for k in range(n):
            p = tables[which[k]]
            coulomb = np.array([p.dry_friction_pitch, p.dry_friction_elevation, p.dry_friction_travel])
            breakaway = np.array(
                [p.breakaway_friction_pitch, p.breakaway_friction_elevation, p.breakaway_friction_travel]
            )
            time_constant = p.t_m + p.motor_lag
            angles[k], rates[k] = q, w
            for i in range(3):
                counts = (q[i] + zeros[i]) / resolution[i] + shake[k, i]
                read[k, i] = resolution[i] * round(counts)
            if closed:
                if k > 0:
                    r += smoothing * ((read[k] - before) / sample - r)
                before[:] = read[k]
                wanted = pitch_reference(references[k, 0], references[k, 2], read[k, 2], r[2], c)
                pitch_error = wanted - read[k, 0]
                elevation_error = hover_elevation + references[k, 1] - read[k, 1]
                integral[0] = clipped(integral[0] + sample * pitch_error, c.integral_limit)
                integral[1] = clipped(integral[1] + sample * elevation_error, c.integral_limit)
                asked_d = c.mu_d0 + c.k_pp * pitch_error - c.k_dp * r[0] + c.k_ip * integral[0]
                asked_s = c.mu_s0 + c.k_pe * elevation_error - c.k_de * r[1] + c.k_ie * integral[1]
                # Five decimals are what the files hold; the rig gets what the file says.
                voltages[k, 0] = round(1e5 * clipped((asked_s + asked_d) / 2, V_MAX)) / 1e5
                voltages[k, 1] = round(1e5 * clipped((asked_s - asked_d) / 2, V_MAX)) / 1e5
                applied[k] = gain * voltages[k]
            if k == lead:
                cable_rest = q[2]
            for j in range(steps):
                t = k * sample + j * h
                middle = t + h / 2
                for i in range(2):
                    v = delayed(applied, i, t, h, sample, p.input_delay)
                    nu_next[i] = spun(nu[i], beyond_dead_zone(v, p.dead_zone), h, time_constant)
                f_front = shares[k, 0] * thrust((nu[0] + nu_next[0]) / 2, middle, p)
                f_rear = shares[k, 1] * thrust((nu[1] + nu_next[1]) / 2, middle, p)
                nu[:] = nu_next
                mu_s, mu_d = f_front + f_rear, f_front - f_rear

                torque[:] = room + air * (mu_s / hover_thrust) + trims + wind[k * steps + j]
                for m in range(touches.shape[0]):
                    since = middle - lead * sample
                    torque[int(touches[m, 0])] += touches[m, 3] * push(since, touches[m, 1], touches[m, 2])

                q_m = q + h / 2 * w
                q_m[2] -= cable_rest
                z_m = z
                if p.presliding > 0.0:
                    z_m = np.array([bent(z[i], w[i], p.presliding, h / 2) for i in range(3)])
                a = accelerations(middle, q_m, w, mu_s, mu_d, p, u, torque)
                w_m = kicked(w, a, coulomb, breakaway, z, w, h / 2, p)
                a = accelerations(middle, q_m, w_m, mu_s, mu_d, p, u, torque)
                w = kicked(w, a, coulomb, breakaway, z_m, w_m, h, p)
                q = q_m + h / 2 * w
                q[2] += cable_rest
                if p.presliding > 0.0:
                    z = np.array([bent(z_m[i], w[i], p.presliding, h / 2) for i in range(3)])

                step = 1 + k * steps + j
                room = room_stay * room + room_kick * noise[step, :3]
                air = air_stay * air + air_kick * noise[step, 3:]
        return read, angles, rates

    return loop


_FOLDER = Path(__file__).parent
_COMPILED = (
    *(_FOLDER.parent / f"{name}.py" for name in ("coefficients", "friction", "integration", "rotors", "torques")),
    _FOLDER.parent / "unknown.py",
    _FOLDER / "control.py",
    _FOLDER / "flight.py",
)
_SOURCES = b"".join(path.read_bytes() for path in _COMPILED)
_LOOP = _make_loop(int.from_bytes(hashlib.sha256(_SOURCES).digest()[:7], "big"))


def fly(
    references: NDArray[np.float64],
    voltages: NDArray[np.float64],
    start: NDArray[np.float64],
    lead: int,
    closed_loop: bool,
    coefficients: Coefficients,
    control: Control,
    hover: tuple[float, float],
    room: tuple[float, float, float],
    air: tuple[tuple[float, float, float], float] | None,
    own: tuple[tuple[float, float, float], float, tuple[float, float, float]],
    touches: NDArray[np.float64],
    rate: float,
    rng: np.random.Generator,
    wind: NDArray[np.float64] | None = None,
    changes: Changes | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Fly once, from rest, motors in steady state for the first voltages.

    Parameters
    ----------
    references, shape (n, 3)
        Of pitch, elevation (about the hover) and travel [rad].
    voltages, shape (n, 2)
        Front and rear voltage of an experiment in open loop; in closed loop only the first sample counts, as the
        voltages that the motors start from [V].
    start, shape (3,)
        Pitch, elevation and travel at the first sample [rad].
    lead
        Samples before the log begins; the cable is relaxed where the log begins.
    closed_loop
        Whether the controller flies.
    coefficients, control
        Numbers of plant and controller.
    hover
        Elevation [rad] and thrust, as mu_s [V].
    room
        Standard deviation [rad/s^2] and correlation time [s] of the random torque, shake of the encoders [counts].
    air
        Standard deviations in hover [rad/s^2] and correlation time [s] of the torque of the air; None for none.
    own
        Encoder zeros [rad], gain [1] and trims [rad/s^2] of the log.
    touches, shape (m, 4)
        Axis number, start and end since the log began [s], acceleration [rad/s^2].
    rate
        Sampling and control rate [Hz].
    rng
        Source of the torques and of the shake.
    wind, shape (n steps, 3)
        Further torque at each step of 1 ms, none if not given [rad/s^2].
    changes
        In place of `coefficients`, where the rig changes.

    Returns
    -------
    read, angles, rates : ndarray, shape (n, 3)
        What the encoders say [rad], the true angles [rad] and their rates [rad/s] at each sample.
    voltages : ndarray, shape (n, 2)
        As they are written down [V].
    """
    n, steps = len(references), round(1.0 / rate / STEP)
    noise = np.zeros((n * steps + 1, 6))
    noise[:, : 6 if air else 3] = rng.standard_normal((n * steps + 1, 6 if air else 3))
    air_std, air_time = air or ((0.0, 0.0, 0.0), 1.0)
    changes = changes or Changes((coefficients,), np.zeros(n, dtype=np.int64), np.ones((n, 2)))
    tables = np.array([tuple(table) for table in changes.tables], [(name, float) for name in Coefficients._fields])
    room_std, room_time, shake = room
    zeros, gain, trims = own
    held = np.array(voltages, dtype=float)
    read, angles, rates = _LOOP(
        references,
        held,
        np.array(start, dtype=float),
        lead,
        closed_loop,
        noise,
        np.zeros((n * steps, 3)) if wind is None else wind,
        room_std,
        room_time,
        np.array(air_std),
        air_time,
        shake * rng.standard_normal((n, 3)),
        np.array(zeros),
        gain,
        np.array(trims),
        touches,
        1.0 / rate,
        steps,
        *hover,
        2 * np.pi / COUNTS_PER_TURN,
        control,
        tables,
        changes.which,
        changes.shares,
        Strange(),
    )
    return read, angles, rates, held
