"""The observer that keeps the twin on the rig, what a change makes of its innovations, and how it crosses a gap.

**Sensitivity.** An acceleration g that the plant lacks moves the errors of the observer (:mod:`heli_plant.observer`).
With (x, w, d) what g makes of them per unit, and the axis' own stiffness a and damping b,

    x += h w + h^2/2 (g + d - a x - b w),  w += h (g + d - a x - b w),  d *= exp(-gamma h)
    psi = x
    x -= l_1 psi,  w -= l_2 psi,  d -= l_3 psi

so that e = delta psi + white noise for a change of size delta along g. psi is known before the sample is.

**Gaps.** Under the last voltages the twin errs along with the rate, as a friction does. With the next sample it goes
back to the gap's begin and through it once more, under voltages on a straight line between both ends,

    V_j = V_0 + (V_n - V_0) j/n,     j = 0 .. n - 1  of  n  sampling intervals

The state is then known less well, and the sample is weighed by the covariance (:mod:`.covariance`), with
q_w = (k h sigma)^2/r for each lost voltage, k the gain of the axis. sigma is by how much the line misses, learned where
no sample is missing, over two minutes:

    sigma^2 = mean of (V_(k-1) - (V_(k-2) + V_k)/2)^2    for difference (front - rear) and sum of the voltages
"""

from math import cos, sin, sqrt
from typing import NamedTuple

from heli_plant.communication import PlantMemory, begin, communicate
from heli_plant.laws import thrust_voltages
from heli_plant.observer import ObserverGains, Torque, measured_against, predicted, with_share
from heli_plant.parameters import PlantParameters
from heli_plant.plant import arriving
from heli_plant.state import PlantState

from .changes import Matrix, Vector, regress_motion
from .covariance import correct_covariance, gap_memory, predict_covariance
from .evidence import MEMORY
from .plan import FollowPlan, Twin

Angles = tuple[float, float, float]
"""Of pitch, elevation and travel [rad]."""

Voltages = tuple[float, float]
"""Front and rear [V]."""

Sensitivity = tuple[tuple[float, float, float], ...]
"""(x, w, d) of each regressor of an axis: what it makes of angle [rad], rate [rad/s] and torque [rad/s^2] per unit."""


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

    def learn(self, voltages: Voltages, missing: bool, h: float) -> "Roughness":
        """Return what is known after a sample with ``voltages`` [V], before which one was ``missing`` or not."""
        in_a_row = 1 if missing else self.in_a_row + 1
        if in_a_row < 3:
            return self._replace(last=voltages, before=self.last, in_a_row=in_a_row)
        front, rear = [b - 0.5 * (a + c) for a, b, c in zip(self.before, self.last, voltages, strict=True)]
        count = min(self.samples + 1, round(MEMORY / h))
        difference = self.difference + ((front - rear) * (front - rear) - self.difference) / count
        total = self.total + ((front + rear) * (front + rear) - self.total) / count
        return Roughness(difference, total, count, voltages, self.last, in_a_row)


def apply_shares(voltages: Voltages, twin: Twin) -> Voltages:
    """Return the voltages [V] as rotors see them that have the twin's shares of their thrust left."""
    limit = twin.parameters.v_max
    return with_share(voltages[0], twin.values[-2], limit), with_share(voltages[1], twin.values[-1], limit)


class Instant(NamedTuple):
    """The twin at one instant: its plant, the unmodelled accelerations [rad/s^2], the sensitivity of each axis."""

    memory: PlantMemory
    torque: Torque
    sensitivities: tuple[Sensitivity, ...]

    def advance(self, voltages: Voltages, time: float, twin: Twin, plan: FollowPlan) -> "tuple[Instant, Voltages]":
        """Return the twin one sampling interval after ``time`` [s], and the voltages that arrived at its motors [V].

        ``voltages`` [V] are held meanwhile; what arrived is without the rotors' shares.
        """
        h, p, before, gains = plan.settings.sample_time, twin.parameters, self.memory.state, plan.steady[0].gains
        front, rear = apply_shares(voltages, twin)
        memory = communicate(self.memory, front, rear, 0.0, time, 0.0, h, h, plan.delay, p)
        if plan.delay > 0.0:
            front, rear = arriving(memory.since, memory.held, len(memory.since) - 1, time, h, p)
            voltages = (front / twin.values[-2], rear / twin.values[-1])
        kept, torque = predicted(memory.state, self.torque, h, gains)
        # the accelerations by which each change would have acted, from the motion at the step's begin
        mu_diff, mu_sum = thrust_voltages(
            0.5 * (before.nu_front + kept.nu_front), 0.5 * (before.nu_rear + kept.nu_rear), time + h, p
        )
        acting = regress_motion(before, mu_diff, mu_sum, plan.laws, p.theta0)
        stiffnesses, dampings = (p.a_th * cos(before.pitch - p.theta0), p.a_e, 0.0), (p.a_wx, p.a_wz, p.a_wy)
        found = []
        for own, accelerations, a, b in zip(self.sensitivities, acting, stiffnesses, dampings, strict=True):
            rows = []
            for (x, w, d), g in zip(own, accelerations, strict=True):
                total = g + d - a * x - b * w
                rows.append((x + h * w + 0.5 * h * h * total, w + h * total, gains.kept * d))
            found.append(tuple(rows))
        return Instant(memory._replace(state=kept), torque, tuple(found)), voltages


