"""The following twin on generated rigs that change in flight: noticed, named, how well it predicts afterwards.

The arguments are kinds of change. Every seed from ``--first`` up to, not with, ``--seeds`` is a rig
(:mod:`tests.blind.flown`), in turn in closed and in open loop, with a flight for every kind of change, which comes
between 35 and 50 s; the flight ends 90 s after it. ``--tuning`` takes the rigs that constants were chosen on. The twin
begins with values that err as those of a diagnosis do. Kinds with a stream at fault have the change of a gain as well.
Unchanged rigs fly for 600 s each, ``--hours`` in all, with a stream in order (none) and with all its faults (faulty).

noticed: an alarm within 20 s by the clock (a slow change: before it is over); the bar counts excited flight (below).
named: the first change put on trial is the true one. error: rms over the three axes of errors 1 s ahead, from 60 to
90 s after the change; told, alone: that of a twin that was given the change, or was left as it was. A wrong adoption
makes predictions worse over the next 60 s than the values before.

**Excited flight.** A change adds the acceleration g to one axis. An oracle that knows all but which change took place
and when has the Kalman filter of x'' = -a x - b x' + d + g, d' = -d/tau + white noise, y = x + white noise, which
makes of g the innovations' mean psi, of variance S; after a time t it has J(t) = sum psi^2/S of information. The 20 s
of excited flight are over 20 s after the change, or when J reaches J* = 40, whichever is later.

J* is derived in docs/explanation/following.md.
"""

import math
from functools import partial
from itertools import chain

import numpy as np
import pandas
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are
from scipy.signal import dlsim, lfilter

from benchmarks.harness import Bar, Row, Words, bar_table, count, run_jobs, table
from heli_identifier import following
from heli_identifier.following import FollowSettings, Sample, TwinEvent
from heli_identifier.live import Clock, Datagram
from heli_plant.effects import AXES
from heli_plant.observer import FIELDS
from heli_plant.parameters import PlantParameters
from tests.blind import flown
from tests.blind.coefficients import Coefficients
from tests.blind.damage import FAULTY, LATE, STREAMS, interrupted
from tests.blind.flown import RATE, FlownRig, Stage
from tests.blind.plant import COUNTS_PER_TURN

Array = NDArray[np.float64]
TWIN, ALONE = slice(1, 4), slice(4, 7)  # columns of errors
H = 1.0 / RATE
AFTER, UNCHANGED, SETTLED = 90.5, 600.0, 6.0
"""Flight after the last change, of an unchanged rig, and of an observer before its errors count [s]."""

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
"""Kinds of change, and the names by which the twin should call them."""

TIMED_KINDS = tuple(NAMES)[:7]
"""Kinds of change with a bar on the time until they are noticed."""

KINDS, UNCHANGED_KINDS = (*NAMES, "two", *STREAMS), ("none", FAULTY)


def draw_initial_values(rig: FlownRig, rng: np.random.Generator) -> PlantParameters:
    """Return the values with which a twin starts: off by what a diagnosis errs, gains 1 %, dampings .01 1/s."""
    c, (elevation, thrust) = rig.coefficients, rig.hover
    shares, offsets = 1.0 + 0.01 * rng.standard_normal(7), 0.01 * rng.standard_normal(3)
    scaled = ("a_e", "k_z", "a_th", "k_x", "a_lt", "k_y")
    values = {name: getattr(c, name) * share for name, share in zip(scaled, shares.tolist(), strict=False)}
    values |= {name: getattr(c, name) + d for name, d in zip(("a_wx", "a_wz", "a_wy"), offsets.tolist(), strict=True)}
    d_pitch, d_elevation = (0.003 * rng.standard_normal(2)).tolist()
    a_1 = values["k_z"] * thrust - values["a_e"] * elevation + d_elevation
    return PlantParameters(**values, a_1=a_1, theta0=c.theta0 + d_pitch / c.a_th, T_m=c.t_m)


JITTER, DELAY, MAXIMUM_AGE = 0.02, 0.05, 0.2
"""Standard deviation of the delay of a sample [s]; delay and maximum age of the units' link to a rig [s]."""


