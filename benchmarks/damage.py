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
from dataclasses import replace

import numpy as np

from benchmarks.harness import Words, in_parallel, span, table
from benchmarks.rigs import DETECTABLE, likelihood_of, log_of, windy_log
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


def diagnosed(job: tuple[str, int, str]) -> tuple[set[str], str, bool]:
    """Damage the logs of one rig and diagnose them: effects shown, what names the damage, told."""
    kind, seed, damage = job
    effect = effect_of(seed, damage) if kind == "both" else "clean"
    made, sound = [], list(logs_of(kind, seed, effect))
    for log in sound:
        v, y = DAMAGES[damage](log.step * np.arange(log.samples, dtype=float), log.voltages, log.angles)
        made.append(replace(log, voltages=v, angles=y))
    told = told_sees(sound[:-1], made[:-1])
    try:
        found = diagnose(made[:-1], held_out=made[-1:])
    except IdentifierError as error:
        return set(), f"refused: {error}", told
    faults = {fault.name for fault in FAULTS}
    shown = {
        f"{effect.name}/{effect.axis}"
        for effect in found.effects
        if not faults & {name for name, _ in effect.alternatives}  # "one of these two" is no accusation
    }
    named = [f"{fault.name}/{fault.channel}" for fault in found.faults]
    named += sorted({f"slip/{event.axis}" for event in found.events if event.kind == "slip"})
    named += [word for word in ("WRONG SIGN", "does not belong") if any(word in note for note in found.notes)]
    rivals = [f"{name}/{axis}" for effect in found.effects for name, axis in effect.alternatives]
    return shown, ", ".join((*named, *(f"or {rival}" for rival in rivals))), told


def is_named(damage: str, said: str) -> bool:
    """Whether what was said names the damage."""
    words = next((own for word, own in SAID.items() if word in damage), "")
    return bool(words) and any(word in said for word in words.split("|"))


def damage(
    damages: Words,
    open: str = "0:4", flown: str = "0:4", both: str = "0:4", workers: int = 1,
) -> None:  # fmt: skip
    """Run the benchmark."""
    kinds = {"open": open, "flown": flown, "both": both}
    names = [name for name in DAMAGES if not damages or any(word in name for word in damages)]
    jobs = [(kind, seed, name) for name in names for kind, seeds in kinds.items() for seed in span(seeds)]
    made: dict[str, list[tuple[bool, set[str], set[str], str, bool, bool]]] = {name: [] for name in names}
    for (kind, seed, name), (shown, said, told) in zip(jobs, in_parallel(diagnosed, jobs, workers), strict=True):
        print(f"{kind} {seed} | {name} | told {told} | shown {sorted(shown)} | {said[:90]}", flush=True)
        true = {effect for effect in shown if kind == "both" and effect.split("/")[0] == effect_of(seed, name)}
        made[name].append((kind == "both", shown, true, said, told, told and is_named(name, said)))
    rows = []
    for name, own in made.items():
        alone = [one for one in own if not one[0]]
        pairs = [one for one in own if one[0] and one[4] and not one[3].startswith("refused")]
        words = Counter(word for _, shown, _, said, _, _ in alone for word in (*shown, said[:60] or "-"))
        rows.append(
            (name, len(alone), sum(bool(shown - true) for _, shown, true, *_ in own), sum(one[4] for one in alone),
             sum(one[5] for one in alone), f"{sum(bool(one[2]) and one[5] for one in pairs)} of {len(pairs)}",
             "; ".join(f"{word} {n}" for word, n in words.most_common(4)))
        )  # fmt: skip
    head = ("damage", "rigs", "a wrong effect shown", "a told test sees it", "of these named", "both named", "said")
    print("\n" + table(head, rows))
