"""The logs of a rig: three to train on and one held out, in memory or as files; the truth stays aside."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.blind.encoders import read
from tests.blind.integration import integrate
from tests.blind.kinds import DURATION, STANDARD_ROOM, draw_rig
from tests.blind.rigs import Rig, Room
from tests.blind.signals import SAMPLE, multisines, square_and_chirp

HEADER = "time [s],v_front [V],v_rear [V],pitch [rad],elevation [rad],travel [rad]"

NAMES = ("train1", "train2", "train3", "held")

_DECIMALS = (2, 5, 5, 6, 6, 6)

_PITCH_OFF, _ELEVATION_SHARE = 0.03, 0.9
"""A log starts at rest, pitch this near to theta0 [rad] and elevation at this share of its trim."""


@dataclass(frozen=True)
class BlindRig:
    """Logs of one rig.

    Attributes
    ----------
    train
        Three logs, each of shape (n, 6): time, two voltages, three angles, in the units of `HEADER`.
    held
        The log to validate on, of the same shape.
    truth
        What the logs must not tell.
    """

    train: tuple[NDArray[np.float64], ...]
    held: NDArray[np.float64]
    truth: Rig

    def write(self, directory: Path) -> tuple[Path, ...]:
        """Write train1.csv, train2.csv, train3.csv and held.csv into a directory; nothing of the truth."""
        directory.mkdir(parents=True, exist_ok=True)
        paths = tuple(directory / f"{name}.csv" for name in NAMES)
        for path, log in zip(paths, (*self.train, self.held), strict=True):
            formats = [f"%.{n}f" for n in _DECIMALS]
            np.savetxt(path, log, fmt=formats, delimiter=",", header=HEADER, comments="")
        return paths


def simulate_log(rig: Rig, voltages: NDArray[np.floating], seed: int | np.random.SeedSequence) -> NDArray[np.float64]:
    """Simulate one log of a rig.

    Parameters
    ----------
    rig
        Its truth.
    voltages, shape (n, 2)
        Front and rear voltage, held over 10 ms [V].
    seed
        Of the start, the room and the encoders.

    Returns
    -------
    ndarray, shape (n, 6)
        The columns of `HEADER`, to the decimals that a file holds.
    """
    rng = np.random.default_rng(seed)
    p = rig.base
    pitch = p.theta0 + rng.uniform(-_PITCH_OFF, _PITCH_OFF)
    trim = (p.k_z * voltages[0].sum() * np.cos(pitch) - p.a_1) / p.a_e
    start = np.array([pitch, _ELEVATION_SHARE * trim, 0.0])
    strange = rig.strange(phase=float(rng.uniform(0, 2 * np.pi)))
    angles, _ = integrate(voltages, start, rig.coefficients(), strange, rig.room.torque_std, rig.room.torque_time, rng)
    time = SAMPLE * np.arange(len(voltages))
    log = np.column_stack([time, voltages, read(angles, rig.room.encoder_shake, rng)])
    return np.column_stack([column.round(n) for column, n in zip(log.T, _DECIMALS, strict=True)])


def make_rig(seed: int, kind: str = "clean", scale: float = 1.0, room: Room = STANDARD_ROOM) -> BlindRig:
    """Draw a rig and make its four logs.

    Parameters
    ----------
    seed, kind, scale, room
        As for `draw_rig`. The room's torque, the excitation and the base parameters depend on the seed alone, so
        that rigs of one seed differ in their effect and in nothing else.

    Returns
    -------
    BlindRig
        Train logs: the paper's two experiments and multisines; held-out log: multisines of other phases.
    """
    rig_seed, phase_seed, *log_seeds = np.random.SeedSequence(seed).spawn(6)
    rng = np.random.default_rng(phase_seed)
    rig = draw_rig(rig_seed, kind, scale, room)
    voltages = (
        square_and_chirp(DURATION, 1.0),
        square_and_chirp(DURATION, 2.0),
        multisines(DURATION, rng),
        multisines(DURATION, rng),
    )
    *train, held = (simulate_log(rig, v, s) for v, s in zip(voltages, log_seeds, strict=True))
    return BlindRig(tuple(train), held, rig)
