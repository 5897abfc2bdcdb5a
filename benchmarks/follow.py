"""The following twin on generated rigs that change in flight: noticed, named, how well it predicts afterwards.

    python -m benchmarks.follow                       the rigs that figures are reported on
    python -m benchmarks.follow --tuning              the rigs that the rules and their constants were chosen on
    python -m benchmarks.follow --rows rows.jsonl     a line per flight, written as soon as it is done; goes on there
    python -m benchmarks.follow --step                processor time of a step of the scenario follow, pythonfmu units

Every seed is a rig (:mod:`benchmarks.follow_rigs`), in turn in closed and in open loop, and flies once for every kind
of change, which comes between 35 and 50 s; the flight ends 90 s after it. The twin begins with values that err as
those of a diagnosis do: gains, stiffnesses by 1 %, dampings by .01 1/s, the balance of torques in hover by .003
rad/s^2. Kinds with a stream at fault have the change of one gain as well. Unchanged rigs fly for 600 s.

noticed: an alarm within 20 s (a slow change: before it is over). named: the first change put on trial is the true one.
error: rms over the three axes of errors 1 s ahead, from 60 to 90 s after the (last) change. told: the same of a twin
that was given the change. alone: of the twin that was left as it was. A wrong adoption is one after which predictions
were worse over the next 60 s than those of the twin with the values before.
"""

import argparse
import json
import math
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np

from benchmarks.follow_bound import bound
from benchmarks.follow_fast import corrected, errors_ahead
from benchmarks.follow_rigs import Rig, Stage, draw_rig, fly
from benchmarks.tables import table
from heli_identifier.link import Clock, ClockSettings, Timed, tick
from heli_identifier.online.following import (
    FollowSettings,
    Sample,
    event_document,
    follow,
    prepare_follower,
    prepare_following,
    start_following,
)
from heli_plant.parameters import PlantParameters, to_names
from tests.blind.coefficients import Coefficients

REPORTED, TUNING = 2, 1
"""Seeds of the two halves."""

GAIN, MASS, SHARE, WARM, SLOW = 0.2, 0.08, 0.8, 0.85, 60.0
"""Change of a gain [1], of the offset [rad/s^2], thrust left of a rotor and of warm motors [1], time of warming [s]."""

NAMES = {
    "k_x": "pitch.gain",
    "k_z": "elevation.gain",
    "k_y": "travel.gain",
    "friction_pitch": "effects.dry_friction.pitch",
    "friction_elevation": "effects.dry_friction.elevation",
    "friction_travel": "effects.dry_friction.travel",
    "mass": "elevation.offset",
    "front": "rotor.front",
    "rear": "rotor.rear",
    "cable": "effects.cable_stiffness.travel",
    "warming": "rotors.thrust",
}
"""Kinds of change, and what the twin should call them."""

FRICTION = {"pitch": 0.03, "elevation": 0.03, "travel": 0.03}
"""Added dry friction [rad/s^2]."""

CABLE = 0.06
"""Stiffness of a cable that is hung on [1/s^2]."""

STREAMS = ("loss", "stuck", "stop", "jitter", "all")
"""Faults of the stream: 5 % of the samples lost; an encoder stuck for 4 s; nothing for 5 s; samples that arrive with a
jitter of 20 ms, 5 % lost; all of them in one flight."""

JITTER, DELAY, MAXIMUM_AGE = 0.02, 0.05, 0.2
"""Standard deviation of the time that a sample travels [s]; delay and maximum age of the units' link to a rig [s]."""

KINDS = (*NAMES, "two", *STREAMS)
AFTER, UNCHANGED = 90.5, 600.0
"""Flight after the last change, and of an unchanged rig [s]."""


def known(rig: Rig, rng: np.random.Generator) -> PlantParameters:
    """Return the values that a twin begins with."""
    c = rig.coefficients
    share = (1.0 + 0.01 * rng.standard_normal(7)).tolist()
    damping = (0.01 * rng.standard_normal(3)).tolist()
    balance = (0.003 * rng.standard_normal(2)).tolist()
    a_e, k_z, a_th = c.a_e * share[0], c.k_z * share[1], c.a_th * share[2]
    elevation, thrust = rig.hover
    return PlantParameters(
        a_wx=c.a_wx + damping[0], a_th=a_th, k_x=c.k_x * share[3], theta0=c.theta0 + balance[0] / c.a_th,
        a_wz=c.a_wz + damping[1], a_e=a_e, a_1=k_z * thrust - a_e * elevation + balance[1], a_lt=c.a_lt * share[4],
        k_z=k_z, a_wy=c.a_wy + damping[2], k_y=c.k_y * share[5], T_m=c.t_m,
    )  # fmt: skip


