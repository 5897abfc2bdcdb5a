"""Every pythonfmu unit and its native twin side by side over 1e5 steps: the number of steps in which a bit differs.

Usage: python -m benchmarks.lockstep [--steps N]. Inputs and steps are random, states are saved, serialised and restored
in between. The section goes to docs/results.md.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.page import PAGE, write_section
from benchmarks.tables import table

STEPS = 100_000
PROGRAM = Path(__file__).parent.parent / "tests" / "hosts" / "lockstep.py"
ANGLES = {"pitch": [-0.6, 0.6], "elevation": [-0.5, 0.5], "travel": [-1.0, 3.0]}
VOLTAGES = {"v_front": [-5.0, 6.0], "v_rear": [-5.0, 6.0]}
WATCHED = {"watch.pitch": "dry_friction,quadratic_drag", "watch.elevation": "quadratic_thrust"}


def cases(log: Path) -> tuple[tuple[str, str, dict, dict], ...]:
    """Return unit, what is special, parameters, and inputs with their ranges."""
    from heli_plant.effects import CATALOGUE

    every = {
        f"effects.{e.name}.{e.axis}": min(0.02, e.upper)
        for e in CATALOGUE
        if e.name not in ("moving_mass", "thrust_fade")
    }
    return (
        ("HelicopterPlant", "no effect", {}, VOLTAGES),
        ("HelicopterPlant", "every effect, encoders", {**every, "encoder.enabled": True}, VOLTAGES),
        ("HelicopterPlant", "every effect, general model", {**every, "general.enabled": 1.0}, VOLTAGES),
        ("AdaptiveIdentifier", "adaptation, three effects watched", {**WATCHED, "report.interval": 0.5},
         {**VOLTAGES, **ANGLES}),
        ("AdaptiveIdentifier", "prediction errors", {"method": "prediction_error", "report.interval": 0.5},
         {**VOLTAGES, **ANGLES}),
        ("PidController", "travel loop", {"travel.enabled": True, "reference.step_pitch": 0.2}, ANGLES),
        ("Exciter", "experiment 2", {"excitation.experiment": 2}, {}),
        ("Exciter", "multisines", {"excitation.experiment": 3}, {}),
        ("LogPlayer", "a log of 1000 s", {"log.path": str(log)}, {}),
    )  # fmt: skip


def measured(steps: int) -> str:
    """Run all cases; return the section."""
    from fmu_src import build
    from fmu_src.native import NATIVE_UNITS, build_native

    rows = []
    with TemporaryDirectory(prefix="heli-lockstep-") as name:
        folder = Path(name)
        log = folder / "log.csv"
        lines = (f"{0.01 * k:.2f},{k % 7},{-k % 5},{k / 1e5!r},.2,-{k / 3e4!r}\n" for k in range(100_000))
        log.write_text("time [s],v_front [V],v_rear [V],pitch [rad],elevation [rad],travel [rad]\n" + "".join(lines))
        pairs = {unit: (build(unit, folder / "python"), build_native(unit, folder / "native")) for unit in NATIVE_UNITS}
        for unit, what, parameters, inputs in cases(log):
            order = folder / "order.json"
            order.write_text(
                json.dumps(
                    [
                        {
                            "parameters": parameters,
                            "inputs": inputs,
                            "steps": steps,
                            "seed": 14,
                            "longest": 0.01,
                            "shortest": 0.001,
                        }
                    ]
                )
            )
            done = subprocess.run(
                [sys.executable, str(PROGRAM), *map(str, pairs[unit]), str(order)],
                capture_output=True, text=True, check=True, env={**os.environ, "PYTHONPATH": str(PROGRAM.parent)},
            )  # fmt: skip
            (found,) = json.loads(done.stdout.strip().splitlines()[-1])
            rows.append((unit, what, str(found["steps"]), str(found["different"])))
            print(*rows[-1], file=sys.stderr, flush=True)
    return "\n\n".join(
        [
            "### Native units in lockstep",
            "`python -m benchmarks.lockstep`",
            "Random inputs, steps of 1 to 10 ms, states saved, serialised and restored in between; a step counts as "
            "different if its status or any bit of any output differs from the pythonfmu unit's.",
            table(("unit", "case", "steps", "different"), rows),
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.lockstep", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--steps", type=int, default=STEPS)
    write_section(PAGE, "lockstep", measured(parser.parse_args().steps))


if __name__ == "__main__":
    main()
