"""The observer that keeps the twin on the rig, and what a change makes of its innovations.

**Sensitivity.** An acceleration g that the plant lacks moves the errors of the observer (:mod:`heli_plant.observer`).
With (x, w, d) what g makes of them per unit, and the axis' own stiffness a and damping b,

    x += h w + h^2/2 (g + d - a x - b w),  w += h (g + d - a x - b w),  d *= exp(-gamma h)
    psi = x
    x -= l_1 psi,  w -= l_2 psi,  d -= l_3 psi

so that e = delta psi + white noise for a change of size delta along g. psi is known before the sample is.
Source: Gustafsson, Adaptive Filtering and Change Detection, 2000, section 8.3.

**Gaps.** While no sample comes in, the twin goes on under the last voltages; what a controller wanted instead goes
along with the rate, as a friction does. With the next sample the voltages V at both ends of the gap are known. The twin
goes back to the gap's begin and through it once more, under voltages on a straight line between them,

    V_j = V_0 + (V_n - V_0) j/n,     j = 0 .. n - 1  of  n  sampling intervals

How much that sample counts, :mod:`.gaps` says.
"""

from math import cos, sin, sqrt
from typing import NamedTuple

from heli_plant.communication import PlantMemory, begin, communicate
from heli_plant.laws import thrust_voltages
from heli_plant.observer import ObserverGains, Torque, measured_against, predicted, with_share
from heli_plant.parameters import PlantParameters
from heli_plant.plant import arriving
from heli_plant.state import PlantState

from .blocks import Vector
from .changes import regress_motion
from .gaps import (
    Covariance,
    Roughness,
    Voltages,
    correct_covariance,
    kalman_gains,
    learn_roughness,
    predict_covariance,
)
from .plan import FollowPlan, Twin

Angles = tuple[float, float, float]
"""Of pitch, elevation and travel [rad]."""


Sensitivity = tuple[tuple[float, float, float], ...]
"""(x, w, d) of each regressor of an axis: what it makes of angle [rad], rate [rad/s] and torque [rad/s^2] per unit."""


class Instant(NamedTuple):
    """The twin at one instant: its plant, the unmodelled accelerations [rad/s^2], the sensitivity of each axis."""

    memory: PlantMemory
    torque: Torque
    sensitivities: tuple[Sensitivity, ...]


class Gap(NamedTuple):
    """Since the last sample that came in.

    ``begin``: the twin then, and the ``voltages`` of that sample [V]; ``unseen``: instants without a sample since;
    ``arrived``: the sum of the voltages that the twin has taken for those that arrived at its motors since [V].
    """

    begin: Instant
    voltages: Voltages
    unseen: int = 0
    arrived: Voltages = (0.0, 0.0)


class Weight(NamedTuple):
    """How much a sample counts: the gains; the innovations' standard deviations in those of the steady state [1].

    P of the axes after the correction; empty in the steady state.
    """

    gains: tuple[ObserverGains, ...]
    deviations: Vector = (1.0, 1.0, 1.0)
    covariances: tuple[Covariance, ...] = ()


class Observer(NamedTuple):
    """What the observer remembers; ``voltages``: held since the last instant [V]; ``covariances`` as in Weight."""

    instant: Instant
    voltages: Voltages
    gap: Gap
    roughness: Roughness
    covariances: tuple[Covariance, ...]


def start_instant(first: PlantState, p: PlantParameters, plan: FollowPlan) -> Instant:
    """Return the twin in the state ``first``, nothing having acted on the regressors."""
    return Instant(begin(first, p), Torque(), tuple([((0.0, 0.0, 0.0),) * len(own) for own in plan.deviations]))


def start_observer(instant: Instant, voltages: Voltages) -> Observer:
    """Return the observer at sample 0."""
    return Observer(instant, voltages, Gap(instant, voltages), Roughness(0.0, 0.0, 0, voltages, voltages, 1), ())


def apply_shares(voltages: Voltages, twin: Twin) -> Voltages:
    """Return the voltages [V] as rotors see them that have the twin's shares of their thrust left."""
    limit = twin.parameters.v_max
    return with_share(voltages[0], twin.values[-2], limit), with_share(voltages[1], twin.values[-1], limit)


def advance(now: Instant, voltages: Voltages, time: float, twin: Twin, plan: FollowPlan) -> tuple[Instant, Voltages]:
    """Return the twin one sampling interval after ``time`` [s], and the voltages that arrived at its motors [V].

    ``voltages`` [V] are held meanwhile; what arrived is without the rotors' shares.
    """
    h, p, before = plan.settings.sample_time, twin.parameters, now.memory.state
    front, rear = apply_shares(voltages, twin)
    memory = communicate(now.memory, front, rear, 0.0, time, 0.0, h, h, plan.delay, p)
    if plan.delay > 0.0:
        front, rear = arriving(memory.since, memory.held, len(memory.since) - 1, time, h, p)
        voltages = (front / twin.values[-2], rear / twin.values[-1])
    kept, torque = predicted(memory.state, now.torque, h, plan.gains[0])
    # the accelerations by which each change would have acted, from the motion at the step's begin
    mu_diff, mu_sum = thrust_voltages(
        0.5 * (before.nu_front + kept.nu_front), 0.5 * (before.nu_rear + kept.nu_rear), time + h, p
    )
    acting = regress_motion(before, mu_diff, mu_sum, plan.laws, p.theta0)
    own: list[tuple[float, float]] = [(p.a_th * cos(before.pitch - p.theta0), p.a_wx), (p.a_e, p.a_wz), (0.0, p.a_wy)]
    sensitivities = [
        predict_sensitivity(now.sensitivities[axis], acting[axis], *own[axis], h, plan.gains[axis].kept)
        for axis in range(3)
    ]
    return Instant(memory._replace(state=kept), torque, tuple(sensitivities)), voltages


