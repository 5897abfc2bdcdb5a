"""The following twin on generated rigs that change in flight: noticed, named, how well it predicts afterwards.

    python -m benchmarks follow [--tuning] [--seeds N] [--first N] [--hours H] [--rows FILE] [KIND]...
    python -m benchmarks follow --step          processor time of a step of the scenario follow, pythonfmu units

``--tuning`` takes the rigs that the rules and their constants were chosen on; ``--rows`` keeps a line per flight and
goes on there. Every seed is a rig (:mod:`benchmarks.flown`), in turn in closed and in open loop, and flies once for
every kind of change, which comes between 35 and 50 s; the flight ends 90 s after it. The twin begins with values that
err as those of a diagnosis do. Kinds with a stream at fault have the change of one gain as well. Unchanged rigs fly for
600 s, with a stream in order (none) and with every fault of it (faulty).

noticed: an alarm within 20 s by the clock (a slow change: before it is over); the bar counts excited flight (below) and
asks for 95 %. named: the first change put on trial is the true one (90 %). error: rms over the three axes of errors 1 s
ahead, from 60 to 90 s after the change; told: that of a twin that was given the change (error/told at most 1.15);
alone: of the twin that was left as it was (error/alone at most 1.05). A wrong adoption is one after which predictions
were worse over the next 60 s than with the values before (1 %). False alarms: one in 10 h.

**Excited flight.** A change adds the acceleration g to one axis. An oracle that knows all but whether the change has
taken place has the Kalman filter of x'' = -a x - b x' + d + g, d' = -d/tau + white noise, y = x + white noise, which
makes of g the innovations' mean psi, of variance S; after a time t it has J(t) = sum psi^2/S of information. A detector
that does not know which of M changes took place notices this one in 95 % from J* = (z_M + 1.645)^2, z_M the quantile of
1 - 20 s/(M T), T the time between false alarms. The 20 s of excited flight are over 20 s after the change, or when J
reaches J*, whichever is later.
"""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are
from scipy.signal import lfilter
from scipy.stats import norm

from benchmarks.flown import SHAKE, TORQUE_STD, TORQUE_TIME, Rig, Stage, draw_rig, flight
from benchmarks.harness import options, table
from heli_identifier.following import (
    CorrectorState,
    FollowPlan,
    FollowSettings,
    IdentifierReport,
    Sample,
    correct,
    prepare_following,
    start_correcting,
)
from heli_identifier.live import Clock, Datagram, tick
from heli_plant.effects import AXES
from heli_plant.parameters import PlantParameters, to_names
from tests.blind.coefficients import Coefficients
from tests.blind.plant import COUNTS_PER_TURN

Array = NDArray[np.float64]
REPORTED, TUNING = 2, 1
"""Seeds of the two halves."""

H, RATE = 0.01, 100
AFTER, UNCHANGED, SETTLED = 90.5, 600.0, 6.0
"""Flight after the last change, of an unchanged rig, and of an observer before its errors count [s]."""

# --- what changes ------------------------------------------------------------------------------------------------

GAIN, MASS, SHARE, WARM, SLOW = 0.2, 0.08, 0.8, 0.85, 60.0
"""Change of a gain [1], of the offset [rad/s^2], thrust left of a rotor and of warm motors [1], time of warming [s]."""

FRICTION, CABLE = 0.03, 0.06
"""Added dry friction [rad/s^2], stiffness of a cable that is hung on [1/s^2]."""

NAMES = {
    "k_x": "pitch.gain",
    "k_z": "elevation.gain",
    "k_y": "travel.gain",
    **{f"friction_{axis}": f"effects.dry_friction.{axis}" for axis in AXES},
    "mass": "elevation.offset",
    "front": "rotor.front",
    "rear": "rotor.rear",
    "cable": "effects.cable_stiffness.travel",
    "warming": "rotors.thrust",
}
"""Kinds of change, and what the twin should call them."""

ASKED = (*list(NAMES)[:7],)
"""Kinds of change for which a bar says how soon they are to be noticed."""

STREAMS = ("loss", "stuck", "stop", "jitter", "all")
"""Faults of a stream that come with a change: 5 % of the samples lost, an encoder stuck for 4 s, nothing for 5 s,
samples that arrive with a jitter of 20 ms and 5 % lost, all of them."""

