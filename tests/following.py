"""A rig that changes in flight, simulated with the plant itself: exact, but for encoders and a random torque."""

import math

import numpy as np

from heli_plant.observer import Torque
from heli_plant.parameters import TABLE_2, PlantParameters
from heli_plant.plant import step
from heli_plant.state import start_state

H = 0.01
COUNT = 2.0 * math.pi / 4096
TORQUE, TORQUE_TIME = 0.012, 1.0
"""Random torque of each axis [rad/s^2] and its correlation time [s]."""


def record(
    seconds: float,
    after: PlantParameters = TABLE_2,
    change: float = math.inf,
    seed: int = 0,
    before: PlantParameters = TABLE_2,
    front: float = 1.0,
    lift: float = 1.0,
) -> list[list[float]]:
    """Return rows (two voltages [V], three angles [rad]) of a flight in open loop under multisines.

    At ``change`` [s] the rig gets the parameters ``after``; its front rotor keeps the share ``front`` of its thrust.
    ``lift``: by how much the sum of the voltages moves more than usual.
    """
    rng = np.random.default_rng(seed)
    n = round(seconds / H)
    t = np.arange(n) * H
    lines = np.array([0.07, 0.11, 0.19, 0.31, 0.5, 0.8])[:, None]
    waves = [np.sin(2 * np.pi * lines * t + rng.uniform(0, 2 * np.pi, (6, 1))).sum(0) for _ in range(2)]
    total, apart = 4.5 + lift * 0.35 * waves[0], 0.31 + 0.15 * waves[1]
    voltages = np.column_stack([total + apart, total - apart]) / 2
    state = start_state(0.0, (TABLE_2.k_z * 4.5 - TABLE_2.a_1) / TABLE_2.a_e, 0.0, *voltages[0])
    torque, stay = Torque(), math.exp(-H / TORQUE_TIME)
    kick = TORQUE * math.sqrt(1.0 - stay * stay)
    rows = []
    for k in range(n):
        shake = 0.25 * rng.standard_normal(3)
        angles = [COUNT * round(a / COUNT + s) for a, s in zip(state[:3], shake, strict=True)]
        rows.append([*voltages[k], *angles])
        share = front if t[k] >= change else 1.0
        p = after if t[k] >= change else before
        state = step(state, share * voltages[k, 0], voltages[k, 1], 0.0, t[k], H, p)
        torque = Torque(*(stay * d + kick * z for d, z in zip(torque, rng.standard_normal(3), strict=True)))
        state = state._replace(
            pitch_rate=state.pitch_rate + H * torque.pitch,
            elevation_rate=state.elevation_rate + H * torque.elevation,
            travel_rate=state.travel_rate + H * torque.travel,
        )
    return rows