def delay_samples(rows: Array, fresh: Array, rng: np.random.Generator) -> Array:
    """Delay the ``fresh`` samples at random; write the output of the units' link into ``rows``, return its flags."""
    delays = np.maximum(0.0, JITTER * (1.0 + rng.standard_normal(len(rows))))
    delays[0] = 0.0
    arrivals: dict[int, list[Datagram]] = {}
    for k in np.flatnonzero(fresh).tolist():
        arrival = k + math.ceil(RATE * float(delays[k]) - 1e-9)
        arrivals.setdefault(arrival, []).append(Datagram(k, k / RATE, tuple(rows[k].tolist())))
    clock, is_fresh = Clock(DELAY, MAXIMUM_AGE, 1.0 / RATE), np.zeros(len(rows))
    for k in range(len(rows)):
        clock.tick(k / RATE, arrivals.get(k, []))
        is_fresh[k] = clock.fresh
        rows[k] = rows[0] if clock.order.last is None else clock.order.last.signals
    return is_fresh


LIMIT, ENOUGH = 20.0, 40.0
"""Time within which a change is to be noticed [s], and the information J* that shows it [1]."""


def excited_until(kind: str, rows: Array, c: Coefficients, start: float) -> float | None:
    """Return when 20 s of excited flight after ``start`` [s] are over, for ``rows`` (N, 5); None without a bar."""
    if kind not in TIMED_KINDS:
        return None
    axis, pitch, decay = TIMED_KINDS.index(kind) % 3, rows[:, 2], math.exp(-H / c.t_m)
    if kind in GAINS:
        voltage = rows[:, 0] - rows[:, 1] if kind == "k_x" else rows[:, 0] + rows[:, 1]
        lagged = lfilter([0.0, 1.0 - decay], [1.0, -decay], voltage - voltage[0]) + voltage[0]  # by the motors
        g = flown.GAIN * getattr(c, kind) * lagged * (np.ones(len(rows)), np.cos(pitch), np.sin(pitch))[axis]
    elif kind == "mass":
        axis, g = 1, np.full(len(rows), flown.MASS)
    else:  # the sign of the rate over .2 s, in which a count of the encoder is 8 mrad/s
        angle = np.pad(rows[:, 2 + axis], 10, "edge")
        g = -flown.FRICTION * np.sign(np.gradient(np.convolve(angle, np.ones(21) / 21.0, "valid")))
    fade = math.exp(-H / flown.TORQUE_TIME)
    stiffness, damping = (c.a_th, c.a_e, 0.0)[axis], (c.a_wx, c.a_wz, c.a_wy)[axis]
    F = np.array([[1.0, H, 0.5 * H * H], [-stiffness * H, 1.0 - damping * H, H], [0.0, 0.0, fade]])
    Q, C = np.diag([0.0, 0.0, flown.TORQUE_STD**2 * (1.0 - fade * fade)]), np.array([[1.0, 0.0, 0.0]])
    r = (2.0 * math.pi / COUNTS_PER_TURN[axis]) ** 2 * (1.0 / 12.0 + flown.SHAKE**2)
    P = solve_discrete_are(F.T, C.T, Q, np.array([[r]]))
    S = P[0, 0] + r
    # the filter's error starts with the change
    error_transition, B = F @ (np.eye(3) - P[:, :1] @ C / S), np.array([[0.5 * H * H], [H], [0.0]])
    _, psi, _ = dlsim((error_transition, B, C @ error_transition, C @ B, H), g[round(start / H) :])
    enough = np.flatnonzero(np.cumsum(psi**2) / S > ENOUGH)
    return max(LIMIT, H * float(enough[0] + 1)) if len(enough) else None


