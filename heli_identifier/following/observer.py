"""The observer that keeps the twin on the rig, what a change makes of its innovations, and how much a sample counts.

**Sensitivity.** An acceleration g that the plant lacks moves the errors of the observer (:mod:`heli_plant.observer`).
With (x, w, d) what g makes of them per unit, and the axis' own stiffness a and damping b,

    x += h w + h^2/2 (g + d - a x - b w),  w += h (g + d - a x - b w),  d *= exp(-gamma h)
    psi = x
    x -= l_1 psi,  w -= l_2 psi,  d -= l_3 psi

so that e = delta psi + white noise for a change of size delta along g. psi is known before the sample is.

**Gaps.** While no sample comes in, the twin goes on under the last voltages. That is not what acted on the rig. A
controller answers the motion, so that the difference goes along with the rate, as a friction or a damping does: a
twentieth of the samples lost gives a bias, not noise. With the next sample the voltages at both ends of the gap are
known. The twin goes back to the gap's begin and through it once more, under voltages on a straight line between them,

    V_j = V_0 + (V_n - V_0) j/n,     j = 0 .. n - 1  of  n  sampling intervals

A controller answers every count of an encoder with a kick, which the line misses by sigma. It is learned where no
sample is missing: of three in a row the middle one is taken for lost,

    sigma^2 = mean of (V_(k-1) - (V_(k-2) + V_k)/2)^2

for the difference (front - rear) and the sum of the voltages, over two minutes.

**Gains.** In a stream without gaps the observer is the Kalman filter in its steady state. After samples that did not
come in, the state is known less well; the next sample counts for more, and its innovation scatters more. With P the
covariance of the errors of (x, w, d), in units of the variance r of the encoder's noise,

    prediction     P <- F P F^T + diag(0, q_w, q_d),    F = [[1, h, h^2/2], [0, 1, h], [0, 0, exp(-gamma h)]]
    innovation     s = P_xx + 1,    l = P_(.x)/s
    correction     P <- P - l P_(x.)

q_d = omega_o^6 h^2 is what the observer's bandwidth stands for, and q_w = (k h sigma)^2/r for each lost voltage, k the
gain of the axis.

Sources: Gustafsson, Adaptive Filtering and Change Detection, 2000, section 8.3; Anderson and Moore, Optimal Filtering,
1979, chapter 3; Sinopoli, Schenato, Franceschetti, Poolla, Jordan, Sastry, Kalman filtering with intermittent
observations, IEEE Transactions on Automatic Control 49 (2004).
"""

from math import cos, log, sin, sqrt
from typing import NamedTuple

from heli_plant.communication import PlantMemory, begin, communicate
from heli_plant.laws import input_delay, thrust_voltages
from heli_plant.observer import (
    TRAVEL_BANDWIDTH,
    ObserverGains,
    Torque,
    measured_against,
    observer_gains,
    predicted,
    with_share,
)
from heli_plant.parameters import PlantParameters
from heli_plant.plant import arriving
from heli_plant.state import PlantState

from .blocks import MEMORY
from .changes import Laws, regress_motion

Voltages = tuple[float, float]
"""Front and rear [V]."""

Angles = tuple[float, float, float]
"""Of pitch, elevation and travel [rad]."""

_ALMOST = 100.0
"""The covariance has come back to its steady state when what a gap has made of it is less by this factor."""

_STEADY = 4.0
"""The steady state is looked for in this many times the samples in which a gap is forgotten."""


class Twin(NamedTuple):
    """A twin: the values of what may change, the front and the rear rotor's share of thrust last, and its plant."""

    values: tuple[float, ...]
    parameters: PlantParameters


class Sensitivity(NamedTuple):
    """What the regressors of one axis make of its errors: angles [rad], rates [rad/s], torques [rad/s^2] per unit."""

    angle: tuple[float, ...]
    rate: tuple[float, ...]
    torque: tuple[float, ...]


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


class ObserverPlan(NamedTuple):
    """Sampling period h [s]; gains and steady state of the axes; samples for which a gap is ``remembered``.

    ``delay``: the plant's input delay [s].
    """

    sample_time: float
    gains: tuple[ObserverGains, ...]
    steady: tuple[Steady, ...]
    remembered: int
    delay: float
    laws: Laws


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


