"""The following twin on generated rigs that change in flight: noticed, named, how well it predicts afterwards.

    python -m benchmarks.follow                       the rigs that figures are reported on
    python -m benchmarks.follow --tuning              the rigs that the rules and their constants were chosen on
    python -m benchmarks.follow --rows rows.jsonl     a line per flight, written as soon as it is done; goes on there
    python -m benchmarks.follow --step                processor time of a step of the scenario follow, pythonfmu units

Every seed is a rig (:mod:`benchmarks.follow_rigs`), in turn in closed and in open loop, and flies once for every kind
of change, which comes between 35 and 50 s; the flight ends 90 s after it. The twin begins with values that err as
those of a diagnosis do: gains, stiffnesses by 1 %, dampings by .01 1/s, the balance of torques in hover by .003
rad/s^2. Kinds with a stream at fault have the change of one gain as well. Unchanged rigs fly for 600 s, with a stream
in order (none) and with every fault of it (faulty: :mod:`benchmarks.follow_streams`).

noticed: an alarm within 20 s by the clock (a slow change: before it is over). The bar counts excited flight: a motion
in which a change does not show excites it no more than standing still does, and 20 s of excited flight are over as soon
as what was flown tells of the change what :mod:`benchmarks.follow_bound` says, at the earliest after 20 s. Both are
reported. named: the first change put on trial is the true one. error: rms over the three axes of errors 1 s ahead, from
60 to 90 s after the (last) change. told: the same of a twin that was given the change. alone: of the twin that was left
as it was. A wrong adoption is one after which predictions were worse over the next 60 s than those of the twin with the
values before.
"""

import argparse
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np

from benchmarks.follow_changes import changed, known
from benchmarks.follow_flights import KINDS, UNCHANGED, UNCHANGED_KINDS, flown
from benchmarks.follow_rigs import Stage, draw_rig, fly
from benchmarks.follow_summary import summary
from heli_plant.parameters import to_names

REPORTED, TUNING = 2, 1
"""Seeds of the two halves."""


def step_cost() -> str:
    """Return the processor time of a step [us]: 60 s of the scenario less 20 s of it, so that building cancels."""
    from fmu_src.master import run

    rng = np.random.default_rng(15)
    rig = draw_rig(rng)
    stages = (Stage(0.0, rig.coefficients), changed("k_z", Stage(0.0, rig.coefficients), 15.0, -1.0))
    rows = fly(rig, stages, 60.0, True, rng).rows
    with TemporaryDirectory(prefix="heli-follow-") as folder:
        path = Path(folder) / "log.csv"
        head = "time [s],v_front [V],v_rear [V],pitch [rad],elevation [rad],travel [rad]"
        np.savetxt(path, np.column_stack([np.arange(len(rows)) * 0.01, rows]), "%.9g", ",", header=head, comments="")
        values = to_names(known(rig, rng))
        parameters = {f"{unit}.{name}": value for unit in ("plant", "corrector") for name, value in values.items()}
        spent = []
        for seconds in (20.0, 59.0):
            began = process_time()
            run("follow", seconds, 0.01, {"player.log.path": str(path), **parameters})
            spent.append(process_time() - began)
    return (
        f"{1e6 * (spent[1] - spent[0]) / 3900:.0f} us of processor time a step, with an alarm, a trial and an adoption"
    )


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.follow")
    parser.add_argument("--tuning", action="store_true", help="the half that the rules were chosen on")
    parser.add_argument("--seeds", type=int, default=40, help="flights per kind of change")
    parser.add_argument("--first", type=int, default=0, help="seed of the first flight")
    parser.add_argument("--hours", type=float, default=20.0, help="flight of unchanged rigs of each kind [h]")
    parser.add_argument(
        "--kind", action="append", choices=(*KINDS, *UNCHANGED_KINDS), help="only this kind; repeatable"
    )
    parser.add_argument("--whole", action="store_true", help="with the identifier beside the corrector")
    parser.add_argument("--rows", type=Path, help="file of the flights' results, which a later run goes on with")
    parser.add_argument("--step", action="store_true", help="time of a step alone")
    chosen = parser.parse_args()
    if chosen.step:
        print(step_cost())
        return
    half = TUNING if chosen.tuning else REPORTED
    kinds = chosen.kind or (*KINDS, *UNCHANGED_KINDS)
    rows: list[dict[str, Any]] = []
    if chosen.rows and chosen.rows.exists():
        rows = [json.loads(line) for line in chosen.rows.read_text(encoding="utf-8").splitlines()]
    done = {(row["half"], row["seed"], row["kind"], row["whole"]) for row in rows}
    still = round(chosen.hours * 3600.0 / UNCHANGED)
    for seed in range(chosen.first, max(chosen.seeds, still)):
        for kind in kinds:
            if (half, seed, kind, chosen.whole) in done or seed >= (still if kind in UNCHANGED_KINDS else chosen.seeds):
                continue
            row = flown(half, seed, kind, chosen.whole)
            rows.append(row)
            if chosen.rows:
                with chosen.rows.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row) + "\n")
    print(summary([row for row in rows if row["half"] == half and row["whole"] == chosen.whole]))


if __name__ == "__main__":
    main()
