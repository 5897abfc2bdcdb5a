"""The observer that keeps the twin on the rig, what a change makes of its innovations, and what a gap leaves unknown.

**Sensitivity.** An acceleration g that the plant lacks moves the errors of the observer (:mod:`heli_plant.observer`).
With (x, w, d) what g makes of them per unit, and the axis' own stiffness a and damping b,

    x += h w + h^2/2 (g + d - a x - b w),  w += h (g + d - a x - b w),  d *= exp(-gamma h)
    psi = x
    x -= l_1 psi,  w -= l_2 psi,  d -= l_3 psi

so that e = delta psi + white noise for a change of size delta along g. psi is known before the sample is.

**Gaps.** Under the last voltages the twin errs along with the rate, as a friction does. With the next sample it goes
back to the gap's begin and through it once more, under voltages on a straight line between both ends,

    V_j = V_0 + (V_n - V_0) j/n,     j = 0 .. n - 1  of  n  sampling intervals

The state is then known less well. With P the covariance of the errors (x, w, d), in units of the variance r of the
encoder's noise, and s that of the innovation,

    P <- F P F^T + diag(0, q_w, q_d),    F = [[1, h, h^2/2], [0, 1, h], [0, 0, exp(-gamma h)]]
    s = P_xx + 1,    l = P_(.x)/s,    P <- P - l P_(x.)

q_d = omega_o^6 h^2 is what the observer's bandwidth stands for, and q_w = (k h sigma)^2/r for each lost voltage, k the
gain of the axis. sigma is by how much the line misses, learned where no sample is missing, over two minutes:

    sigma^2 = mean of (V_(k-1) - (V_(k-2) + V_k)/2)^2    for difference (front - rear) and sum of the voltages

Sources: Anderson and Moore, Optimal Filtering, 1979, chapter 3; Gustafsson, Adaptive Filtering and Change Detection,
2000, section 8.3; Sinopoli and others, IEEE Transactions on Automatic Control 49 (2004).
"""

from functools import lru_cache
from math import cos, log, sin, sqrt
from typing import NamedTuple

from heli_plant.communication import PlantMemory, begin, communicate
from heli_plant.laws import thrust_voltages
from heli_plant.observer import ObserverGains, Torque, measured_against, observer_gains, predicted, with_share
from heli_plant.parameters import PlantParameters
from heli_plant.plant import arriving
from heli_plant.state import PlantState

from .blocks import MEMORY, Vector
from .changes import regress_motion
from .plan import FollowPlan, Twin

Angles = tuple[float, float, float]
"""Of pitch, elevation and travel [rad]."""

Voltages = tuple[float, float]
"""Front and rear [V]."""

Sensitivity = tuple[tuple[float, float, float], ...]
"""(x, w, d) of each regressor of an axis: what it makes of angle [rad], rate [rad/s] and torque [rad/s^2] per unit."""

_ALMOST = 100.0
"""The covariance has come back to its steady state when what a gap has made of it is less by this factor."""

_STEADY = 4.0  # the steady state is looked for in this many times the samples in which a gap is forgotten


class Covariance(NamedTuple):
    """P of one axis, over r: ``angle`` xx [1], ``angle_rate`` xw [1/s], ``rate`` ww [1/s^2] and so on for d."""

    angle: float
    angle_rate: float
    angle_torque: float
    rate: float
    rate_torque: float
    torque: float


class Steady(NamedTuple):
    """Of one axis in a stream without gaps: P after a correction, s, and the drive q_d [1/s^4]."""

    covariance: Covariance
    variance: float
    drive: float


class Roughness(NamedTuple):
    """sigma^2 of the ``difference`` and of the ``total`` of the voltages [V^2], over ``samples``.

    The ``last`` sample's voltages and those ``before`` it [V]; ``in_a_row``: samples since one was missing.
    """

    difference: float
    total: float
    samples: int
    last: Voltages
    before: Voltages
    in_a_row: int


class Instant(NamedTuple):
    """The twin at one instant: its plant, the unmodelled accelerations [rad/s^2], the sensitivity of each axis."""

    memory: PlantMemory
    torque: Torque
    sensitivities: tuple[Sensitivity, ...]


class Weight(NamedTuple):
    """How much a sample counts: the gains; the innovations' standard deviations in those of the steady state [1].

    P of the axes after the correction; empty in the steady state.
    """

    gains: tuple[ObserverGains, ...]
    deviations: Vector = (1.0, 1.0, 1.0)
    covariances: tuple[Covariance, ...] = ()


