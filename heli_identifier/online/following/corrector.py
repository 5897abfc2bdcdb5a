"""The corrector: one sample in, the values in use out."""

from math import cos, sqrt

from heli_plant.communication import PlantMemory, begin
from heli_plant.correction import with_share
from heli_plant.motor import saturate
from heli_plant.observer import Torque, measured_against, predicted
from heli_plant.plant import measured_angles
from heli_plant.state import PlantState, start_state

from .adoption import KEPT, judged
from .ahead import advanced, read
from .blocks import UNKNOWN, Block, Sums, added, first_level, learned, multiplied, no_sums, parted
from .changes import TRAVEL
from .detection import AT_ZERO, NOTHING
from .errors import Row, rms
from .events import BACK, CUT, FROZEN, HELD, STOPPED, STREAM, Event
from .plan import FollowPlan, parameters_of
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
    Stream,
    Told,
    Twins,
    Values,
)

_LARGEST_INNOVATION = 4.0
"""Innovations count with at most this many standard deviations."""

_DOUBTFUL = 2
"""Blocks before a fault of the stream that are dropped."""

_LONG_STUCK, _HELD = 0.5, 0.06
"""An encoder that stands still for this long [s] is at fault as well if meanwhile the acceleration with which the
observer holds the axis has grown by this much [rad/s^2]: more than dry friction of a usual bearing."""

_MOVING = 0.03
"""Rate [rad/s] at which an encoder that stands still is at fault: it would have moved by five counts of 4096."""

_COUNT = 1.5e-3
"""Width of an encoder's grid that the noise begins with [rad]."""

RAMP = 2.0
"""Time in which an adopted change is ramped in [s]."""


