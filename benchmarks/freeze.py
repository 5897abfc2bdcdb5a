"""What the program says, recorded by one commit and compared with another: what a move leaves, and what it changes.

    python -m benchmarks freeze record FOLDER [--only KIND,...] [--most N]      what is there already is kept
    python -m benchmarks freeze compare OLD NEW

A kind is a folder of at most ``--most`` entries, JSON files. The comparison names for each what differs, numbers with
their relative difference, and ends with 1 if anything does.
"""

import json
import re
import sys
from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal
from zipfile import ZipFile

import heli_identifier as hi
from benchmarks.follow import flight
from benchmarks.rigs import blind_rig
from fmu_src import UNITS, build
from fmu_src.master import run_apart
from fmu_src.native import NATIVE_UNITS
from heli_identifier.files import write_atomically
from heli_identifier.records import DEMO_RIGS
from tests.blind.generator import BATTERY
from tests.faults.case import try_fault
from tests.faults.page import FAULTS

VOLATILE = ("seconds", "provenance", "file", "sha256", "path")
"""Keys whose values differ from run to run, and are not compared."""

EVERY = 97
"""Of an array every 97th number is recorded."""


def record_diagnosis(kind: str, scale: float) -> Any:
    """Diagnose a rig of the blind battery."""
    return blind_rig(kind, scale, 0).diagnose().to_dict()


def record_identification(rig: str) -> Any:
    """Return the estimates of the on-line identifier over the logs of a demonstration rig."""
    result = hi.identify(hi.demo_logs(rig)[0])
    histories = {history.name: history.parameters.ravel()[::EVERY].tolist() for history in result.histories}
    return {"document": result.to_dict(), "histories": histories}


def record_scenario(scenario: str, language: str) -> Any:
    """Return every output of a scenario's units over 20 s."""
    run = run_apart(scenario, 20.0, 0.01, {"plant.encoder.enabled": True}, native=language == "C")
    return {output: run.column(output)[::EVERY].tolist() for output in run.names}


def record_description(unit: str, language: str) -> Any:
    """Return the model description of a unit, without identifiers and dates."""
    with TemporaryDirectory() as folder, ZipFile(build(unit, Path(folder), native=language == "C")) as fmu:
        text = fmu.read("modelDescription.xml").decode()
    return re.sub(r'(guid|instantiationToken|generationDateAndTime)="[^"]*"', "", text).splitlines()


def record_message(name: str) -> Any:
    """Return exit code and sentence of a fault, and the files that it leaves."""
    with TemporaryDirectory() as folder:
        answer = try_fault(MESSAGES[name], Path(folder))
    return [answer.code, answer.sentence, list(answer.left)]


MESSAGES = {f"{section} {fault.what}": fault for section, fault in FAULTS if not fault.shell}
"""Faults that need no separate process."""

KINDS: dict[str, tuple[Callable[..., Any], list[tuple[Any, ...]]]] = {
    "battery": (record_diagnosis, [(case.kind, case.scale) for case in BATTERY]),
    "flights": (flight, [(2, 400, kind) for kind in ("k_x", "friction_elevation", "mass", "stuck", "loss")]),
    "identifier": (record_identification, [(rig,) for rig in DEMO_RIGS]),
    "scenarios": (record_scenario, [*product(("open_loop", "closed_loop"), ("Python", "C"))]),
    "units": (record_description, [*product(UNITS, ("Python",)), *product(NATIVE_UNITS, ("C",))]),
    "messages": (record_message, [(name,) for name in MESSAGES]),
}
"""By kind the function that makes an entry, and the arguments of all entries; an entry is named after its arguments."""


def differences(old: Any, new: Any, place: str = "") -> Iterator[str]:
    """Yield what differs, and where; two NaN are equal."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in (key for key in {**old, **new} if key not in VOLATILE):
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
        old, new = ({path.relative_to(folder).as_posix(): json.loads(path.read_text())
                     for path in sorted(folder.glob("*/*.json"))} for folder in folders)  # fmt: skip
        lines = list(differences(old, new))
        print(*lines, f"{len({**old, **new})} entries, {len(lines)} differences", sep="\n")
        sys.exit(bool(lines))
    for kind in only.split(","):
        make, entries = KINDS[kind]
        for arguments in entries[:most]:
            name = re.sub(r"[^A-Za-z0-9_.+-]+", "-", " ".join(map(str, arguments)))
            path = folders[0] / kind / f"{name[:120]}.json"
            if not path.exists():
                path.parent.mkdir(parents=True, exist_ok=True)
                write_atomically(path, json.dumps(make(*arguments), indent=1, ensure_ascii=False))
                print(path, flush=True)
