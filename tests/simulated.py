"""Records of the plant for the tests of prediction, tracing and evaluation: exact, or with process noise and encoders.

The loop below is the interpreted step with a further acceleration d, held over each sampling period h: angles move by
d h^2/2 and rates by d h. This is exact for a free axis; damping and stiffness make an error of the order h."""

from math import pi
from random import Random

import numpy as np
from scipy.signal import lfilter

from heli_identifier.online import output_of, prepare, start, step
from heli_identifier.online.excitation import Excitation, Multisine, voltages
from heli_identifier.records import Log
from heli_plant.communication import EncoderCounts
from heli_plant.control import PidSettings, pid_step, start_pid
from heli_plant.effects import AXES
from heli_plant.parameters import TABLE_2
from heli_plant.plant import advance, measured_angles, rigid_start
from heli_plant.simulation import simulate
from heli_plant.state import rest_state
from heli_plant.tabulated_torque import KNOTS
from tests.blind.signals import multisines as blind_multisines

H = 0.01
"""Sampling period of every record [s]."""

PROCESS_NOISE = 0.003
"""Standard deviation of the process noise on each axis [rad/s^2]; it is correlated over 1 s."""

COUNT = 2.0 * pi / 4096
"""One count of an encoder [rad]."""


def drive(seconds, seed=0):
    """Return multisines on both inputs, (N, 2) [V]."""
    return blind_multisines(seconds, np.random.default_rng(seed))


def start_at_rest(parameters, voltages):
    """Return the state near rest under a record's first voltages; its elevation is that of the encoder."""
    v_front, v_rear = (float(v) for v in voltages[0])
    return rest_state(parameters, v_front + v_rear)._replace(nu_front=v_front, nu_rear=v_rear)


def process_noise(count, seed, deviation=PROCESS_NOISE, correlation_time=1.0):
    """Return random accelerations (N, 3) [rad/s^2] of a first-order process."""
    pole = float(np.exp(-H / correlation_time))
    white = np.random.default_rng(seed).standard_normal((count + 1000, 3))
    return deviation * np.sqrt(1.0 - pole**2) * lfilter([1.0], [1.0, -pole], white, axis=0)[1000:]


def simulate_pushed(parameters, voltages, torque, law=None, controller=None, changed=None):
    """Simulate with accelerations ``torque`` (N, 3) and a further ``law`` of sample and state [rad/s^2].

    ``controller`` gives the voltages [V] by sample and angles, ``changed`` the parameters at a sample. Returns the
    voltages (N, 2), and the angles (N, 3).
    """
    state, held = rigid_start(start_at_rest(parameters, voltages), parameters), []
    time = [k * H for k in range(len(voltages))]
    used, angles = np.array(voltages, dtype=float), np.empty((len(voltages), 3))
    for k in range(len(voltages)):
        angles[k] = measured_angles(state)
        if controller is not None:
            used[k] = controller(k, tuple(angles[k]))
        p = parameters if changed is None else changed(k)
        held.append((float(used[k, 0]), float(used[k, 1])))
        d = torque[k] if law is None else torque[k] + law(k, state)
        moved = advance(state, time, held, k, 0.0, H, p)
        positions = {axis: getattr(moved, axis) + 0.5 * H * H * a for axis, a in zip(AXES, d, strict=True)}
        rates = {f"{axis}_rate": getattr(moved, f"{axis}_rate") + H * a for axis, a in zip(AXES, d, strict=True)}
        state = moved._replace(**positions, **rates)
    return used, angles


def noisy_log(parameters, voltages, seed, law=None, deviation=PROCESS_NOISE, name="noisy"):
    """Return a log in open loop with process noise, as the rig's encoders read it."""
    torque = process_noise(len(voltages), seed, deviation)
    return Log(name, 1.0 / H, voltages, read_encoders(simulate_pushed(parameters, voltages, torque, law)[1]))