class Observer(NamedTuple):
    """What the observer remembers.

    The twin now and at the last sample that came in (``begin``); ``voltages`` held since the last instant [V];
    ``roughness`` of the voltages, which knows those of the last sample; P of the axes then (``covariances``, as in
    Weight); instants ``unseen`` since, and the sum of the voltages that have ``arrived`` at the motors in them [V].
    """

    instant: Instant
    begin: Instant
    voltages: Voltages
    roughness: Roughness
    covariances: tuple[Covariance, ...] = ()
    unseen: int = 0
    arrived: Voltages = (0.0, 0.0)


def gap_memory(bandwidth: float, h: float) -> int:
    """Return the samples in which a gap is forgotten; ``bandwidth`` [rad/s], sampling period ``h`` [s].

    The slowest poles of the error have the real part -omega_o/2, and a covariance fades with twice that.
    """
    return round(log(_ALMOST) / (bandwidth * h))


@lru_cache
def find_steady_state(bandwidth: float, h: float) -> Steady:
    """Return the steady state for a ``bandwidth`` omega_o [rad/s] and samples every ``h`` [s]."""
    drive, kept = bandwidth**6 * h * h, observer_gains(bandwidth, h).kept
    u, variance = Covariance(1.0, 0.0, 0.0, bandwidth**2, 0.0, bandwidth**4), 1.0
    for _ in range(round(_STEADY * gap_memory(bandwidth, h))):
        u = predict_covariance(u, h, kept, 0.0, drive)
        variance = u.angle + 1.0
        _, u = correct_covariance(u, kept)
    return Steady(u, variance, drive)


def predict_covariance(u: Covariance, h: float, kept: float, of_rate: float, drive: float) -> Covariance:
    """Return P one sampling interval later; ``of_rate`` q_w [1/s^2] and ``drive`` q_d [1/s^4]."""
    xx, xw, xd, ww, wd, dd = u
    half = 0.5 * h * h
    # M = F P, of which only what F P F^T needs
    m_xx, m_xw, m_xd = xx + h * xw + half * xd, xw + h * ww + half * wd, xd + h * wd + half * dd
    m_ww, m_wd = ww + h * wd, wd + h * dd
    return Covariance(
        m_xx + h * m_xw + half * m_xd,
        m_xw + h * m_xd,
        kept * m_xd,
        m_ww + h * m_wd + of_rate,
        kept * m_wd,
        kept * kept * dd + drive,
    )


def correct_covariance(u: Covariance, kept: float) -> tuple[ObserverGains, Covariance]:
    """Return the Kalman gain l of a sample, and P after the correction by it."""
    xx, xw, xd, ww, wd, dd = u
    s = xx + 1.0
    after = Covariance(xx / s, xw / s, xd / s, ww - xw * xw / s, wd - xw * xd / s, dd - xd * xd / s)
    return ObserverGains(xx / s, xw / s, xd / s, kept), after


def learn_roughness(r: Roughness, voltages: Voltages, missing: bool, h: float) -> Roughness:
    """Return what is known after a sample with ``voltages`` [V], before which one was ``missing`` or not."""
    in_a_row = 1 if missing else r.in_a_row + 1
    if in_a_row < 3:
        return r._replace(last=voltages, before=r.last, in_a_row=in_a_row)
    front = r.last[0] - 0.5 * (r.before[0] + voltages[0])
    rear = r.last[1] - 0.5 * (r.before[1] + voltages[1])
    count = min(r.samples + 1, round(MEMORY / h))
    difference = r.difference + ((front - rear) * (front - rear) - r.difference) / count
    total = r.total + ((front + rear) * (front + rear) - r.total) / count
    return Roughness(difference, total, count, voltages, r.last, in_a_row)


def start_instant(first: PlantState, p: PlantParameters, plan: FollowPlan) -> Instant:
    """Return the twin in the state ``first``, nothing having acted on the regressors."""
    return Instant(begin(first, p), Torque(), tuple([((0.0, 0.0, 0.0),) * len(own) for own in plan.deviations]))


def apply_shares(voltages: Voltages, twin: Twin) -> Voltages:
    """Return the voltages [V] as rotors see them that have the twin's shares of their thrust left."""
    limit = twin.parameters.v_max
    return with_share(voltages[0], twin.values[-2], limit), with_share(voltages[1], twin.values[-1], limit)


