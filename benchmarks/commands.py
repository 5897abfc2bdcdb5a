"""Time of whole commands: `heli --help`, and `heli diagnose` with four logs, cold and warm.

Cold: HELI_CACHE_DIR is empty, so numba compiles everything. Warm: the cache holds the code that the cold run compiled.
"""

from functools import partial
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryDirectory

from benchmarks.campaign_speed import heli
from benchmarks.machine import measured_at
from benchmarks.tables import Bar, bar_table, seconds, table
from benchmarks.timing import in_turn
from heli_identifier.records import demo_logs, read_log

ROUNDS = 3
RIGS = {"rig-a": "one effect found", "rig-c": "nothing found"}


def diagnose(rig: str, cache: Path, cold: bool) -> None:
    """Diagnose a demonstration rig, three logs to fit and one held out."""
    if cold:
        rmtree(cache, ignore_errors=True)
    training, held_out = (list(map(str, logs)) for logs in demo_logs(rig))
    with TemporaryDirectory() as output:
        heli("diagnose", *training, "--validate", *held_out, "--output", output + "/out", HELI_CACHE_DIR=str(cache))


def section(load: float) -> str:
    with TemporaryDirectory() as folder:
        cache = Path(folder) / "cache"
        (log,) = demo_logs("rig-a")[1]
        contenders = {"help": partial(heli, "--help"), "read": partial(read_log, log)}
        for rig in RIGS:
            # the order matters: the warm run uses the cache of the cold one
            contenders[f"{rig} cold"] = partial(diagnose, rig, cache, True)
            contenders[f"{rig} warm"] = partial(diagnose, rig, cache, False)
        heli("--help")
        read_log(log)
        times = in_turn(contenders, ROUNDS, warm_up=False)
    rows = [("`heli --help`", seconds(times["help"].median), seconds(times["help"].least))]
    reading = times["read"]
    rows.append(("`read_log` of 90 s in Python", seconds(reading.median), seconds(reading.least)))
    for rig, outcome in RIGS.items():
        for how in ("cold", "warm"):
            shown = times[f"{rig} {how}"]
            rows.append((f"`heli diagnose`, {rig}, {outcome}, {how}", seconds(shown.median), seconds(shown.least)))
    return "\n\n".join(
        [
            "## Whole commands",
            bar_table(
                [
                    Bar("`heli diagnose`, four logs of 90 s, cold", times["rig-a cold"].median, 8.0, "s"),
                    Bar("`heli diagnose`, four logs of 90 s, warm", times["rig-a warm"].median, 4.0, "s"),
                    Bar("`heli --help`", times["help"].median, 0.4, "s"),
                ]
            ),
            table(("command", "median", "least"), rows),
            f"{ROUNDS} rounds, wall time; commands in a process of their own. Cold: nothing compiled is cached.",
            measured_at(("numpy", "numba", "scipy"), load),
        ]
    )
