"""The corrector: one sample in, the values in use out."""

from heli_plant.motor import saturate
from heli_plant.observer import FIELDS
from heli_plant.plant import measured_angles
from heli_plant.state import start_state

from .changes import Vector
from .cusum import Projection
from .evidence import Noise, Sums, project_block, start_baseline
from .observer import Angles, Encoder, start_observer
from .plan import FollowPlan
from .prediction import Copies, Predictions
from .state import CorrectorState, Sample, TwinEvent
from .trial import SWINGING, add_event, judge_block

_LARGEST_INNOVATION = 4.0  # innovations count with at most this many standard deviations
_KEPT_BLOCKS = 90  # a change is looked for in the last minute and a half
_PROVED_AFTER = 20  # blocks without an alarm after which a block counts as one without a change
_DROPPED_BLOCKS = 2  # blocks before a fault of the stream that are dropped: it shows only after a while


def start_correcting(plan: FollowPlan, sample: Sample) -> CorrectorState:
    """Return the state at the first ``sample``, with the plant at rest at its angles."""
    voltages, angles = sample[:2], sample[2:5]
    return CorrectorState(
        settled_at=plan.settling,
        observer=start_observer(start_state(*angles, *voltages), voltages, plan.alone, plan),
        encoders=tuple([Encoder(angle, still=1) for angle in angles]),
        twin=plan.alone,
        errors=(0.0,) * len(FIELDS),
        predictions=Predictions((Copies(predicted=angles),) * 2),
        sums=plan.no_sums,
        noises=(Noise(),) * 3,
        baseline=start_baseline(plan.deviations),
    )


def correct(state: CorrectorState, sample: Sample, plan: FollowPlan) -> tuple[CorrectorState, tuple[TwinEvent, ...]]:
    """Return the state after the ``sample`` of the next instant, and the events to report.

    An instant without a sample waits for the next sample, until the stream counts as stopped.
    """
    has_sample, n = sample.fresh > 0.5, state.waiting + 1
    if not has_sample and not state.suspended and n < plan.stop:
        return state._replace(waiting=n, events=(), predictions=state.predictions._replace(compared=False)), ()
    state = state._replace(waiting=0, events=())
    begin, end = state.observer.voltages, sample[:2] if has_sample else state.observer.voltages
    for j in range(1, n):
        front, rear = [a + j / n * (b - a) for a, b in zip(begin, end, strict=True)]
        state = _pass_instant(state, sample._replace(v_front=front, v_rear=rear, fresh=0.0), False, plan)
    state = _pass_instant(state, sample, not has_sample, plan)
    return state, state.events


def _pass_instant(state: CorrectorState, sample: Sample, stopped: bool, plan: FollowPlan) -> CorrectorState:
    """Return the state after instant k = ``state.samples`` + 1; ``stopped``: the stream has stopped."""
    k, suspended, voltages, angles = state.samples + 1, state.suspended, sample[:2], sample[2:5]
    time, has_sample = (k - 1) * plan.settings.sample_time, sample.fresh > 0.5
    observer, arrived = state.observer.advance(voltages, time, has_sample or suspended, state.twin, plan)
    deviations, encoders, broken = observer.deviations(plan), state.encoders, suspended or stopped
    if has_sample:
        readings = zip(encoders, angles, observer.memory.state[3:6], strict=True)
        encoders = tuple([encoder.read(angle, rate, plan) for encoder, angle, rate in readings])
        scatter = zip(encoders, deviations, state.noise, strict=True)
        broken = any([encoder.is_at_fault(a * b, plan) for encoder, a, b in scatter])
    fresh = has_sample and not broken
    front, rear = state.predictions.arrived
    predictions = state.predictions._replace(arrived=(front + arrived[0], rear + arrived[1]), compared=False)
    state = state._replace(samples=k, observer=observer, encoders=encoders, predictions=predictions)
    if broken and not suspended:
        state = _suspend(state, "frozen" if has_sample else "stopped", plan)
    elif suspended and fresh:
        state = _resume(state, angles, plan)
    sums = _add_innovations(state, angles, fresh, deviations, plan)
    observer = state.observer.correct(angles, plan) if fresh else state.observer._replace(in_a_row=0)
    state = state._replace(sums=sums, observer=observer)
    if k % plan.coarse == 0:
        state = _coarse_step(state, angles, fresh, plan)
    if k % plan.block == 0:
        state = judge_block(_close_block(state, plan), plan)
    return state


