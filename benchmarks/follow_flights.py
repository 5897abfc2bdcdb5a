"""One flight of the benchmark: a rig is drawn, changes, its stream may be at fault, and the twin follows it."""

import math
from typing import Any

import numpy as np

from benchmarks.follow_bound import Excitation, excitation
from benchmarks.follow_changes import NAMES, changed, known, told
from benchmarks.follow_rigs import Stage, draw_rig, fly
from benchmarks.follow_streams import FAULTY, STREAMS, broken
from heli_identifier.following import (
    CorrectorOutput,
    FollowPlan,
    FollowSettings,
    IdentifierReport,
    Sample,
    correct,
    follow,
    prepare_follower,
    prepare_following,
    start_correcting,
    start_following,
)
from heli_plant.parameters import PlantParameters

KINDS = (*NAMES, "two", *STREAMS)
UNCHANGED_KINDS = ("none", FAULTY)
AFTER, UNCHANGED = 90.5, 600.0
"""Flight after the last change, and of an unchanged rig [s]."""

SETTLED = 6.0
"""Time for which the observer of a twin with fixed values flies before its errors count [s]."""


def flown(half: int, seed: int, kind: str, whole: bool = False) -> dict[str, Any]:
    """Fly one rig with one kind of change and follow it; ``whole``: with the identifier beside the corrector."""
    rng = np.random.default_rng([15, half, seed, (*KINDS, *UNCHANGED_KINDS).index(kind)])
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
    elif kind in UNCHANGED_KINDS:
        kinds = []
    stages = [Stage(0.0, rig.coefficients)]
    for name in kinds:
        stages.append(changed(name, stages[-1], start, sign))
        start += 50.0
    end = stages[-1].start + stages[-1].slow
    duration = end + AFTER if kinds else UNCHANGED
    rows = fly(rig, tuple(stages), duration, closed, rng).rows
    measured = rows.copy()
    fresh = broken(kind, rows, stages[-1].start, rng)
    found = followed(rows, fresh, values, whole)
    row = {"half": half, "seed": seed, "kind": kind, "closed": closed, "whole": whole, "changes": [], **found}
    for name, stage in zip(kinds, stages[1:], strict=True):
        one = {"kind": name, "name": NAMES[name], "start": stage.start, "slow": stage.slow}
        of = excitation(name, measured, rig.coefficients, stage.start, FollowSettings().false_alarm_time)
        row["changes"].append(one if of is None else {**one, **_plain(of)})
    errors = row.pop("errors")
    plan = prepare_following(FollowSettings(parameters=values, correcting=False))
    if kinds:
        late = (errors[:, 0] >= end + 60.0) & (errors[:, 0] <= end + 90.0)
        row["error"], row["alone"] = _rms(errors[late, 1:4]), _rms(errors[late, 4:7])
        p, shares = told(values, rig.coefficients, stages[-1])
        informed = tuple(getattr(p, field) for field in plan.fields) + shares
        row["told"] = _rms(errors_ahead(rows, fresh, plan, end + 60.0, end + 90.0, informed))
    else:
        row["hours"] = duration / 3600.0
    row["wrong"] = []
    first = plan.first_values
    for event, before in row.pop("adoptions"):
        since = event["time_s"] + 2.0
        during = (errors[:, 0] >= since) & (errors[:, 0] <= since + 60.0)
        old = errors[during, 4:7] if before == first else errors_ahead(rows, fresh, plan, since, since + 60.0, before)
        row["wrong"].append([event["name"], event["time_s"], _rms(old), _rms(errors[during, 1:4])])
    return row


def _plain(of: Excitation) -> dict[str, float | None]:
    """Return an excitation for JSON, which has no infinite number."""
    return {name: value if math.isfinite(value) else None for name, value in of._asdict().items()}


