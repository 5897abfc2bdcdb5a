"""The following twin on generated rigs that change in flight: noticed, named, how well it predicts afterwards.

    python -m benchmarks follow [--tuning] [--first N] [--seeds N] [--hours H] [--workers N] [KIND]...
    python -m benchmarks follow --step          processor time of a step of the scenario follow, pythonfmu units

``--tuning`` takes the rigs that the rules and their constants were chosen on. Every seed from ``--first`` up to, not
with, ``--seeds`` is a rig (:mod:`benchmarks.flown`), in turn in closed and in open loop, and flies once for every kind
of change, which comes between 35 and 50 s; the flight ends 90 s after it. The twin begins with values that err as those
of a diagnosis do. Kinds with a stream at fault have the change of one gain as well. Unchanged rigs fly for 600 s each,
``--hours`` in all, with a stream in order (none) and with every fault of it (faulty).

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

import math
from collections.abc import Sequence
from functools import partial
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are
from scipy.signal import lfilter
from scipy.stats import norm

from benchmarks.flown import SHAKE, TORQUE_STD, TORQUE_TIME, Rig, Stage, draw_rig, flight
from benchmarks.harness import Words, count, in_parallel, table
from fmu_src.master import run
from heli_identifier import following
from heli_identifier.following import Event, FollowSettings, Sample
from heli_identifier.live import Clock, Datagram
from heli_identifier.records import demo_files
from heli_plant.effects import AXES
from heli_plant.observer import FIELDS
from heli_plant.parameters import PlantParameters
from tests.blind.coefficients import Coefficients
from tests.blind.plant import COUNTS_PER_TURN

Array = NDArray[np.float64]
Row = dict[str, Any]
TWIN, ALONE = slice(1, 4), slice(4, 7)  # columns of errors
REPORTED, TUNING = 2, 1  # seeds of the two halves
H, RATE = 0.01, 100
AFTER, UNCHANGED, SETTLED = 90.5, 600.0, 6.0
"""Flight after the last change, of an unchanged rig, and of an observer before its errors count [s]."""

# --- what changes ------------------------------------------------------------------------------------------------

GAIN, MASS, FRICTION, CABLE, SLOW = 0.2, 0.08, 0.03, 0.06, 60.0
"""Change of a gain [1], of the offset, an added dry friction [rad/s^2], stiffness of a cable that is hung on [1/s^2],
time in which motors warm up [s]."""

SHARES = {"front": (0.8, 1.0), "rear": (1.0, 0.8), "warming": (0.85, 0.85)}
"""Thrust that is left of the front and the rear rotor [1]."""

GAINS, FRICTIONS = ("k_x", "k_z", "k_y"), tuple(f"dry_friction_{axis}" for axis in AXES)
NAMES = {
    **{gain: f"{axis}.gain" for gain, axis in zip(GAINS, AXES, strict=True)},
    **{f"friction_{axis}": f"effects.dry_friction.{axis}" for axis in AXES},
    "mass": "elevation.offset",
    "front": "rotor.front",
    "rear": "rotor.rear",
    "cable": "effects.cable_stiffness.travel",
    "warming": "rotor.both",
}
"""Kinds of change, and what the twin should call them."""

ASKED = tuple(NAMES)[:7]
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
    c, after = stage.coefficients, {}
    if kind in GAINS:
        after = {kind: getattr(c, kind) * (1.0 + sign * GAIN)}
    elif kind == "mass":
        after = {"a_1": c.a_1 + sign * MASS}
    elif kind == "cable":
        after = {"cable_stiffness": CABLE}
    elif kind not in SHARES:
        after = {f"dry_{kind}": getattr(c, f"dry_{kind}") + FRICTION}
    (front, rear), (front_left, rear_left) = stage.shares, SHARES.get(kind, (1.0, 1.0))
    shares = front_left * front, rear_left * rear
    return Stage(start, c._replace(**after), shares, SLOW if kind == "warming" else 0.0)


def told(values: PlantParameters, before: Coefficients, stage: Stage) -> PlantParameters:
    """Return the values of a twin that is given the change, without the rotors' shares."""
    c = stage.coefficients
    same = {name: getattr(values, name) * getattr(c, name) / getattr(before, name) for name in GAINS}
    same |= {name: getattr(c, name) for name in FRICTIONS}
    return values._replace(a_1=values.a_1 + c.a_1 - before.a_1, cable_stiffness_travel=c.cable_stiffness, **same)


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
    fresh = np.ones(len(rows))
    minutes = 60.0 * np.arange(len(rows) // (60 * RATE)) if kind == FAULTY else np.empty(0)
    stuck = [start + rng.choice([-20.0, 5.0, 40.0])] if kind in ("stuck", "all") else []
    for time in [*stuck, *minutes]:
        at = round(RATE * (time + (rng.uniform(15.0, 35.0) if kind == FAULTY else 0.0)))
        column = int(rng.integers(2, 5))
        rows[at : at + round(RATE * STUCK), column] = rows[at - 1, column]
    if kind in ("loss", "jitter", "all", FAULTY):
        fresh[1:][rng.random(len(rows))[1:] < LOST] = 0.0
    stops = [start + rng.choice([-20.0, 5.0, 40.0])] if kind in ("stop", "all") else []
    for time in [*stops, *(minute + rng.uniform(40.0, 54.0) for minute in minutes)]:
        fresh[round(RATE * time) :][: round(RATE * STOPPED)] = 0.0
    if kind in ("jitter", "all", FAULTY):
        return late(rows, fresh, rng)
    for k in np.flatnonzero(fresh == 0.0):
        rows[k] = rows[k - 1]
    return fresh.tolist()


def late(rows: Array, fresh: Array, rng: np.random.Generator) -> list[float]:
    """Let the samples that are ``fresh`` travel for a random time, and put into ``rows`` what the units' link shows."""
    travelled = np.maximum(0.0, JITTER * (1.0 + rng.standard_normal(len(rows))))
    travelled[0] = 0.0
    arrivals: dict[int, list[Datagram]] = {}
    for k in np.flatnonzero(fresh).tolist():
        arrived = k + math.ceil(RATE * float(travelled[k]) - 1e-9)
        arrivals.setdefault(arrived, []).append(Datagram(k, k / RATE, tuple(rows[k].tolist())))
    clock, shown = Clock(DELAY, MAXIMUM_AGE, 1.0 / RATE), []
    for k in range(len(rows)):
        clock.tick(k / RATE, arrivals.get(k, []))
        shown.append(float(clock.fresh))
        rows[k] = rows[0] if clock.order.last is None else clock.order.last.signals
    return shown


# --- excited flight ----------------------------------------------------------------------------------------------

LIMIT, POWER, TESTS = 20.0, 0.95, 32
"""Time in which a change is to be noticed [s], with which probability, among how many: 16 of either sign."""


def excited_until(kind: str, rows: Array, c: Coefficients, start: float, false_alarm_time: float) -> float | None:
    """Return when 20 s of excited flight are over after a change at ``start`` [s]; None for no bar, or not flown.

    ``rows`` (N, 5) has voltages [V] and angles [rad], ``c`` the rig before the change, ``false_alarm_time`` is T [s].
    """
    if kind not in ASKED:
        return None
    axis, pitch, stay = ASKED.index(kind) % 3, rows[:, 2], math.exp(-H / c.t_m)
    if kind in GAINS:
        voltage = rows[:, 0] - rows[:, 1] if kind == "k_x" else rows[:, 0] + rows[:, 1]
        turned = lfilter([0.0, 1.0 - stay], [1.0, -stay], voltage - voltage[0]) + voltage[0]  # as the rotors follow
        g = GAIN * getattr(c, kind) * turned * (np.ones(len(rows)), np.cos(pitch), np.sin(pitch))[axis]
    elif kind == "mass":
        axis, g = 1, np.full(len(rows), MASS)
    else:  # the sign of the rate over .2 s, in which a count of the encoder is 8 mrad/s
        angle = np.pad(rows[:, 2 + axis], 10, "edge")
        g = -FRICTION * np.sign(np.gradient(np.convolve(angle, np.ones(21) / 21.0, "valid")))
    fade = math.exp(-H / TORQUE_TIME)
    stiffness, damping = (c.a_th, c.a_e, 0.0)[axis], (c.a_wx, c.a_wz, c.a_wy)[axis]
    F = np.array([[1.0, H, 0.5 * H * H], [-stiffness * H, 1.0 - damping * H, H], [0.0, 0.0, fade]])
    Q = np.diag([0.0, 0.0, TORQUE_STD**2 * (1.0 - fade * fade)])
    r = (2.0 * math.pi / COUNTS_PER_TURN[axis]) ** 2 * (1.0 / 12.0 + SHAKE * SHAKE)
    P = solve_discrete_are(F.T, np.array([[1.0], [0.0], [0.0]]), Q, np.array([[r]]))
    S = P[0, 0] + r
    needed = (norm.ppf(1.0 - LIMIT / false_alarm_time / TESTS) + norm.ppf(POWER)) ** 2
    made, J, first = np.zeros(3), 0.0, round(start / H)
    for k in range(first, len(g)):  # what acted before the change did not act: the filter's error begins there
        made = F @ made + np.array([0.5 * H * H, H, 0.0]) * g[k]
        J += made[0] ** 2 / S
        if needed < J:
            return max(LIMIT, H * (k - first + 1))
        made = made - P[:, 0] / S * made[0]
    return None


# --- one flight --------------------------------------------------------------------------------------------------


def flown(half: int, seed: int, kind: str) -> Row:
    """Fly one rig with one kind of change, follow it, and judge what the twin said and predicted."""
    rng = np.random.default_rng([15, half, seed, (*KINDS, *UNCHANGED_KINDS).index(kind)])
    rig = draw_rig(rng)
    values = known(rig, rng)
    sign, start = float(rng.choice([-1.0, 1.0])), float(rng.uniform(35.0, 50.0))
    kinds = [] if kind in UNCHANGED_KINDS else [kind]
    if kind == "two":
        kinds = rng.choice([name for name in NAMES if name != "warming"], 2, replace=False).tolist()
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
    plan = following.FollowPlan(FollowSettings(parameters=values))
    fixed = following.FollowPlan(FollowSettings(parameters=values, correcting=False))
    errors, events, adoptions = followed(rows, fresh, plan)

    def with_values(begin: float, end: float, used: tuple[float, ...]) -> float:
        """Error of a twin with these values, which predicts from the same observer at the same samples."""
        fixed.alone = plan.twin(used)
        return rms(followed(rows, fresh, fixed, begin, end)[0], columns=TWIN)

    alarms = [event for event in events if event.what == "alarm"]
    first = stages[1].start if kinds else duration
    false = sum("no longer" in event.why for event in alarms if event.time < first)
    row: Row = {"kind": kind, "hours": first / 3600.0, "false": false, "changes": [], "adoptions": []}
    row["events"] = [event.document() for event in events]
    ends = [*(stage.start for stage in stages[2:]), math.inf][: len(kinds)]
    for name, stage, until in zip(kinds, stages[1:], ends, strict=True):
        own = [event for event in alarms if stage.start <= event.time < until]
        tried = [event.name for event in own if not event.why.startswith("the inno")]
        delay = own[0].time - stage.start if own else math.inf
        enough = excited_until(name, measured, rig.coefficients, stage.start, plan.settings.false_alarm_time)
        row["changes"].append({
            "delay": delay, "noticed": delay <= (stage.slow or LIMIT), "named": tried[:1] == [NAMES[name]],
            "excited": None if enough is None else delay <= enough,
        })  # fmt: skip
    if kinds:
        begin, last = end + 60.0, end + 90.0
        row["error"], row["alone"] = (rms(errors, begin, last, columns) for columns in (TWIN, ALONE))
        p = told(values, rig.coefficients, stages[-1])
        row["told"] = with_values(begin, last, (*(getattr(p, field) for field in FIELDS), *stages[-1].shares))
    for event, before in adoptions:
        begin, last = event.time + 2.0, event.time + 62.0
        left = before == plan.alone.values
        old = rms(errors, begin, last, ALONE) if left else with_values(begin, last, before)
        row["adoptions"].append([event.name, event.time, old, rms(errors, begin, last, TWIN)])
    return row


def followed(
    rows: Array, fresh: Sequence[float], plan: following.FollowPlan, begin: float = 0.0, end: float = 1e9
) -> tuple[Array, list[Event], list[tuple[Event, tuple[float, ...]]]]:
    """Follow a record, for errors from ``begin`` to ``end`` [s].

    Returns errors 1 s ahead (M, 7): time, the twin's, those of the one left alone; events; adoptions with the values
    before.
    """
    first, last = max(0, round(RATE * (begin - SETTLED))), min(len(rows), round(RATE * end) + 1)
    state = following.start_correcting(plan, Sample(*rows[first].tolist()))
    memory = state.observer.memory  # a cable hangs straight where the whole record begins
    memory = memory._replace(state=memory.state._replace(cable_rest=float(rows[0, 4])))
    state = state._replace(observer=state.observer._replace(memory=memory))
    errors: list[tuple[float, ...]] = []
    events, adoptions = list[Event](), list[tuple[Event, tuple[float, ...]]]()
    for k in range(first + 1, last):
        before, sample = state.twin.values, Sample(*(*rows[k].tolist(), fresh[k]))
        state, said = following.correct(state, sample, plan)
        events += said
        adoptions += [(event, before) for event in said if event.what == "adopted"]
        twins = state.predictions
        if twins.compared and k >= round(RATE * begin):
            errors.append((H * k, *(rows[k, 2:] - twins.used.predicted), *(rows[k, 2:] - twins.alone.predicted)))
    return np.array(errors).reshape(-1, 7), events, adoptions


def rms(errors: Array, begin: float = 0.0, end: float = 1e9, columns: slice = ALONE) -> float:
    """Return the rms over a time of the length of the errors of the three axes [rad]."""
    own = errors[(errors[:, 0] >= begin) & (errors[:, 0] <= end), columns]
    return float(np.sqrt((own**2).sum(axis=1).mean())) if len(own) else float("nan")


# --- tables ------------------------------------------------------------------------------------------------------


def summary(rows: Sequence[Row]) -> str:
    """Return the tables of some flights."""
    head = ("change", "flights", "noticed", "after [s]", "named", "error/told: median, largest", "<= 1.15",
            "largest error/alone")  # fmt: skip
    lines = []
    for kind in KINDS:
        if own := [row for row in rows if row["kind"] == kind]:
            changes = [change for row in own for change in row["changes"]]
            ratio, alone = (np.array([row["error"] / row[other] for row in own]) for other in ("told", "alone"))
            delays = [change["delay"] for change in changes if change["delay"] < math.inf]
            lines.append((
                kind, len(own), count(one["noticed"] for one in changes), f"{np.median(delays or [np.nan]):.0f}",
                count(one["named"] for one in changes), f"{np.median(ratio):.3f}, {np.max(ratio):.2f}",
                count(ratio <= 1.15), f"{np.max(alone):.3f}",
            ))  # fmt: skip
    asked = [change for row in rows if row["kind"] in ASKED for change in row["changes"]]
    noticed, excited, named = (
        count(one[key] for one in asked if one[key] is not None) for key in ("noticed", "excited", "named")
    )
    said = [f"Gains, dry frictions, mass: noticed within 20 s {noticed}, within 20 s of excited flight {excited}, "
            f"named {named}."]  # fmt: skip
    for name, kinds in (
        ("Unchanged rigs", ("none",)), ("Unchanged rigs, streams at fault", (FAULTY,)),
        ("Before a change", (*NAMES, "two")), ("Before a change, streams at fault", STREAMS),
    ):  # fmt: skip
        own = [row for row in rows if row["kind"] in kinds]
        said.append(f"{name}: {sum(r['false'] for r in own)} false alarms in {sum(r['hours'] for r in own):.1f} h.")
    known = [one for row in rows for one in row["adoptions"] if np.isfinite(one[2:]).all()]
    wrong = [one for one in known if one[3] > one[2]]
    said.append(f"Adoptions: {len(known)}, wrong (worse over the next 60 s): {len(wrong)} {wrong or ''}")
    return "\n\n".join((table(head, lines), *said))


def step_cost() -> str:
    """Return the processor time of a step [us]: 59 s of the scenario less 20 s of it, so that building cancels."""
    spent = [process_time()]
    for seconds in (20.0, 59.0):
        run("follow", seconds, H, {"player.log.path": str(demo_files("rig-a")[0][0])})
        spent.append(process_time())
    micro = 1e6 * (spent[2] - 2.0 * spent[1] + spent[0]) / 3900
    return f"{micro:.0f} us of processor time a step (at most 250), on a rig that the twin does not fit"


def follow(
    kinds: Words, tuning: bool = False, seeds: int = 40, first: int = 0, hours: float = 20.0, workers: int = 1,
    step: bool = False,
) -> None:  # fmt: skip
    """Fly, and print the tables."""
    if step:
        print(step_cost())
        return
    still = round(hours * 3600.0 / UNCHANGED)
    jobs = [
        partial(flown, TUNING if tuning else REPORTED, seed, kind)
        for seed in range(first, max(seeds, still))
        for kind in kinds or (*KINDS, *UNCHANGED_KINDS)
        if seed < (still if kind in UNCHANGED_KINDS else seeds)
    ]
    print(summary(list(in_parallel(partial.__call__, jobs, workers))))
