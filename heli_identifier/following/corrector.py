"""The corrector: one sample in, the values in use out."""

from heli_plant.motor import saturate
from heli_plant.observer import FIELDS
from heli_plant.parameters import BY_FIELD, PlantParameters
from heli_plant.plant import measured_angles
from heli_plant.state import start_state

from .changes import Vector
from .cusum import PROVED, Inflation, Projection
from .evidence import Noise, Sums, project_block, start_baseline
from .observer import Angles, Encoder, start_observer
from .plan import FollowPlan
from .prediction import Copies, Predictions
from .state import CorrectorState, Event, Sample
from .trial import SWINGING, add_event, judge_block

_LARGEST_INNOVATION = 4.0  # innovations count with at most this many standard deviations
_KEPT = 90  # blocks that are kept: a change is looked for in the last minute and a half
_DROPPED = 2  # blocks before a fault of the stream that are dropped: it is seen only after a while


def start_correcting(plan: FollowPlan, now: Sample) -> CorrectorState:
    """Return the state at sample 0, the plant at rest in its angles."""
    voltages, angles, twin = now[:2], now[2:5], plan.alone
    return CorrectorState(
        settled=plan.settling,
        observer=start_observer(start_state(*angles, *voltages), voltages, twin.parameters, plan),
        encoders=tuple([Encoder(angle) for angle in angles]),
        twin=twin,
        errors=(0.0,) * len(twin.values),
        predictions=Predictions((Copies(predicted=angles),) * 2),
        sums=plan.no_sums,
        noises=(Noise(),) * 3,
        baseline=start_baseline(plan.deviations),
        inflations=(Inflation(),) * len(plan.changes),
    )


def correct(state: CorrectorState, now: Sample, plan: FollowPlan) -> tuple[CorrectorState, tuple[Event, ...]]:
    """Take in the sample ``now`` of the next instant.

    Returns the state after it, and the events that there are to report. Without a sample the instant waits for the next
    one, until the stream counts as stopped.
    """
    came_in, n = now.fresh > 0.5, state.waiting + 1
    if not came_in and state.mode != "suspended" and n < plan.stop:
        return state._replace(waiting=n, events=(), predictions=state.predictions._replace(compared=False)), ()
    state = state._replace(waiting=0, events=())
    begin, end = state.observer.voltages, now[:2] if came_in else state.observer.voltages
    for j in range(1, n):
        front, rear = [a + j / n * (b - a) for a, b in zip(begin, end, strict=True)]
        state = _pass_instant(state, now._replace(v_front=front, v_rear=rear, fresh=0.0), False, plan)
    state = _pass_instant(state, now, not came_in, plan)
    return state, state.events


def _pass_instant(state: CorrectorState, now: Sample, stopped: bool, plan: FollowPlan) -> CorrectorState:
    """Take in sample k = ``state.samples`` + 1, or an instant without one, at which the stream may have ``stopped``."""
    k, suspended, voltages, angles = state.samples + 1, state.mode == "suspended", now[:2], now[2:5]
    noise, came_in = state.noise, now.fresh > 0.5
    time = (k - 1) * plan.settings.sample_time
    observer, arrived = state.observer.advance(voltages, time, came_in or suspended, state.twin, plan)
    deviations, encoders, broken = observer.deviations(plan), state.encoders, suspended or stopped
    if came_in:
        read = zip(encoders, angles, observer.memory.state[3:6], strict=True)
        encoders = tuple([one.read(angle, rate, plan) for one, angle, rate in read])
        scatter = zip(encoders, deviations, noise, strict=True)
        broken = any([one.is_at_fault(a * b, plan) for one, a, b in scatter])
    fresh = came_in and not broken
    front, rear = state.predictions.arrived
    predictions = state.predictions._replace(arrived=(front + arrived[0], rear + arrived[1]), compared=False)
    state = state._replace(samples=k, observer=observer, encoders=encoders, predictions=predictions)
    if broken and not suspended:
        state = _suspend(state, "frozen" if came_in else "stopped", plan)
    elif suspended and fresh:
        state = _resume(state, angles, plan)
    sums = _take_innovations(state, angles, fresh, deviations, noise, plan)
    observer = state.observer.correct(angles, plan) if fresh else state.observer._replace(in_a_row=0)
    state = state._replace(sums=sums, observer=observer)
    if k % plan.coarse == 0:
        state = _coarse_step(state, angles, fresh, plan)
    if k % plan.block == 0:
        state = judge_block(_close_block(state, plan), plan)
    return state


def _suspend(state: CorrectorState, why: str, plan: FollowPlan) -> CorrectorState:
    """Return the state with everything at rest; a trial is broken off."""
    state = add_event(state, why, plan)
    if state.mode == "on trial":
        state = add_event(state, "cut", plan, state.finding)
    state = state.follow_again()
    return state.enter(
        "suspended",
        predictions=state.predictions.drop_running(),
        blocks=state.blocks[:-_DROPPED],
        observer=state.observer._replace(covariances=()),
    )


