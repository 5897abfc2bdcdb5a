"""The battery: which kinds of rig, how many of each, at which share of their strength.

    for case in BATTERY:
        for blind in case.rigs():
            ...diagnose blind.train, blind.held; compare with blind.truth

Seeds come from a digest of the case, so that no two cases share a rig and none can be told from a seed's size.
"""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass

from tests.blind.generator import BlindRig, make_rig


@dataclass(frozen=True)
class Case:
    """One line of the battery.

    Attributes
    ----------
    group
        clean, single, weak, pair, unknown or beyond (in the catalogue, but in no bar).
    kind
        As for `draw_rig`.
    count
        How many rigs.
    scale
        Share of the strength.
    """

    group: str
    kind: str
    count: int
    scale: float = 1.0

    def seed(self, index: int) -> int:
        """Seed of one rig of the case."""
        digest = hashlib.sha256(f"{self.kind} {self.scale} {index}".encode()).digest()
        return int.from_bytes(digest[:8], "big")

    def rig(self, index: int) -> BlindRig:
        """Make one rig of the case."""
        return make_rig(self.seed(index), self.kind, self.scale)

    def rigs(self, limit: int | None = None) -> Iterator[BlindRig]:
        """Make the case's rigs one after the other, at most `limit` of them."""
        for index in range(self.count if limit is None else min(limit, self.count)):
            yield self.rig(index)


SINGLE = (
    "dry_friction",
    "quadratic_drag",
    "gyroscopic_coupling",
    "airspeed_thrust_loss",
    "reverse_thrust_loss",
    "quadratic_thrust",
    "dead_zone",
    "input_delay",
    "motor_lag",
    "thrust_fade",
    "rotor_mismatch",
    "cable_stiffness",
    "arm_bending",
    "moving_mass",
    "inertial_coupling",
    "large_angle_gravity",
)
"""Effects of the bars."""

BEYOND = ("breakaway_friction", "constant_torque", "rotor_drag_torque", "pitch_gravity_coupling", "ground_effect")
"""Effects of the catalogue that no bar names."""

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
