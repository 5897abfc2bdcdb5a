"""The corrector: one sample in, the values in use out. The follower: the same with the on-line identifier beside it."""

from typing import NamedTuple

from heli_plant.communication import PlantMemory
from heli_plant.motor import saturate
from heli_plant.parameters import PlantParameters
from heli_plant.plant import measured_angles
from heli_plant.state import start_state

from ..online import (
    PREDICTION_ERROR,
    IdentifierOutput,
    IdentifierSettings,
    IdentifierState,
    Plan,
    before_samples,
    prepare,
    start,
    step,
)
from . import blocks, prediction
from .baseline import allow_for_baseline, forget_latest, start_baseline
from .blocks import Sums
from .cusum import NOTHING, Cusum
from .observer import (
    Angles,
    Weight,
    advance_observer,
    correct_observer,
    miss_sample,
    start_instant,
    start_observer,
    weigh_full,
    weigh_sample,
)
from .plan import FollowPlan, FollowSettings, prepare_following
from .prediction import Predictions
from .state import (
    FOLLOWING,
    HEARD,
    HELD,
    ON_TRIAL,
    STARTING,
    STREAM,
    SUSPENDED,
    WATCHED,
    CorrectorOutput,
    CorrectorState,
    Event,
    IdentifierReport,
    Sample,
    Values,
    make_event,
)
from .stream import is_discounted, start_stream, stood_in_last_block, update_stream
from .trial import judge_block

_LARGEST_INNOVATION = 4.0
"""Innovations count with at most this many standard deviations."""

_RAMP = 2.0
"""Time in which an adopted change is ramped in [s]."""

_KEPT = 90
"""Blocks that are kept: a change is looked for in the last minute and a half."""

_TESTED = blocks.PROVED + 3
"""Blocks that are kept as the tests see them: a proved one and the two before it."""

_DROPPED = 2
"""Blocks before a fault of the stream that are dropped: it is seen only after a while."""

_FORGETTING = 0.02
"""Of the identifier beside the twin [1/s]: what changed a minute ago is known."""


def start_correcting(plan: FollowPlan, now: Sample) -> CorrectorState:
    """Return the state at sample 0, the plant at rest in its angles."""
    voltages, angles = (now.v_front, now.v_rear), (now.pitch, now.elevation, now.travel)
    twin, count = plan.twin(plan.first_values), len(plan.changes)
    instant = start_instant(start_state(*angles, *voltages), twin.parameters, plan.columns)
    return CorrectorState(
        samples=0,
        mode=STARTING,
        since=0,
        settled=plan.settling,
        observer=start_observer(instant, voltages),
        stream=start_stream(angles),
        values=Values(twin, twin.values, twin.values, 0, (), (0.0,) * len(twin.values)),
        predictions=Predictions(angles, angles),
        sums=tuple([blocks.start_sums(n) for n in plan.columns]),
        noises=(blocks.Noise(), blocks.Noise(), blocks.Noise()),
        baseline=start_baseline(plan.deviations),
        inflations=(blocks.Inflation(),) * count,
        blocks=(),
        tested=(),
        cusums=(Cusum(),) * count,
        cusums_before=(Cusum(),) * count,
        alarm=0.0,
        run=0,
        finding=NOTHING,
        scored=(0,) * len(plan.settings.effects),
        heard=(),
    )