FAULTY = "faulty"
"""All faults on an unchanged rig, stuck and stopped once a minute."""

KINDS, UNCHANGED_KINDS = (*NAMES, "two", *STREAMS), ("none", FAULTY)


def known(rig: Rig, rng: np.random.Generator) -> PlantParameters:
    """Return the values that a twin begins with.

    They err as those of a diagnosis do: gains, stiffnesses by 1 %, dampings by .01 1/s, torques in hover by .003
    rad/s^2.
    """
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
    c, (front, rear) = stage.coefficients, stage.shares
    friction = f"dry_friction_{kind.removeprefix('friction_')}"
    match kind:
        case "k_x" | "k_z" | "k_y":
            return Stage(start, c._replace(**{kind: getattr(c, kind) * (1.0 + sign * GAIN)}), stage.shares)
        case "mass":
            return Stage(start, c._replace(a_1=c.a_1 + sign * MASS), stage.shares)
        case "cable":
            return Stage(start, c._replace(cable_stiffness=CABLE), stage.shares)
        case "front":
            return Stage(start, c, (SHARE * front, rear))
        case "rear":
            return Stage(start, c, (front, SHARE * rear))
        case "warming":
            return Stage(start, c, (WARM * front, WARM * rear), SLOW)
    return Stage(start, c._replace(**{friction: getattr(c, friction) + FRICTION}), stage.shares)


def told(values: PlantParameters, before: Coefficients, stage: Stage) -> tuple[PlantParameters, tuple[float, float]]:
    """Return the values of a twin that is given the change, and the rotors' shares."""
    c = stage.coefficients
    same = {name: getattr(values, name) * getattr(c, name) / getattr(before, name) for name in ("k_x", "k_z", "k_y")}
    same |= {name: getattr(c, name) for name in (f"dry_friction_{axis}" for axis in AXES)}
    same["cable_stiffness_travel"] = c.cable_stiffness
    return values._replace(a_1=values.a_1 + c.a_1 - before.a_1, **same), stage.shares


# --- faults of a stream ------------------------------------------------------------------------------------------

LOST, STUCK, STOPPED = 0.05, 4.0, 5.0
"""Share of the samples that are lost [1], and the times of a stuck encoder and of a stop [s]."""

JITTER, DELAY, MAXIMUM_AGE = 0.02, 0.05, 0.2
"""Standard deviation of the time that a sample travels [s]; delay and maximum age of the units' link to a rig [s]."""


