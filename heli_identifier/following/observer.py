"""The observer that keeps the twin on the rig, what a change makes of its innovations, and how it crosses a gap.

**Sensitivity.** An acceleration g that the plant lacks moves the errors of the observer (:mod:`heli_plant.observer`).
With (x, w, d) what g makes of them per unit, and the axis' own stiffness a and damping b,

    x += h w + h^2/2 (g + d - a x - b w),  w += h (g + d - a x - b w),  d *= exp(-gamma h)
    psi = x
    x -= l_1 psi,  w -= l_2 psi,  d -= l_3 psi

so that e = delta psi + white noise for a change of size delta along g. psi is known before the sample is.

**Gaps.** Instants without a sample wait for the next one, and then pass under voltages on a straight line,

    V_j = V_0 + (V_n - V_0) j/n,     j = 0 .. n - 1  of  n  sampling intervals

Under the last voltages the twin would err along with the rate, as a friction does. The state is known less well after a
gap, and the sample is weighed by the covariance (:mod:`.covariance`), with q_w = (k h sigma)^2/r for each lost voltage,
k the gain of the axis. sigma is by how much the line misses, learned where no sample is missing, over two minutes:

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
        acting = regress_motion(before, mu_diff, mu_sum, p.theta0)
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

    The twin now; ``voltages`` held from now on [V]; their ``roughness``; P of the axes (``covariances``), empty in the
    steady state; whether the last instant was ``missing``, without a sample.
    """

    instant: Instant
    voltages: Voltages
    roughness: Roughness
    covariances: tuple[Matrix, ...] = ()
    missing: bool = False

    def advance(
        self, now: Voltages, time: float, seen: bool, noise: Vector, twin: Twin, plan: FollowPlan
    ) -> "tuple[Observer, Voltages]":
        """Return the observer one sampling interval after ``time`` [s], and the voltages that arrived meanwhile [V].

        The voltages ``now`` [V] are held from then on; it is before the correction by a sample, if one is ``seen``.
        ``noise``: standard deviations of the innovations of the axes in the steady state [rad].
        """
        instant, arrived = self.instant.advance(self.voltages, time, twin, plan)
        known, p, h = self.covariances, twin.parameters, plan.settings.sample_time
        if known or not seen:
            known, rough = known or tuple([one.covariance for one in plan.steady]), self.roughness
            gains = p.k_x, p.k_z, p.k_y * sin(instant.memory.state.pitch)
            missed = rough.difference, rough.total, rough.total
            found = []
            for P, one, k, square, deviation in zip(known, plan.steady, gains, missed, noise, strict=True):
                of_rate = (k * h / deviation) ** 2 * square * one.variance if self.missing else 0.0
                found.append(predict_covariance(P, h, one.gains.kept, of_rate, one.drive))
            known = tuple(found)
        return self._replace(instant=instant, voltages=now, covariances=known), arrived

    def weigh(self, plan: FollowPlan) -> Weight:
        """Return how much a sample counts that has come in."""
        if not self.covariances:
            return Weight(tuple([one.gains for one in plan.steady]))
        found = []
        for P, one in zip(self.covariances, plan.steady, strict=True):
            gains, after = correct_covariance(P, one.gains.kept)
            found.append((gains, sqrt((P[0][0] + 1.0) / one.variance), after))
        return Weight(*zip(*found, strict=True))

    def correct(self, angles: Angles, weight: Weight, plan: FollowPlan) -> "Observer":
        """Return the observer after the correction by a sample of the ``angles`` [rad]."""
        before, h = self.instant, plan.settings.sample_time
        kept, torque = measured_against(before.memory.state, before.torque, angles, weight.gains)
        rows = []
        for own, g in zip(before.sensitivities, weight.gains, strict=True):
            left = 1.0 - g.angle
            rows.append(tuple([(left * x, w - g.rate * x, d - g.torque * x) for x, w, d in own]))
        instant = Instant(before.memory._replace(state=kept), torque, tuple(rows))
        roughness = self.roughness.learn(self.voltages, self.missing, h)
        recent = roughness.in_a_row < gap_memory(plan.settings.observer_bandwidth, h)
        return Observer(instant, self.voltages, roughness, weight.covariances if recent else ())


def start_instant(first: PlantState, p: PlantParameters, plan: FollowPlan) -> Instant:
    """Return the twin in the state ``first``, nothing having acted on the regressors."""
    return Instant(begin(first, p), Torque(), tuple([((0.0, 0.0, 0.0),) * len(own) for own in plan.deviations]))
