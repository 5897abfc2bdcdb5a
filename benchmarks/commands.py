"""Time of whole commands: `heli --help`, `heli diagnose` with four logs cold and warm.

Cold: HELI_CACHE_DIR is empty, so numba compiles everything. Warm: the cache holds what the cold run compiled.
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter

from benchmarks.harness import ROOT, Bar, bar_table, section, table
from heli_identifier.records import demo_files, read_log
from heli_identifier.results import significant

ROUNDS = 3


def heli(*arguments: str, **environment: str) -> None:
    """Run a command to its end, by an interpreter that keeps bytecode, as it does unless told otherwise."""
    told = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    command = [sys.executable, "-c", "from heli_command import main; main()", *arguments]
    subprocess.run(command, capture_output=True, check=True, env={**told, "PYTHONPATH": str(ROOT), **environment})


def diagnose(rig: str, cache: Path, cold: bool) -> None:
    """Diagnose a demonstration rig, three logs to fit and one held out."""
    if cold:
        shutil.rmtree(cache, ignore_errors=True)
    training, held_out = (list(map(str, logs)) for logs in demo_files(rig))
    with TemporaryDirectory() as output:
        heli("diagnose", *training, "--validate", *held_out, "--output", output + "/out", HELI_CACHE_DIR=str(cache))


def commands() -> str:
    """Measure single commands in turn, so that a busy moment of the machine affects all of them."""
    with TemporaryDirectory() as folder:
        cache = Path(folder) / "cache"
        (log,) = demo_files("rig-a")[1]
        contenders: dict[str, Callable[[], object]] = {
            "`heli --help`": partial(heli, "--help"),
            "`read_log` of 90 s in Python": partial(read_log, log),
            # the order matters: the warm run uses the cache of the cold one
            "`heli diagnose`, rig-a, cold": partial(diagnose, "rig-a", cache, True),
            "`heli diagnose`, rig-a, warm": partial(diagnose, "rig-a", cache, False),
            "`heli diagnose`, rig-c, warm": partial(diagnose, "rig-c", cache, False),
        }
        heli("--help")
        read_log(log)
        times: dict[str, list[float]] = {name: [] for name in contenders}
        for _ in range(ROUNDS):
            for name, work in contenders.items():
                began = perf_counter()
                work()
                times[name].append(perf_counter() - began)
    asked = {"`heli --help`": 0.25, "`heli diagnose`, rig-a, cold": 8.0, "`heli diagnose`, rig-a, warm": 4.5}
    return section(
        "Whole commands",
        bar_table(Bar(what, median(times[what]), bound, "s") for what, bound in asked.items()),
        table(
            ("command", "median [s]", "least [s]"),
            [(what, significant(median(own)), significant(min(own))) for what, own in times.items()],
        ),
        f"{ROUNDS} rounds, wall time; commands in a process of their own. Four logs of 90 s a diagnosis; cold: "
        "nothing compiled is cached.",
        packages=("numpy", "numba", "scipy"),
    )
