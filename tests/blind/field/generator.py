"""The logs of a field rig."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.blind.field.flight import fly
from tests.blind.field.references import joystick
from tests.blind.field.truth import FieldTruth
from tests.blind.rigs import AXES
from tests.blind.signals import multisines, square_and_chirp

LEAD = 6.0
"""A flight begins this much before its log does [s]."""

_TIME_DECIMALS, _ANGLE_DECIMALS = 6, 6

_GENTLER = 0.5
"""Share of the experiments' voltage difference, so that a badly damped pitch that is touched does not turn over [1]."""

_START = 0.03
"""How far from its hover a flight starts, and a log in open loop from its trim [rad]."""


@dataclass(frozen=True)
class Flight:
    """One flown log and what no encoder saw.

    Attributes
    ----------
    log, shape (n, 6)
        Time [s], front and rear voltage [V], pitch, elevation and travel [rad], as a file holds them.
    angles, rates, shape (n, 3)
        True angles [rad] and rates [rad/s] at the samples.
    before, shape (m, 2)
        Voltages of the seconds before the log [V].
    """

    log: NDArray[np.float64]
    angles: NDArray[np.float64]
    rates: NDArray[np.float64]
    before: NDArray[np.float64]


def fly_log(truth: FieldTruth, number: int) -> Flight:
    """Fly one log of a rig.

    Parameters
    ----------
    truth
        The rig.
    number
        Of the log, in ``truth.logs``.

    Returns
    -------
    Flight
        The same every time.
    """
    own = truth.logs[number]
    person, start, world = (np.random.default_rng(seed) for seed in np.random.SeedSequence(own.seed).spawn(3))
    lead = round(truth.rate * LEAD) if truth.closed_loop else 0
    samples = lead + round(truth.rate * own.duration)
    references = np.zeros((samples, 3))
    if truth.closed_loop:
        references = joystick(samples, truth.rate, truth.liveliness, truth.control.b_p > 0.0, person)
        voltages = np.full((samples, 2), truth.control.mu_s0 / 2)
        at = np.array([0.0, truth.hover[0], 0.0])
    else:
        voltages = _experiment(number, own.duration, person)
        at = np.array([truth.base.theta0, 0.9 * _open_trim(truth, voltages[0]), 0.0])
    at[:2] += start.uniform(-_START, _START, 2)
    read, angles, rates, held = fly(
        references,
        voltages,
        at,
        lead,
        truth.closed_loop,
        truth.coefficients(),
        truth.control,
        truth.hover,
        (truth.room.torque_std, truth.room.torque_time, truth.room.encoder_shake),
        (truth.air.torque_std, truth.air.torque_time),
        (own.zeros, own.gain, own.trims),
        np.array([[AXES.index(t.axis), t.start, t.end, t.acceleration] for t in own.touches]).reshape(-1, 4),
        truth.rate,
        world,
    )
    time = np.arange(samples - lead) / truth.rate
    log = np.column_stack(
        [time.round(_TIME_DECIMALS), held[lead:], read[lead:].round(_ANGLE_DECIMALS)]
    )  # fmt: skip
    return Flight(log, angles[lead:], rates[lead:], held[:lead])


def _experiment(number: int, duration: float, rng: np.random.Generator) -> NDArray[np.floating]:
    voltages = multisines(duration, rng) if number % 3 == 2 else square_and_chirp(duration, 1.0 + number % 3)
    mu_s, mu_d = voltages.sum(axis=1), _GENTLER * (voltages[:, 0] - voltages[:, 1])
    return np.column_stack([(mu_s + mu_d) / 2, (mu_s - mu_d) / 2]).round(5)


def _open_trim(truth: FieldTruth, voltages: NDArray[np.floating]) -> float:
    p = truth.base
    return float((p.k_z * voltages.sum() * np.cos(p.theta0) - p.a_1) / p.a_e)