def correct(
    state: CorrectorState, now: Sample, report: IdentifierReport, plan: FollowPlan
) -> tuple[CorrectorState, CorrectorOutput]:
    """Take in the next sample.

    Parameters
    ----------
    state : CorrectorState
    now : Sample
        At the time of sample k = ``state.samples`` + 1.
    report : IdentifierReport
        What the identifier last said.
    plan : FollowPlan

    Returns
    -------
    state : CorrectorState
    output : CorrectorOutput
    """
    k = state.samples + 1
    time = k * plan.settings.sample_time
    voltages, angles = (now.v_front, now.v_rear), (now.pitch, now.elevation, now.travel)
    values = _ramp(state.values, k, plan)
    p, fresh = values.now.parameters, now.fresh > 0.5
    unseen = state.observer.gap.unseen if state.mode != SUSPENDED else 0
    observer, arrived = advance_observer(state.observer, voltages, k, fresh and unseen > 0, values.now, plan.observer)
    noise = blocks.deviations_of(state.noises)
    weight = weigh_sample(observer, unseen, noise, p, plan.observer) if fresh else weigh_full(plan.observer)
    scatter = tuple([a * b for a, b in zip(weight.deviations, noise, strict=True)])
    predicted = observer.instant
    stream = update_stream(state.stream, angles, fresh, predicted.memory.state, predicted.torque, scatter, plan)
    fresh = fresh and not stream.broken
    predictions = state.predictions
    predictions = predictions._replace(
        arrived=(predictions.arrived[0] + arrived[0], predictions.arrived[1] + arrived[1])
    )
    state = state._replace(samples=k, observer=observer, values=values, stream=stream, predictions=predictions)
    events: list[Event] = []
    if stream.broken and state.mode != SUSPENDED:
        state, events = _suspend(state, time, plan)
    elif state.mode == SUSPENDED and fresh:
        state, events = _resume(state, angles, time, plan)
    elif stood_in_last_block(stream, k, plan):
        state = _withdraw_block(state)
    state = state._replace(sums=_take_innovations(state, angles, fresh, weight, noise, plan))
    if fresh:
        state = state._replace(observer=correct_observer(state.observer, angles, weight, plan.observer))
    else:
        state = state._replace(observer=miss_sample(state.observer, arrived))
    compared = False
    if k % plan.coarse == 0:
        state, compared = _coarse_step(state, angles, fresh, plan)
        if state.predictions.steps % plan.block == 0:
            state, said = judge_block(_close_block(state, plan), report, plan)
            events = events + said
    return state, _output(state, time, compared, events, plan)


def _ramp(values: Values, k: int, plan: FollowPlan) -> Values:
    """Return the values of sample ``k``: on the ramp from ``begin`` to ``end``, then there."""
    if values.now.values == values.end:
        return values
    share = min(1.0, (k - values.ramp) * plan.settings.sample_time / _RAMP)
    now = tuple([a + share * (b - a) for a, b in zip(values.begin, values.end, strict=True)])
    return values._replace(now=plan.twin(values.end if share >= 1.0 else now))


def _suspend(state: CorrectorState, time: float, plan: FollowPlan) -> tuple[CorrectorState, list[Event]]:
    """Return the state with everything at rest; a trial is broken off."""
    events = [make_event(time, STREAM, "stopped" if state.stream.unseen >= plan.stop else "frozen", plan)]
    if state.mode == ON_TRIAL:
        events.append(make_event(time, HELD, "cut", plan, state.finding.change))
    return state.without_alarm().enter(
        SUSPENDED,
        values=state.values._replace(rival=()),
        predictions=prediction.drop_rival(prediction.drop_copies(state.predictions)),
        blocks=state.blocks[:-_DROPPED],
        tested=(),
        baseline=forget_latest(state.baseline),
        observer=state.observer._replace(covariances=()),
    ), events


def _resume(state: CorrectorState, angles: Angles, time: float, plan: FollowPlan) -> tuple[CorrectorState, list[Event]]:
    """Return the state with the observer begun again from a sample's ``angles``."""
    memory = state.observer.instant.memory
    first = start_state(*angles, memory.state.nu_front, memory.state.nu_rear)
    first = first._replace(cable_rest=memory.state.cable_rest)
    instant = start_instant(first, state.values.now.parameters, plan.columns)
    instant = instant._replace(memory=PlantMemory(instant.memory.state, memory.since, memory.held))
    return state.enter(
        FOLLOWING if blocks.is_noise_known(state.noises) else STARTING,
        settled=state.samples + plan.settling,
        observer=state.observer._replace(instant=instant),
    ), [make_event(time, STREAM, "back", plan)]


