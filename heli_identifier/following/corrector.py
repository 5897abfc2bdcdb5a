"""The corrector: one sample in, the values in use out."""

from heli_plant.communication import begin
from heli_plant.motor import saturate
from heli_plant.observer import Torque, measured_against
from heli_plant.plant import measured_angles
from heli_plant.state import start_state

from .baseline import allowed_for, first_baseline
from .blocks import TESTED, UNKNOWN, Block, Sums, added, first_level, learned, multiplied, no_sums, noise_of, parted
from .detection import AT_ZERO, NOTHING
from .errors import Row, rms
from .events import Event
from .gap import crossed, no_gap, widened
from .instant import Instant, later
from .judgement import KEPT, judged
from .plan import FollowPlan
from .roughness import no_roughness, roughened
from .sensitivity import corrected_sensitivity, no_sensitivity
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
from .stream import discounted, first_stream, watched, withdraws
from .suspension import resumed, suspended, withdrawn
from .trust import full_trust, trusted
from .twins import first_twins, launched, moved
from .values import RAMP, ramped, start_values

LARGEST_INNOVATION = 4.0
"""Innovations count with at most this many standard deviations."""

_COUNT = 1.5e-3
"""Width of an encoder's grid that the noise begins with [rad]."""


def start_correcting(plan: FollowPlan, now: Sample) -> CorrectorState:
    """Return the state at sample 0, the plant at rest in its angles."""
    voltages = (now.v_front, now.v_rear)
    first = start_state(now.pitch, now.elevation, now.travel, *voltages)
    values = start_values(plan)
    a, b, c = plan.columns
    angles = (now.pitch, now.elevation, now.travel)
    instant = Instant(
        begin(first, values.parameters), Torque(), (no_sensitivity(a), no_sensitivity(b), no_sensitivity(c))
    )
    return CorrectorState(
        0,
        voltages,
        *instant,
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
        no_gap(instant, voltages),
        no_roughness(voltages),
        (),
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
    voltages = (now.v_front, now.v_rear)
    values = ramped(state.values, k, plan)
    fresh = now.fresh > 0.5
    unseen = state.gap.unseen if state.mode != SUSPENDED else 0
    if fresh and unseen > 0:
        ahead, arrived = crossed(state.gap, voltages, k, values, plan)
    else:
        before = Instant(state.memory, state.torque, state.sensitivities)
        ahead, arrived = later(before, state.voltages, (k - 1) * h, values, plan)
    angles = (now.pitch, now.elevation, now.travel)
    noise = noise_of(state.levels)
    trust = full_trust(plan)
    if fresh:
        pitch = ahead.memory.state.pitch
        trust = trusted(state.uncertainties, unseen, pitch, state.roughness, noise, values, plan)
    a, b, c = trust.deviations
    expected = (a * noise[0], b * noise[1], c * noise[2])
    stream = watched(state.stream, angles, fresh, ahead.memory.state, ahead.torque, expected, plan)
    fresh = fresh and not stream.broken
    state = state._replace(
        samples=k,
        voltages=voltages,
        memory=ahead.memory,
        torque=ahead.torque,
        sensitivities=ahead.sensitivities,
        arrived=(state.arrived[0] + arrived[0], state.arrived[1] + arrived[1]),
        values=values,
        stream=stream,
    )
    events: list[Event] = []
    if stream.broken and state.mode != SUSPENDED:
        state, events = suspended(state, time, plan)
    elif state.mode == SUSPENDED and fresh:
        state, events = resumed(state, now, time, plan)
    elif withdraws(stream, k, plan):
        state = withdrawn(state)

    seen = state.memory.state
    of_plant = measured_angles(seen)
    ramping = k < values.ramp + round(RAMP / h)
    resting = k < state.settled or stream.broken or ramping
    new_sensitivities = []
    new_sums: list[Sums] = []
    for axis in range(3):
        s = state.sensitivities[axis]
        total = state.sums[axis]
        left_out = resting or discounted(stream, axis, plan)
        if fresh and not left_out:
            share = 1.0 / trust.deviations[axis]
            innovation = share * (angles[axis] - of_plant[axis])
            if state.mode != STARTING:
                innovation = saturate(innovation, LARGEST_INNOVATION * noise[axis])
            psi = s.angle if share == 1.0 else tuple([share * x for x in s.angle])
            total = added(total, psi, innovation)
        elif not total.spoiled and left_out:
            total = total._replace(spoiled=True)
        new_sensitivities.append(corrected_sensitivity(s, trust.gains[axis]) if fresh else s)
        new_sums.append(total)
    sensitivities = (new_sensitivities[0], new_sensitivities[1], new_sensitivities[2])
    memory, torque, gap = state.memory, state.torque, state.gap
    roughness, uncertainties = state.roughness, state.uncertainties
    if fresh:
        kept, torque = measured_against(seen, torque, *angles, *trust.gains)
        memory = memory._replace(state=kept)
        roughness = roughened(roughness, voltages, gap.unseen > 0, h)
        uncertainties = trust.uncertainties if roughness.in_a_row < plan.remembered else ()
        gap = no_gap(Instant(memory, torque, sensitivities), voltages)
    else:
        gap = widened(gap, arrived)
    state = state._replace(
        memory=memory,
        torque=torque,
        sensitivities=sensitivities,
        sums=(new_sums[0], new_sums[1], new_sums[2]),
        gap=gap,
        roughness=roughness,
        uncertainties=uncertainties,
    )
    compared = False
    if k % plan.coarse == 0:
        state, compared = _coarse_step(state, angles, fresh, plan)
        if state.steps % plan.block == 0:
            state, said = judged(closed(state, plan), told, plan)
            events = events + said
    return state, _output(state, time, compared, events, plan)


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
        rms(state.twins.used[-plan.window :]) if compared else (0.0, 0.0, 0.0),
        rms(state.twins.alone[-plan.window :]) if compared else (0.0, 0.0, 0.0),
        (pitch, elevation, travel, seen.pitch_rate, seen.elevation_rate, seen.travel_rate),
        state.torque,
        state.values.now,
        state.values.errors,
        state.alarm,
        state.finding.change,
        state.mode,
        tuple(events),
    )
