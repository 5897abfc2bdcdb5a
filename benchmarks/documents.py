"""Write diagnosis.json of 67 rigs of the blind battery, and compare two such folders, as before and after a change.

Usage: python -m benchmarks.documents make FOLDER          with the code of one commit, then of another
       python -m benchmarks.documents compare OLD NEW

The comparison prints the rigs whose verdict or effects differ, and for effects, parameters, errors and catalogue the
largest relative difference with its place.
"""

import argparse
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

import heli_identifier as hi
from benchmarks.blind_rigs import blind_rig
from heli_identifier.files import write_atomically
from tests.blind.battery import BATTERY, Case

RIGS = 67
"""How many rigs, spread evenly over the cases of the battery."""

TWICE = ("clean", "single", "pair", "unknown")
"""Groups of which two rigs of a case take part; one of a case of the others."""

VOLATILE = ("seconds", "provenance", "file", "sha256")
"""Keys of what differs from run to run."""


def chosen() -> list[tuple[Case, int]]:
    """Cases with the number of a rig."""
    rows = [(case, i) for case in BATTERY for i in range(min(2 if case.group in TWICE else 1, case.count))]
    spacing = max(1.0, len(rows) / RIGS)
    return [rows[int(j * spacing)] for j in range(min(RIGS, len(rows)))]


def make(folder: Path) -> None:
    """Write one document per rig; those that are there already are kept."""
    folder.mkdir(parents=True, exist_ok=True)
    for case, index in chosen():
        name = f"{case.group} {case.kind} {case.scale:g} {index}.json".replace(" ", "-")
        if not (folder / name).exists():
            rig = blind_rig(case.group, case.kind, case.count, case.scale, index)
            diagnosis = hi.diagnose(rig.training, held_out=rig.held_out)
            write_atomically(folder / name, json.dumps(diagnosis.to_dict()))
            print(name, diagnosis.verdict.value, flush=True)


def structure(document: dict[str, Any]) -> tuple[str, list[tuple[str, str, str]]]:
    """Verdict, and name, axis and verdict of every effect."""
    return document["verdict"], [(e["name"], e["axis"], e["verdict"]) for e in document["effects"]]


def differences(old: Any, new: Any, place: str = "") -> Iterator[tuple[float, str]]:
    """Relative differences of all numbers that both have, with their places."""
    if isinstance(old, dict):
        for key in old:
            if key in new and key not in VOLATILE:
                yield from differences(old[key], new[key], f"{place}.{key}")
    elif isinstance(old, list):
        for index, pair in enumerate(zip(old, new, strict=False)):
            yield from differences(*pair, f"{place}[{index}]")
    elif isinstance(old, int | float) and isinstance(new, int | float):
        yield abs(old - new) / max(abs(old), 1e-12), place


def compare(old: Path, new: Path) -> None:
    """Print what differs between two folders."""
    worst: dict[str, tuple[float, str]] = {}
    pairs = [(path, new / path.name) for path in sorted(old.glob("*.json")) if (new / path.name).exists()]
    for one, other in pairs:
        before, after = (json.loads(path.read_text(encoding="utf-8")) for path in (one, other))
        if structure(before) != structure(after):
            print(f"{one.name}: {structure(before)} became {structure(after)}")
        for part in ("effects", "parameters", "error", "catalogue"):
            found = max(differences(before[part], after[part]), default=(0.0, ""))
            worst[part] = max(worst.get(part, (0.0, "")), (found[0], f"{one.name}{found[1]}"))
    print(f"{len(pairs)} rigs")
    for part, (difference, place) in worst.items():
        print(f"{part}: largest relative difference {difference:.1e} ({place})")


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.documents", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("task", choices=("make", "compare"))
    parser.add_argument("folders", nargs="+", type=Path)
    asked = parser.parse_args(arguments)
    wanted = 1 if asked.task == "make" else 2
    if len(asked.folders) != wanted:
        parser.error(f"{asked.task} takes {wanted} folder{'s' if wanted > 1 else ''}, got {len(asked.folders)}")
    with threadpool_limits(1):
        (make if asked.task == "make" else compare)(*asked.folders)


if __name__ == "__main__":
    main()
