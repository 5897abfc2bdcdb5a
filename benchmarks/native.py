"""Native units beside the pythonfmu units: doStep, the four-unit loop under three masters, start, memory, build.

Usage: python -m benchmarks native, or python -m benchmarks.native CASE ORDER STEPS for one case. Every case runs in a
process of its own, in turn within a round. A step of a native unit alone is measured in machine code, as a C host calls
it; the same loop calls a pythonfmu unit through ctypes, which is 2 us of its time.
"""

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from benchmarks import master_speed
from benchmarks.fmpy_masters import STEP
from benchmarks.machine import measured_at
from benchmarks.master_speed import GIVEN
from benchmarks.tables import Bar, bar_table, figure, table
from tests.c_hosts import described

ROUNDS = 5
LONG, SHORT = 100_000, 2_000
"""Steps of a native and of a pythonfmu unit in a round: some tenths of a second each."""

HOST = Path(__file__).parent.parent / "tests" / "hosts" / "native_host.c"


def _alone(order: dict, steps: int, unit: str, parameters: dict) -> float:
    """Step one native unit in machine code, its inputs at rest, nothing recorded."""
    from fmu_src import Scenario
    from fmu_src.master import run

    alone = Scenario("alone", f"{unit} alone", (("unit", unit),), ())
    given = {f"unit.{name}": value for name, value in parameters.items()}
    return run(alone, steps * STEP, STEP, given, {"unit": order["units"][unit]}, record=()).seconds


def native_plant_off(order: dict, steps: int) -> float:
    """Step HelicopterPlant with all effects off."""
    return _alone(order, steps, "HelicopterPlant", {})


def native_plant_on(order: dict, steps: int) -> float:
    """Step HelicopterPlant with every effect on."""
    from heli_plant.effects import CATALOGUE

    small = {f"effects.{e.name}.{e.axis}": 1e-3 * min(e.upper, 1.0) for e in CATALOGUE}
    return _alone(order, steps, "HelicopterPlant", {**small, "effects.input_delay.rotors": 0.034})


def native_identifier(order: dict, steps: int) -> float:
    """Step AdaptiveIdentifier on three axes."""
    return _alone(order, steps, "AdaptiveIdentifier", {"adaptation.hold_time": 0.0})


def prediction_errors(order: dict, steps: int) -> float:
    """Step AdaptiveIdentifier on three axes with prediction errors and the lag estimated, of either kind."""
    given = {"method": "prediction_error", "adaptation.hold_time": 0.0}
    return _alone(order, steps, "AdaptiveIdentifier", given)


NATIVE: dict[str, Callable[[dict, int], float]] = {
    "loop": master_speed.ours,
    "libcosim": master_speed.libcosimpy,
    "ecos": master_speed.ecos,
    "plant_off": native_plant_off,
    "plant_on": native_plant_on,
    "identifier": native_identifier,
    "prediction": prediction_errors,
}
PYTHON: dict[str, Callable[[dict, int], float]] = {
    "loop": master_speed.ours,
    "plant_off": master_speed.plant_off,
    "plant_on": master_speed.plant_on,
    "identifier": master_speed.identifier,
    "prediction": prediction_errors,
}
TITLES = {
    "loop": "closed loop of four units, our master",
    "libcosim": "the same, libcosim",
    "ecos": "the same, Ecos",
    "plant_off": "HelicopterPlant doStep, all effects off",
    "plant_on": "HelicopterPlant doStep, every effect on",
    "identifier": "AdaptiveIdentifier doStep, three axes",
    "prediction": "the same, prediction errors with the lag estimated",
}


def _orders(folder: Path) -> tuple[dict[str, dict], float, float]:
    """Build all units both ways; return the orders, and wall and processor seconds of the native build, cold."""
    from fmu_src import CLOSED_LOOP, build_all
    from fmu_src.native import NATIVE_UNITS
    from fmu_src.ssp import write_ssp

    began, before = time.perf_counter(), os.times()
    subprocess.run(
        [sys.executable, "-c", "from heli_identifier.cli import main; main()",
         "build", "--native", "--output", str(folder / "native")],
        check=True, capture_output=True, env={**os.environ, "ZIG_GLOBAL_CACHE_DIR": str(folder / "cache")},
    )  # fmt: skip
    seconds, after = time.perf_counter() - began, os.times()
    busy = after.children_user + after.children_system - before.children_user - before.children_system
    orders = {}
    for kind, files in (
        ("native", {unit: folder / "native" / f"{unit}.fmu" for unit in NATIVE_UNITS}),
        ("python", build_all(folder / "python")),
    ):
        fmus = {name: str(files[unit]) for name, unit in CLOSED_LOOP.units}
        ssp = write_ssp(CLOSED_LOOP, folder / f"{kind}.ssp", GIVEN, fmus)
        orders[kind] = {
            "units": {unit: str(path) for unit, path in files.items()},
            "fmus": fmus,
            "ssp": str(ssp),
            "parameters": {},
        }
    return orders, seconds, busy


