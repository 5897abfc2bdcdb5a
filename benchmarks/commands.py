"""Time of whole commands: `heli --help`, `heli diagnose` with four logs cold and warm, `heli campaign` on two cores.

Cold: HELI_CACHE_DIR is empty, so numba compiles everything. Warm: the cache holds what the cold run compiled.
"""

import os
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.harness import ROOT, Bar, Times, Work, bar_table, figure, in_turn, measured_at, ratio, seconds, table
from heli_identifier.records import demo_logs, read_log

ROUNDS, CAMPAIGN_ROUNDS, COPIES = 3, 2, 8
RIGS = ("rig-a", "rig-b", "rig-c")


def heli(*arguments: str, **environment: str) -> None:
    """Run a command to its end, by an interpreter that keeps bytecode, as it does unless told otherwise.

    Raises
    ------
    RuntimeError
        If it fails.
    """
    told = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    command = [sys.executable, "-c", "from heli_command import main; main()", *arguments]
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, env={**told, "PYTHONPATH": str(ROOT), **environment}
    )
    if done.returncode:
        raise RuntimeError(f"heli {' '.join(arguments)} failed: {done.stderr[-1500:]}")


def diagnose(rig: str, cache: Path, cold: bool) -> None:
    """Diagnose a demonstration rig, three logs to fit and one held out."""
    if cold:
        shutil.rmtree(cache, ignore_errors=True)
    training, held_out = (list(map(str, logs)) for logs in demo_logs(rig))
    with TemporaryDirectory() as output:
        heli("diagnose", *training, "--validate", *held_out, "--output", output + "/out", HELI_CACHE_DIR=str(cache))


def commands() -> str:
    """Measure single commands."""
    with TemporaryDirectory() as folder:
        cache = Path(folder) / "cache"
        (log,) = demo_logs("rig-a")[1]
        contenders: dict[str, Work] = {
            "`heli --help`": partial(heli, "--help"),
            "`read_log` of 90 s in Python": partial(read_log, log),
            # the order matters: the warm run uses the cache of the cold one
            "`heli diagnose`, rig-a, cold": partial(diagnose, "rig-a", cache, True),
            "`heli diagnose`, rig-a, warm": partial(diagnose, "rig-a", cache, False),
            "`heli diagnose`, rig-c, warm": partial(diagnose, "rig-c", cache, False),
        }
        heli("--help")
        read_log(log)
        times = in_turn(contenders, ROUNDS, warm_up=False)
    asked = {"`heli --help`": 0.25, "`heli diagnose`, rig-a, cold": 8.0, "`heli diagnose`, rig-a, warm": 4.5}
    return "\n\n".join(
        [
            "## Whole commands",
            bar_table(Bar(what, times[what].median, bound, "s") for what, bound in asked.items()),
            table(("command", "median", "least"), [(w, seconds(t.median), seconds(t.least)) for w, t in times.items()]),
            f"{ROUNDS} rounds, wall time; commands in a process of their own. Four logs of 90 s a diagnosis; cold: "
            "nothing compiled is cached.",
            measured_at("numpy", "numba", "scipy"),
        ]
    )


def efficiency(one: Times, two: Times) -> float:
    """Speed of two workers over twice that of one."""
    return ratio(one, two) / 2.0


def campaign() -> str:
    """Measure a campaign with one and with two workers over copies of the demonstration rigs."""

    def run(folder: str, workers: int) -> None:
        with TemporaryDirectory() as output:
            heli("campaign", folder, "--output", output, "--workers", str(workers))

    with TemporaryDirectory() as folder, TemporaryDirectory() as warm:
        for rig in (f"{rig}-{copy}" for rig in RIGS for copy in range(COPIES)):
            Path(folder, rig).mkdir()
            for log in (log for logs in demo_logs(rig[:5]) for log in logs):
                shutil.copy(log, Path(folder, rig))
        heli("diagnose", *map(str, demo_logs("rig-a")[0]), "--output", f"{warm}/out")  # nothing compiles later
        times = in_turn({f"{n}": partial(run, folder, n) for n in (1, 2)}, CAMPAIGN_ROUNDS, warm_up=False)
    rigs, twice = len(RIGS) * COPIES, efficiency(*times.values())
    rows = [(n, seconds(t.median), seconds(t.least), figure(3600.0 * rigs / t.median)) for n, t in times.items()]
    return "\n\n".join(
        [
            "## Campaign",
            bar_table([Bar("speed of two workers over twice that of one", twice, 0.85, "", True)]),
            table(("workers", f"median for {rigs} rigs", "least", "rigs an hour"), rows),
            f"{CAMPAIGN_ROUNDS} rounds of the whole command, starting processes included; four logs of 90 s a rig.",
            measured_at("numpy", "numba", "distributed"),
        ]
    )