def broken(kind: str, rows: Array, start: float, rng: np.random.Generator) -> list[float]:
    """Put the fault of a stream into ``rows`` (N, 5), what the twin is shown.

    Returns 1 for samples that come in, else 0. A fault comes 20 s before the change at ``start`` [s], or 5 or 40 s
    after it.
    """
    fresh = [1.0] * len(rows)
    minutes = range(len(rows) // (60 * RATE))
    stuck = [start + rng.choice([-20.0, 5.0, 40.0])] if kind in ("stuck", "all") else []
    for time in [*stuck, *((60.0 * minute for minute in minutes) if kind == FAULTY else ())]:
        at = round(RATE * (time + (rng.uniform(15.0, 35.0) if kind == FAULTY else 0.0)))
        column = int(rng.integers(2, 5))
        rows[at : at + round(RATE * STUCK), column] = rows[at - 1, column]
    if kind in ("loss", "jitter", "all", FAULTY):
        for k in np.flatnonzero(rng.random(len(rows)) < LOST).tolist():
            fresh[k] = 0.0 if k > 0 else 1.0
    stops = [start + rng.choice([-20.0, 5.0, 40.0])] if kind in ("stop", "all") else []
    stops += [60.0 * minute + rng.uniform(40.0, 54.0) for minute in minutes] if kind == FAULTY else []
    for time in stops:
        silent = round(RATE * time)
        fresh[silent : silent + round(RATE * STOPPED)] = [0.0] * round(RATE * STOPPED)
    if kind in ("jitter", "all", FAULTY):
        return _late(rows, fresh, rng)
    for k in range(1, len(rows)):
        if not fresh[k]:
            rows[k] = rows[k - 1]
    return fresh


def _late(rows: Array, fresh: list[float], rng: np.random.Generator) -> list[float]:
    """Let the samples that are ``fresh`` travel for a random time, and put into ``rows`` what the units' link shows."""
    travelled = np.maximum(0.0, JITTER * (1.0 + rng.standard_normal(len(rows))))
    travelled[0] = 0.0
    arrivals: list[list[Datagram]] = [[] for _ in rows]
    for k in range(len(rows)):
        arrived = k + math.ceil(RATE * float(travelled[k]) - 1e-9)
        if fresh[k] and arrived < len(rows):
            arrivals[arrived].append(Datagram(k, k / RATE, tuple(rows[k].tolist())))
    clock, shown = Clock(DELAY, MAXIMUM_AGE, 1.0 / RATE), []
    for k in range(len(rows)):
        clock, seen = tick(clock, k / RATE, arrivals[k])
        shown.append(1.0 if seen.fresh else 0.0)
        rows[k] = rows[0] if seen.latest is None else seen.latest.signals
    return shown


# --- excited flight ----------------------------------------------------------------------------------------------

LIMIT, POWER, TESTS = 20.0, 0.95, 32
"""Time in which a change is to be noticed [s], with which probability, among how many: 16 of either sign."""


def excited_until(kind: str, rows: Array, c: Coefficients, start: float, false_alarm_time: float) -> float | None:
    """Return when 20 s of excited flight are over after a change at ``start`` [s]; None for kinds without a bar.

    ``rows`` (N, 5) has voltages [V] and angles [rad], ``c`` the rig before the change, ``false_alarm_time`` is T [s].
    The time is after the change, inf if longer than flown.
    """
    found = _added(kind, rows, c)
    if found is None:
        return None
    axis, g = found
    # what acted before the change did not act: the filter's error begins there
    total = np.cumsum(_information(g[round(start / H) :], axis, c))
    needed = (norm.ppf(1.0 - LIMIT / false_alarm_time / TESTS) + norm.ppf(POWER)) ** 2
    enough = np.flatnonzero(total > needed)
    return max(LIMIT, H * (int(enough[0]) + 1)) if len(enough) else math.inf


def _added(kind: str, rows: Array, c: Coefficients) -> tuple[int, Array] | None:
    """Return the axis on which a change acts, and the acceleration that it adds there [rad/s^2]."""
    pitch = rows[:, 2]
    if kind == "k_x":
        return 0, GAIN * c.k_x * _turned(rows[:, 0] - rows[:, 1], c)
    if kind == "k_z":
        return 1, GAIN * c.k_z * _turned(rows[:, 0] + rows[:, 1], c) * np.cos(pitch)
    if kind == "k_y":
        return 2, GAIN * c.k_y * _turned(rows[:, 0] + rows[:, 1], c) * np.sin(pitch)
    if kind == "mass":
        return 1, np.full(len(rows), MASS)
    if kind.startswith("friction_"):
        axis = AXES.index(kind.removeprefix("friction_"))
        # the sign of the rate over .2 s, in which a count of the encoder is 8 mrad/s
        rate = np.gradient(np.convolve(np.pad(rows[:, 2 + axis], 10, "edge"), np.ones(21) / 21.0, "valid"))
        return axis, -FRICTION * np.sign(rate)
    return None


def _turned(voltage: Array, c: Coefficients) -> Array:
    """Return a sum of voltages [V] as the rotors follow it."""
    stay = math.exp(-H / c.t_m)
    return lfilter([0.0, 1.0 - stay], [1.0, -stay], voltage - voltage[0]) + voltage[0]


def _information(g: Array, axis: int, c: Coefficients) -> Array:
    """Return psi^2/S of every sample."""
    fade = math.exp(-H / TORQUE_TIME)
    stiffness = (c.a_th, c.a_e, 0.0)[axis]
    damping = (c.a_wx, c.a_wz, c.a_wy)[axis]
    F = np.array([[1.0, H, 0.5 * H * H], [-stiffness * H, 1.0 - damping * H, H], [0.0, 0.0, fade]])
    Q = np.diag([0.0, 0.0, TORQUE_STD**2 * (1.0 - fade * fade)])
    count = 2.0 * math.pi / COUNTS_PER_TURN[axis]
    r = count * count * (1.0 / 12.0 + SHAKE * SHAKE)
    P = solve_discrete_are(F.T, np.array([[1.0], [0.0], [0.0]]), Q, np.array([[r]]))
    S = P[0, 0] + r
    gain, made, found = P[:, 0] / S, np.zeros(3), np.empty(len(g))
    for k in range(len(g)):
        made = F @ made + np.array([0.5 * H * H, H, 0.0]) * g[k]
        found[k] = made[0] ** 2 / S
        made = made - gain * made[0]
    return found


# --- one flight --------------------------------------------------------------------------------------------------


def flown(half: int, seed: int, kind: str) -> dict[str, Any]:
    """Fly one rig with one kind of change and follow it."""
    rng = np.random.default_rng([15, half, seed, (*KINDS, *UNCHANGED_KINDS).index(kind)])
    rig = draw_rig(rng)
    values = known(rig, rng)
    sign, start = float(rng.choice([-1.0, 1.0])), float(rng.uniform(35.0, 50.0))
    kinds = [] if kind in UNCHANGED_KINDS else [kind]
    if kind == "two":
        kinds = [str(name) for name in rng.choice([name for name in NAMES if name != "warming"], 2, replace=False)]
    elif kind in STREAMS:
        kinds = [str(rng.choice(["k_x", "k_z"]))]
    stages = [Stage(0.0, rig.coefficients)]
    for number, name in enumerate(kinds):
        stages.append(changed(name, stages[-1], start + 50.0 * number, sign))
    end = stages[-1].start + stages[-1].slow
    duration = end + AFTER if kinds else UNCHANGED
    rows = flight(rig, tuple(stages), duration, seed % 2 == 0, rng)
    measured = rows.copy()
    fresh = broken(kind, rows, stages[-1].start, rng)
    settings = FollowSettings(parameters=values)
    events, adoptions, errors = followed(rows, fresh, settings)
    row: dict[str, Any] = {"half": half, "seed": seed, "kind": kind, "events": events, "changes": [], "wrong": []}
    for name, stage in zip(kinds, stages[1:], strict=True):
        excited = excited_until(name, measured, rig.coefficients, stage.start, settings.false_alarm_time)
        row["changes"].append(
            {"kind": name, "name": NAMES[name], "start": stage.start, "slow": stage.slow,
             "excited": excited if excited is not None and math.isfinite(excited) else None}
        )  # fmt: skip
    plan = prepare_following(FollowSettings(parameters=values, correcting=False))
    if kinds:
        late = (errors[:, 0] >= end + 60.0) & (errors[:, 0] <= end + 90.0)
        row["error"], row["alone"] = _rms(errors[late, 1:4]), _rms(errors[late, 4:7])
        p, shares = told(values, rig.coefficients, stages[-1])
        informed = tuple(getattr(p, field) for field in plan.fields) + shares
        row["told"] = _rms(errors_ahead(rows, fresh, plan, end + 60.0, end + 90.0, informed))
    row["hours"] = duration / 3600.0
    for event, before in adoptions:
        since = event["time_s"] + 2.0
        during = (errors[:, 0] >= since) & (errors[:, 0] <= since + 60.0)
        alone = before == plan.alone.values
        old = errors[during, 4:7] if alone else errors_ahead(rows, fresh, plan, since, since + 60.0, before)
        row["wrong"].append([event["name"], event["time_s"], _rms(old), _rms(errors[during, 1:4])])
    return row


def followed(
    rows: Array, fresh: Sequence[float], settings: FollowSettings
) -> tuple[list[dict[str, Any]], list[tuple[dict[str, Any], tuple[float, ...]]], Array]:
    """Follow a record; return events, adoptions with the values before, and errors (M, 7): time, twin, alone."""
    plan, samples = prepare_following(settings), rows.tolist()
    state = start_correcting(plan, Sample(*samples[0]))
    events: list[dict[str, Any]] = []
    values, errors = [], []
    for k in range(1, len(samples)):
        before = state.values.end
        state, said = correct(state, Sample(*(*samples[k], fresh[k])), IdentifierReport(), plan)
        events.extend(event.document() for event in said)
        if state.values.end != before:
            values.append(before)
        errors.extend(_errors(samples[k], state))
    moved = [event for event in events if event["what"] in ("adopted", "rolled back")]
    adoptions = [pair for pair in zip(moved, values, strict=True) if pair[0]["what"] == "adopted"]
    keys = ("time_s", "what", "name", "value", "since_s", "why")
    return [{key: event[key] for key in keys} for event in events], adoptions, np.array(errors)


def _errors(row: Sequence[float], state: CorrectorState) -> list[tuple[float, ...]]:
    twins = state.predictions
    if not twins.compared:
        return []
    pairs = zip([*row[2:], *row[2:]], (*twins.used.predicted, *twins.alone.predicted), strict=True)
    return [(H * state.samples, *[measured - predicted for measured, predicted in pairs])]


def errors_ahead(
    rows: Array, fresh: Sequence[float], plan: FollowPlan, first: float, last: float, values: tuple[float, ...]
) -> Array:
    """Return the errors 1 s ahead (M, 3) [rad] of a twin with fixed ``values``, from ``first`` to ``last`` [s].

    It is a corrector that does not correct, so that it predicts from the same observer at the same samples.
    """
    begin, end = max(0, round(100 * (first - SETTLED))), min(len(rows), round(100 * last) + 1)
    fixed = plan._replace(alone=plan.twin(values))
    state = start_correcting(fixed, Sample(*rows[begin].tolist()))
    # a cable hangs straight where the whole record begins
    now = state.observer.instant
    rest = now.memory.state._replace(cable_rest=float(rows[0, 4]))
    now = now._replace(memory=now.memory._replace(state=rest))
    state = state._replace(observer=state.observer._replace(instant=now))
    errors = []
    for k in range(begin + 1, end):
        row = rows[k].tolist()
        state, _ = correct(state, Sample(*(*row, fresh[k])), IdentifierReport(), fixed)
        if k >= round(100 * first):
            errors.extend(_errors(row, state))
    return np.array([error[1:4] for error in errors]).reshape(-1, 3)


def _rms(errors: Array) -> float:
    """Return the rms over time of the length of the errors of the three axes [rad]."""
    return float(np.sqrt((errors**2).sum(axis=1).mean())) if len(errors) else float("nan")


# --- tables ------------------------------------------------------------------------------------------------------


def judged(row: dict[str, Any]) -> list[dict[str, Any]]:
    """Return for every change of a flight whether it was noticed, by the clock and in excited flight, and named."""
    found = []
    ends = [change["start"] for change in row["changes"][1:]] + [math.inf]
    for change, later in zip(row["changes"], ends, strict=True):
        alarms = [e for e in row["events"] if e["what"] == "alarm" and change["start"] <= e["time_s"] < later]
        tried = [event["name"] for event in alarms if not event["why"].startswith("the inno")]
        delay = alarms[0]["time_s"] - change["start"] if alarms else math.inf
        found.append(
            {"kind": change["kind"], "delay": delay, "noticed": delay <= (change["slow"] or LIMIT),
             "excited": None if change["excited"] is None else delay <= change["excited"],
             "named": tried[:1] == [change["name"]]}
        )  # fmt: skip
    return found


def false_alarms(row: dict[str, Any]) -> tuple[int, float]:
    """Return the alarms of the detector before the first change, and the hours flown until then."""
    until = row["changes"][0]["start"] if row["changes"] else 3600.0 * row["hours"]
    alarms = [event for event in row["events"] if event["what"] == "alarm" and event["time_s"] < until]
    return sum("no longer" in event["why"] for event in alarms), until / 3600.0


def summary(rows: Sequence[dict[str, Any]]) -> str:
    """Return the tables of a half."""
    head = ("change", "flights", "noticed", "after [s]", "named", "error/told: median, largest", "<= 1.15",
            "largest error/alone")  # fmt: skip
    lines = [_line(kind, own) for kind in KINDS if (own := [row for row in rows if row["kind"] == kind])]
    asked = [change for row in rows if row["kind"] in ASKED for change in judged(row)]
    excited = [change["excited"] for change in asked if change["excited"] is not None]
    text = [
        f"Gains, dry frictions, mass: noticed within 20 s {_count([c['noticed'] for c in asked])}, within 20 s of "
        f"excited flight {_count(excited)}, named {_count([c['named'] for c in asked])}."
    ]
    for name, kinds in (
        ("Unchanged rigs", ("none",)), ("Unchanged rigs, streams at fault", (FAULTY,)),
        ("Before a change", (*NAMES, "two")), ("Before a change, streams at fault", STREAMS),
    ):  # fmt: skip
        alarms = [false_alarms(row) for row in rows if row["kind"] in kinds]
        if alarms:
            text.append(f"{name}: {sum(n for n, _ in alarms)} false alarms in {sum(h for _, h in alarms):.1f} h.")
    adoptions = [one for row in rows for one in row["wrong"] if math.isfinite(one[2]) and math.isfinite(one[3])]
    wrong = [one for one in adoptions if one[3] > one[2]]
    text.append(f"Adoptions: {len(adoptions)}, wrong (worse over the next 60 s): {len(wrong)} {wrong or ''}")
    return "\n\n".join(([table(head, lines)] if lines else []) + text)


def _line(kind: str, rows: Sequence[dict[str, Any]]) -> tuple[str, ...]:
    changes = [change for row in rows for change in judged(row)]
    ratio, alone = (np.array([row["error"] / row[other] for row in rows]) for other in ("told", "alone"))
    delays = [change["delay"] for change in changes if math.isfinite(change["delay"])]
    return (
        kind, f"{len(rows)}", _count([change["noticed"] for change in changes]),
        f"{np.median(delays):.0f}" if delays else "", _count([change["named"] for change in changes]),
        f"{np.median(ratio):.3f}, {np.max(ratio):.2f}", _count((ratio <= 1.15).tolist()), f"{np.max(alone):.3f}",
    )  # fmt: skip


def _count(flags: Sequence[bool]) -> str:
    return f"{sum(flags)} of {len(flags)}"


def step_cost() -> str:
    """Return the processor time of a step [us]: 59 s of the scenario less 20 s of it, so that building cancels."""
    from fmu_src.master import run

    rng = np.random.default_rng(15)
    rig = draw_rig(rng)
    first = Stage(0.0, rig.coefficients)
    rows = flight(rig, (first, changed("k_z", first, 15.0, -1.0)), 60.0, True, rng)
    with TemporaryDirectory(prefix="heli-follow-") as folder:
        path = Path(folder) / "log.csv"
        head = "time [s],v_front [V],v_rear [V],pitch [rad],elevation [rad],travel [rad]"
        np.savetxt(path, np.column_stack([np.arange(len(rows)) * H, rows]), "%.9g", ",", header=head, comments="")
        values = to_names(known(rig, rng))
        parameters = {f"{unit}.{name}": value for unit in ("plant", "corrector") for name, value in values.items()}
        spent = []
        for seconds in (20.0, 59.0):
            began = process_time()
            run("follow", seconds, H, {"player.log.path": str(path), **parameters})
            spent.append(process_time() - began)
    micro = 1e6 * (spent[1] - spent[0]) / 3900
    return f"{micro:.0f} us of processor time a step (at most 250), with an alarm, a trial and an adoption"


def follow(arguments: Sequence[str]) -> None:
    """Fly, and print the tables."""
    asked = options(
        arguments,
        "follow",
        __doc__,
        "kind",
        tuning=(False, "the half that the rules were chosen on"),
        seeds=(40, "number behind the last seed of flights with a change"),
        first=(0, "seed of the first flight"),
        hours=(20.0, "flight of unchanged rigs of each kind, from seed 0"),
        rows=(Path, "file of the flights' results, which a later run goes on with"),
        step=(False, "time of a step alone"),
    )
    if asked.step:
        print(step_cost())
        return
    half = TUNING if asked.tuning else REPORTED
    kept = asked.rows.read_text(encoding="utf-8").splitlines() if asked.rows and asked.rows.exists() else []
    rows = [row for row in map(json.loads, kept) if row["half"] == half]
    done = {(row["seed"], row["kind"]) for row in rows}
    still = round(asked.hours * 3600.0 / UNCHANGED)
    for seed in range(asked.first, max(asked.seeds, still)):
        for kind in asked.kind or (*KINDS, *UNCHANGED_KINDS):
            if (seed, kind) not in done and seed < (still if kind in UNCHANGED_KINDS else asked.seeds):
                rows.append(flown(half, seed, kind))
                if asked.rows:
                    with asked.rows.open("a", encoding="utf-8") as file:
                        file.write(json.dumps(rows[-1]) + "\n")
    print(summary(rows))
