"""The observer of the twin: how its innovations respond to a change, and what it does in a gap of the stream.

**Sensitivity.** An acceleration g that the plant lacks moves the errors of the observer (:mod:`heli_plant.observer`).
(x, w, d) are the errors per unit of g, and a and b are the stiffness and the damping of the axis:

    x += h w + h^2/2 (g + d - a x - b w),  w += h (g + d - a x - b w),  d *= exp(-gamma h)
    psi = x
    x -= l_1 psi,  w -= l_2 psi,  d -= l_3 psi

so that e = delta psi + white noise for a change of size delta along g. psi is known before the sample is.

**Gaps and encoders** (docs/explanation/following.md, "The stream"). After a gap the next sample's gain follows from the
covariance (:mod:`.covariance`). An axis that turns within a count would, at the rate with which it came to this count,
have moved by up to four counts meanwhile, and the observer's rate is late. Only an encoder that has stood while the rig
should have moved further is at fault.
"""

from math import cos, sqrt
from typing import NamedTuple

from heli_plant.communication import PlantMemory, communicate, start_memory
from heli_plant.laws import thrust_voltages
from heli_plant.observer import Torque, correct_state, predict_state
from heli_plant.parameters import PlantParameters
from heli_plant.plant import delayed_input
from heli_plant.state import PlantState

from .changes import Matrix, Vector, regress_motion
from .covariance import correct_covariance, predict_covariance
from .plan import FollowPlan

Angles = tuple[float, float, float]
"""Of pitch, elevation and travel [rad]."""

Voltages = tuple[float, float]
"""Front and rear [V]."""

Sensitivity = tuple[tuple[float, float, float], ...]
"""(x, w, d) of each regressor of an axis: errors of angle [rad], rate [rad/s] and torque [rad/s^2] per unit."""

_FAULT_PATH, _FAULT_PATH_NOISE, _DOUBT_PATH_NOISE = 15e-3, 8.0, 2.0
"""An encoder that stands still is at fault when the rig should have moved by more than the larger of two paths: [rad],
ten counts of 4096, and in standard deviations of the innovations [1]. It is doubtful from the third path on [1]."""


class Observer(NamedTuple):
    """The observer between two samples.

    ``memory`` of the twin's plant; its unmodelled accelerations ``torque`` [rad/s^2]; the sensitivities of each axis;
    ``voltages`` held from now on [V]; P of each axis (``covariances``), empty in the steady state; number of samples
    ``in_a_row`` since one was missing.
    """

    memory: PlantMemory
    torque: Torque
    sensitivities: tuple[Sensitivity, ...]
    voltages: Voltages
    covariances: tuple[Matrix, ...] = ()
    in_a_row: int = 0

    def advance(
        self, voltages: Voltages, time: float, has_sample: bool, p: PlantParameters, plan: FollowPlan
    ) -> "tuple[Observer, Voltages]":
        """Return the observer of the twin ``p`` an interval after ``time`` [s], and the voltages that arrived [V].

        The new ``voltages`` [V] are held from then on. The correction by a sample, if there is one, comes afterwards.
        """
        h, before, gains = plan.settings.sample_time, self.memory.state, plan.steady[0].gains
        arrived = self.voltages
        memory = communicate(self.memory, *arrived, 0.0, time, 0.0, h, h, plan.delay, p)
        if plan.delay > 0.0:
            arrived = delayed_input(memory.since, memory.held, len(memory.since) - 1, time, h, p)
        state, torque = predict_state(memory.state, self.torque, h, gains)
        # accelerations per unit of each change, from the motion at the beginning of the step
        mu_diff, mu_sum = thrust_voltages(
            0.5 * (before.nu_front + state.nu_front), 0.5 * (before.nu_rear + state.nu_rear), time + h, p
        )
        regressors = regress_motion(before, mu_diff, mu_sum, p.theta0)
        stiffnesses, dampings = (p.a_th * cos(before.pitch - p.theta0), p.a_e, 0.0), (p.a_wx, p.a_wz, p.a_wy)
        sensitivities = []
        for sensitivity, accelerations, a, b in zip(self.sensitivities, regressors, stiffnesses, dampings, strict=True):
            rows = []
            for (x, w, d), g in zip(sensitivity, accelerations, strict=True):
                total = g + d - a * x - b * w
                rows.append((x + h * w + 0.5 * h * h * total, w + h * total, gains.decay * d))
            sensitivities.append(tuple(rows))
        covariances = self.covariances
        if covariances or not has_sample:
            pairs = zip(covariances or [axis.covariance for axis in plan.steady], plan.steady, strict=True)
            covariances = tuple([predict_covariance(P, h, axis.gains.decay, axis.drive) for P, axis in pairs])
        memory = memory._replace(state=state)
        return Observer(memory, torque, tuple(sensitivities), voltages, covariances, self.in_a_row), arrived

    def deviations(self, plan: FollowPlan) -> Vector:
        """Return the standard deviations of the axes' innovations over those of the steady state [1]."""
        pairs = zip(self.covariances, plan.steady, strict=False)
        return tuple([sqrt((P[0][0] + 1.0) / axis.variance) for P, axis in pairs]) or (1.0, 1.0, 1.0)

    def correct(self, angles: Angles, plan: FollowPlan) -> "Observer":
        """Return the observer after the correction by a sample of the ``angles`` [rad]."""
        gains, covariances = [axis.gains for axis in plan.steady], list(self.covariances)
        for axis, P in enumerate(self.covariances):
            gains[axis], covariances[axis] = correct_covariance(P, gains[axis].decay)
        state, torque = correct_state(self.memory.state, self.torque, angles, tuple(gains))
        sensitivities, in_a_row = [], self.in_a_row + 1
        for rows, g in zip(self.sensitivities, gains, strict=True):
            factor = 1.0 - g.angle
            sensitivities.append(tuple([(factor * x, w - g.rate * x, d - g.torque * x) for x, w, d in rows]))
        memory = self.memory._replace(state=state)
        recent = tuple(covariances) if in_a_row < plan.gap_memory else ()
        return Observer(memory, torque, tuple(sensitivities), self.voltages, recent, in_a_row)