class Weight(NamedTuple):
    """How much a sample counts: the gains; the innovations' standard deviations in those of the steady state [1].

    P of the axes after the correction; empty in the steady state.
    """

    gains: tuple[ObserverGains, ...]
    deviations: Vector = (1.0, 1.0, 1.0)
    covariances: tuple[Matrix, ...] = ()


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
    covariances: tuple[Matrix, ...] = ()
    unseen: int = 0
    arrived: Voltages = (0.0, 0.0)

    def advance(
        self, voltages: Voltages, k: int, crosses: bool, twin: Twin, plan: FollowPlan
    ) -> "tuple[Observer, Voltages]":
        """Return the observer at sample ``k``, before its correction, and the voltages that arrived since [V].

        ``voltages`` [V] are held from sample ``k`` on. Where ``k`` is the first sample after a gap it ``crosses`` the
        gap once more; what arrived is then less by what the twin had taken for it before.
        """
        n, instant, first, front, rear = 1, self.instant, self.voltages, 0.0, 0.0
        if crosses:
            n, instant, first = self.unseen + 1, self.begin, self.roughness.last
            front, rear = -self.arrived[0], -self.arrived[1]
        for j in range(n):
            held = first[0] + j / n * (voltages[0] - first[0]), first[1] + j / n * (voltages[1] - first[1])
            instant, arrived = instant.advance(held, (k - n + j) * plan.settings.sample_time, twin, plan)
            front, rear = front + arrived[0], rear + arrived[1]
        return self._replace(instant=instant, voltages=voltages), (front, rear)

    def correct(self, angles: Angles, weight: Weight, plan: FollowPlan) -> "Observer":
        """Return the observer after the correction by a sample of the ``angles`` [rad]."""
        before, voltages, h = self.instant, self.voltages, plan.settings.sample_time
        kept, torque = measured_against(before.memory.state, before.torque, angles, weight.gains)
        rows = []
        for own, g in zip(before.sensitivities, weight.gains, strict=True):
            left = 1.0 - g.angle
            rows.append(tuple([(left * x, w - g.rate * x, d - g.torque * x) for x, w, d in own]))
        instant = Instant(before.memory._replace(state=kept), torque, tuple(rows))
        roughness = self.roughness.learn(voltages, self.unseen > 0, h)
        recent = roughness.in_a_row < gap_memory(plan.settings.observer_bandwidth, h)
        return Observer(instant, instant, voltages, roughness, weight.covariances if recent else ())

    def weigh(self, unseen: int, noise: Vector, p: PlantParameters, plan: FollowPlan) -> Weight:
        """Return how much a sample counts that came in after ``unseen`` instants without one.

        ``noise``: standard deviations of the innovations of the axes in the steady state [rad].
        """
        known, rough, h = self.covariances, self.roughness, plan.settings.sample_time
        if not known and unseen == 0:
            return Weight(tuple([one.gains for one in plan.steady]))
        of_travel = p.k_y * sin(self.instant.memory.state.pitch)
        kicks = (
            (p.k_x * h) ** 2 * rough.difference,
            (p.k_z * h) ** 2 * rough.total,
            (of_travel * h) ** 2 * rough.total,
        )
        found = []
        for axis, steady in enumerate(plan.steady):
            kept, P = steady.gains.kept, known[axis] if known else steady.covariance
            P = predict_covariance(P, h, kept, 0.0, steady.drive)
            of_rate = kicks[axis] * steady.variance / (noise[axis] * noise[axis])
            for _ in range(unseen):
                P = predict_covariance(P, h, kept, of_rate, steady.drive)
            gains, after = correct_covariance(P, kept)
            found.append((gains, sqrt((P[0][0] + 1.0) / steady.variance), after))
        return Weight(*zip(*found, strict=True))


def start_instant(first: PlantState, p: PlantParameters, plan: FollowPlan) -> Instant:
    """Return the twin in the state ``first``, nothing having acted on the regressors."""
    return Instant(begin(first, p), Torque(), tuple([((0.0, 0.0, 0.0),) * len(own) for own in plan.deviations]))