def start_correcting(plan: FollowPlan, now: Sample) -> CorrectorState:
    """Return the state at sample 0, the plant at rest in its angles."""
    first = start_state(now.pitch, now.elevation, now.travel, now.v_front, now.v_rear)
    values = plan.first_values
    p = parameters_of(values, plan)
    a, b, c = plan.columns
    angles = (now.pitch, now.elevation, now.travel)
    nothing = (0.0, 0.0, 0.0)
    return CorrectorState(
        0,
        (now.v_front, now.v_rear),
        begin(first, p),
        Torque(),
        (no_sensitivity(a), no_sensitivity(b), no_sensitivity(c)),
        (no_sums(a), no_sums(b), no_sums(c)),
        (first_level(_COUNT), first_level(_COUNT), first_level(_COUNT)),
        (UNKNOWN,) * len(plan.changes),
        (0.0, 0.0),
        0,
        Twins((), (), (), (), (), (), (), angles, angles),
        (),
        (AT_ZERO,) * len(plan.changes),
        Values(values, values, values, 0, (), (0.0,) * len(values), p, p),
        STARTING,
        0,
        plan.settling,
        NOTHING,
        0,
        (0,) * len(plan.settings.effects),
        Stream(0, angles, (0, 0, 0), nothing, nothing, False),
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
    values = _ramped(state.values, k, plan)
    p = values.parameters
    memory, arrived = _advanced(state.memory, state.voltages, time - h, values, plan)
    ahead, torque = predicted(memory.state, state.torque, h, plan.gains)
    memory = memory._replace(state=ahead)

    angles = (now.pitch, now.elevation, now.travel)
    fresh = now.fresh > 0.5
    stream = _watched(state.stream, angles, fresh, memory.state, torque, plan)
    events: list[Event] = []
    mode, since, settled = state.mode, state.since, state.settled
    twins, sums, sensitivities = state.twins, state.sums, state.sensitivities
    if stream.broken:
        fresh = False
        if mode != SUSPENDED:
            why = STOPPED if stream.unseen >= plan.stop else FROZEN
            events.append(Event(time, STREAM, -1, 0.0, 0.0, why, -1, time))
            if mode == ON_TRIAL:
                axis = plan.changes[state.finding.change].axis
                events.append(Event(time, HELD, state.finding.change, 0.0, 0.0, CUT, axis, time))
            mode, since = SUSPENDED, k
            values = values._replace(rival=())
            twins = twins._replace(copies=(), copies_alone=(), copies_rival=(), against=(), rival=())
            # what came in before the fault was seen is not to be trusted
            state = state._replace(blocks=state.blocks[:-_DOUBTFUL], pages=(AT_ZERO,) * len(state.pages))
    elif mode == SUSPENDED and fresh:
        events.append(Event(time, STREAM, -1, 0.0, 0.0, BACK, -1, time))
        settled = k + plan.settling
        mode, since = (FOLLOWING if k > plan.learning else STARTING), k
        rest = memory.state.cable_rest
        first = start_state(now.pitch, now.elevation, now.travel, memory.state.nu_front, memory.state.nu_rear)
        memory = PlantMemory(begin(first._replace(cable_rest=rest), p).state, memory.since, memory.held)
        torque = Torque()
        a, b, c = plan.columns
        sensitivities = (no_sensitivity(a), no_sensitivity(b), no_sensitivity(c))

    # the accelerations by which each change would have acted, from the motion at the step's begin
    before = state.memory.state
    mu_diff, mu_sum = plan.thrusts(
        0.5 * (before.nu_front + memory.state.nu_front), 0.5 * (before.nu_rear + memory.state.nu_rear), time, p
    )
    g = acting(before, mu_diff, mu_sum, plan.laws)
    own = ((p.a_th * cos(before.pitch - p.theta0), p.a_wx), (p.a_e, p.a_wz), (0.0, p.a_wy))
    seen = measured_angles(memory.state)
    innovation = (angles[0] - seen[0], angles[1] - seen[1], angles[2] - seen[2])
    ramping = k < values.ramp + round(RAMP / h)
    counts = fresh and k >= settled and not ramping
    new_sensitivities = []
    new_sums: list[Sums] = []
    for axis in range(3):
        stiffness, damping = own[axis]
        gains = plan.gains_travel if axis == TRAVEL else plan.gains
        s = predicted_sensitivity(sensitivities[axis], g[axis], stiffness, damping, h, gains)
        total = sums[axis]
        if counts:
            most = _LARGEST_INNOVATION * sqrt(state.levels[axis].variance)
            total = added(total, s.angle, saturate(innovation[axis], most) if mode != STARTING else innovation[axis])
        elif not total.spoiled and (k < settled or stream.broken or ramping):
            total = total._replace(spoiled=True)
        new_sensitivities.append(corrected_sensitivity(s, gains) if fresh else s)
        new_sums.append(total)
    if fresh:
        kept, torque = measured_against(memory.state, torque, *angles, plan.gains, plan.gains_travel)
        memory = memory._replace(state=kept)

    held = state.arrived[0] + arrived[0], state.arrived[1] + arrived[1]
    state = state._replace(
        samples=k,
        voltages=(now.v_front, now.v_rear),
        memory=memory,
        torque=torque,
        sensitivities=(new_sensitivities[0], new_sensitivities[1], new_sensitivities[2]),
        sums=(new_sums[0], new_sums[1], new_sums[2]),
        arrived=held,
        twins=twins,
        values=values,
        mode=mode,
        since=since,
        settled=settled,
        stream=stream,
    )
    compared = False
    if k % plan.coarse == 0:
        state, compared = _coarse_step(state, angles, fresh, plan)
        if state.steps % plan.block == 0:
            state, told_of = judged(_closed(state), told, plan)
            events.extend(told_of)
    return state, _output(state, time, compared, events, plan)


def _ramped(values: Values, k: int, plan: FollowPlan) -> Values:
    """Return the values of sample ``k``: on the ramp from ``begin`` to ``end``, then there."""
    if values.now == values.end:
        return values
    share = min(1.0, (k - values.ramp) * plan.settings.sample_time / RAMP)
    now = tuple([a + share * (b - a) for a, b in zip(values.begin, values.end, strict=True)])
    if share >= 1.0:
        now = values.end
    return values._replace(now=now, parameters=parameters_of(now, plan))


def scaled(voltages: tuple[float, float], values: tuple[float, ...], limit: float) -> tuple[float, float]:
    """Return the voltages [V] of rotors that have the last two of ``values`` as shares of their thrust left."""
    return with_share(voltages[0], values[-2], limit), with_share(voltages[1], values[-1], limit)


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


def _watched(stream: Stream, angles: Row, fresh: bool, state: PlantState, torque: Torque, plan: FollowPlan) -> Stream:
    """Return how the samples come in, after one more instant."""
    if not fresh:
        unseen = stream.unseen + 1
        return stream._replace(unseen=unseen, broken=stream.broken or unseen >= plan.stop)
    rates = (state.pitch_rate, state.elevation_rate, state.travel_rate)
    still = [0, 0, 0]
    began, torques = list(stream.rates), list(stream.torques)
    frozen = False
    for axis in range(3):
        if angles[axis] == stream.angles[axis]:
            still[axis] = stream.still[axis] + 1
            if still[axis] == 1:
                began[axis], torques[axis] = rates[axis], torque[axis]
            moving = still[axis] >= plan.stuck and abs(began[axis]) > _MOVING
            held = still[axis] * plan.settings.sample_time >= _LONG_STUCK and abs(torque[axis] - torques[axis]) > _HELD
            frozen = frozen or moving or held
    return Stream(
        0,
        angles,
        (still[0], still[1], still[2]),
        (began[0], began[1], began[2]),
        (torques[0], torques[1], torques[2]),
        frozen,
    )


def _coarse_step(state: CorrectorState, angles: Row, fresh: bool, plan: FollowPlan) -> tuple[CorrectorState, bool]:
    """Advance the copies of the twins; compare those that have run for 1 s, start new ones; take the products."""
    values, twins, steps = state.values, state.twins, state.steps + 1
    length = plan.coarse * plan.settings.sample_time
    mean = state.arrived[0] / plan.coarse, state.arrived[1] / plan.coarse
    begun = (steps - 1) * length
    first, p = plan.settings.parameters, values.parameters
    copies = advanced(twins.copies, scaled(mean, values.now, p.v_max), begun, length, p, plan.step)
    alone = advanced(twins.copies_alone, mean, begun, length, first, plan.step)
    rival: tuple[PlantState, ...] = ()
    if values.rival:
        q = values.rival_parameters
        rival = advanced(twins.copies_rival, scaled(mean, values.rival, q.v_max), begun, length, q, plan.step)
    twins = twins._replace(copies=copies, copies_alone=alone, copies_rival=rival)
    compared = False
    if steps % plan.per_launch == 0:
        if state.mode != SUSPENDED and state.samples >= state.settled:
            twins, compared = _launched(twins, state.memory.state, angles, fresh, values.rival != (), plan)
        else:
            twins = twins._replace(copies=(), copies_alone=(), copies_rival=())
    a, b, c = state.sums
    sums = multiplied(a), multiplied(b), multiplied(c)
    return state._replace(arrived=(0.0, 0.0), steps=steps, twins=twins, sums=sums), compared


def _difference(a: Row, b: Row) -> Row:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _launched(
    twins: Twins, seen: PlantState, angles: Row, fresh: bool, has_rival: bool, plan: FollowPlan
) -> tuple[Twins, bool]:
    """Compare the oldest copies if they have run for 1 s; start new ones from what the observer sees."""
    full = plan.horizon // plan.per_launch
    compared = len(twins.copies) == full
    if compared:
        predicted, alone = read(twins.copies[0]), read(twins.copies_alone[0])
        used_error = _difference(angles, predicted)
        if fresh:
            twins = twins._replace(
                used=(*twins.used, used_error)[-plan.window :],
                alone=(*twins.alone, _difference(angles, alone))[-plan.window :],
            )
        twins = twins._replace(
            copies=twins.copies[1:], copies_alone=twins.copies_alone[1:], predicted=predicted, predicted_alone=alone
        )
        if len(twins.copies_rival) == full:
            if fresh:
                error = _difference(angles, read(twins.copies_rival[0]))
                twins = twins._replace(against=(*twins.against, used_error), rival=(*twins.rival, error))
            twins = twins._replace(copies_rival=twins.copies_rival[1:])
    return twins._replace(
        copies=(*twins.copies, seen),
        copies_alone=(*twins.copies_alone, seen),
        copies_rival=(*twins.copies_rival, seen) if has_rival else (),
    ), compared and fresh


def _closed(state: CorrectorState) -> CorrectorState:
    """Return the state with the block that is complete taken in, where the noise is known, and its noise learned."""
    a, b, c = state.sums
    calm = state.mode in (STARTING, FOLLOWING, WATCHED, ON_TRIAL)
    r_a, b_a = parted(a, state.levels[0])
    r_b, b_b = parted(b, state.levels[1])
    r_c, b_c = parted(c, state.levels[2])
    blocks = state.blocks
    if state.mode != STARTING:
        blocks = (*blocks, Block((r_a, r_b, r_c), (b_a, b_b, b_c)))[-KEPT:]
    levels = state.levels
    if calm:
        levels = learned(levels[0], a), learned(levels[1], b), learned(levels[2], c)
    sums = no_sums(len(a.psi)), no_sums(len(b.psi)), no_sums(len(c.psi))
    return state._replace(blocks=blocks, levels=levels, sums=sums)


def _output(
    state: CorrectorState, time: float, compared: bool, events: list[Event], plan: FollowPlan
) -> CorrectorOutput:
    seen = state.memory.state
    alarm = 0.0
    for up, down, _, _ in state.pages:
        alarm = max(alarm, up, down)
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
        alarm / plan.threshold,
        state.finding.change,
        state.mode,
        tuple(events),
    )
