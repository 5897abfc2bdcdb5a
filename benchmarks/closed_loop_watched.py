"""Scores of watched effects in closed loop: how often an absent effect passes 3, and how often a present one does.

Usage: python -m benchmarks.closed_loop_watched [--tuning]      the half of the rigs that constants were chosen on

Twelve generated rigs (:mod:`benchmarks.closed_loop_rigs`) with five logs of 22 to 40 s each, in the native unit, and as
many of 180 s.
"""

import argparse
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from benchmarks.closed_loop import REPORTED, TUNING
from benchmarks.closed_loop_rigs import DURATIONS, ClosedLoopRig, closed_loop_rigs
from benchmarks.native_identifier import Units, built_units
from benchmarks.tables import table
from heli_identifier.online import PREDICTION_ERROR

PRESENT = {
    ("dry_friction", "pitch"): {"dry_friction_pitch": 0.03},
    ("quadratic_drag", "pitch"): {"quadratic_drag_pitch": 0.3},
    ("dry_friction", "elevation"): {"dry_friction_elevation": 0.02},
    ("dry_friction", "travel"): {"dry_friction_travel": 0.03},
    ("quadratic_thrust", "pitch"): {"quadratic_thrust": 0.1},
}
"""Watched effects, and the strength at which the power is measured [rad/s^2], [1/rad], [1/V]."""

LIMIT = 3.0
LONG = (180.0, 180.0)
"""Length of the longer logs [s]."""
OUTPUTS = ("score.pitch[1]", "score.pitch[2]", "score.elevation[1]", "score.travel[1]", "score.pitch[3]")
"""In the order of ``PRESENT``."""
WATCH = {
    f"watch__{axis}": ",".join(name for name, own in PRESENT if own == axis)
    for axis in ("pitch", "elevation", "travel")
}


def scores(units: Units, rigs: Sequence[ClosedLoopRig]) -> NDArray[np.float64]:
    """Return the scores of all watched effects at the end of every log, (logs, effects)."""
    found = []
    for rig in rigs:
        for log in rig.logs:
            given = {"method": PREDICTION_ERROR, "report__interval": 0.5, **WATCH}
            with units.unit(log.step, OUTPUTS, **given) as unit:
                found.append(unit.take(np.column_stack((log.voltages, log.angles)), len(log.angles))[-1])
    return np.array(found)


def percent(passed: NDArray[np.bool_]) -> str:
    return f"{100.0 * passed.mean():.1f} %"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.closed_loop_watched")
    parser.add_argument("--tuning", action="store_true", help="the other half of the rigs")
    seed = TUNING if parser.parse_args().tuning else REPORTED
    with built_units() as units:
        for durations in (DURATIONS, LONG):
            _print(units, seed, durations)


def _print(units: Units, seed: int, durations: tuple[float, float]) -> None:
    absent = scores(units, closed_loop_rigs(seed, durations=durations))
    alarms, rows = np.abs(absent) > LIMIT, []
    for column, (name, effects) in enumerate(PRESENT.items()):
        clean = absent[:, column]
        rigs = closed_loop_rigs(seed, durations=durations, effects=effects)
        present = scores(units, rigs)[:, column]
        strength = ", ".join(f"{value:g}" for value in effects.values())
        decided = clean[clean != 0.0]
        spread = f"{np.sqrt(np.mean(decided**2)):.2f}" if len(decided) else "-"
        cells = (percent(alarms[:, column]), f"{100.0 * len(decided) / len(clean):.0f} %", spread)
        rows.append((":".join(name), *cells, strength, percent(np.abs(present) > LIMIT), f"{np.median(present):.1f}"))
    rows.append(("all", f"{percent(alarms)} of {alarms.size}", "", "", "", "", ""))
    head = (
        "effect",
        f"absent, beyond {LIMIT:g}",
        "decided",
        "root mean square",
        "strength",
        f"present, beyond {LIMIT:g}",
        "median",
    )
    print(f"logs of {durations[0]:g} to {durations[1]:g} s\n\n{table(head, rows)}\n", flush=True)


if __name__ == "__main__":
    main()
