"""The corrector: one sample in, the values in use out."""

from math import cos

from heli_plant.communication import PlantMemory, begin
from heli_plant.motor import saturate
from heli_plant.observer import Torque, measured_against, predicted
from heli_plant.plant import measured_angles
from heli_plant.state import start_state

from .baseline import allowed_for, first_baseline
from .blocks import TESTED, UNKNOWN, Block, Sums, added, first_level, learned, multiplied, no_sums, noise_of, parted
from .changes import TRAVEL
from .detection import AT_ZERO, NOTHING
from .errors import Row, rms
from .events import Event
from .judgement import KEPT, judged
from .plan import FollowPlan
from .regressors import acting
from .sensitivity import corrected_sensitivity, no_sensitivity, predicted_sensitivity
from .state import (
    FOLLOWING,
    ON_TRIAL,
    STARTING,
    SUSPENDED,
    WATCHED,
    CorrectorOutput,
    CorrectorState,
    Sample,
    Told,
)
from .stream import first_stream, standing, watched
from .suspension import resumed, suspended
from .twins import first_twins, launched, moved, scaled
from .values import RAMP, Values, ramped, start_values

LARGEST_INNOVATION = 4.0
"""Innovations count with at most this many standard deviations."""

_COUNT = 1.5e-3
"""Width of an encoder's grid that the noise begins with [rad]."""


def start_correcting(plan: FollowPlan, now: Sample) -> CorrectorState:
    """Return the state at sample 0, the plant at rest in its angles."""
    first = start_state(now.pitch, now.elevation, now.travel, now.v_front, now.v_rear)
    values = start_values(plan)
    a, b, c = plan.columns
    angles = (now.pitch, now.elevation, now.travel)
    return CorrectorState(
        0,
        (now.v_front, now.v_rear),
        begin(first, values.parameters),
        Torque(),
        (no_sensitivity(a), no_sensitivity(b), no_sensitivity(c)),
        (no_sums(a), no_sums(b), no_sums(c)),
        (first_level(_COUNT), first_level(_COUNT), first_level(_COUNT)),
        first_baseline(plan.deviations),
        (UNKNOWN,) * len(plan.changes),
        (0.0, 0.0),
        0,
        first_twins(angles),
        (),
        (),
        (AT_ZERO,) * len(plan.changes),
        0.0,
        values,
        STARTING,
        0,
        plan.settling,
        NOTHING,
        0,
        (0,) * len(plan.settings.effects),
        (),
        first_stream(angles),
    )


def correct(state: CorrectorState, now: Sample, told: Told, plan: FollowPlan) -> tuple[CorrectorState, CorrectorOutput]:
    """Take in the next sample.

    Parameters
    ----------
    state : CorrectorState
    now : Sample
        At the time of sample k = ``state.samples`` + 1.
    told : Told
        What the identifier last said.
    plan : FollowPlan

    Returns
    -------
    state : CorrectorState
    output : CorrectorOutput
    """
    h, k = plan.settings.sample_time, state.samples + 1
    time = k * h
    before = state.memory.state
    values = ramped(state.values, k, plan)
    memory, arrived = _advanced(state.memory, state.voltages, time - h, values, plan)
    ahead, torque = predicted(memory.state, state.torque, h, plan.gains)
    angles = (now.pitch, now.elevation, now.travel)
    fresh = now.fresh > 0.5
    noise = noise_of(state.levels)
    stream = watched(state.stream, angles, fresh, ahead, torque, noise, plan)
    fresh = fresh and not stream.broken
    state = state._replace(
        samples=k,
        voltages=(now.v_front, now.v_rear),
        memory=memory._replace(state=ahead),
        torque=torque,
        arrived=(state.arrived[0] + arrived[0], state.arrived[1] + arrived[1]),
        values=values,
        stream=stream,
    )
    events: list[Event] = []
    if stream.broken and state.mode != SUSPENDED:
        state, events = suspended(state, time, plan)
    elif state.mode == SUSPENDED and fresh:
        state, events = resumed(state, now, time, plan)

    # the accelerations by which each change would have acted, from the motion at the step's begin
    p, seen = values.parameters, state.memory.state
    mu_diff, mu_sum = plan.thrusts(
        0.5 * (before.nu_front + seen.nu_front), 0.5 * (before.nu_rear + seen.nu_rear), time, p
    )
    g = acting(before, mu_diff, mu_sum, plan.laws, p.theta0)
    own = ((p.a_th * cos(before.pitch - p.theta0), p.a_wx), (p.a_e, p.a_wz), (0.0, p.a_wy))
    of_plant = measured_angles(seen)
    ramping = k < values.ramp + round(RAMP / h)
    resting = k < state.settled or stream.broken or ramping
    new_sensitivities = []
    new_sums: list[Sums] = []
    for axis in range(3):
        stiffness, damping = own[axis]
        gains = plan.gains_travel if axis == TRAVEL else plan.gains
        s = predicted_sensitivity(state.sensitivities[axis], g[axis], stiffness, damping, h, gains)
        total = state.sums[axis]
        stands = standing(stream, axis, plan)
        if fresh and not resting and not stands:
            innovation = angles[axis] - of_plant[axis]
            most = LARGEST_INNOVATION * noise[axis]
            total = added(total, s.angle, saturate(innovation, most) if state.mode != STARTING else innovation)
        elif not total.spoiled and (resting or stands):
            total = total._replace(spoiled=True)
        new_sensitivities.append(corrected_sensitivity(s, gains) if fresh else s)
        new_sums.append(total)
    if fresh:
        kept, torque = measured_against(seen, state.torque, *angles, plan.gains, plan.gains_travel)
        state = state._replace(memory=state.memory._replace(state=kept), torque=torque)
    state = state._replace(
        sensitivities=(new_sensitivities[0], new_sensitivities[1], new_sensitivities[2]),
        sums=(new_sums[0], new_sums[1], new_sums[2]),
    )
    compared = False
    if k % plan.coarse == 0:
        state, compared = _coarse_step(state, angles, fresh, plan)
        if state.steps % plan.block == 0:
            state, said = judged(closed(state, plan), told, plan)
            events = events + said
    return state, _output(state, time, compared, events, plan)