def _withdraw_block(state: CorrectorState) -> CorrectorState:
    """Return the state as if the last block had told nothing: an encoder stood in it, which has been seen only now."""
    return state._replace(
        blocks=(*state.blocks[:-1], *[blocks.empty_block(block) for block in state.blocks[-1:]]),
        tested=(*state.tested[:-1], *[blocks.empty_block(block) for block in state.tested[-1:]]),
        cusums=state.cusums_before,
    )


def _take_innovations(
    state: CorrectorState, angles: Angles, fresh: bool, weight: Weight, noise: tuple[float, ...], plan: FollowPlan
) -> tuple[Sums, ...]:
    """Return the sums with a sample's innovations; sums without them are spoiled."""
    instant, k = state.observer.instant, state.samples
    predicted = measured_angles(instant.memory.state)
    ramping = k < state.values.ramp + round(_RAMP / plan.settings.sample_time)
    resting = k < state.settled or state.stream.broken or ramping
    result: list[Sums] = []
    for axis in range(3):
        total = state.sums[axis]
        if resting or is_discounted(state.stream.encoders[axis], plan):
            total = total if total.spoiled else total._replace(spoiled=True)
        elif fresh:
            share = 1.0 / weight.deviations[axis]
            innovation = share * (angles[axis] - predicted[axis])
            if state.mode != STARTING:
                innovation = saturate(innovation, _LARGEST_INNOVATION * noise[axis])
            psi = instant.sensitivities[axis].angle
            total = blocks.add_sample(total, psi if share == 1.0 else tuple([share * x for x in psi]), innovation)
        result.append(total)
    return tuple(result)


def _coarse_step(state: CorrectorState, angles: Angles, fresh: bool, plan: FollowPlan) -> tuple[CorrectorState, bool]:
    """Move the copies of the twins; compare those that have run for 1 s, start new ones; take the products."""
    values, compared = state.values, False
    predictions = prediction.move_copies(
        state.predictions, values.now, plan.twin(plan.first_values), values.rival, plan
    )
    if predictions.steps % plan.per_launch == 0:
        if state.mode != SUSPENDED and state.samples >= state.settled:
            seen = state.observer.instant.memory.state
            predictions, compared = prediction.launch_copies(predictions, seen, angles, fresh, values.rival != (), plan)
        else:
            predictions = prediction.drop_copies(predictions)
    sums = tuple([blocks.add_products(one) for one in state.sums])
    return state._replace(predictions=predictions, sums=sums), compared


def _close_block(state: CorrectorState, plan: FollowPlan) -> CorrectorState:
    """Return the state with the block that is complete taken in, and noise and baseline learned from it."""
    block = blocks.close_block(state.sums, state.noises)
    if state.mode in (STARTING, FOLLOWING, WATCHED, ON_TRIAL):
        learned = [blocks.learn_noise(*own) for own in zip(state.noises, state.sums, strict=True)]
        state = state._replace(noises=tuple(learned))
    state = state._replace(sums=tuple([blocks.start_sums(n) for n in plan.columns]))
    if state.mode == STARTING:
        return state
    tested, baseline = allow_for_baseline(block, state.baseline, state.mode == FOLLOWING, plan.deviations)
    return state._replace(
        blocks=(*state.blocks, block)[-_KEPT:], tested=(*state.tested, tested)[-_TESTED:], baseline=baseline
    )


