"""Measured rigs, disjoint halves of their logs: whether gains and names agree, and the other half gets likelier.

Usage: python -m benchmarks.halves [--from SECONDS] RIG...    a folder of logs each; RIG:-pitch if its pitch counts down

Every second log makes a half; each half is identified by itself. Printed are, by half, the gains with their 95 %
intervals and what they rest on, the families shown, and the log-likelihood of the other half under the corrected plant
less that under the model before [nats]; then over all rigs the shares that the bars ask for.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from time import process_time

import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.tables import table
from heli_identifier.errors import IdentifierError
from heli_identifier.records import Log, LogFormat, read_logs
from heli_identifier.tracing import Determination, Diagnosis, diagnose

OPPOSITE = ":-pitch"
NEAR = 3.0
"""Nats within which a plant is no worse than the model before."""

MARKS = {Determination.OUTSIDE: "", Determination.NOISE_MODEL: "*", Determination.NOT_DETERMINED: "?"}
"""Behind a gain: nothing where references determine it, * where it rests on the noise model, ? where nothing does."""


def rig_logs(rig: str, first: float) -> list[Log]:
    """Read the logs of a rig, the folder of its files, from ``first`` [s] on."""
    signs = {"pitch": -1} if rig.endswith(OPPOSITE) else {}
    files = sorted(Path(rig.removesuffix(OPPOSITE)).glob("*.csv*"))
    return list(read_logs(files, LogFormat(signs=signs), start=first or None))


def gains_agree(halves: Sequence[Diagnosis]) -> list[bool]:
    """Tell of every gain that both halves determine whether its values lie within their joint 95 % interval."""
    first, second = (half.parameters for half in halves)
    found = []
    for name in ("k_x", "k_z", "k_y"):
        both = [half[name] for half in (first, second) if name in half]
        if len(both) == 2 and all(r.determination is not Determination.NOT_DETERMINED for r in both):
            errors = np.hypot(*(r.estimate.standard_error or 0.0 for r in both))
            found.append(abs(both[0].estimate.value - both[1].estimate.value) <= 1.96 * errors)
    return found


def families(found: Diagnosis) -> set[str]:
    """Families of the effects that a diagnosis shows."""
    return {effect.family for effect in found.effects}


def main(arguments: Sequence[str]) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.halves", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("rigs", nargs="+", metavar="RIG")
    parser.add_argument("--from", dest="start", type=float, default=6.0, help="leave out what is earlier [s]")
    asked = parser.parse_args(arguments)
    rows: list[tuple[str, ...]] = []
    agree: list[bool] = []
    nats: list[float] = []
    indices: list[tuple[float, float]] = []
    for rig in asked.rigs:
        logs, name = rig_logs(rig, asked.start), Path(rig.removesuffix(OPPOSITE)).name
        halves = []
        for half in (0, 1):
            began = process_time()
            try:
                with threadpool_limits(1):
                    found = diagnose(logs[half::2], held_out=logs[1 - half :: 2])
            except IdentifierError as error:
                print(f"{name} {half}: {error}", flush=True)
                continue
            halves.append(found)
            nats.append(found.held_out.gain.value)
            cells = [
                f"{r.estimate.value:.3g} ± {1.96 * (r.estimate.standard_error or 0.0):.2g}{MARKS[r.determination]}"
                for r in (found.parameters[gain] for gain in ("k_x", "k_z", "k_y"))
            ]
            shown = ", ".join(sorted(families(found))) or "nothing"
            rows.append(
                (
                    f"{name} {'ab'[half]}",
                    found.references,
                    *cells,
                    shown,
                    f"{nats[-1]:.0f}",
                    f"{process_time() - began:.1f}",
                )
            )
            print(" | ".join(rows[-1]), flush=True)
        if len(halves) == 2:
            agree += gains_agree(halves)
            both, either = (families(halves[0]) & families(halves[1])), (families(halves[0]) | families(halves[1]))
            expected = float(np.mean([half.agreement.expected for half in halves if half.agreement]))
            indices += [(len(both) / len(either), expected)] if either else []
    head = ("half", "references", "k_x", "k_z", "k_y", "shown", "nats of the other half", "s")
    print(f"\n{table(head, rows)}\n")
    print(f"gains agree within their joint 95 % interval: {sum(agree)} of {len(agree)} determined by both")
    if indices:
        observed, expected = np.mean(indices, axis=0)
        print(f"families shown by both over shown by either: {observed:.2f}, expected from sampling {expected:.2f}")
    fine = sum(value > -NEAR for value in nats)
    print(f"nats of the other half: above -{NEAR:g} on {fine} of {len(nats)}; median {np.median(nats):.0f}")


if __name__ == "__main__":
    main(sys.argv[1:])
