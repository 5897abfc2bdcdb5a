"""The field battery: which kinds of field rig, and how many of each.

    for case in FIELD_BATTERY:
        for rig in case.rigs():
            for half in rig.halves:
                ...diagnose half.train, half.held; compare with rig.truth and with the other half

Seeds come from a digest of the case, so that no two cases share a rig and none can be told from a seed's size; the
touched logs in open loop are the exception, being the clean ones with a touch put in.
"""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass

from tests.blind.field.generator import FieldRig, make_field_rig
from tests.blind.field.strengths import STRENGTHS


@dataclass(frozen=True)
class FieldCase:
    """One line of the battery.

    Attributes
    ----------
    group
        field, single, touched, clean or open.
    kind
        As for `draw_field_rig`.
    count
        How many rigs.
    scale
        Share of the strength of the drawn effects.
    touched
        Whether a hand disturbs some logs of each rig.
    """

    group: str
    kind: str
    count: int
    scale: float = 1.0
    touched: bool = False

    def seed(self, index: int) -> int:
        """Seed of one rig of the case."""
        kind = "open" if self.group == "open" else f"{self.kind} {self.scale} {self.touched}"
        digest = hashlib.sha256(f"field {kind} {index}".encode()).digest()
        return int.from_bytes(digest[:8], "big")

    def rig(self, index: int) -> FieldRig:
        """Make one rig of the case."""
        return make_field_rig(self.seed(index), self.kind, self.scale, self.touched)

    def rigs(self, limit: int | None = None) -> Iterator[FieldRig]:
        """Make the case's rigs one after the other, at most `limit` of them."""
        for index in range(self.count if limit is None else min(limit, self.count)):
            yield self.rig(index)


FIELD_BATTERY = (
    FieldCase("field", "field", 48),
    FieldCase("touched", "field", 16, touched=True),
    *(FieldCase("single", kind, 4) for kind in STRENGTHS),
    FieldCase("clean", "clean", 100),
    FieldCase("clean", "clean_linear", 100),
    FieldCase("clean", "clean_loop", 50),
    # Six logs of 90 s each: 54 clean ones, and the same 54 touched.
    FieldCase("open", "open_clean", 9),
    FieldCase("open", "open_touched", 9),
)