def _suspend(state: CorrectorState, why: str, plan: FollowPlan) -> CorrectorState:
    """Return the suspended state, without what was learned just before; its mode goes on after the fault."""
    nothing = (Projection(0.0, 0.0),) * len(plan.changes)
    return add_event(state, why, plan)._replace(
        suspended=True,
        predictions=state.predictions.drop_running(),
        blocks=(*state.blocks[:-_DROPPED_BLOCKS], *[plan.no_block] * _DROPPED_BLOCKS),
        tested=(*state.tested[:-_DROPPED_BLOCKS], *[nothing] * _DROPPED_BLOCKS),
        observer=state.observer._replace(covariances=()),
        sums=plan.no_sums,
    )


def _resume(state: CorrectorState, angles: Angles, plan: FollowPlan) -> CorrectorState:
    """Return the state with an observer that starts again from the ``angles`` of a sample."""
    before, since, held = state.observer.memory
    first = start_state(*angles, before.nu_front, before.nu_rear)._replace(cable_rest=before.cable_rest)
    observer = start_observer(first, state.observer.voltages, state.twin, plan)
    return add_event(state, "back", plan)._replace(
        suspended=False,
        settled_at=state.samples + plan.settling,
        observer=observer._replace(memory=observer.memory._replace(since=since, held=held)),
    )


def _add_innovations(
    state: CorrectorState, angles: Angles, fresh: bool, deviations: Vector, plan: FollowPlan
) -> tuple[Sums, ...]:
    """Return the sums of each axis with the innovation of a sample, if it counts."""
    k, noise, predicted = state.samples, state.noise, measured_angles(state.observer.memory.state)
    resting = k < max(state.settled_at, state.changed_at + SWINGING * plan.block) or state.suspended
    result: list[Sums] = []
    for axis, sums in enumerate(state.sums):
        if fresh and not resting and not state.encoders[axis].is_ignored(plan):
            share = 1.0 / deviations[axis]
            innovation = share * (angles[axis] - predicted[axis])
            if state.mode != "starting":
                innovation = saturate(innovation, _LARGEST_INNOVATION * noise[axis])
            sums = sums.with_sample((*[share * x for x, _, _ in state.observer.sensitivities[axis]], innovation))
        result.append(sums)
    return tuple(result)


def _coarse_step(state: CorrectorState, angles: Angles, fresh: bool, plan: FollowPlan) -> CorrectorState:
    """Move the copies of the twins, compare and launch them when they are due, and take the products of the sums."""
    k = state.samples
    predictions = state.predictions.move((state.twin, plan.alone, *state.rival), k, plan)
    if k % plan.launch == 0:
        if not state.suspended and k >= state.settled_at:
            predictions = predictions.launch(state.observer.memory.state, angles, fresh, plan)
        else:
            predictions = predictions.drop_running()
    return state._replace(predictions=predictions, sums=tuple([sums.with_products() for sums in state.sums]))


def _close_block(state: CorrectorState, plan: FollowPlan) -> CorrectorState:
    """Return the state with the complete block, and with what noise and baseline learn from it."""
    pairs = list(zip(state.sums, state.noises, strict=True))
    block = tuple([sums.evidence(noise.variance * noise.inflation) for sums, noise in pairs])
    if state.mode != "alarmed":
        state = state._replace(noises=tuple([noise.learn(sums, plan.block) for sums, noise in pairs]))
    state = state._replace(sums=plan.no_sums)
    if state.mode == "starting":
        return state
    marginal = tuple([theta.marginalise(rows) for theta, rows in zip(state.baseline, block, strict=True)])
    if state.mode == "following":
        axes = zip(state.baseline, marginal, plan.deviations, strict=True)
        state = state._replace(baseline=tuple([theta.learn(rows, deviation) for theta, rows, deviation in axes]))
        if len(state.tested) >= _PROVED_AFTER:
            squares: tuple[list[float], ...] = ([], [], [])
            for change, (response, information) in zip(plan.changes, state.tested[-_PROVED_AFTER], strict=True):
                if len(change.axes) == 1 and information > 0.0:
                    squares[change.axes[0]].append(response * response / information)
            proved = zip(state.noises, squares, strict=True)
            state = state._replace(noises=tuple([noise.inflate(of_axis) for noise, of_axis in proved]))
    tested = tuple([Projection(*project_block(marginal, one.direction(state.twin))) for one in plan.changes])
    return state._replace(blocks=(*state.blocks, block)[-_KEPT_BLOCKS:], tested=(*state.tested, tested)[-_KEPT_BLOCKS:])