def followed(rows: np.ndarray, fresh: list[float], values: PlantParameters, whole: bool) -> dict[str, Any]:
    """Follow a record; return events, adoptions (event, values before) and errors (time, twin, alone)."""
    settings = FollowSettings(parameters=values)
    run = with_identifier if whole else corrected
    events, adoptions, errors = run(rows.tolist(), fresh, settings)
    documents = [event.document() for event in events]
    adopted = [document for document in documents if document["what"] in ("adopted", "rolled back")]
    pairs = [(one, before) for one, before in zip(adopted, adoptions, strict=True) if one["what"] == "adopted"]
    keys = ("time_s", "what", "name", "value", "since_s", "why")
    shown = [{key: document[key] for key in keys} for document in documents]
    return {"events": shown, "adoptions": pairs, "errors": np.array(errors)}


Followed = tuple[list[Any], list[tuple[float, ...]], list[tuple[float, ...]]]
"""Events; the values before each adoption and roll-back; time [s] and errors 1 s ahead of the twin and of the one left
alone [rad]."""


def corrected(rows: list[list[float]], fresh: list[float], settings: FollowSettings) -> Followed:
    """Follow a record with the corrector alone."""
    plan = prepare_following(settings)
    state = start_correcting(plan, Sample(*rows[0]))
    events, adoptions, errors = [], [], []
    for k in range(1, len(rows)):
        before = state.values.end
        state, output = correct(state, Sample(*rows[k], fresh[k]), IdentifierReport(), plan)
        events.extend(output.events)
        if state.values.end != before:
            adoptions.append(before)
        errors.extend(_errors(rows[k], output))
    return events, adoptions, errors


def with_identifier(rows: list[list[float]], fresh: list[float], settings: FollowSettings) -> Followed:
    """Follow a record with the identifier beside the corrector, as the units are wired."""
    plan = prepare_follower(settings)
    state = start_following(plan, Sample(*rows[0]))
    events, adoptions, errors = [], [], []
    for k in range(1, len(rows)):
        before = state.corrector.values.end
        state, said = follow(state, Sample(*rows[k], fresh[k]), plan)
        events.extend(said.corrector.events)
        if state.corrector.values.end != before:
            adoptions.append(before)
        errors.extend(_errors(rows[k], said.corrector))
    return events, adoptions, errors


def _errors(row: list[float], output: CorrectorOutput) -> list[tuple[float, ...]]:
    if not output.compared:
        return []
    pairs = zip(row[2:] * 2, (*output.predicted, *output.predicted_alone), strict=True)
    return [(output.time, *[measured - predicted for measured, predicted in pairs])]


def errors_ahead(
    rows: np.ndarray, fresh: list[float], plan: FollowPlan, first: float, last: float, values: tuple[float, ...]
) -> np.ndarray:
    """Return the errors 1 s ahead (M, 3) [rad] of a twin with fixed ``values``, from ``first`` to ``last`` [s].

    It is a corrector that does not correct, so that it predicts from the same observer at the same samples.
    """
    begin, end = max(0, round(100 * (first - SETTLED))), min(len(rows), round(100 * last) + 1)
    fixed = plan._replace(first_values=values)
    state = start_correcting(fixed, Sample(*rows[begin].tolist()))
    # a cable hangs straight where the whole record begins
    now = state.observer.instant
    rest = now.memory.state._replace(cable_rest=float(rows[0, 4]))
    now = now._replace(memory=now.memory._replace(state=rest))
    state = state._replace(observer=state.observer._replace(instant=now))
    errors = []
    for k in range(begin + 1, end):
        row = rows[k].tolist()
        state, output = correct(state, Sample(*row, fresh[k]), IdentifierReport(), fixed)
        if k >= round(100 * first):
            errors.extend(_errors(row, output))
    return np.array([error[1:4] for error in errors]).reshape(-1, 3)


def _rms(errors: np.ndarray) -> float:
    """Return the rms over time of the length of the errors of the three axes [rad]."""
    return float(np.sqrt((errors**2).sum(axis=1).mean())) if len(errors) else float("nan")
