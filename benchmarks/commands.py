"""Time of whole commands: `heli --help`, `heli diagnose` with four logs cold and warm.

Cold: HELI_CACHE_DIR is empty, so numba compiles everything. Warm: the cache holds what the cold run compiled.
"""

import os
import subprocess
import sys
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter

from benchmarks.harness import ROOT, Bar, bar_table, section
from heli_identifier.records import demo_files

ROUNDS = 3


def timed(folder: Path, *arguments: str) -> float:
    """Run a command to its end, by an interpreter that keeps bytecode, as it does unless told otherwise [s]."""
    told = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    told |= {"PYTHONPATH": str(ROOT), "HELI_CACHE_DIR": str(folder / "cache")}
    began = perf_counter()
    command = [sys.executable, "-P", "-m", "heli_command", *arguments]
    subprocess.run(command, capture_output=True, check=True, env=told, cwd=folder)
    return perf_counter() - began


def commands() -> str:
    """Measure single commands in turn, so that a busy moment of the machine affects all of them."""
    training, held_out = (list(map(str, logs)) for logs in demo_files("rig-a"))
    diagnose = ("diagnose", *training, "--validate", *held_out)
    rounds = []
    for _ in range(ROUNDS):
        with TemporaryDirectory() as name:
            runs = (("--help",), (*diagnose, "-o", "cold"), (*diagnose, "-o", "warm"))
            rounds.append([timed(Path(name), *words) for words in runs])
    help_, cold, warm = (median(times) for times in zip(*rounds, strict=True))
    bars = [
        Bar("`heli --help`", help_, 0.25, "s"),
        Bar("`heli diagnose`, rig-a, cold", cold, 8.0, "s"),
        Bar("`heli diagnose`, rig-a, warm", warm, 4.5, "s"),
    ]
    said = f"Median of {ROUNDS} rounds, wall time. Four logs of 90 s a diagnosis; cold: nothing compiled is cached."
    return section("Whole commands", bar_table(bars), said, packages=("numpy", "numba", "scipy"))