class Weight(NamedTuple):
    """How much a sample counts: the gains; the innovations' standard deviations in those of the steady state [1].

    P of the axes after the correction; empty in the steady state.
    """

    gains: tuple[ObserverGains, ...]
    deviations: tuple[float, ...]
    covariances: tuple[Covariance, ...]


class Observer(NamedTuple):
    """What the observer remembers; ``voltages``: held since the last instant [V]; ``covariances`` as in Weight."""

    instant: Instant
    voltages: Voltages
    gap: Gap
    roughness: Roughness
    covariances: tuple[Covariance, ...]


def prepare_observer(h: float, bandwidth: float, p: PlantParameters, laws: Laws) -> ObserverPlan:
    """Return the plan for samples every ``h`` [s] and poles of ``bandwidth`` omega_o [rad/s]."""
    gains, gains_travel = observer_gains(bandwidth, h), observer_gains(TRAVEL_BANDWIDTH * bandwidth, h)
    steady = find_steady_state(bandwidth, h, gains.kept)
    return ObserverPlan(
        sample_time=h,
        gains=(gains, gains, gains_travel),
        steady=(steady, steady, find_steady_state(TRAVEL_BANDWIDTH * bandwidth, h, gains.kept)),
        remembered=gap_memory(bandwidth, h),
        delay=input_delay(p),
        laws=laws,
    )


def start_instant(first: PlantState, p: PlantParameters, columns: tuple[int, int, int]) -> Instant:
    """Return the twin in the state ``first``, nothing having acted on the ``columns`` regressors of each axis."""
    return Instant(begin(first, p), Torque(), tuple([Sensitivity((0.0,) * n, (0.0,) * n, (0.0,) * n) for n in columns]))


def start_observer(instant: Instant, voltages: Voltages) -> Observer:
    """Return the observer at sample 0."""
    return Observer(instant, voltages, Gap(instant, voltages), Roughness(0.0, 0.0, 0, voltages, voltages, 1), ())


def apply_shares(voltages: Voltages, twin: Twin) -> Voltages:
    """Return the voltages [V] as rotors see them that have the twin's shares of their thrust left."""
    limit = twin.parameters.v_max
    return with_share(voltages[0], twin.values[-2], limit), with_share(voltages[1], twin.values[-1], limit)


def advance(now: Instant, voltages: Voltages, time: float, twin: Twin, plan: ObserverPlan) -> tuple[Instant, Voltages]:
    """Return the twin one sampling interval after ``time`` [s], and the voltages that arrived at its motors [V].

    ``voltages`` [V] are held meanwhile. The sensitivities' ``angle`` is then psi; what arrived is without the rotors'
    shares.
    """
    h, p, before = plan.sample_time, twin.parameters, now.memory.state
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
        predict_sensitivity(now.sensitivities[axis], acting[axis], *own[axis], h, plan.gains[axis]) for axis in range(3)
    ]
    return Instant(memory._replace(state=kept), torque, tuple(sensitivities)), voltages


def advance_observer(
    observer: Observer, voltages: Voltages, k: int, crosses: bool, twin: Twin, plan: ObserverPlan
) -> tuple[Observer, Voltages]:
    """Return the observer at sample ``k``, before its correction, and the voltages that arrived since [V].

    ``voltages`` [V] are held from sample ``k`` on. Where ``k`` is the first sample after a gap it ``crosses`` the gap
    once more; what arrived is then less by what the twin had taken for it before.
    """
    h, gap = plan.sample_time, observer.gap
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


def correct_observer(observer: Observer, angles: Angles, weight: Weight, plan: ObserverPlan) -> Observer:
    """Return the observer after the correction by a sample of the ``angles`` [rad]."""
    before, voltages = observer.instant, observer.voltages
    kept, torque = measured_against(before.memory.state, before.torque, angles, weight.gains)
    rows = [correct_sensitivity(*own) for own in zip(before.sensitivities, weight.gains, strict=True)]
    instant = Instant(before.memory._replace(state=kept), torque, tuple(rows))
    roughness = learn_roughness(observer.roughness, voltages, observer.gap.unseen > 0, plan.sample_time)
    covariances = weight.covariances if roughness.in_a_row < plan.remembered else ()
    return Observer(instant, voltages, Gap(instant, voltages), roughness, covariances)


