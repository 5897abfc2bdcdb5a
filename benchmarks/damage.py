"""Damaged logs of clean rigs: whether the rig is accused, and whether the damage is named.

    python -m benchmarks damage [--open 0:4] [--flown 0:4] [--both 0:4] [--workers N] [DAMAGE...]

DAMAGE are words of the damages' names. Rigs of the blind generator in open loop, clean or (``both``) with one of the
battery's effects, and bare windy rigs under a controller whose references are logged; every damage of
:mod:`tests.blind.damage` strikes all logs of a rig. Printed is a line for each damage: rigs of which an effect is shown
that they do not have, rigs whose damage a told test sees (the simplified model loses 8 nats by it), those of them whose
damage is named or whose logs are refused by its name, the same with an effect, where that has to be named as well, and
what was said.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

import pandas

from benchmarks.harness import Words, count, in_parallel, span, table
from benchmarks.rigs import DETECTABLE, likelihood_of, log_of, struck, windy_log
from heli_identifier.chain import FAULTS
from heli_identifier.errors import IdentifierError
from heli_identifier.records import Log
from heli_identifier.tracing import diagnose, fit
from tests.blind.damage import DAMAGES
from tests.blind.generator import SINGLE, make_rig
from tests.blind.windy import windy_rig

SAID = {
    "drifts": "drift", "late": "late", "filter": "low pass|filtered|late", "play": "backlash", "slips": "slip",
    "counts": "counts|rest", "cut": "rounded", "clipped": "clipped", "copy": "same numbers",
    "twice": "too large|counts", "times": "scale|rotor_mismatch", "sign": "SIGN|wrong sign",
    "[deg]": "was read as", "[rad]": "was read as", "folded": "whole turn", "jitters": "jitter", "fast": "clock",
}  # fmt: skip
"""What names a damage, by a word of its own name."""


def effect_of(seed: int, damage: str) -> str:
    """Choose the effect beside a damage: all kinds take turns."""
    return SINGLE[(list(DAMAGES).index(damage) + 7 * seed) % len(SINGLE)]


def logs_of(kind: str, seed: int, effect: str = "clean") -> Iterator[Log]:
    """Make the logs of a rig, the last one to be held out."""
    if kind != "flown":
        rig = make_rig(9000 + seed, effect)
        return (log_of(f"log {i}", 100.0, log) for i, log in enumerate((*rig.train, rig.held)))
    flown = windy_rig(500 + seed, "ou", False, 100.0, "bare", True, {"a": 4, "b": 0, "t": 1, "c": 0})
    return (windy_log(name, own) for name, own in flown.logs.items())


def told_sees(sound: Sequence[Log], struck: Sequence[Log]) -> bool:
    """Whether the simplified model tells damaged logs from what they were."""
    fitted = [fit(own, own.rig.base).value for own in map(likelihood_of, (sound, struck))]
    return fitted[1] - fitted[0] > DETECTABLE


def diagnosed(job: tuple[str, int, str]) -> dict[str, Any]:
    """Diagnose a rig whose logs are damaged; say what is shown that it has and has not, and whether it is named."""
    kind, seed, damage = job
    true = effect_of(seed, damage) if kind == "both" else "clean"
    sound = list(logs_of(kind, seed, true))
    made = [struck(log, damage) for log in sound]
    told = told_sees(sound[:-1], made[:-1])
    row: dict[str, Any] = {"kind": kind, "seed": seed, "damage": damage, "told": told, "shown": set()}
    try:
        found = diagnose(made[:-1], held_out=made[-1:])
    except IdentifierError as error:
        said = f"refused: {error}"
    else:
        faults = {fault.name for fault in FAULTS}
        row["shown"] = {
            f"{effect.name}/{effect.axis}"
            for effect in found.effects
            if not faults & {name for name, _ in effect.alternatives}  # "one of these two" is no accusation
        }
        words = [f"{fault.name}/{fault.channel}" for fault in found.faults]
        words += sorted({f"slip/{event.axis}" for event in found.events if event.kind == "slip"})
        words += [word for word in ("WRONG SIGN", "does not belong") if any(word in note for note in found.notes)]
        words += [f"or {name}/{axis}" for effect in found.effects for name, axis in effect.alternatives]
        said = ", ".join(words)
    own = {effect for effect in row["shown"] if kind == "both" and effect.split("/")[0] == true}
    named = told and is_named(damage, said)
    return row | {"said": said, "named": named, "false": bool(row["shown"] - own), "both": bool(own) and named}


def is_named(damage: str, said: str) -> bool:
    """Whether what was said names the damage."""
    words = next((own for word, own in SAID.items() if word in damage), "")
    return bool(words) and any(word in said for word in words.split("|"))


def damage(damages: Words, open: str = "0:4", flown: str = "0:4", both: str = "0:4", workers: int = 1) -> None:
    """Run the benchmark."""
    kinds = {"open": open, "flown": flown, "both": both}
    names = [name for name in DAMAGES if not damages or any(word in name for word in damages)]
    jobs = [(kind, seed, name) for name in names for kind, seeds in kinds.items() for seed in span(seeds)]
    done = []
    for row in in_parallel(diagnosed, jobs, workers):
        done.append(row)
        told, shown = f"told {row['told']}", f"shown {sorted(row['shown'])}"
        print(f"{row['kind']} {row['seed']}", row["damage"], told, shown, row["said"][:90], sep=" | ", flush=True)
    found, lines = pandas.DataFrame(done), []
    for name, own in found.groupby("damage", sort=False):
        alone = own[own.kind != "both"]
        pairs = own[(own.kind == "both") & own.told & ~own.said.str.startswith("refused")]
        words = Counter(word for shown, said in zip(alone.shown, alone.said, strict=True)
                        for word in (*shown, said[:60] or "-"))  # fmt: skip
        said = "; ".join(f"{word} {n}" for word, n in words.most_common(4))
        lines.append((name, len(alone), own.false.sum(), alone.told.sum(), alone.named.sum(), count(pairs.both), said))
    head = ("damage", "rigs", "a wrong effect shown", "a told test sees it", "of these named", "both named", "said")
    print("\n" + table(head, lines))