def changed(kind: str, stage: Stage, start: float, sign: float) -> Stage:
    """Return the stage that follows after a change of one kind at ``start`` [s]."""
    c, shares, slow = stage.coefficients, stage.shares, 0.0
    if kind in ("k_x", "k_z", "k_y"):
        c = c._replace(**{kind: getattr(c, kind) * (1.0 + sign * GAIN)})
    elif kind.startswith("friction_"):
        axis = kind.removeprefix("friction_")
        c = c._replace(**{f"dry_friction_{axis}": getattr(c, f"dry_friction_{axis}") + FRICTION[axis]})
    elif kind == "mass":
        c = c._replace(a_1=c.a_1 + sign * MASS)
    elif kind == "cable":
        c = c._replace(cable_stiffness=CABLE)
    elif kind == "front":
        shares = (SHARE * shares[0], shares[1])
    elif kind == "rear":
        shares = (shares[0], SHARE * shares[1])
    elif kind == "warming":
        shares, slow = (WARM * shares[0], WARM * shares[1]), SLOW
    return Stage(start, c, shares, slow)


def told(values: PlantParameters, before: Coefficients, stage: Stage) -> tuple[PlantParameters, tuple[float, float]]:
    """Return the values of a twin that is given the change, and the rotors' shares."""
    c, same = stage.coefficients, {}
    for name in ("k_x", "k_z", "k_y"):
        same[name] = getattr(values, name) * getattr(c, name) / getattr(before, name)
    for axis in FRICTION:
        same[f"dry_friction_{axis}"] = getattr(c, f"dry_friction_{axis}")
    same["cable_stiffness_travel"] = c.cable_stiffness
    return values._replace(a_1=values.a_1 + c.a_1 - before.a_1, **same), stage.shares


def flown(half: int, seed: int, kind: str, whole: bool = False) -> dict[str, Any]:
    """Fly one rig with one kind of change and follow it; ``whole``: with the identifier beside the corrector."""
    rng = np.random.default_rng([15, half, seed, (*KINDS, "none").index(kind)])
    closed = seed % 2 == 0
    rig = draw_rig(rng)
    values = known(rig, rng)
    sign = float(rng.choice([-1.0, 1.0]))
    start = float(rng.uniform(35.0, 50.0))
    kinds = [kind]
    if kind == "two":
        kinds = [str(name) for name in rng.choice([name for name in NAMES if name != "warming"], 2, replace=False)]
    elif kind in STREAMS:
        kinds = [str(rng.choice(["k_x", "k_z"]))]
    elif kind == "none":
        kinds = []
    stages = [Stage(0.0, rig.coefficients)]
    for name in kinds:
        stages.append(changed(name, stages[-1], start, sign))
        start += 50.0
    end = stages[-1].start + stages[-1].slow
    duration = UNCHANGED if kind == "none" else end + AFTER
    rows = fly(rig, tuple(stages), duration, closed, rng).rows
    flown_rows = rows.copy()
    fresh = _stream(kind, rows, stages[-1].start, rng)
    found = followed(rows, fresh, values, whole)
    row = {"half": half, "seed": seed, "kind": kind, "closed": closed, "whole": whole, "changes": [], **found}
    for name, stage in zip(kinds, stages[1:], strict=True):
        row["changes"].append({"kind": name, "name": NAMES[name], "start": stage.start, "slow": stage.slow})
    if kind == "k_y":
        time_asked = FollowSettings().false_alarm_time
        row["oracle"] = list(bound(flown_rows, rig.coefficients, stages[-1].start, GAIN, time_asked))
    if kind == "none":
        row["hours"] = duration / 3600.0
    errors = row.pop("errors")
    plan = prepare_following(FollowSettings(parameters=values, correcting=False))
    if kind != "none":
        late = (errors[:, 0] >= end + 60.0) & (errors[:, 0] <= end + 90.0)
        row["error"], row["alone"] = _rms(errors[late, 1:4]), _rms(errors[late, 4:7])
        p, shares = told(values, rig.coefficients, stages[-1])
        informed = tuple(getattr(p, field) for field in plan.fields) + shares
        row["told"] = _rms(errors_ahead(rows, plan, end + 60.0, end + 90.0, informed))
    row["wrong"] = []
    first = plan.first_values
    for event, before in row.pop("adoptions"):
        since = event["time_s"] + 2.0
        during = (errors[:, 0] >= since) & (errors[:, 0] <= since + 60.0)
        old = errors[during, 4:7] if before == first else errors_ahead(rows, plan, since, since + 60.0, before)
        row["wrong"].append([event["name"], event["time_s"], _rms(old), _rms(errors[during, 1:4])])
    return row


