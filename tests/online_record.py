"""A record of the paper's plant, Table 2, for the tests of the on-line identifier."""

from math import cos, pi

import numpy as np

from heli_identifier.online import output_of, prepare, start, step
from heli_identifier.online.excitation import Excitation, Multisine, voltages
from heli_plant.communication import EncoderCounts
from heli_plant.parameters import TABLE_2
from heli_plant.simulation import simulate
from heli_plant.state import start_state

H = 0.01
"""Sampling period of every record [s]."""


def multisines(seed, period, difference_rms=0.4, total_rms=0.9, base=1.0):
    """Multisines over the resonances of pitch (.13 Hz) and elevation (.26 Hz)."""
    return Excitation(
        base=base,
        difference=Multisine(difference_rms, 0.03, 0.6, 12, period, seed),
        total=Multisine(total_rms, 0.15, 0.5, 12, period, seed + 1000),
    )


def record(seconds, excitation, parameters=TABLE_2, encoders=True, h=H):
    """Voltages (N, 2) [V], angles (N, 3) [rad] and states (N, 12) of the plant, from its equilibrium on."""
    count = round(seconds / h)
    held = np.array([voltages(k * h, excitation) for k in range(count)])
    total = held[0].sum()
    elevation = (parameters.k_z * total * cos(parameters.theta0) - parameters.a_1) / parameters.a_e
    rest = start_state(parameters.theta0, elevation, 0.0, 0.5 * total, 0.5 * total)
    states, angles = simulate(held, h, rest, parameters)
    return held, read(angles) if encoders else angles, states


def read(angles):
    """``angles`` (N, 3) as encoders give them [rad], by the formula of ``heli_plant.communication.quantise``."""
    width = 2.0 * pi / np.array(EncoderCounts())
    return np.floor(angles / width + 0.5) * width


def identified(voltages, angles, settings, state=None):
    """State and output of the identifier after a record; without ``state`` its first row is sample 0."""
    plan, rows = prepare(settings), np.hstack([voltages, angles]).tolist()
    if state is None:
        state, rows = start(plan, rows[0]), rows[1:]
    output = output_of(state, plan)
    for row in rows:
        state, output = step(state, row, plan)
    return state, output