def predict_sensitivity(
    s: Sensitivity, acting: list[float], stiffness: float, damping: float, h: float, g: ObserverGains
) -> Sensitivity:
    """Return psi (as ``angle``) and the rest one sample later, before its correction.

    ``acting``: the accelerations g over the step [rad/s^2 per unit]; ``stiffness`` [1/s^2] and ``damping`` [1/s].
    """
    half = 0.5 * h * h
    total = [
        of + d - stiffness * x - damping * w for of, x, w, d in zip(acting, s.angle, s.rate, s.torque, strict=True)
    ]
    return Sensitivity(
        tuple([x + h * w + half * a for x, w, a in zip(s.angle, s.rate, total, strict=True)]),
        tuple([w + h * a for w, a in zip(s.rate, total, strict=True)]),
        tuple([g.kept * d for d in s.torque]),
    )


def correct_sensitivity(s: Sensitivity, g: ObserverGains) -> Sensitivity:
    """Return the sensitivity after the sample's correction."""
    left = 1.0 - g.angle
    return Sensitivity(
        tuple([left * x for x in s.angle]),
        tuple([w - g.rate * x for x, w in zip(s.angle, s.rate, strict=True)]),
        tuple([d - g.torque * x for x, d in zip(s.angle, s.torque, strict=True)]),
    )


def learn_roughness(r: Roughness, voltages: Voltages, missing: bool, h: float) -> Roughness:
    """Return what is known after a sample with ``voltages`` [V], before which one was ``missing`` or not."""
    if missing:
        return r._replace(last=voltages, in_a_row=1)
    in_a_row = r.in_a_row + 1
    if in_a_row < 3:
        return r._replace(last=voltages, before=r.last, in_a_row=in_a_row)
    front = r.last[0] - 0.5 * (r.before[0] + voltages[0])
    rear = r.last[1] - 0.5 * (r.before[1] + voltages[1])
    count = min(r.samples + 1, round(MEMORY / h))
    return Roughness(
        difference=r.difference + ((front - rear) * (front - rear) - r.difference) / count,
        total=r.total + ((front + rear) * (front + rear) - r.total) / count,
        samples=count,
        last=voltages,
        before=r.last,
        in_a_row=in_a_row,
    )


def weigh_full(plan: ObserverPlan) -> Weight:
    """Return how much a sample counts in a stream without gaps."""
    return Weight(plan.gains, (1.0, 1.0, 1.0), ())


def weigh_sample(
    observer: Observer, unseen: int, noise: tuple[float, ...], p: PlantParameters, plan: ObserverPlan
) -> Weight:
    """Return how much a sample counts that came in after ``unseen`` instants without one.

    ``noise``: standard deviations of the innovations of the axes in the steady state [rad].
    """
    known, rough, h = observer.covariances, observer.roughness, plan.sample_time
    if not known and unseen == 0:
        return weigh_full(plan)
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


def gap_memory(bandwidth: float, h: float) -> int:
    """Return the samples in which a gap is forgotten; ``bandwidth`` [rad/s], sampling period ``h`` [s].

    The slowest poles of the error have the real part -omega_o/2, and a covariance fades with twice that.
    """
    return round(log(_ALMOST) / (bandwidth * h))


def find_steady_state(bandwidth: float, h: float, kept: float) -> Steady:
    """Return the steady state for a ``bandwidth`` omega_o [rad/s], samples every ``h`` [s], exp(-gamma h) ``kept``."""
    drive = bandwidth**6 * h * h
    u, variance = Covariance(1.0, 0.0, 0.0, bandwidth**2, 0.0, bandwidth**4), 1.0
    for _ in range(round(_STEADY * gap_memory(bandwidth, h))):
        u = predict_covariance(u, h, kept, 0.0, drive)
        variance = u.angle + 1.0
        u = correct_covariance(u)
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


def kalman_gains(u: Covariance, kept: float) -> ObserverGains:
    """Return the Kalman gain l for P before a correction."""
    s = u.angle + 1.0
    return ObserverGains(u.angle / s, u.angle_rate / s, u.angle_torque / s, kept)


def correct_covariance(u: Covariance) -> Covariance:
    """Return P after the correction by a sample."""
    xx, xw, xd, ww, wd, dd = u
    s = xx + 1.0
    return Covariance(xx / s, xw / s, xd / s, ww - xw * xw / s, wd - xw * xd / s, dd - xd * xd / s)