def _resume(state: CorrectorState, angles: Angles, plan: FollowPlan) -> CorrectorState:
    """Return the state with the observer begun again from a sample's ``angles``."""
    before, since, held = state.observer.memory
    first = start_state(*angles, before.nu_front, before.nu_rear)._replace(cable_rest=before.cable_rest)
    observer = start_observer(first, state.observer.voltages, state.twin.parameters, plan)
    return add_event(state, "back", plan).enter(
        "following" if state.is_noise_known else "starting",
        settled=state.samples + plan.settling,
        observer=observer._replace(memory=observer.memory._replace(since=since, held=held)),
    )


def _take_innovations(
    state: CorrectorState, angles: Angles, fresh: bool, deviations: Vector, noise: Vector, plan: FollowPlan
) -> tuple[Sums, ...]:
    """Return the sums with a sample's innovations; sums without them are spoiled."""
    k, predicted = state.samples, measured_angles(state.observer.memory.state)
    resting = k < max(state.settled, state.changed + SWINGING * plan.block) or state.mode == "suspended"
    result: list[Sums] = []
    for axis, total in enumerate(state.sums):
        if resting or state.encoders[axis].is_discounted(plan):
            total = total._replace(spoiled=True)
        elif fresh:
            share = 1.0 / deviations[axis]
            innovation = share * (angles[axis] - predicted[axis])
            if state.mode != "starting":
                innovation = saturate(innovation, _LARGEST_INNOVATION * noise[axis])
            total = total.with_sample((*[share * x for x, _, _ in state.observer.sensitivities[axis]], innovation))
        result.append(total)
    return tuple(result)


def _coarse_step(state: CorrectorState, angles: Angles, fresh: bool, plan: FollowPlan) -> CorrectorState:
    """Move the copies of the twins; compare those that have run for 1 s, start new ones; take the products."""
    k = state.samples
    predictions = state.predictions.move((state.twin, plan.alone, *state.rival), k, plan)
    if k % plan.launch == 0:
        if state.mode != "suspended" and k >= state.settled:
            predictions = predictions.launch(state.observer.memory.state, angles, fresh, plan)
        else:
            predictions = predictions.drop_running()
    return state._replace(predictions=predictions, sums=tuple([one.with_products() for one in state.sums]))


def _close_block(state: CorrectorState, plan: FollowPlan) -> CorrectorState:
    """Return the state with the block that is complete taken in, and noise and baseline learned from it."""
    pairs = list(zip(state.sums, state.noises, strict=True))
    block = tuple([one.evidence(noise.variance) for one, noise in pairs])
    if state.mode not in ("alarmed", "suspended"):
        state = state._replace(noises=tuple([noise.learn(one) for one, noise in pairs]))
    state = state._replace(sums=plan.no_sums)
    if state.mode == "starting":
        return state
    seen = tuple([own.discount(one) for own, one in zip(state.baseline, block, strict=True)])
    projected = [project_block(seen, change.direction(state.twin.values)) for change in plan.changes]
    if state.mode == "following":
        rows = zip(state.baseline, seen, plan.deviations, strict=True)
        state = state._replace(baseline=tuple([own.learn(one, deviation) for own, one, deviation in rows]))
        if len(state.tested) >= PROVED + 2:  # a block and the two before it have been proved
            proved = zip(state.inflations, *state.tested[-PROVED : -PROVED - 3 : -1], strict=True)
            state = state._replace(inflations=tuple([one.learn(*blocks) for one, *blocks in proved]))
    counted = zip(projected, state.inflations, strict=True)
    tested = tuple([Projection(u, w, 1.0 / inflation.factor) for (u, w), inflation in counted])
    return state._replace(blocks=(*state.blocks, block)[-_KEPT:], tested=(*state.tested, tested)[-_KEPT:])


def parameters_in_use(state: CorrectorState) -> tuple[PlantParameters, dict[str, float]]:
    """Return the plant's parameters that the twin uses, and the standard errors of those that were adopted, by name.

    Rotors with the shares f and r of their thrust have mu_d = f nu_f - r nu_r = a (nu_f - nu_r) + b (nu_f + nu_r) with
    a = (f + r)/2, b = (f - r)/2: on the pitch k_x becomes a k_x, and the rotors' sum turns it by b k_x (rotor
    mismatch); k_z and k_y become a k_z and a k_y, where b (nu_f - nu_r) is left out.
    """
    p, (front, rear) = state.twin.parameters, state.twin.values[-2:]
    errors = {BY_FIELD[field].name: error for field, error in zip(FIELDS, state.errors, strict=False) if error > 0.0}
    if front == 1.0 and rear == 1.0:
        return p, errors
    a, b = 0.5 * (front + rear), 0.5 * (front - rear)
    gains = {"k_x": a * p.k_x, "k_z": a * p.k_z, "k_y": a * p.k_y}
    return p._replace(**gains, rotor_mismatch_pitch=p.rotor_mismatch_pitch + b * p.k_x), errors