def flight(half: int, seed: int, kind: str) -> list[Row]:
    """Fly one rig with one kind of change, follow it, and judge events and predictions of the twin."""
    rng = np.random.default_rng([15, half, seed, (*KINDS, *UNCHANGED_KINDS).index(kind)])
    rig = flown.draw_flown(rng)
    values = draw_initial_values(rig, rng)
    sign, start = float(rng.choice([-1.0, 1.0])), float(rng.uniform(35.0, 50.0))
    kinds = [] if kind in UNCHANGED_KINDS else [kind]
    if kind == "two":
        kinds = rng.choice([name for name in NAMES if name != "warming"], 2, replace=False).tolist()
    elif kind in STREAMS:
        kinds = [str(rng.choice(["k_x", "k_z"]))]
    stages = [Stage(0.0, rig.coefficients)]
    for number, name in enumerate(kinds):
        stages.append(flown.changed(name, stages[-1], start + 50.0 * number, sign))
    end = stages[-1].start + stages[-1].slow
    rows = flown.flight(rig, stages, end + AFTER if kinds else UNCHANGED, seed % 2 == 0, rng)
    measured = rows.copy()
    fresh = interrupted(kind, rows, stages[-1].start, rng)
    if kind in LATE:
        fresh = delay_samples(rows, fresh, rng)
    plan = following.FollowPlan(FollowSettings(parameters=values))
    fixed = following.FollowPlan(FollowSettings(parameters=values, correcting=False))
    errors, events, adoptions = follow_record(rows, fresh, plan)

    def error_with(twin: PlantParameters, begin: float, end: float) -> float:
        """Return the error of this twin, which predicts from the same observer at the same samples."""
        fixed.alone = twin
        return rms(follow_record(rows, fresh, fixed, begin, end)[0], columns=TWIN)

    alarms = [event for event in events if event.what == "alarm"]
    row: Row = {"kind": kind, "events": [event._asdict() for event in events], "changes": [], "adoptions": []}
    row["false"] = 0 if kinds else sum("no longer" in event.why for event in alarms)
    ends = [*(stage.start for stage in stages[2:]), math.inf][: len(kinds)]
    for name, stage, until in zip(kinds, stages[1:], ends, strict=True):
        of_change = [event for event in alarms if stage.start <= event.time_s < until]
        tried = [event.name for event in of_change if not event.why.startswith("the inno")]
        delay = of_change[0].time_s - stage.start if of_change else math.inf
        enough = excited_until(name, measured, rig.coefficients, stage.start)
        row["changes"].append({
            "delay": delay, "noticed": delay <= (stage.slow or LIMIT), "named": tried[:1] == [NAMES[name]],
            "excited": None if enough is None else delay <= enough,
        })  # fmt: skip
    if kinds:
        begin, last = end + 60.0, end + 90.0
        row["error"], row["alone"] = (rms(errors, begin, last, columns) for columns in (TWIN, ALONE))
        was, is_ = rig.coefficients, stages[-1].coefficients
        same = {name: getattr(values, name) * getattr(is_, name) / getattr(was, name) for name in GAINS}
        same |= {name: getattr(is_, name) for name in FRICTIONS} | {"a_1": values.a_1 + is_.a_1 - was.a_1}
        same |= dict(zip(FIELDS[-2:], stages[-1].shares, strict=True))
        p = values._replace(cable_stiffness_travel=is_.cable_stiffness, **same)
        row["told"] = error_with(p, begin, last)
    for event, before in adoptions:
        begin, last = event.time_s + 2.0, event.time_s + 62.0
        old = rms(errors, begin, last, ALONE)
        if before != plan.alone:
            old = error_with(before, begin, last)
        row["adoptions"].append([event.name, event.time_s, old, rms(errors, begin, last, TWIN)])
    texts = [f"{event.time_s:.1f} s {event.what} {event.name}" for event in events]
    return [row | {"line": f"{kind} {seed}: {'; '.join(texts) or 'nothing'}"}]