def _advanced(
    memory: PlantMemory, voltages: tuple[float, float], time: float, values: Values, plan: FollowPlan
) -> tuple[PlantMemory, tuple[float, float]]:
    """Return the plant one sample later, and the voltages that arrived at its motors, without the rotors' shares."""
    h, p = plan.settings.sample_time, values.parameters
    front, rear = scaled(voltages, values.now, p.v_max)
    memory = plan.communicate(
        memory, front, rear, 0.0, time, 0.0, h, h, plan.delay, p, plan.step, plan.arriving
    )  # fmt: skip
    if plan.delay > 0.0:
        front, rear = plan.arriving(memory.since, memory.held, len(memory.since) - 1, time, h, p)
        return memory, (front / values.now[-2], rear / values.now[-1])
    return memory, voltages


def _coarse_step(state: CorrectorState, angles: Row, fresh: bool, plan: FollowPlan) -> tuple[CorrectorState, bool]:
    """Move the copies of the twins; compare those that have run for 1 s, start new ones; take the products."""
    steps = state.steps + 1
    length = plan.coarse * plan.settings.sample_time
    mean = state.arrived[0] / plan.coarse, state.arrived[1] / plan.coarse
    twins = moved(state.twins, mean, (steps - 1) * length, length, state.values, plan)
    compared = False
    if steps % plan.per_launch == 0:
        if state.mode != SUSPENDED and state.samples >= state.settled:
            has_rival = state.values.rival != ()
            twins, compared = launched(twins, state.memory.state, angles, fresh, has_rival, plan)
        else:
            twins = twins._replace(copies=(), copies_alone=(), copies_rival=())
    a, b, c = state.sums
    sums = multiplied(a), multiplied(b), multiplied(c)
    return state._replace(arrived=(0.0, 0.0), steps=steps, twins=twins, sums=sums), compared


def closed(state: CorrectorState, plan: FollowPlan) -> CorrectorState:
    """Return the state with the block that is complete taken in, and noise and baseline learned from it."""
    a, b, c = state.sums
    levels = state.levels
    r_a, b_a = parted(a, levels[0])
    r_b, b_b = parted(b, levels[1])
    r_c, b_c = parted(c, levels[2])
    if state.mode in (STARTING, FOLLOWING, WATCHED, ON_TRIAL):
        levels = learned(levels[0], a), learned(levels[1], b), learned(levels[2], c)
    state = state._replace(levels=levels, sums=(no_sums(len(a.psi)), no_sums(len(b.psi)), no_sums(len(c.psi))))
    if state.mode == STARTING:
        return state
    block = Block((r_a, r_b, r_c), (b_a, b_b, b_c))
    tested, baseline = allowed_for(block, state.baseline, state.mode == FOLLOWING, plan.deviations)
    return state._replace(
        blocks=(*state.blocks, block)[-KEPT:], tested=(*state.tested, tested)[-TESTED:], baseline=baseline
    )


def _output(
    state: CorrectorState, time: float, compared: bool, events: list[Event], plan: FollowPlan
) -> CorrectorOutput:
    seen = state.memory.state
    pitch, elevation, travel = measured_angles(seen)
    return CorrectorOutput(
        time,
        compared,
        state.twins.predicted,
        state.twins.predicted_alone,
        rms(state.twins.used) if compared else (0.0, 0.0, 0.0),
        rms(state.twins.alone) if compared else (0.0, 0.0, 0.0),
        (pitch, elevation, travel, seen.pitch_rate, seen.elevation_rate, seen.travel_rate),
        state.torque,
        state.values.now,
        state.values.errors,
        state.alarm,
        state.finding.change,
        state.mode,
        tuple(events),
    )