def _stream(kind: str, rows: np.ndarray, start: float, rng: np.random.Generator) -> list[float]:
    """Put the fault of a stream into ``rows``; return which samples come in."""
    fresh = [1.0] * len(rows)
    if kind in ("stuck", "all"):
        at, axis = round(100 * (start + rng.choice([-20.0, 5.0, 40.0]))), int(rng.integers(2, 5))
        for k in range(at, at + 400):
            rows[k, axis] = rows[at - 1, axis]
    if kind in ("loss", "jitter", "all"):
        for k in np.flatnonzero(rng.random(len(rows)) < 0.05):
            fresh[k] = 0.0 if k > 0 else 1.0
    if kind in ("stop", "all"):
        at = round(100 * (start + rng.choice([-20.0, 5.0, 40.0])))
        fresh[at : at + 500] = [0.0] * 500
    if kind in ("jitter", "all"):
        return _late(rows, fresh, rng)
    for k in range(1, len(rows)):
        if not fresh[k]:
            rows[k] = rows[k - 1]
    return fresh


def _late(rows: np.ndarray, fresh: list[float], rng: np.random.Generator) -> list[float]:
    """Let the samples that are ``fresh`` travel for a random time, and put into ``rows`` what the units' link shows."""
    travelled = np.maximum(0.0, JITTER * (1.0 + rng.standard_normal(len(rows))))
    travelled[0] = 0.0
    arrivals: list[list[Timed]] = [[] for _ in rows]
    for k in range(len(rows)):
        at = k + math.ceil(100.0 * travelled[k] - 1e-9)
        if fresh[k] and at < len(rows):
            arrivals[at].append(Timed(k * 0.01, k, tuple(rows[k].tolist())))
    clock, settings, shown = Clock(), ClockSettings(DELAY, MAXIMUM_AGE, 0.01), []
    for k in range(len(rows)):
        clock, seen = tick(clock, k * 0.01, tuple(arrivals[k]), settings)
        shown.append(1.0 if seen.fresh else 0.0)
        rows[k] = rows[0] if seen.latest is None else seen.latest.signals
    return shown


def followed(rows: np.ndarray, fresh: list[float], values: PlantParameters, whole: bool) -> dict[str, Any]:
    """Follow a record; return events, adoptions (event, values before) and errors (time, twin, alone)."""
    settings = FollowSettings(parameters=values)
    plan = prepare_following(settings)
    if whole:
        events, adoptions, errors = with_identifier(rows.tolist(), fresh, settings)
    else:
        events, adoptions, errors, _ = corrected(rows, fresh, plan)
    documents = [event_document(event, plan.changes) for event in events]
    adopted = [document for document in documents if document["what"] in ("adopted", "rolled back")]
    pairs = [(one, before) for one, (before, _) in zip(adopted, adoptions, strict=True) if one["what"] == "adopted"]
    keys = ("time_s", "what", "name", "value", "since_s", "why")
    shown = [{key: document[key] for key in keys} for document in documents]
    return {"events": shown, "adoptions": pairs, "errors": np.array(errors)}


def with_identifier(
    rows: list[list[float]], fresh: list[float], settings: FollowSettings
) -> tuple[list[Any], list[Any], list[tuple[float, ...]]]:
    """Follow a record with the identifier beside the corrector, as the units are wired."""
    plan = prepare_follower(settings)
    state = start_following(plan, Sample(*rows[0]))
    events, adoptions, errors = [], [], []
    for k in range(1, len(rows)):
        before = state.corrector.values.end
        state, said = follow(state, Sample(*rows[k], fresh[k]), plan)
        output = said.corrector
        events.extend(output.events)
        if state.corrector.values.end != before:
            adoptions.append((before, state.corrector.values.end))
        if output.compared:
            one, two = np.subtract(rows[k][2:], output.predicted), np.subtract(rows[k][2:], output.predicted_alone)
            errors.append((output.time, *one, *two))
    return events, adoptions, errors


def _rms(errors: np.ndarray) -> float:
    """Return the rms over time of the length of the errors of the three axes [rad]."""
    return float(np.sqrt((errors**2).sum(axis=1).mean())) if len(errors) else float("nan")


def judged(row: dict[str, Any]) -> list[dict[str, Any]]:
    """Return for every change of a flight whether it was noticed, and named right."""
    found = []
    for number, change in enumerate(row["changes"]):
        later = row["changes"][number + 1]["start"] if number + 1 < len(row["changes"]) else float("inf")
        limit = change["start"] + (change["slow"] or 20.0)
        mine = [event for event in row["events"] if change["start"] <= event["time_s"] < later]
        alarms = [event["time_s"] for event in mine if event["what"] == "alarm"]
        tried = [
            event["name"] for event in mine if event["what"] == "alarm" and not event["why"].startswith("the inno")
        ]
        found.append(
            {
                "kind": change["kind"],
                "noticed": bool(alarms) and alarms[0] <= limit,
                "delay": alarms[0] - change["start"] if alarms else None,
                "tried": bool(tried),
                "named": bool(tried) and tried[0] == change["name"],
            }
        )
    return found