def start_observer(first: PlantState, voltages: Voltages, p: PlantParameters, plan: FollowPlan) -> Observer:
    """Return the observer of a plant in the state ``first``, with sensitivities of zero."""
    sensitivities = tuple([((0.0, 0.0, 0.0),) * len(deviations) for deviations in plan.deviations])
    return Observer(start_memory(first, p), Torque(), sensitivities, voltages)


class Encoder(NamedTuple):
    """One encoder.

    Its last ``angle`` [rad]; number of samples for which it has stood ``still``, and the ``rate`` [rad/s] of the
    observer when it stopped; ``unsettled``: samples until the observer has settled after half a second of standstill;
    ``jump`` with which it has just ended such a standstill [rad].
    """

    angle: float
    still: int = 0
    rate: float = 0.0
    unsettled: int = 0
    jump: float = 0.0

    def read(self, angle: float, rate: float, plan: FollowPlan) -> "Encoder":
        """Return the encoder after a sample of its ``angle`` [rad], the observer at a ``rate`` [rad/s]."""
        unsettled = max(0, self.unsettled - 1)
        if angle == self.angle:
            return Encoder(angle, self.still + 1, self.rate if self.still else rate, unsettled)
        if self.still < plan.stuck:
            return Encoder(angle, unsettled=unsettled)
        return Encoder(angle, unsettled=plan.settling, jump=abs(angle - self.angle))

    def is_ignored(self, plan: FollowPlan) -> bool:
        """Return whether its angle is ignored: it stands, or stood until recently."""
        return self.still >= plan.stuck or self.unsettled > 0

    def path(self, plan: FollowPlan) -> float:
        """Return how far the rig would have moved since the encoder stopped, at the rate that it had then [rad]."""
        return abs(self.rate) * self.still * plan.settings.sample_time

    def is_at_fault(self, deviation: float, plan: FollowPlan) -> bool:
        """Return whether it stood although the rig has moved on; ``deviation`` of the innovations [rad]."""
        moved = self.path(plan) if self.still >= plan.stuck else self.jump
        return moved > max(_FAULT_PATH, _FAULT_PATH_NOISE * deviation)

    def is_doubtful(self, deviation: float, plan: FollowPlan) -> bool:
        """Return whether it stands and should have moved; ``deviation`` of the innovations [rad]."""
        return self.path(plan) > _DOUBT_PATH_NOISE * deviation