def changing_rig(seconds, after=TABLE_2, change=np.inf, seed=0, before=TABLE_2, lift=1.0):
    """Return rows (two voltages [V], three angles [rad]) of a rig in open loop that changes in flight.

    At ``change`` [s] it gets the parameters ``after``; ``lift``: factor on the motion of the sum of the voltages. The
    air has .012 rad/s^2.
    """
    rng, t = np.random.default_rng(seed), np.arange(round(seconds / H)) * H
    lines = np.array([0.07, 0.11, 0.19, 0.31, 0.5, 0.8])[:, None]
    waves = [np.sin(2 * np.pi * lines * t + rng.uniform(0, 2 * np.pi, (6, 1))).sum(0) for _ in range(2)]
    total, difference = 4.5 + lift * 0.35 * waves[0], 0.31 + 0.15 * waves[1]
    voltages = np.column_stack([total + difference, total - difference]) / 2
    torque = process_noise(len(t), seed, 0.012)

    def changed(k):
        return after if k * H >= change else before

    _, angles = simulate_pushed(before, voltages, torque, changed=changed)
    counts = angles / COUNT + 0.25 * rng.standard_normal(angles.shape)
    return np.hstack([voltages, COUNT * np.round(counts)]).tolist()


def closed_loop_log(parameters, seconds, seed, name="closed loop", torque=process_noise):
    """Return a log under the PID, with steps of the references of pitch and elevation and one period of delay."""
    count = round(seconds / H)
    random = np.random.default_rng(seed)
    references = np.repeat(random.uniform((-0.25, 0.0), (0.25, 0.3), (count // 250 + 1, 2)), 250, axis=0)
    settings, pid = PidSettings(), [start_pid(parameters.theta0, 0.1, 0.0)]
    waiting = [(0.5, 0.5)]

    def controller(k, angles):
        counts = tuple(float(a) for a in read_encoders(np.array([angles]))[0])
        pid[0], voltages = pid_step(pid[0], *counts, (*references[k], 0.0), H, settings)
        waiting.append(voltages)
        return waiting.pop(0)

    voltages, angles = simulate_pushed(parameters, np.full((count, 2), 0.5), torque(count, seed), None, controller)
    return Log(name, 1.0 / H, voltages, read_encoders(angles))


def random_tables():
    """Return tables of torque over three variables, by field; motions leave the range of the tables."""
    tables = {}
    for axis, number in zip(AXES, (7, 2, 3), strict=True):
        draw = Random(number)
        tables |= {f"table_torque_{k}_{axis}": draw.uniform(-0.3, 0.3) for k in range(1, KNOTS + 1)}
        tables |= {f"table_variable_{axis}": float(number), f"table_first_{axis}": draw.uniform(-1.5, -0.5)}
        tables |= {f"table_spacing_{axis}": draw.uniform(0.05, 0.2)}
    return tables


def multisines(seed, period, base=1.0):
    """Return multisines over the resonances of pitch (.13 Hz) and elevation (.26 Hz)."""
    return Excitation(
        base=base,
        difference=Multisine(0.4, 0.03, 0.6, 12, period, seed),
        total=Multisine(0.9, 0.15, 0.5, 12, period, seed + 1000),
    )


def simulate_record(seconds, excitation, parameters=TABLE_2, encoders=True):
    """Return voltages (N, 2) [V], angles (N, 3) [rad] and states (N, 12) of the plant, from its equilibrium on."""
    held = np.array([voltages(k * H, excitation) for k in range(round(seconds / H))])
    states, angles = simulate(held, H, rest_state(parameters, held[0].sum()), parameters)
    return held, read_encoders(angles) if encoders else angles, states


def read_encoders(angles):
    """Return ``angles`` (N, 3) as encoders read them [rad], by the formula of ``heli_plant.communication.quantise``."""
    width = 2.0 * pi / np.array(EncoderCounts())
    return np.floor(angles / width + 0.5) * width


def run_identifier(voltages, angles, settings):
    """Return state and output of the identifier after a record, whose first row is sample 0."""
    plan, (first, *rows) = prepare(settings), np.hstack([voltages, angles]).tolist()
    state = start(plan, first)
    output = output_of(state, plan)
    for row in rows:
        state, output = step(state, row, plan)
    return state, output
