"""The logs of a rig, three to train on and one held out, and the battery of rigs; the truth stays aside.

    for case in BATTERY:
        for index in range(case.count):
            rig = case.rig(index)
            ...diagnose rig.train, rig.held; compare with rig.truth

Seeds come from a digest of the case, so that no two cases share a rig and none can be told from a seed's size.
"""

import hashlib
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.blind.plant import STEP, Push, fly, push_torque, room_torque
from tests.blind.rigs import DURATION, ENCODER_SHAKE, ROOM_TIME, ROOM_TORQUE, STRENGTHS, Rig, draw_rig
from tests.blind.signals import SAMPLE, multisines, square_and_chirp

_DECIMALS = (2, 5, 5, 6, 6, 6)
"""Of time [s], two voltages [V] and three angles [rad], as a file holds them."""

_PITCH_OFF, _ELEVATION_SHARE = 0.03, 0.9
"""A log starts at rest, pitch this near to theta0 [rad] and elevation at this share of its trim."""


class BlindRig(NamedTuple):
    """Three training logs and a held-out one, and the truth that they must not tell.

    A log has the shape (n, 6): time [s], two voltages [V], three angles [rad].
    """

    train: tuple[NDArray[np.float64], ...]
    held: NDArray[np.float64]
    truth: Rig


def simulate_log(
    rig: Rig, voltages: NDArray[np.floating], seed: int | np.random.SeedSequence, pushes: Sequence[Push] = ()
) -> NDArray[np.float64]:
    """Simulate a log under voltages (n, 2) that are held over 10 ms [V], as a file holds it, shape (n, 6).

    Start, room and encoders follow the seed.
    """
    rng = np.random.default_rng(seed)
    p = rig.base
    pitch = p.theta0 + rng.uniform(-_PITCH_OFF, _PITCH_OFF)
    trim = (p.k_z * voltages[0].sum() * np.cos(pitch) - p.a_1) / p.a_e
    start = np.array([pitch, _ELEVATION_SHARE * trim, 0.0])
    strange = rig.strange(phase=float(rng.uniform(0, 2 * np.pi)))
    count = len(voltages)
    noise = rng.standard_normal((round(count * SAMPLE / STEP) + 1, 3))
    torque = room_torque(noise, ROOM_TORQUE, ROOM_TIME)
    torque += push_torque(len(torque), pushes)
    shake = ENCODER_SHAKE * rng.standard_normal((count, 3))
    read, *_ = fly(voltages, start, rig.coefficients(), torque, shake, strange=strange)
    log = np.column_stack([SAMPLE * np.arange(count), voltages, read])
    return np.column_stack([column.round(n) for column, n in zip(log.T, _DECIMALS, strict=True)])


def make_rig(seed: int, kind: str = "clean", scale: float = 1.0) -> BlindRig:
    """Draw a rig and make its logs: training, the paper's two experiments and multisines; held out, other multisines.

    Excitation and base parameters depend on the seed alone: rigs of one seed differ in their effect only.
    """
    rig_seed, phase_seed, *log_seeds = np.random.SeedSequence(seed).spawn(6)
    rng = np.random.default_rng(phase_seed)
    rig = draw_rig(rig_seed, kind, scale)
    voltages = (
        square_and_chirp(DURATION, 1.0),
        square_and_chirp(DURATION, 2.0),
        multisines(DURATION, rng),
        multisines(DURATION, rng),
    )
    *train, held = (simulate_log(rig, v, s) for v, s in zip(voltages, log_seeds, strict=True))
    return BlindRig(tuple(train), held, rig)


# --- the battery: which kinds of rig, how many of each, at which share of their strength ---------------------------


class Case(NamedTuple):
    """One line of the battery: its group, a kind as for `draw_rig`, how many rigs, and the share of the strength.

    Groups are clean, single, weak, pair, unknown, and beyond (in the catalogue, but in no bar).
    """

    group: str
    kind: str
    count: int
    scale: float = 1.0

    def rig(self, index: int) -> BlindRig:
        """Make one rig of the case."""
        digest = hashlib.sha256(f"{self.kind} {self.scale} {index}".encode()).digest()
        return make_rig(int.from_bytes(digest[:8], "big"), self.kind, self.scale)


SINGLE, BEYOND = tuple(STRENGTHS)[:16], tuple(STRENGTHS)[16:]
"""Effects of the bars, and those of the catalogue that no bar names."""

PAIRS = (
    "dry_friction:pitch+quadratic_drag:travel",
    "quadratic_thrust+moving_mass",
    "input_delay+dry_friction:elevation",
    "rotor_mismatch+cable_stiffness",
    "thrust_fade+gyroscopic_coupling",
    "quadratic_drag:pitch+arm_bending",
)
"""Two effects on different parts."""

UNKNOWN = ("unknown:periodic", "unknown:detent", "unknown:travel_angle")

WEAK = 0.35
"""Share of the strengths in the group of weak effects."""

BATTERY = (
    Case("clean", "clean", 200),
    *(Case("single", kind, 20) for kind in SINGLE),
    *(Case("weak", kind, 20, WEAK) for kind in SINGLE),
    *(Case("pair", kind, 20) for kind in PAIRS),
    *(Case("unknown", kind, 20) for kind in UNKNOWN),
    *(Case("beyond", kind, 20) for kind in BEYOND),
)
