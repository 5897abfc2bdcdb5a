"""Speed of `heli campaign` with two workers and with one, over the same rigs: whole commands, start-up included.

The rigs are copies of the demonstration rigs, equally many of each, and enough that the seconds for starting a cluster
matter little. One diagnosis runs before the timing, so that no run has to compile.
"""

import os
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.machine import measured_at
from benchmarks.tables import Bar, bar_table, figure, seconds, table
from benchmarks.timing import Times, in_turn, ratio
from heli_identifier.records import demo_logs

ROUNDS, COPIES = 2, 8
RIGS = ("rig-a", "rig-b", "rig-c")


def heli(*arguments: str, **environment: str) -> None:
    """Run a command of ours to its end, by an interpreter that keeps bytecode, as it does unless told otherwise.

    Raises
    ------
    RuntimeError
        If it fails.
    """
    command = [str(Path(sys.executable).with_name("heli")), *arguments]
    told = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env={**told, **environment})
    if done.returncode:
        raise RuntimeError(f"heli {' '.join(arguments)} failed: {done.stderr[-1500:]}")


def campaign(folder: Path, workers: int) -> None:
    """Run a campaign into an empty folder."""
    with TemporaryDirectory() as output:
        heli("campaign", str(folder), "--output", output, "--workers", str(workers))


def write_rigs(folder: Path) -> int:
    """Copy the rigs into a folder; returns their number."""
    for rig in RIGS:
        for copy in range(COPIES):
            own = folder / f"{rig}-{copy}"
            own.mkdir()
            for log in (log for logs in demo_logs(rig) for log in logs):
                shutil.copy(log, own)
    return len(RIGS) * COPIES


def efficiency(one: Times, two: Times) -> float:
    """Speed of two workers over twice that of one."""
    return ratio(one, two) / 2.0


def section(load: float) -> str:
    with TemporaryDirectory() as folder:
        rigs = write_rigs(Path(folder))
        logs = [str(log) for log in demo_logs("rig-a")[0]]
        heli("diagnose", *logs, "--output", str(Path(folder) / "warm"))
        shutil.rmtree(Path(folder) / "warm")
        times = in_turn({f"{n}": partial(campaign, Path(folder), n) for n in (1, 2)}, ROUNDS, warm_up=False)
    one, two = times["1"], times["2"]
    return "\n\n".join(
        [
            "## Campaign",
            bar_table([Bar("speed of two workers over twice that of one", efficiency(one, two), 0.85, "", True)]),
            table(
                ("workers", f"median for {rigs} rigs", "least", "rigs an hour"),
                [(n, seconds(t.median), seconds(t.least), figure(3600.0 * rigs / t.median)) for n, t in times.items()],
            ),
            f"{ROUNDS} rounds of the whole command `heli campaign`, starting processes included; {rigs} rigs of four "
            "logs of 90 s each.",
            measured_at(("numpy", "numba", "distributed"), load),
        ]
    )
