"""The corrector over whole records in a tenth of the time: what it does in every sample, compiled.

Hundreds of flights of two minutes take the pure step of :mod:`heli_identifier.online.following` an hour. Here the
samples of a block of one second go through one compiled loop over arrays, and what happens once per block (noise,
Page's test, naming, trial, adoption) is the corrector's own code. Blocks in which the stream is at fault, a value is
ramped or the noise is not known yet are taken by the pure step. ``tests/test_benchmarks_follow.py`` holds both to the
same events and values.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from heli_identifier.online.following import (
    CorrectorState,
    FollowPlan,
    Sample,
    Told,
    correct,
    parameters_of,
    start_correcting,
)
from heli_identifier.online.following.blocks import Sums
from heli_identifier.online.following.corrector import LARGEST_INNOVATION, closed
from heli_identifier.online.following.judgement import judged
from heli_identifier.online.following.sensitivity import Sensitivity
from heli_identifier.online.following.state import STARTING, SUSPENDED
from heli_plant.compiled import compiled_for, parameter_record
from heli_plant.correction import with_share
from heli_plant.laws import thrust_voltages
from heli_plant.observer import Torque
from heli_plant.plant import step
from heli_plant.state import PlantState

H, BLOCK, COARSE, LAUNCH, FULL = 0.01, 100, 5, 4, 5
"""Sampling period [s]; samples in a block and in a coarse step; coarse steps between launches; copies that run."""

_STUCK, _MOVING, _LONG, _HELD = 25, 0.03, 50, 0.06
_SMOOTHING = 0.005
_MOST = 8


def _block(rows, first, plant, torque, x, w, d, psi, products, squares, copies, count, rival_count, has_rival, arrived,
           p, p_alone, p_rival, shares, gains, most, angles, still, began, held, out):  # fmt: skip
    """Take the samples ``first`` .. ``first`` + 99; everything is changed in place; return (compared, fault)."""
    number = np.array([6, 6, 6])
    e_sum, taken, compared = np.zeros(3), 0, 0
    used_count, rivals = count, rival_count
    th, ep, la, w1, w2, w3, nf, nr, rest = (
        plant[0], plant[1], plant[2], plant[3], plant[4], plant[5], plant[6], plant[7], plant[11],
    )  # fmt: skip
    half = 0.5 * H * H
    g = np.zeros((3, _MOST))
    z = np.zeros(_MOST)
    for k in range(first, first + BLOCK):
        time = k * H
        v_front, v_rear = rows[k - 1, 0], rows[k - 1, 1]
        front, rear = with_share(v_front, shares[0], p.v_max), with_share(v_rear, shares[1], p.v_max)
        before = PlantState(th, ep, la, w1, w2, w3, nf, nr, 0.0, 0.0, 0.0, rest)
        after = step(before, front, rear, 0.0, (time - H) + 0 * H, H, p)
        mu_diff, mu_sum = thrust_voltages(0.5 * (nf + after.nu_front), 0.5 * (nr + after.nu_rear), time, p)
        up, aside = math.cos(th), math.sin(th)
        g[0, 0], g[0, 1], g[0, 2], g[0, 3] = mu_diff, mu_sum, 1.0, -w1
        g[1, 0], g[1, 1], g[1, 2], g[1, 3] = mu_sum * up, mu_diff * up, -1.0, -w2
        g[2, 0], g[2, 1], g[2, 2], g[2, 3] = mu_sum * aside, mu_diff * aside, 1.0, -w3
        g[0, 4], g[1, 4], g[2, 4] = (
            -math.tanh(w1 / _SMOOTHING),
            -math.tanh(w2 / _SMOOTHING),
            -math.tanh(w3 / _SMOOTHING),
        )
        g[2, 5] = -(la - rest)
        g[0, 5], g[1, 5] = -math.sin(th - p.theta0), -ep
        stiff = (p.a_th * math.cos(th - p.theta0), p.a_e, 0.0)
        damp = (p.a_wx, p.a_wz, p.a_wy)
        state = np.array([after.pitch, after.elevation, after.travel])
        rate = np.array([after.pitch_rate, after.elevation_rate, after.travel_rate])
        nf, nr = after.nu_front, after.nu_rear
        for axis in range(3):
            state[axis] += half * torque[axis]
            rate[axis] += H * torque[axis]
            torque[axis] *= gains[axis, 3]
        for axis in range(3):
            y = rows[k, 2 + axis]
            if y == angles[axis]:
                still[axis] += 1
                if still[axis] == 1:
                    began[axis], held[axis] = rate[axis], torque[axis]
                if still[axis] >= _STUCK and abs(began[axis]) > _MOVING:
                    return compared, True
                if still[axis] >= _LONG and abs(torque[axis] - held[axis]) > _HELD:
                    return compared, True
            else:
                still[axis] = 0
            angles[axis] = y
        for axis in range(3):
            n = number[axis]
            e = rows[k, 2 + axis] - state[axis]
            for i in range(n):
                a = g[axis, i] + d[axis, i] - stiff[axis] * x[axis, i] - damp[axis] * w[axis, i]
                moved = x[axis, i] + H * w[axis, i] + half * a
                w[axis, i] += H * a
                d[axis, i] *= gains[axis, 3]
                psi[axis, i] += moved
                x[axis, i] = (1.0 - gains[axis, 0]) * moved
                w[axis, i] -= gains[axis, 1] * moved
                d[axis, i] -= gains[axis, 2] * moved
            clipped = min(max(e, -most[axis]), most[axis])
            e_sum[axis] += clipped
            squares[axis] += clipped * clipped
            state[axis] += gains[axis, 0] * e
            rate[axis] += gains[axis, 1] * e
            torque[axis] += gains[axis, 2] * e
        taken += 1
        th, ep, la, w1, w2, w3 = state[0], state[1], state[2], rate[0], rate[1], rate[2]
        arrived[0] += v_front
        arrived[1] += v_rear
        if k % COARSE > 0:
            continue
        steps = k // COARSE
        length = COARSE * H
        a_front, a_rear = arrived[0] / COARSE, arrived[1] / COARSE
        arrived[:] = 0.0
        for twin in range(3):
            if twin == 2 and not has_rival:
                continue
            own = p if twin == 0 else (p_alone if twin == 1 else p_rival)
            f = a_front if twin == 1 else with_share(a_front, shares[2 * twin], own.v_max)
            r = a_rear if twin == 1 else with_share(a_rear, shares[2 * twin + 1], own.v_max)
            many = rivals if twin == 2 else used_count
            for j in range(many):
                c = copies[twin, j]
                one = PlantState(c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], 0.0, 0.0, 0.0, c[11])
                one = step(one, f, r, 0.0, (steps - 1) * length, length, own)
                c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7] = (
                    one.pitch, one.elevation, one.travel, one.pitch_rate, one.elevation_rate, one.travel_rate,
                    one.nu_front, one.nu_rear,
                )  # fmt: skip
        if steps % LAUNCH == 0:
            if used_count == FULL:
                out[compared, 0] = time
                for axis in range(3):
                    out[compared, 1 + axis] = rows[k, 2 + axis] - copies[0, 0, axis]
                    out[compared, 4 + axis] = rows[k, 2 + axis] - copies[1, 0, axis]
                    out[compared, 7 + axis] = np.nan
                    out[compared, 10 + axis] = copies[0, 0, axis]
                    out[compared, 13 + axis] = copies[1, 0, axis]
                if has_rival and rivals == FULL:
                    for axis in range(3):
                        out[compared, 7 + axis] = rows[k, 2 + axis] - copies[2, 0, axis]
                    for j in range(FULL - 1):
                        copies[2, j] = copies[2, j + 1]
                    rivals -= 1
                compared += 1
                for j in range(FULL - 1):
                    copies[0, j] = copies[0, j + 1]
                    copies[1, j] = copies[1, j + 1]
                used_count -= 1
            for twin in range(3):
                if twin == 2 and not has_rival:
                    continue
                c = copies[twin, rivals if twin == 2 else used_count]
                c[:] = 0.0
                c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[11] = th, ep, la, w1, w2, w3, nf, nr, rest
            used_count += 1
            if has_rival:
                rivals += 1
        for axis in range(3):
            n = number[axis]
            for i in range(n):
                z[i] = psi[axis, i]
            z[n] = e_sum[axis]
            share = 1.0 / taken
            q = 0
            for i in range(n + 1):
                for j in range(i, n + 1):
                    products[axis, q] += share * z[i] * z[j]
                    q += 1
            for i in range(n):
                psi[axis, i] = 0.0
            e_sum[axis] = 0.0
        taken = 0
    plant[0], plant[1], plant[2], plant[3], plant[4], plant[5], plant[6], plant[7] = th, ep, la, w1, w2, w3, nf, nr
    return compared, False


def corrected(
    rows: np.ndarray, fresh: list[float], plan: FollowPlan, told: Told | None = None
) -> tuple[list[Any], list[Any], list[tuple[float, ...]], CorrectorState]:
    """Correct over a record.

    Parameters
    ----------
    rows : ndarray, shape (N, 5)
        Voltages [V] and angles [rad] every 10 ms.
    fresh : list
        1 where a sample came in, else 0.
    plan : FollowPlan
        For 10 ms and the default effects.
    told : Told, optional

    Returns
    -------
    events, adoptions : list
        Events; of each block the values in use before it and after it, where they differ.
    errors : list of tuple
        Time [s] and the errors 1 s ahead of the twin in use and of the one left alone [rad].
    state : CorrectorState
        The last one.
    """
    told = told or Told()
    plain = rows.tolist()
    state = start_correcting(plan, Sample(*plain[0]))
    run = compiled_for(_block, plan.settings.parameters)
    alone = parameter_record(plan.settings.parameters)
    sound = np.asarray(fresh) > 0.5
    events: list[Any] = []
    errors: list[tuple[float, ...]] = []
    adoptions = []
    k = 1
    while k < len(rows):
        before = state.values.end
        ready = (
            (k - 1) % BLOCK == 0
            and k + BLOCK <= len(rows)
            and state.mode not in (STARTING, SUSPENDED)
            and k > state.settled
            and state.values.now == state.values.end
            and k > state.values.ramp + 200
            and state.stream.unseen == 0
            and bool(sound[k - 1 : k + BLOCK].all())
        )
        taken = _by_block(rows, k, state, told, plan, run, alone) if ready else None
        if taken is not None:
            state, said, found = taken
            k += BLOCK
        else:
            last = min(len(rows), (k - 1) // BLOCK * BLOCK + BLOCK + 1)
            said, found = [], []
            while k < last:
                state, output = correct(state, Sample(*plain[k], fresh[k]), told, plan)
                said.extend(output.events)
                if output.compared:
                    measured = plain[k][2:]
                    one = [a - b for a, b in zip(measured, output.predicted, strict=True)]
                    two = [a - b for a, b in zip(measured, output.predicted_alone, strict=True)]
                    found.append((output.time, *one, *two))
                k += 1
        events.extend(said)
        errors.extend(found)
        if state.values.end != before:
            adoptions.append((before, state.values.end))
    return events, adoptions, errors, state


def _by_block(
    rows: np.ndarray, k: int, state: CorrectorState, told: Told, plan: FollowPlan, run: Callable, alone: Any
) -> tuple[CorrectorState, list[Any], list[tuple[float, ...]]] | None:
    """Take one block by the compiled loop; None if the stream is at fault in it."""
    twins, values = state.twins, state.values
    plant, torque = np.array(state.memory.state), np.array(state.torque)
    x, w, d = np.zeros((3, _MOST)), np.zeros((3, _MOST)), np.zeros((3, _MOST))
    for axis, s in enumerate(state.sensitivities):
        n = len(s.angle)
        x[axis, :n], w[axis, :n], d[axis, :n] = s.angle, s.rate, s.torque
    psi, products, squares = np.zeros((3, _MOST)), np.zeros((3, 40)), np.zeros(3)
    copies = np.zeros((3, FULL + 1, 12))
    for twin, own in enumerate((twins.copies, twins.copies_alone, twins.copies_rival)):
        for j, one in enumerate(own):
            copies[twin, j] = one
    gains = np.array([plan.gains, plan.gains, plan.gains_travel])
    most = np.array([LARGEST_INNOVATION * math.sqrt(level.variance) for level in state.levels])
    angles, still = np.array(state.stream.angles), np.array(state.stream.still, dtype=np.int64)
    held = np.array(state.stream.torques)
    began, out, arrived = np.array(state.stream.rates), np.zeros((8, 16)), np.array(state.arrived)
    shares = np.array([*values.now[-2:], 1.0, 1.0, *(values.rival[-2:] or (1.0, 1.0))])
    has_rival = values.rival != ()
    compared, fault = run(
        rows, k, plant, torque, x, w, d, psi, products, squares, copies, len(twins.copies), len(twins.copies_rival),
        has_rival, arrived, parameter_record(values.parameters), alone, parameter_record(values.rival_parameters),
        shares, gains, most, angles, still, began, held, out,
    )  # fmt: skip
    if fault:
        return None
    launched = BLOCK // COARSE // LAUNCH
    count = min(FULL, len(twins.copies) + launched)
    rivals = min(FULL, len(twins.copies_rival) + launched) if has_rival else 0
    found = [tuple(row[:7]) for row in out[:compared].tolist()]
    pairs = [row for row in out[:compared].tolist() if not math.isnan(row[7])]
    window = plan.window
    twins = twins._replace(
        copies=tuple(PlantState(*one) for one in copies[0, :count].tolist()),
        copies_alone=tuple(PlantState(*one) for one in copies[1, :count].tolist()),
        copies_rival=tuple(PlantState(*one) for one in copies[2, :rivals].tolist()),
        used=(*twins.used, *(tuple(row[1:4]) for row in found))[-window:],
        alone=(*twins.alone, *(tuple(row[4:7]) for row in found))[-window:],
        against=(*twins.against, *(tuple(row[1:4]) for row in pairs)),
        rival=(*twins.rival, *(tuple(row[7:10]) for row in pairs)),
    )
    if compared:
        last = out[compared - 1].tolist()
        twins = twins._replace(predicted=tuple(last[10:13]), predicted_alone=tuple(last[13:16]))
    sizes = plan.columns
    sums = tuple(
        Sums(
            (0.0,) * n, 0.0, 0, tuple(products[axis, : (n + 1) * (n + 2) // 2].tolist()), float(squares[axis]), BLOCK,
            False,
        )
        for axis, n in enumerate(sizes)
    )  # fmt: skip
    sensitivities = tuple(
        Sensitivity(*(tuple(own[axis, :n].tolist()) for own in (x, w, d))) for axis, n in enumerate(sizes)
    )
    end = k + BLOCK - 1
    state = state._replace(
        samples=end,
        voltages=(float(rows[end, 0]), float(rows[end, 1])),
        memory=state.memory._replace(state=PlantState(*plant.tolist())),
        torque=Torque(*torque.tolist()),
        sensitivities=sensitivities,
        sums=sums,
        arrived=(0.0, 0.0),
        steps=state.steps + BLOCK // COARSE,
        twins=twins,
        stream=state.stream._replace(
            angles=tuple(angles.tolist()),
            still=tuple(still.tolist()),
            rates=tuple(began.tolist()),
            torques=tuple(held.tolist()),
        ),
    )
    state, said = judged(closed(state, plan), told, plan)
    return state, said, found


def _fixed(rows, begin, end, first, gains, shares, rest, p, out):
    """Fill ``out`` (M, 3) with the errors 1 s ahead of a plant with fixed values; return their number."""
    half, ahead, count = 0.5 * H * H, 100, 0
    torque, held = np.zeros(3), np.empty(2)
    one = PlantState(
        rows[begin, 2],
        rows[begin, 3],
        rows[begin, 4],
        0.0,
        0.0,
        0.0,
        rows[begin, 0],
        rows[begin, 1],
        0.0,
        0.0,
        0.0,
        rest,
    )
    for k in range(begin + 1, end - ahead):
        for i in range(2):
            held[i] = with_share(rows[k - 1, i], shares[i], p.v_max)
        one = step(one, held[0], held[1], 0.0, (k - 1) * H, H, p)
        state = np.array([one.pitch, one.elevation, one.travel])
        rate = np.array([one.pitch_rate, one.elevation_rate, one.travel_rate])
        for axis in range(3):
            state[axis] += half * torque[axis]
            rate[axis] += H * torque[axis]
            torque[axis] *= gains[axis, 3]
            e = rows[k, 2 + axis] - state[axis]
            state[axis] += gains[axis, 0] * e
            rate[axis] += gains[axis, 1] * e
            torque[axis] += gains[axis, 2] * e
        one = PlantState(
            state[0], state[1], state[2], rate[0], rate[1], rate[2], one.nu_front, one.nu_rear, 0.0, 0.0, 0.0, rest
        )
        if k % (COARSE * LAUNCH) == 0 and (k + ahead) * H >= first:
            free = one
            for j in range(k, k + ahead, COARSE):
                front = rear = 0.0
                for i in range(j, j + COARSE):
                    front += with_share(rows[i, 0], shares[0], p.v_max) / COARSE
                    rear += with_share(rows[i, 1], shares[1], p.v_max) / COARSE
                free = step(free, front, rear, 0.0, j * H, COARSE * H, p)
            out[count, 0] = rows[k + ahead, 2] - free.pitch
            out[count, 1] = rows[k + ahead, 3] - free.elevation
            out[count, 2] = rows[k + ahead, 4] - free.travel
            count += 1
    return count


def errors_ahead(
    rows: np.ndarray, plan: FollowPlan, first: float, last: float, values: tuple[float, ...]
) -> np.ndarray:
    """Return the errors 1 s ahead (M, 3) [rad] of a twin with fixed ``values``, from ``first`` to ``last`` [s]."""
    p = parameters_of(values, plan)
    begin, end = max(0, round((first - 6.0) / H)), min(len(rows), round(last / H) + 1)
    gains = np.array([plan.gains, plan.gains, plan.gains_travel])
    out = np.empty((max(0, end - begin), 3))
    run = compiled_for(_fixed, p)
    shares, rest = np.array(values[-2:]), float(rows[0, 4])
    return out[: run(rows, begin, end, first, gains, shares, rest, parameter_record(p), out)]
