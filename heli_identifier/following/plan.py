"""What a step of the following twin computes with, made once from its settings."""

from collections.abc import Callable
from math import inf
from typing import NamedTuple

from heli_plant.communication import communicate
from heli_plant.laws import input_delay, thrust_voltages
from heli_plant.observer import TRAVEL_BANDWIDTH, ObserverGains, observer_gains
from heli_plant.parameters import PlantParameters
from heli_plant.plant import arriving, step
from heli_plant.specialised import specialised

from ..online import Candidate
from .ahead import APART, COARSE, HORIZON
from .baseline import deviations
from .changes import FRONT, REAR, ROTORS, Change, changes, laws
from .detection import threshold
from .settings import FollowSettings
from .uncertainty import Steady, memory_of, steady_state

BLOCK_TIME = 1.0
"""Length of a block of sums, about [s]."""

SETTLING = 3.0
"""Time until the observer has settled [s]."""

LEARNING = 9
"""Blocks from which the noise is known."""

STOP, STUCK = 0.2, 0.5
"""Time without a sample that is a stop, and time at one count after which an encoder's angle does not count [s]."""


class FollowPlan(NamedTuple):
    """Coefficients, functions and names.

    ``changes``: what may change. ``changeable``: names of the values in use, ``fields`` those of the parameters among
    them; the two rotors' shares stand last. ``places``: of each change, which value it changes (-1: the rotors).
    ``columns``: regressors of each axis; ``deviations``: by how much the twin's coefficients of them may err.
    ``gains`` of the observer on the three axes, its ``steady`` state; samples for which a gap is ``remembered``.
    ``step``, ``arriving``, ``thrusts``: the plant's, in which everything that cannot change is a constant.
    """

    settings: FollowSettings
    changes: tuple[Change, ...]
    changeable: tuple[str, ...]
    fields: tuple[str, ...]
    first_values: tuple[float, ...]
    places: tuple[int, ...]
    times_gain: tuple[bool, ...]
    sizes: tuple[float, ...]
    columns: tuple[int, int, int]
    deviations: tuple[tuple[float, ...], ...]
    laws: tuple[tuple[Candidate, ...], ...]
    gains: tuple[ObserverGains, ObserverGains, ObserverGains]
    steady: tuple[Steady, Steady, Steady]
    remembered: int
    step: Callable
    arriving: Callable
    thrusts: Callable
    communicate: Callable
    delay: float
    threshold: float
    coarse: int
    per_launch: int
    horizon: int
    block: int
    settling: int
    stop: int
    stuck: int
    window: int


def prepare_following(settings: FollowSettings) -> FollowPlan:
    """Return the plan of ``settings``."""
    h, p = settings.sample_time, settings.parameters
    bank = changes(p, settings.effects)
    fields = tuple(change.field for change in bank if change.field)
    of_laws = laws(settings.effects)
    known = {field: value for field, value in p._asdict().items() if field not in fields}
    coarse = max(1, round(COARSE / h))
    coarse_time = coarse * h
    per_block = max(1, round(BLOCK_TIME / coarse_time))
    by_field = {law.name + "_" + law.axis: law.times_gain for own in of_laws for law in own}
    values = tuple(getattr(p, field) for field in fields)
    errs = deviations(p, of_laws)
    omega = settings.observer_bandwidth
    gains, gains_travel = observer_gains(omega, h), observer_gains(TRAVEL_BANDWIDTH * omega, h)
    steady = steady_state(omega, h, gains.kept)
    launches = max(1, round(APART * COARSE / coarse_time))
    return FollowPlan(
        settings,
        bank,
        (*(change.name for change in bank if change.field), FRONT, REAR),
        fields,
        (*values, 1.0, 1.0),
        tuple(fields.index(change.field) if change.axis != ROTORS else -1 for change in bank),
        tuple(by_field.get(change.field, False) for change in bank),
        tuple(change.size * (abs(getattr(p, change.field)) if change.relative else 1.0) for change in bank),
        (len(errs[0]), len(errs[1]), len(errs[2])),
        errs,
        of_laws,
        (gains, gains, gains_travel),
        (steady, steady, steady_state(TRAVEL_BANDWIDTH * omega, h, gains.kept)),
        memory_of(omega, h),
        specialised(step, known),
        specialised(arriving, known),
        specialised(thrust_voltages, known),
        communicate,
        input_delay(p),
        threshold(2 * len(bank), settings.false_alarm_time, BLOCK_TIME),
        coarse,
        launches,
        max(1, round(HORIZON * COARSE / coarse_time / launches)) * launches,
        per_block,
        round(SETTLING / h),
        max(1, round(STOP / h)),
        max(2, round(STUCK / h)),
        round(settings.window / (launches * coarse_time)),
    )


def parameters_of(values: tuple[float, ...], plan: FollowPlan) -> PlantParameters:
    """Return the plant's parameters with the ``values`` in use; the rotors' shares are not among them."""
    return plan.settings.parameters._replace(**dict(zip(plan.fields, values[: len(plan.fields)], strict=True)))


def limits(change: Change, value: float) -> tuple[float, float]:
    """Return the least and the largest size of ``change`` that keep its value, ``value`` now, within bounds."""
    least = change.lower - value if change.lower > -inf else -inf
    most = change.upper - value if change.upper < inf else inf
    return least, most