def advance_instant(
    now: Instant, voltages: Voltages, time: float, twin: Twin, plan: FollowPlan
) -> tuple[Instant, Voltages]:
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
    a, b = (p.a_th * cos(before.pitch - p.theta0), p.a_e, 0.0), (p.a_wx, p.a_wz, p.a_wy)
    rows = zip(now.sensitivities, acting, a, b, strict=True)
    found = tuple([predict_sensitivity(own, g, a, b, h, plan.gains[0].kept) for own, g, a, b in rows])
    return Instant(memory._replace(state=kept), torque, found), voltages


def predict_sensitivity(s: Sensitivity, acting: list[float], a: float, b: float, h: float, kept: float) -> Sensitivity:
    """Return the sensitivity one sample later, before its correction: x is then psi.

    ``acting``: the accelerations g over the step [rad/s^2 per unit]; stiffness ``a`` [1/s^2] and damping ``b`` [1/s] of
    the axis; exp(-gamma h) ``kept``.
    """
    found = []
    for (x, w, d), g in zip(s, acting, strict=True):
        total = g + d - a * x - b * w
        found.append((x + h * w + 0.5 * h * h * total, w + h * total, kept * d))
    return tuple(found)


def advance_observer(
    observer: Observer, voltages: Voltages, k: int, crosses: bool, twin: Twin, plan: FollowPlan
) -> tuple[Observer, Voltages]:
    """Return the observer at sample ``k``, before its correction, and the voltages that arrived since [V].

    ``voltages`` [V] are held from sample ``k`` on. Where ``k`` is the first sample after a gap it ``crosses`` the gap
    once more; what arrived is then less by what the twin had taken for it before.
    """
    n, instant, first, front, rear = 1, observer.instant, observer.voltages, 0.0, 0.0
    if crosses:
        n, instant, first = observer.unseen + 1, observer.begin, observer.roughness.last
        front, rear = -observer.arrived[0], -observer.arrived[1]
    for j in range(n):
        held = first[0] + j / n * (voltages[0] - first[0]), first[1] + j / n * (voltages[1] - first[1])
        instant, arrived = advance_instant(instant, held, (k - n + j) * plan.settings.sample_time, twin, plan)
        front, rear = front + arrived[0], rear + arrived[1]
    return observer._replace(instant=instant, voltages=voltages), (front, rear)


def miss_sample(observer: Observer, arrived: Voltages) -> Observer:
    """Return the observer after an instant without a sample, reached under the voltages ``arrived`` [V]."""
    total = observer.arrived[0] + arrived[0], observer.arrived[1] + arrived[1]
    return observer._replace(unseen=observer.unseen + 1, arrived=total)


def correct_observer(observer: Observer, angles: Angles, weight: Weight, plan: FollowPlan) -> Observer:
    """Return the observer after the correction by a sample of the ``angles`` [rad]."""
    before, voltages, h = observer.instant, observer.voltages, plan.settings.sample_time
    kept, torque = measured_against(before.memory.state, before.torque, angles, weight.gains)
    rows = []
    for own, g in zip(before.sensitivities, weight.gains, strict=True):
        left = 1.0 - g.angle
        rows.append(tuple([(left * x, w - g.rate * x, d - g.torque * x) for x, w, d in own]))
    instant = Instant(before.memory._replace(state=kept), torque, tuple(rows))
    roughness = learn_roughness(observer.roughness, voltages, observer.unseen > 0, h)
    recent = roughness.in_a_row < gap_memory(plan.settings.observer_bandwidth, h)
    return Observer(instant, instant, voltages, roughness, weight.covariances if recent else ())


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
    found = []
    for axis, bandwidth in enumerate(plan.bandwidths):
        steady, kept = find_steady_state(bandwidth, h), plan.gains[axis].kept
        u = predict_covariance(known[axis] if known else steady.covariance, h, kept, 0.0, steady.drive)
        of_rate = kicks[axis] * steady.variance / (noise[axis] * noise[axis])
        for _ in range(unseen):
            u = predict_covariance(u, h, kept, of_rate, steady.drive)
        gains, after = correct_covariance(u, kept)
        found.append((gains, sqrt((u.angle + 1.0) / steady.variance), after))
    return Weight(*zip(*found, strict=True))
