"""What the program says, recorded by one commit and compared with another: what a move leaves, and what it changes.

    python -m benchmarks freeze record FOLDER [--only KIND,...] [--most N]      what is there already is kept
    python -m benchmarks freeze compare OLD NEW

A kind is a folder, an entry a JSON file in it. A long array is kept as the hash of its bytes and every so many of its
numbers, so that a difference has a size. The comparison gives for each kind how many entries have the same bits and the
largest relative difference of a number, and names what has come, gone or another text. It ends with 1 if anything
differs.
"""

import hashlib
import json
import math
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zipfile import ZipFile

import numpy as np

import heli_identifier as hi
from benchmarks.follow import flown
from benchmarks.rigs import log_of
from fmu_src import SCENARIOS, UNITS, build
from fmu_src.master import run_apart
from fmu_src.native import NATIVE_UNITS, build_native
from heli_identifier.files import write_atomically
from tests.blind.generator import BATTERY
from tests.faults.case import Fault, tried
from tests.faults.page import FAULTS

Entries = Iterator[tuple[str, Callable[[], Any]]]
"""Names of entries, each with what makes its content."""

VOLATILE = ("seconds", "provenance", "file", "sha256", "path")
"""Keys of what differs from run to run."""

RIGS = ("rig-a", "rig-b", "rig-c")

SHOWN = 500
"""Most numbers that are kept of an array."""


def shown(values: Any) -> dict[str, Any]:
    """Give an array as the hash of its bytes and evenly chosen numbers."""
    array = np.ascontiguousarray(values, dtype=float)
    flat = array.ravel()
    chosen = flat[:: max(1, math.ceil(len(flat) / SHOWN))]
    return {
        "shape": list(array.shape),
        "hash": hashlib.sha256(array.tobytes()).hexdigest(),
        "numbers": chosen.tolist(),
    }


def steady(document: Any) -> Any:
    """Give a document without what differs from run to run."""
    if isinstance(document, dict):
        return {key: steady(value) for key, value in document.items() if key not in VOLATILE}
    return [steady(value) for value in document] if isinstance(document, list | tuple) else document


# --- what is recorded --------------------------------------------------------------------------------------------


def battery(most: int) -> Entries:
    """Documents of rigs of the blind battery, spread evenly over its cases."""

    def made(case: Any) -> Any:
        rig = case.rig(0)
        logs = [log_of(f"train{number}", 100.0, samples) for number, samples in enumerate(rig.train, 1)]
        return steady(hi.diagnose(logs, held_out=[log_of("held1", 100.0, rig.held)]).to_dict())

    for case in [BATTERY[int(k * len(BATTERY) / most)] for k in range(min(most, len(BATTERY)))]:
        yield f"{case.group} {case.kind} {case.scale:g}", partial(made, case)


def flights(most: int) -> Entries:
    """Followed flights: events, adoptions and errors of the twin's predictions."""
    for kind in ("k_x", "friction_elevation", "mass", "stuck", "loss")[:most]:
        yield kind, partial(flown, 2, 400, kind)


def identifier(most: int) -> Entries:
    """Histories of the on-line identifier over the demonstration's logs."""

    def made(rig: str, method: str) -> Any:
        found = hi.identify([hi.read_log(path) for path in hi.demo_logs(rig)[0]], method=method)
        histories = {one.name: [shown(one.parameters), shown(one.standard_errors)] for one in found.histories}
        return {"document": steady(found.to_dict()), "histories": histories}

    for rig in RIGS[:most]:
        for method in ("adaptation", "prediction_error"):
            yield f"{rig} {method}", partial(made, rig, method)


def scenarios(most: int) -> Entries:
    """Every output of the scenarios' units over 20 s, in Python and natively."""

    def made(name: str, native: bool) -> Any:
        with TemporaryDirectory() as folder:
            units = dict(SCENARIOS[name].units)
            fmus = {unit: (build_native if native else build)(kind, Path(folder)) for unit, kind in units.items()}
            run = run_apart(name, 20.0, 0.01, {"plant.encoder.enabled": True}, fmus)
        return {output: shown(run.column(output)) for output in run.names}

    for name in ("open_loop", "closed_loop")[:most]:
        for native in (False, True):
            if not native or all(kind in NATIVE_UNITS for _, kind in SCENARIOS[name].units):
                yield f"{name} {'native' if native else 'python'}", partial(made, name, native)