def follow_record(
    rows: Array, fresh: Array, plan: following.FollowPlan, begin: float = 0.0, end: float = 1e9
) -> tuple[Array, list[TwinEvent], list[tuple[TwinEvent, PlantParameters]]]:
    """Follow a record, for errors from ``begin`` to ``end`` [s].

    Returns errors 1 s ahead (M, 7): time, errors of the twin, errors of the twin that is left alone; events; adoptions
    with the twin before.
    """
    first, last = max(0, round(RATE * (begin - SETTLED))), min(len(rows), round(RATE * end) + 1)
    state = following.start_correcting(plan, Sample(*rows[first].tolist()))
    memory = state.observer.memory  # a cable hangs straight where the whole record begins
    memory = memory._replace(state=memory.state._replace(cable_rest=float(rows[0, 4])))
    state = state._replace(observer=state.observer._replace(memory=memory))
    errors: list[tuple[float, ...]] = []
    events, adoptions = list[TwinEvent](), list[tuple[TwinEvent, PlantParameters]]()
    for k in range(first + 1, last):
        before, sample = state.twin, Sample(*(*rows[k].tolist(), float(fresh[k])))
        state, new_events = following.correct(state, sample, plan)
        events += new_events
        adoptions += [(event, before) for event in new_events if event.what == "adopted"]
        twins = state.predictions
        if twins.compared and k >= round(RATE * begin):
            errors.append((H * k, *(rows[k, 2:] - twins.used.predicted), *(rows[k, 2:] - twins.alone.predicted)))
    return np.array(errors).reshape(-1, 7), events, adoptions


def rms(errors: Array, begin: float = 0.0, end: float = 1e9, columns: slice = ALONE) -> float:
    """Return the rms, from ``begin`` to ``end`` [s], of the length of the error vector of the three axes [rad]."""
    vectors = errors[(errors[:, 0] >= begin) & (errors[:, 0] <= end), columns]
    return float(np.sqrt((vectors**2).sum(axis=1).mean())) if len(vectors) else float("nan")


def follow(
    kinds: Words, tuning: bool = False, seeds: int = 40, first: int = 0, hours: float = 20.0, workers: int = 1
) -> None:
    """Fly, and print the tables."""
    unchanged_seeds = round(hours * 3600.0 / UNCHANGED)
    jobs = [
        partial(flight, 1 if tuning else 2, seed, kind)
        for seed in range(first, max(seeds, unchanged_seeds))
        for kind in kinds or (*KINDS, *UNCHANGED_KINDS)
        if seed < (unchanged_seeds if kind in UNCHANGED_KINDS else seeds)
    ]
    flights = run_jobs(jobs, workers)
    changed = flights[~flights.kind.isin(UNCHANGED_KINDS)]
    pairs = zip(changed.kind, changed.changes, strict=True)
    changes = pandas.DataFrame([{"kind": kind, **change} for kind, of_flight in pairs for change in of_flight])
    lines = []
    for name, group in changed.groupby("kind", sort=False):
        ratio, of_kind = group.error / group.told, changes[changes.kind == name]
        lines.append((
            name, len(group), count(of_kind.noticed), f"{of_kind.delay[of_kind.delay < math.inf].median():.0f}",
            count(of_kind.named), f"{ratio.median():.3f}, {ratio.max():.2f}", count(ratio <= 1.15),
            f"{(group.error / group.alone).max():.3f}",
        ))  # fmt: skip
    head = ("change", "flights", "noticed", "after [s]", "named", "error/told: median, largest", "<= 1.15",
            "largest error/alone")  # fmt: skip
    adoptions = [adoption for adoption in chain(*flights.adoptions) if np.isfinite(adoption[2:]).all()]
    bars = [Bar("adoptions that are wrong", [after > before for *_, before, after in adoptions], 1.0)]
    for name, group in flights[flights.kind.isin(UNCHANGED_KINDS)].groupby("kind"):
        hours, false = len(group) * UNCHANGED / 3600.0, float(group.false.sum())
        bars.append(Bar(f"false alarms in {hours:.1f} h of unchanged rigs, {name}", false, hours / 10.0))
    if len(changed):
        timed = changes[changes.kind.isin(TIMED_KINDS)]
        over_told, over_alone = changed.error / changed.told, changed.error / changed.alone
        bars += [
            Bar("gains, dry frictions, mass: noticed within 20 s", timed.noticed),
            Bar("the same within 20 s of excited flight", timed.excited.dropna(), least=95.0),
            Bar("the right one named", timed.named, least=90.0),
            Bar("error at most 1.15 times that of the twin that is told", over_told <= 1.15, least=100.0),
            Bar("error over that of the twin left alone, largest", over_alone.max(), 1.05),
        ]
    print(f"{table(head, lines)}\n\n{bar_table(bars)}")