def _seconds(kind: str, case: str, order: Path, steps: int) -> float:
    libraries = os.pathsep.join([str(Path(sys.prefix) / "lib"), os.environ.get("LD_LIBRARY_PATH", "")])
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.native", f"{kind}.{case}", str(order), str(steps)],
        capture_output=True, text=True, check=True, env={**os.environ, "LD_LIBRARY_PATH": libraries},
    )  # fmt: skip
    return float(done.stdout.split()[-1])


def _in_c_host(folder: Path, unit: str) -> tuple[float, float]:
    """Return what a C host with two instances of a native unit needs: first instance [ms], peak memory [MB]."""
    compiler = shutil.which("gcc")
    if compiler is None:
        return float("nan"), float("nan")
    program, opened = folder / "host", folder / "opened"
    subprocess.run([compiler, "-std=gnu11", "-O1", str(HOST), "-o", str(program), "-ldl", "-lm"], check=True)
    shutil.unpack_archive(folder / "native" / f"{unit}.fmu", opened, "zip")
    guid, _, references = described(opened)
    done = subprocess.run(
        [str(program), str(opened / f"binaries/linux64/{unit}.so"), guid, "2000", "-1", "", *references],
        check=True, capture_output=True, text=True,
    )  # fmt: skip
    said = {line.split()[0]: line.split()[2] for line in done.stderr.splitlines() if line[:4] in ("firs", "peak")}
    return float(said["first"]), float(said["peak"]) / 1024.0


def section(load: float) -> str:
    with TemporaryDirectory(prefix="heli-bench-") as name:
        folder = Path(name)
        orders, cold, busy = _orders(folder)
        files = {}
        for kind, order in orders.items():
            files[kind] = folder / f"{kind}.json"
            files[kind].write_text(json.dumps(order))
        taken: dict[tuple[str, str], list[float]] = {}
        for _ in range(ROUNDS):
            for kind, cases, steps in (("native", NATIVE, LONG), ("python", PYTHON, SHORT)):
                for case in cases:
                    per_step = 1e6 * _seconds(kind, case, files[kind], steps) / steps
                    taken.setdefault((kind, case), []).append(per_step)
        hosts = {unit: _in_c_host(folder, unit) for unit in ("HelicopterPlant", "AdaptiveIdentifier")}
        sizes = {kind: Path(orders[kind]["units"]["HelicopterPlant"]).stat().st_size / 1e3 for kind in orders}
    least = {key: min(values) for key, values in taken.items()}
    middle = {key: median(values) for key, values in taken.items()}
    own = least["native", "loop"]
    bars = [
        Bar("plant doStep, all effects off", least["native", "plant_off"], 0.3, "us"),
        Bar("plant doStep, every effect on", least["native", "plant_on"], 1.0, "us"),
        Bar("identifier doStep", least["native", "identifier"], 1.0, "us"),
        Bar("identifier doStep, prediction errors", least["native", "prediction"], 3.0, "us"),
        Bar("the same, pythonfmu", least["python", "prediction"], 80.0, "us"),
        Bar("closed loop of four units, our master", own, 5.0, "us a step"),
        Bar("speed against real time, 10 ms a step", 1e6 * STEP / own, 2000.0, "times", True),
        Bar("against libcosim, same units", middle["native", "libcosim"] / middle["native", "loop"], 1.0,
            "times faster", True),
        Bar("against Ecos, same units", middle["native", "ecos"] / middle["native", "loop"], 1.0, "times faster", True),
        *(Bar(f"first {unit} in a C host, with loading", said[0], 1.0, "ms") for unit, said in hosts.items()),
        *(Bar(f"memory of a C host, {unit}", said[1], 4.0, "MB") for unit, said in hosts.items()),
        Bar("`heli build --native`, five units, both platforms, cold", cold, 60.0, "s"),
    ]  # fmt: skip
    rows = [
        (
            TITLES[case],
            figure(middle["native", case]),
            figure(middle["python", case]) if ("python", case) in middle else "",
            figure(middle["python", case] / middle["native", case]) if ("python", case) in middle else "",
        )
        for case in NATIVE
    ]
    return "\n\n".join(
        [
            "## Native units",
            bar_table(bars),
            table(("what", "native [us]", "pythonfmu [us]", "ratio"), rows),
            f"{ROUNDS} rounds in turn, {LONG} steps of native units and {SHORT} of pythonfmu units a round, every case "
            "in a process of its own. Times in the first table are those of the fastest round; the second table has "
            f"medians. The plant's FMU has {sizes['native']:.0f} kB natively and {sizes['python']:.0f} kB in Python. "
            f"The cold build took {busy:.0f} s of processor time, of which the compiler needs most to build its own "
            "libraries for both platforms, once on a machine.",
            measured_at(("fmpy", "pythonfmu", "libcosimpy", "ecospy", "ziglang", "numba"), load),
        ]
    )


def child(case: str, order: str, steps: str) -> None:
    """Run one case and print its seconds."""
    kind, _, name = case.partition(".")
    cases = NATIVE if kind == "native" else PYTHON
    seconds = cases[name](json.loads(Path(order).read_text()), int(steps))
    print(seconds)
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    child(*sys.argv[1:])