def advance_observer(
    observer: Observer, voltages: Voltages, k: int, crosses: bool, twin: Twin, plan: FollowPlan
) -> tuple[Observer, Voltages]:
    """Return the observer at sample ``k``, before its correction, and the voltages that arrived since [V].

    ``voltages`` [V] are held from sample ``k`` on. Where ``k`` is the first sample after a gap it ``crosses`` the gap
    once more; what arrived is then less by what the twin had taken for it before.
    """
    h, gap = plan.settings.sample_time, observer.gap
    if not crosses:
        instant, arrived = advance(observer.instant, observer.voltages, (k - 1) * h, twin, plan)
        return observer._replace(instant=instant, voltages=voltages), arrived
    n = gap.unseen + 1
    instant, front, rear = gap.begin, -gap.arrived[0], -gap.arrived[1]
    for j in range(n):
        share = j / n
        held = (
            gap.voltages[0] + share * (voltages[0] - gap.voltages[0]),
            gap.voltages[1] + share * (voltages[1] - gap.voltages[1]),
        )
        instant, arrived = advance(instant, held, (k - n + j) * h, twin, plan)
        front, rear = front + arrived[0], rear + arrived[1]
    return observer._replace(instant=instant, voltages=voltages), (front, rear)


def miss_sample(observer: Observer, arrived: Voltages) -> Observer:
    """Return the observer after an instant without a sample, reached under the voltages ``arrived`` [V]."""
    gap = observer.gap
    total = (gap.arrived[0] + arrived[0], gap.arrived[1] + arrived[1])
    return observer._replace(gap=gap._replace(unseen=gap.unseen + 1, arrived=total))


def correct_observer(observer: Observer, angles: Angles, weight: Weight, plan: FollowPlan) -> Observer:
    """Return the observer after the correction by a sample of the ``angles`` [rad]."""
    before, voltages = observer.instant, observer.voltages
    kept, torque = measured_against(before.memory.state, before.torque, angles, weight.gains)
    rows = [correct_sensitivity(*own) for own in zip(before.sensitivities, weight.gains, strict=True)]
    instant = Instant(before.memory._replace(state=kept), torque, tuple(rows))
    roughness = learn_roughness(observer.roughness, voltages, observer.gap.unseen > 0, plan.settings.sample_time)
    covariances = weight.covariances if roughness.in_a_row < plan.remembered else ()
    return Observer(instant, voltages, Gap(instant, voltages), roughness, covariances)


def predict_sensitivity(
    s: Sensitivity, acting: list[float], stiffness: float, damping: float, h: float, kept: float
) -> Sensitivity:
    """Return the sensitivity one sample later, before its correction: x is then psi.

    ``acting``: the accelerations g over the step [rad/s^2 per unit]; ``stiffness`` a [1/s^2] and ``damping`` b [1/s] of
    the axis; exp(-gamma h) ``kept``.
    """
    found = []
    for (x, w, d), g in zip(s, acting, strict=True):
        total = g + d - stiffness * x - damping * w
        found.append((x + h * w + 0.5 * h * h * total, w + h * total, kept * d))
    return tuple(found)


def correct_sensitivity(s: Sensitivity, g: ObserverGains) -> Sensitivity:
    """Return the sensitivity after the sample's correction."""
    left = 1.0 - g.angle
    return tuple([(left * x, w - g.rate * x, d - g.torque * x) for x, w, d in s])


def weigh_sample(observer: Observer, unseen: int, noise: Vector, p: PlantParameters, plan: FollowPlan) -> Weight:
    """Return how much a sample counts that came in after ``unseen`` instants without one.

    ``noise``: standard deviations of the innovations of the axes in the steady state [rad].
    """
    known, rough, h = observer.covariances, observer.roughness, plan.settings.sample_time
    if not known and unseen == 0:
        return Weight(plan.gains)
    of_travel = p.k_y * sin(observer.instant.memory.state.pitch)
    kicks = (
        (p.k_x * h) ** 2 * rough.difference,
        (p.k_z * h) ** 2 * rough.total,
        (of_travel * h) ** 2 * rough.total,
    )
    gains: list[ObserverGains] = []
    deviations: list[float] = []
    after: list[Covariance] = []
    for axis in range(3):
        steady, kept = plan.steady[axis], plan.gains[axis].kept
        u = predict_covariance(known[axis] if known else steady.covariance, h, kept, 0.0, steady.drive)
        of_rate = kicks[axis] * steady.variance / (noise[axis] * noise[axis])
        for _ in range(unseen):
            u = predict_covariance(u, h, kept, of_rate, steady.drive)
        gains.append(kalman_gains(u, kept))
        deviations.append(sqrt((u.angle + 1.0) / steady.variance))
        after.append(correct_covariance(u))
    return Weight(tuple(gains), tuple(deviations), tuple(after))