def units(most: int) -> Entries:
    """Model descriptions of every unit, without identifiers and dates."""

    def made(unit: str, native: bool) -> Any:
        with TemporaryDirectory() as folder, ZipFile((build_native if native else build)(unit, Path(folder))) as fmu:
            text = fmu.read("modelDescription.xml").decode()
        return re.sub(r'(guid|instantiationToken|generationDateAndTime)="[^"]*"', "", text).splitlines()

    for native in (False, True):
        for unit in list(NATIVE_UNITS if native else UNITS)[:most]:
            yield f"{unit} {'native' if native else 'python'}", partial(made, unit, native)


def messages(most: int) -> Entries:
    """Exit code and sentence of every fault of tests/faults that needs no process of its own."""

    def made(fault: Fault) -> Any:
        with TemporaryDirectory() as folder:
            answer = tried(fault, Path(folder))
        return [answer.code, answer.sentence, list(answer.left)]

    for section, fault in [pair for pair in FAULTS if not pair[1].shell][:most]:
        yield f"{section} {fault.what}", partial(made, fault)


KINDS: dict[str, tuple[Callable[[int], Entries], int]] = {
    "battery": (battery, 67),
    "flights": (flights, 5),
    "identifier": (identifier, 3),
    "scenarios": (scenarios, 2),
    "units": (units, 9),
    "messages": (messages, 1000),
}
"""What is recorded, and how many entries of each, or of each sort within it, at most."""


def record(folder: Path, only: Sequence[str], most: int) -> None:
    """Write the entries that are not there yet."""
    for kind in only:
        entries, usual = KINDS[kind]
        for name, made in entries(min(usual, most)):
            path = folder / kind / f"{re.sub(r'[^A-Za-z0-9_.+-]+', '-', name)[:120]}.json"
            if not path.exists():
                path.parent.mkdir(parents=True, exist_ok=True)
                write_atomically(path, json.dumps(made(), indent=1, ensure_ascii=False))
                print(path.relative_to(folder), flush=True)


# --- comparison --------------------------------------------------------------------------------------------------


def leaves(document: Any, place: str = "") -> Iterator[tuple[str, Any]]:
    """Give every value of a document that holds no others, behind its place."""
    entries = dict(enumerate(document)) if isinstance(document, list) else document
    if not entries or not isinstance(entries, dict):
        yield place, document
        return
    for key, value in entries.items():
        yield from leaves(value, f"{place}.{key}")


def differences(old: Any, new: Any) -> Iterator[tuple[float, str]]:
    """Give what differs: the relative difference of two numbers, infinite for everything else, and its place."""
    olds, news = dict(leaves(old)), dict(leaves(new))
    for place in {**olds, **news}:
        one, other = olds.get(place, "nothing"), news.get(place, "nothing")
        if one == other or (one != one and other != other):
            continue
        if place.endswith(".hash"):
            yield 0.0, f"{place}: other bits"
        elif all(isinstance(own, int | float) and not isinstance(own, bool) for own in (one, other)):
            yield abs(one - other) / max(abs(one), abs(other)), place
        else:
            yield math.inf, f"{place}: {one!r} became {other!r}"


def compare(old: Path, new: Path) -> bool:
    """Print what differs between two folders; give whether nothing does."""
    same = True
    for kind in sorted({path.parent.name for folder in (old, new) for path in folder.glob("*/*.json")}):
        olds, news = ({path.name for path in (folder / kind).glob("*.json")} for folder in (old, new))
        apart = {old: sorted(olds - news), new: sorted(news - olds)}
        lines = [f"  only in {folder}: {', '.join(own)}" for folder, own in apart.items() if own]
        equal, largest, where = 0, 0.0, ""
        for name in sorted(olds & news):
            pair = [json.loads((folder / kind / name).read_text(encoding="utf-8")) for folder in (old, new)]
            found = list(differences(*pair))
            equal += not found
            size, place = max((one for one in found if one[0] < math.inf), default=(0.0, ""))
            if place and size >= largest:
                largest, where = size, f"; largest relative difference {size:.1e} ({name}{place})"
            others = [f"  {name}{text[:300]}" for size, text in found if size == math.inf]
            lines += others[:3] + ([f"  {name}: {len(others) - 3} more"] if len(others) > 3 else [])
        print(f"{kind}: {equal} of {len(olds & news)} with the same bits{where}", *lines, sep="\n")
        same = same and equal == len(olds & news) and not lines
    return same


def freeze(what: str, folders: list[Path], only: str = ",".join(KINDS), most: int = 1000) -> None:
    """Record or compare."""
    if what == "record":
        record(folders[0], only.split(","), most)
    elif what == "compare":
        sys.exit(not compare(*folders))
    else:
        sys.exit(__doc__)