def _output(
    state: CorrectorState, time: float, compared: bool, events: list[Event], plan: FollowPlan
) -> CorrectorOutput:
    instant, predictions = state.observer.instant, state.predictions
    seen = instant.memory.state
    nothing = (0.0, 0.0, 0.0)
    return CorrectorOutput(
        time=time,
        compared=compared,
        predicted=predictions.predicted,
        predicted_alone=predictions.predicted_alone,
        error=prediction.rms(predictions.used[-plan.window :]) if compared else nothing,
        error_alone=prediction.rms(predictions.alone[-plan.window :]) if compared else nothing,
        observed=(*measured_angles(seen), seen.pitch_rate, seen.elevation_rate, seen.travel_rate),
        torque=instant.torque,
        values=state.values.now.values,
        standard_errors=state.values.errors,
        alarm=state.alarm,
        suspect=state.finding.change,
        mode=state.mode,
        events=tuple(events),
    )


class Follower(NamedTuple):
    """Plans of identifier and corrector."""

    identifier: Plan
    corrector: FollowPlan


class FollowState(NamedTuple):
    """States of identifier and corrector, and what the identifier said last."""

    identifier: IdentifierState
    corrector: CorrectorState
    estimates: IdentifierOutput


class FollowOutput(NamedTuple):
    """What the corrector says after a sample, and the identifier's estimates."""

    corrector: CorrectorOutput
    estimates: IdentifierOutput


def prepare_follower(settings: FollowSettings) -> Follower:
    """Return the plans of ``settings``; the identifier is the one that holds in closed loop, and forgets."""
    beside = IdentifierSettings(
        sample_time=settings.sample_time,
        method=PREDICTION_ERROR,
        forgetting=_FORGETTING,
        motor_time_constant=settings.parameters.T_m,
        voltage_limit=settings.parameters.v_max,
        report_interval=2.0,
        watched=settings.effects,
    )
    return Follower(prepare(beside), prepare_following(settings))


def start_following(plan: Follower, now: Sample) -> FollowState:
    """Return the state at sample 0."""
    state = start(plan.identifier, now[:5])
    return FollowState(state, start_correcting(plan.corrector, now), before_samples(plan.identifier))


def follow(state: FollowState, now: Sample, plan: Follower) -> tuple[FollowState, FollowOutput]:
    """Take in the next sample.

    The corrector takes the measurement of sample k and what the identifier said after sample k - 1: that is what a unit
    sees whose inputs are set at a communication point.
    """
    said = state.estimates
    report = IdentifierReport(
        said.excitation,
        tuple([score.score for score in said.scores]),
        tuple([getattr(said.parameters, field) for field in HEARD]),
        tuple([getattr(said.standard_errors, field) for field in HEARD]),
    )
    corrector, output = correct(state.corrector, now, report, plan.corrector)
    identifier, estimates = step(state.identifier, now[:5], plan.identifier)
    return FollowState(identifier, corrector, estimates), FollowOutput(output, estimates)


def parameters_in_use(state: CorrectorState, plan: FollowPlan) -> PlantParameters:
    """Return the plant's parameters that the twin uses, the rotors' shares folded in.

    Rotors with the shares f and r of their thrust have mu_d = f nu_f - r nu_r = a (nu_f - nu_r) + b (nu_f + nu_r) with
    a = (f + r)/2, b = (f - r)/2: on the pitch k_x becomes a k_x, and the rotors' sum turns it by b k_x (rotor
    mismatch); k_z and k_y become a k_z and a k_y, where b (nu_f - nu_r) is left out.
    """
    p, (front, rear) = plan.twin(state.values.end).parameters, state.values.end[-2:]
    if front == 1.0 and rear == 1.0:
        return p
    a, b = 0.5 * (front + rear), 0.5 * (front - rear)
    return p._replace(
        k_x=a * p.k_x, k_z=a * p.k_z, k_y=a * p.k_y, rotor_mismatch_pitch=p.rotor_mismatch_pitch + b * p.k_x
    )


def standard_errors_in_use(state: CorrectorState, plan: FollowPlan) -> dict[str, float]:
    """Return the standard errors of the values that were adopted, by name."""
    pairs = zip(plan.changeable, state.values.errors, strict=True)
    return {name: error for name, error in pairs if error > 0.0}