def summary(rows: list[dict[str, Any]]) -> str:
    """Return the tables of a half."""
    lines = []
    for kind in KINDS:
        for closed in (True, False):
            mine = [row for row in rows if row["kind"] == kind and row["closed"] == closed]
            if not mine:
                continue
            changes = [change for row in mine for change in judged(row)]
            ratio = np.array([row["error"] / row["told"] for row in mine])
            alone = np.array([row["error"] / row["alone"] for row in mine])
            delays = [change["delay"] for change in changes if change["delay"] is not None]
            lines.append(
                (
                    kind,
                    "closed" if closed else "open",
                    f"{len(mine)}",
                    _share([change["noticed"] for change in changes]),
                    f"{np.median(delays):.0f}" if delays else "",
                    _share([change["named"] for change in changes]),
                    f"{np.median(ratio):.3f}, {np.quantile(ratio, 0.9):.2f}",
                    _share(ratio <= 1.15),
                    f"{np.max(alone):.3f}",
                )
            )
    head = ("change", "loop", "flights", "noticed", "after [s]", "named", "error/told: median, 90 %", "<= 1.15",
            "largest error/alone")  # fmt: skip
    text = [table(head, lines)] if lines else []
    hours = sum(row.get("hours", 0.0) for row in rows)
    if hours:
        still = [row for row in rows if row["kind"] == "none"]
        alarms = [
            event
            for row in still
            for event in row["events"]
            if event["what"] == "alarm" and "no longer" in event["why"]
        ]
        adopted = sum(len(row["wrong"]) for row in still)
        text.append(f"Unchanged rigs: {len(alarms)} false alarms in {hours:.1f} h of flight, {adopted} adoptions.")
    oracles = [row["oracle"] for row in rows if "oracle" in row]
    if oracles:
        power, delay = 100 * np.mean([one for one, _ in oracles]), np.median([one for _, one in oracles])
        text.append(
            f"k_y: who knows noise, size and sign would notice {power:.0f} % within 20 s; no detector's mean "
            f"delay is below {delay:.0f} s (median of the flights)."
        )
    early = [
        (row["changes"][0]["start"], [e for e in row["events"] if e["what"] == "alarm"])
        for row in rows
        if row["changes"]
    ]
    before = sum(event["time_s"] < start for start, alarms in early for event in alarms if "no longer" in event["why"])
    flown_before = sum(start for start, _ in early) / 3600.0
    if early:
        text.append(f"Before the change: {before} alarms in {flown_before:.1f} h.")
    adoptions = [(row, one) for row in rows for one in row["wrong"] if np.isfinite(one[2]) and np.isfinite(one[3])]
    worse = [one for _, one in adoptions if one[3] > one[2]]
    text.append(f"Adoptions: {len(adoptions)}, wrong (worse over the next 60 s): {len(worse)}.")
    return "\n\n".join(text)


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


def _share(flags: Any) -> str:
    flags = list(flags)
    return f"{100 * np.mean(flags):.0f} %" if flags else ""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.follow")
    parser.add_argument("--tuning", action="store_true", help="the half that the rules were chosen on")
    parser.add_argument("--seeds", type=int, default=40, help="flights per kind of change")
    parser.add_argument("--first", type=int, default=0, help="seed of the first flight")
    parser.add_argument("--hours", type=float, default=20.0, help="flight of unchanged rigs [h]")
    parser.add_argument("--kind", action="append", choices=(*KINDS, "none"), help="only this kind; repeatable")
    parser.add_argument("--whole", action="store_true", help="with the identifier beside the corrector")
    parser.add_argument("--rows", type=Path, help="file of the flights' results, which a later run goes on with")
    parser.add_argument("--step", action="store_true", help="time of a step alone")
    chosen = parser.parse_args()
    if chosen.step:
        print(step_cost())
        return
    half = TUNING if chosen.tuning else REPORTED
    kinds = chosen.kind or (*KINDS, "none")
    rows: list[dict[str, Any]] = []
    if chosen.rows and chosen.rows.exists():
        rows = [json.loads(line) for line in chosen.rows.read_text(encoding="utf-8").splitlines()]
    done = {(row["half"], row["seed"], row["kind"], row["whole"]) for row in rows}
    still = round(chosen.hours * 3600.0 / UNCHANGED)
    for seed in range(chosen.first, max(chosen.seeds, still)):
        for kind in kinds:
            if (half, seed, kind, chosen.whole) in done or seed >= (still if kind == "none" else chosen.seeds):
                continue
            row = flown(half, seed, kind, chosen.whole)
            rows.append(row)
            if chosen.rows:
                with chosen.rows.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row) + "\n")
    print(summary([row for row in rows if row["half"] == half and row["whole"] == chosen.whole]))


if __name__ == "__main__":
    main()
