"""What a fault of the stream does to the corrector: it suspends everything, and begins anew when samples come back."""

from heli_plant.communication import PlantMemory, begin
from heli_plant.observer import Torque
from heli_plant.state import start_state

from .baseline import forgotten
from .blocks import emptied, noise_is_known
from .detection import AT_ZERO
from .events import BACK, CUT, FROZEN, HELD, STOPPED, STREAM, Event
from .plan import LEARNING, FollowPlan
from .sensitivity import no_sensitivity
from .state import FOLLOWING, ON_TRIAL, STARTING, SUSPENDED, CorrectorState, Sample

_DOUBTFUL = 2
"""Blocks before a fault of the stream that are dropped: it is seen only after a while."""


def suspended(state: CorrectorState, time: float, plan: FollowPlan) -> tuple[CorrectorState, list[Event]]:
    """Return the state with everything at rest, at the sample of ``time`` [s]; a trial is broken off."""
    why = STOPPED if state.stream.unseen >= plan.stop else FROZEN
    events = [Event(time, STREAM, -1, 0.0, 0.0, why, -1, time)]
    if state.mode == ON_TRIAL:
        number = state.finding.change
        events.append(Event(time, HELD, number, 0.0, 0.0, CUT, plan.changes[number].axis, time))
    return state._replace(
        mode=SUSPENDED,
        since=state.samples,
        values=state.values._replace(rival=()),
        twins=state.twins._replace(copies=(), copies_alone=(), copies_rival=(), against=(), rival=()),
        blocks=state.blocks[:-_DOUBTFUL],
        tested=(),
        baseline=forgotten(state.baseline),
        pages=(AT_ZERO,) * len(state.pages),
        pages_before=(AT_ZERO,) * len(state.pages),
        alarm=0.0,
        uncertainties=(),
    ), events


def withdrawn(state: CorrectorState) -> CorrectorState:
    """Return the state as if the last block had told nothing: an encoder stood in it, which has been seen only now."""
    return state._replace(
        blocks=(*state.blocks[:-1], *[emptied(block) for block in state.blocks[-1:]]),
        tested=(*state.tested[:-1], *[emptied(block) for block in state.tested[-1:]]),
        pages=state.pages_before,
    )


def resumed(state: CorrectorState, now: Sample, time: float, plan: FollowPlan) -> tuple[CorrectorState, list[Event]]:
    """Return the state with the observer begun anew from the sample ``now`` of ``time`` [s]."""
    memory = state.memory
    first = start_state(now.pitch, now.elevation, now.travel, memory.state.nu_front, memory.state.nu_rear)
    first = first._replace(cable_rest=memory.state.cable_rest)
    a, b, c = plan.columns
    return state._replace(
        mode=FOLLOWING if noise_is_known(state.levels, LEARNING) else STARTING,
        since=state.samples,
        settled=state.samples + plan.settling,
        memory=PlantMemory(begin(first, state.values.parameters).state, memory.since, memory.held),
        torque=Torque(),
        sensitivities=(no_sensitivity(a), no_sensitivity(b), no_sensitivity(c)),
    ), [Event(time, STREAM, -1, 0.0, 0.0, BACK, -1, time)]
