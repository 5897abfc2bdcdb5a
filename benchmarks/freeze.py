"""What the program says, recorded by one commit and compared with another: what a move leaves, and what it changes.

    python -m benchmarks freeze record FOLDER [--only KIND,...] [--most N]      what is there already is kept
    python -m benchmarks freeze compare OLD NEW

A kind is a folder, an entry a JSON file in it, of which ``--most`` of a kind are recorded. A long array is kept as the
hash of its bytes and every so many of its numbers, so that a difference has a size. The comparison gives for each kind
how many entries have the same bits and the largest relative difference of a number, and names what has come, gone or
another text. It ends with 1 if anything differs.
"""

import hashlib
import json
import math
import re
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal
from zipfile import ZipFile

import numpy as np

import heli_identifier as hi
from benchmarks.follow import flown
from benchmarks.rigs import log_of
from fmu_src import SCENARIOS, UNITS, build
from fmu_src.master import run_apart
from fmu_src.native import NATIVE_UNITS, build_native
from heli_identifier.files import write_atomically
from tests.blind.generator import BATTERY, Case
from tests.faults.case import Fault, tried
from tests.faults.page import FAULTS

VOLATILE = ("seconds", "provenance", "file", "sha256", "path")
"""Keys of what differs from run to run."""

SHOWN = 500
"""Most numbers that are kept of an array."""


def shown(values: Any) -> dict[str, Any]:
    """Give an array as the hash of its bytes and evenly chosen numbers."""
    array = np.ascontiguousarray(values, dtype=float)
    chosen = array.ravel()[:: max(1, math.ceil(array.size / SHOWN))]
    return {"shape": array.shape, "hash": hashlib.sha256(array.tobytes()).hexdigest(), "numbers": chosen.tolist()}


def steady(document: Any) -> Any:
    """Give a document without what differs from run to run."""
    if isinstance(document, dict):
        return {key: steady(value) for key, value in document.items() if key not in VOLATILE}
    return [steady(value) for value in document] if isinstance(document, list | tuple) else document


# --- what is recorded --------------------------------------------------------------------------------------------


def diagnosed(case: Case) -> Any:
    """Diagnose a rig of the blind battery."""
    rig = case.rig(0)
    logs = [log_of(f"train{number}", 100.0, samples) for number, samples in enumerate(rig.train, 1)]
    return steady(hi.diagnose(logs, held_out=[log_of("held1", 100.0, rig.held)]).to_dict())


def identified(rig: str, method: str) -> Any:
    """Give the histories of the on-line identifier over the logs of a demonstration rig."""
    found = hi.identify([hi.read_log(path) for path in hi.demo_logs(rig)[0]], method=method)
    histories = {one.name: [shown(one.parameters), shown(one.standard_errors)] for one in found.histories}
    return {"document": steady(found.to_dict()), "histories": histories}


def simulated(name: str, make: Callable[..., Path]) -> Any:
    """Give every output of a scenario's units over 20 s."""
    with TemporaryDirectory() as folder:
        fmus = {unit: make(kind, Path(folder)) for unit, kind in SCENARIOS[name].units}
        run = run_apart(name, 20.0, 0.01, {"plant.encoder.enabled": True}, fmus)
    return {output: shown(run.column(output)) for output in run.names}


def described(unit: str, make: Callable[..., Path]) -> Any:
    """Give the model description of a unit, without identifiers and dates."""
    with TemporaryDirectory() as folder, ZipFile(make(unit, Path(folder))) as fmu:
        text = fmu.read("modelDescription.xml").decode()
    return re.sub(r'(guid|instantiationToken|generationDateAndTime)="[^"]*"', "", text).splitlines()


def answered(fault: Fault) -> Any:
    """Give exit code, sentence and what is left of a fault."""
    with TemporaryDirectory() as folder:
        answer = tried(fault, Path(folder))
    return [answer.code, answer.sentence, list(answer.left)]


BUILDS: dict[str, Callable[..., Path]] = {"python": build, "native": build_native}
KINDS: dict[str, dict[str, Callable[[], Any]]] = {
    "battery": {f"{case.group} {case.kind} {case.scale:g}": partial(diagnosed, case) for case in BATTERY},
    "flights": {
        kind: partial(flown, 2, 400, kind) for kind in ("k_x", "friction_elevation", "mass", "stuck", "loss")
    },
    "identifier": {
        f"{rig} {method}": partial(identified, rig, method)
        for rig in ("rig-a", "rig-b", "rig-c")
        for method in ("adaptation", "prediction_error")
    },
    "scenarios": {
        f"{name} {word}": partial(simulated, name, make)
        for name in ("open_loop", "closed_loop")
        for word, make in BUILDS.items()
    },
    "units": {
        f"{unit} {word}": partial(described, unit, make)
        for word, make in BUILDS.items()
        for unit in (NATIVE_UNITS if word == "native" else UNITS)
    },
    "messages": {f"{section} {fault.what}": partial(answered, fault) for section, fault in FAULTS if not fault.shell},
}
"""What is recorded: entries with what makes their content; of faults those that need no process of their own."""


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


def compared(old: Path, new: Path, kind: str) -> bool:
    """Print what differs in the entries of a kind; give whether nothing does."""
    olds, news = ({p.name: json.loads(p.read_text()) for p in (folder / kind).glob("*.json")} for folder in (old, new))
    lines = [f"  only in {old if name in olds else new}: {name}" for name in sorted(olds.keys() ^ news.keys())]
    found = {name: list(differences(olds[name], news[name])) for name in sorted(olds.keys() & news.keys())}
    sizes = [(size, f"{name}{place}") for name, own in found.items() for size, place in own if size < math.inf]
    for name, own in found.items():
        others = [f"  {name}{text[:300]}" for size, text in own if size == math.inf]
        lines += others[:3] + ([f"  {name}: {len(others) - 3} more"] if len(others) > 3 else [])
    largest = "; largest relative difference {:.1e} ({})".format(*max(sizes)) if sizes else ""
    equal = sum(not own for own in found.values())
    print(f"{kind}: {equal} of {len(found)} with the same bits{largest}", *lines, sep="\n")
    return equal == len(found) and not lines


def freeze(
    what: Literal["record", "compare"], folders: list[Path], only: str = ",".join(KINDS), most: int = 1000
) -> None:
    """Record or compare."""
    if what == "compare":
        old, new = folders
        kinds = sorted({path.parent.name for folder in folders for path in folder.glob("*/*.json")})
        sys.exit(not all([compared(old, new, kind) for kind in kinds]))
    for kind in only.split(","):
        for name, made in list(KINDS[kind].items())[:most]:
            path = folders[0] / kind / f"{re.sub(r'[^A-Za-z0-9_.+-]+', '-', name)[:120]}.json"
            if not path.exists():
                path.parent.mkdir(parents=True, exist_ok=True)
                write_atomically(path, json.dumps(made(), indent=1, ensure_ascii=False))
                print(path, flush=True)
