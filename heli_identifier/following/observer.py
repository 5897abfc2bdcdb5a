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
gap, and the sample is weighed by the covariance (:mod:`.covariance`).

**Encoders that stand still** although the rig moves. An encoder stands at one count wherever an axis turns back or
rests. It is at fault if at the rate that the axis had when it stopped the rig would have gone further than five counts
and the noise since. This is seen only after a while, and one that stood while the rig moved by less cannot be told from
one that rested. What an encoder says therefore does not count while it stands for half a second or more, and afterwards
until the observer has settled, which took that angle for the rig's. An alarm waits while an encoder stands from which
the rig should have gone by more than the noise.
"""

from math import cos, sqrt
from typing import NamedTuple

from heli_plant.communication import PlantMemory, communicate, start_memory
from heli_plant.laws import thrust_voltages
from heli_plant.observer import Torque, correct_state, predict_state, with_share
from heli_plant.parameters import PlantParameters
from heli_plant.plant import delayed_input
from heli_plant.state import PlantState

from .changes import Matrix, Vector, regress_motion
from .covariance import correct_covariance, gap_memory, predict_covariance
from .plan import FollowPlan, Twin

Angles = tuple[float, float, float]
"""Of pitch, elevation and travel [rad]."""

Voltages = tuple[float, float]
"""Front and rear [V]."""

Sensitivity = tuple[tuple[float, float, float], ...]
"""(x, w, d) of each regressor of an axis: what it makes of angle [rad], rate [rad/s] and torque [rad/s^2] per unit."""

_PATH, _PATH_NOISE = 7.5e-3, 8.0
"""Path [rad], and path in standard deviations of the innovations, at which an encoder that stands still is at fault:
five counts of 4096, and more of a coarser one. The larger of the two counts."""

_DOUBTFUL = 2.0  # path in standard deviations of the innovations at which an encoder that stands still may be at fault


def apply_shares(voltages: Voltages, twin: Twin) -> Voltages:
    """Return the voltages [V] as rotors see them that have the twin's shares of their thrust left."""
    limit = twin.parameters.v_max
    return with_share(voltages[0], twin.values[-2], limit), with_share(voltages[1], twin.values[-1], limit)


class Observer(NamedTuple):
    """What the observer remembers.

    The twin's plant now, its unmodelled accelerations [rad/s^2], the sensitivity of each axis; ``voltages`` held from
    now on [V]; P of the axes (``covariances``), empty in the steady state; samples ``in_a_row`` since one was missing.
    """

    memory: PlantMemory
    torque: Torque
    sensitivities: tuple[Sensitivity, ...]
    voltages: Voltages
    covariances: tuple[Matrix, ...] = ()
    in_a_row: int = 0

    def advance(
        self, now: Voltages, time: float, seen: bool, twin: Twin, plan: FollowPlan
    ) -> "tuple[Observer, Voltages]":
        """Return the observer one sampling interval after ``time`` [s], and the voltages that arrived meanwhile [V].

        The voltages ``now`` [V] are held from then on; it is before the correction by a sample, if one is ``seen``.
        What arrived is without the rotors' shares.
        """
        h, p, before, gains = plan.settings.sample_time, twin.parameters, self.memory.state, plan.steady[0].gains
        arrived, (front, rear) = self.voltages, apply_shares(self.voltages, twin)
        memory = communicate(self.memory, front, rear, 0.0, time, 0.0, h, h, plan.delay, p)
        if plan.delay > 0.0:
            front, rear = delayed_input(memory.since, memory.held, len(memory.since) - 1, time, h, p)
            arrived = (front / twin.values[-2], rear / twin.values[-1])
        state, torque = predict_state(memory.state, self.torque, h, gains)
        # the accelerations by which each change would have acted, from the motion at the step's begin
        mu_diff, mu_sum = thrust_voltages(
            0.5 * (before.nu_front + state.nu_front), 0.5 * (before.nu_rear + state.nu_rear), time + h, p
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
        known = self.covariances
        if known or not seen:
            pairs = zip(known or [one.covariance for one in plan.steady], plan.steady, strict=True)
            known = tuple([predict_covariance(P, h, one.gains.kept, one.drive) for P, one in pairs])
        return Observer(memory._replace(state=state), torque, tuple(found), now, known, self.in_a_row), arrived

    def deviations(self, plan: FollowPlan) -> Vector:
        """Return the standard deviations of the axes' innovations in those of the steady state [1]."""
        pairs = zip(self.covariances, plan.steady, strict=False)
        return tuple([sqrt((P[0][0] + 1.0) / one.variance) for P, one in pairs]) or (1.0, 1.0, 1.0)

    def correct(self, angles: Angles, plan: FollowPlan) -> "Observer":
        """Return the observer after the correction by a sample of the ``angles`` [rad]."""
        gains, covariances = [one.gains for one in plan.steady], list(self.covariances)
        for axis, P in enumerate(self.covariances):
            gains[axis], covariances[axis] = correct_covariance(P, gains[axis].kept)
        state, torque = correct_state(self.memory.state, self.torque, angles, tuple(gains))
        rows, in_a_row = [], self.in_a_row + 1
        for own, g in zip(self.sensitivities, gains, strict=True):
            left = 1.0 - g.angle
            rows.append(tuple([(left * x, w - g.rate * x, d - g.torque * x) for x, w, d in own]))
        recent = in_a_row < gap_memory(plan.settings.observer_bandwidth, plan.settings.sample_time)
        known = tuple(covariances) if recent else ()
        return Observer(self.memory._replace(state=state), torque, tuple(rows), self.voltages, known, in_a_row)


def start_observer(first: PlantState, voltages: Voltages, p: PlantParameters, plan: FollowPlan) -> Observer:
    """Return the observer of a plant in the state ``first``, nothing having acted on the regressors."""
    unmoved = tuple([((0.0, 0.0, 0.0),) * len(own) for own in plan.deviations])
    return Observer(start_memory(first, p), Torque(), unmoved, voltages)


class Encoder(NamedTuple):
    """One encoder.

    Its last ``angle`` [rad]; for how many samples it has been ``still``, and the ``rate`` [rad/s] that the observer saw
    when it stopped; for how many samples the observer has not ``settled`` since it moved again after half a second.
    """

    angle: float
    still: int = 0
    rate: float = 0.0
    unsettled: int = 0

    def read(self, angle: float, rate: float, plan: FollowPlan) -> "Encoder":
        """Return the encoder after a sample of its ``angle`` [rad], the observer at a ``rate`` [rad/s]."""
        unsettled = max(0, self.unsettled - 1)
        if angle == self.angle:
            return Encoder(angle, self.still + 1, self.rate if self.still else rate, unsettled)
        return Encoder(angle, unsettled=plan.settling if self.still >= plan.stuck else unsettled)

    def is_discounted(self, plan: FollowPlan) -> bool:
        """Return whether what it says does not count: it stands, or has stood until shortly before."""
        return self.still >= plan.stuck or self.unsettled > 0

    def path(self, plan: FollowPlan) -> float:
        """Return how far the rig has gone since it stopped, at the rate that it had [rad]."""
        return abs(self.rate) * self.still * plan.settings.sample_time

    def is_at_fault(self, deviation: float, plan: FollowPlan) -> bool:
        """Return whether it stands although the rig has moved on; ``deviation`` of the innovations [rad]."""
        return self.path(plan) > max(_PATH, _PATH_NOISE * deviation)

    def is_doubtful(self, deviation: float, plan: FollowPlan) -> bool:
        """Return whether it stands and should have moved; ``deviation`` of the innovations [rad]."""
        return self.path(plan) > _DOUBTFUL * deviation
