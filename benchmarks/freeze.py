"""What the program says, recorded by one commit and compared with another: what a move leaves, and what it changes.

    python -m benchmarks freeze record FOLDER [--only KIND,...] [--most N]      what is there already is kept
    python -m benchmarks freeze compare OLD NEW

A kind is a folder, an entry a JSON file in it, of which ``--most`` of a kind are recorded. The comparison names for
each entry what differs, numbers with their relative difference, and ends with 1 if anything does.
"""

import json
import re
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal
from zipfile import ZipFile

import heli_identifier as hi
from benchmarks.follow import flown
from benchmarks.rigs import log_of
from fmu_src import SCENARIOS, UNITS, build
from fmu_src.master import run_apart
from fmu_src.native import NATIVE_UNITS
from heli_identifier.files import write_atomically
from tests.blind.generator import BATTERY, Case
from tests.faults.case import Fault, tried
from tests.faults.page import FAULTS

VOLATILE = ("seconds", "provenance", "file", "sha256", "path")
"""Keys of what differs from run to run."""

EVERY = 97
"""An array is recorded by each so many of its numbers."""


def steady(document: Any) -> Any:
    """Give a document without what differs from run to run."""
    if isinstance(document, dict):
        return {key: steady(value) for key, value in document.items() if key not in VOLATILE}
    return [steady(value) for value in document] if isinstance(document, list | tuple) else document


def diagnosed(case: Case) -> Any:
    """Diagnose a rig of the blind battery."""
    rig = case.rig(0)
    logs = [log_of(f"train{number}", 100.0, samples) for number, samples in enumerate(rig.train, 1)]
    return steady(hi.diagnose(logs, held_out=[log_of("held1", 100.0, rig.held)]).to_dict())


def identified(rig: str, method: str) -> Any:
    """Give the histories of the on-line identifier over the logs of a demonstration rig."""
    found = hi.identify(hi.demo_logs(rig)[0], method=method)
    histories = {one.name: one.parameters.ravel()[::EVERY].tolist() for one in found.histories}
    return {"document": steady(found.to_dict()), "histories": histories}


def simulated(name: str, make: Callable[..., Path]) -> Any:
    """Give every output of a scenario's units over 20 s."""
    with TemporaryDirectory() as folder:
        fmus = {unit: make(kind, Path(folder)) for unit, kind in SCENARIOS[name].units}
        run = run_apart(name, 20.0, 0.01, {"plant.encoder.enabled": True}, fmus)
    return {output: run.column(output)[::EVERY].tolist() for output in run.names}


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


BUILDS: dict[str, Callable[..., Path]] = {"python": build, "native": partial(build, native=True)}
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


def differences(old: Any, new: Any, place: str = "") -> Iterator[str]:
    """Say what differs, and where; numbers that are no number are the same."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in {**old, **new}:
            yield from differences(old.get(key), new.get(key), f"{place}.{key}")
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for number, pair in enumerate(zip(old, new, strict=True)):
            yield from differences(*pair, f"{place}.{number}")
    elif old != new and (old == old or new == new):
        numbers = isinstance(old, int | float) and isinstance(new, int | float)
        size = f"differ by {abs(old - new) / max(abs(old), abs(new)):.1e}: " if numbers else ""
        yield f"{place}: {size}{old!r} became {new!r}"[:300]


def freeze(
    what: Literal["record", "compare"], folders: list[Path], only: str = ",".join(KINDS), most: int = 1000
) -> None:
    """Record or compare."""
    if what == "compare":
        entries = sorted({path.relative_to(folder) for folder in folders for path in folder.glob("*/*.json")})
        found = []
        for entry in entries:
            there = [folder / entry for folder in folders if (folder / entry).exists()]
            pair = [json.loads(path.read_text()) for path in there]
            lines = list(differences(*pair)) if len(pair) == 2 else [f"only in {there[0].parent.parent}"]
            found += [f"{entry}{line}" for line in lines]
        print(*found, f"{len(entries)} entries, {len(found)} differences", sep="\n")
        sys.exit(bool(found))
    for kind in only.split(","):
        for name, made in list(KINDS[kind].items())[:most]:
            path = folders[0] / kind / f"{re.sub(r'[^A-Za-z0-9_.+-]+', '-', name)[:120]}.json"
            if not path.exists():
                path.parent.mkdir(parents=True, exist_ok=True)
                write_atomically(path, json.dumps(made(), indent=1, ensure_ascii=False))
                print(path, flush=True)
