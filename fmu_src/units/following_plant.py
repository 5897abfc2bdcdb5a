"""FollowingPlant: HelicopterPlant that follows a rig, with an observer and corrections of its parameters, as a unit."""

from __future__ import annotations

from typing import ClassVar

from heli_plant.communication import PlantMemory, shown
from heli_plant.observer import (
    CORRECTED,
    TRAVEL_BANDWIDTH,
    Torque,
    measured_against,
    observer_gains,
    predicted,
    with_correction,
    with_share,
)
from heli_plant.parameters import PlantParameters

from ..variables import Variable, for_each, real_input
from .helicopter_plant import HelicopterPlant
from .signals import ANGLE_BOUND, AXES

_LARGEST_CORRECTION = 100.0  # in the unit of what it corrects; the parameter's own range holds for the sum

_CORRECTIONS = tuple(
    real_input(f"correction.{name}", unit, _LARGEST_CORRECTION, 1.0, f"what is added to {name}")
    for name, unit in CORRECTED
)
_KEEPING = (
    *for_each(
        AXES, real_input, "measured.{}", "rad", ANGLE_BOUND, 1.0, "{} of the rig that the observer keeps the plant on"
    ),
    real_input("measured.fresh", "1", 1.0, 1.0, "1: the measured angles are of this instant, 0: nothing came in", 1.0),
    real_input(
        "observer.bandwidth", "rad/s", 100.0, 10.0, "poles of the observer; 0: it is off and the plant runs free"
    ),
)

_CORRECTING = slice(-len(_CORRECTIONS) - len(_KEEPING), -len(_KEEPING))
"""Values of the corrections."""


class FollowingPlant(HelicopterPlant):
    """The plant with an observer that keeps its state on a rig, and corrections of its parameters."""

    variables: ClassVar[tuple[Variable, ...]] = (*HelicopterPlant.variables, *_CORRECTIONS, *_KEEPING)
    hidden = {"memory": PlantMemory, "torque": Torque}
    summary = "HelicopterPlant that follows a rig: an observer keeps its state there, a Corrector its parameters"

    def initialise(self, time: float) -> None:
        """Start as the plant, without unmodelled torques."""
        super().initialise(time)
        self.torque = Torque()

    def _corrected(self, parameters: PlantParameters) -> PlantParameters:
        self.corrected_by = self.values[_CORRECTING]
        return with_correction(parameters, self.corrected_by) if any(self.corrected_by) else parameters

    def advance(self, time: float, step_size: float) -> None:
        """Step the physics over [time, time + step_size] [s], from where the measured angles of ``time`` put it."""
        if self.tuned or self.values[_CORRECTING] != self.corrected_by:
            self._take_parameters()
        # the last corrections are those of the rotors' shares
        front, rear, pitch, elevation, travel, fresh, bandwidth = self.values[-2 - len(_KEEPING) :]
        memory, torque, limit = self.memory, self.torque, self.parameters.v_max
        v_front, v_rear = map(with_share, self.values[:2], (1.0 + front, 1.0 + rear), (limit, limit))
        if bandwidth > 0.0:
            gains = observer_gains(bandwidth, step_size)
            if fresh > 0.5:
                on_travel = observer_gains(TRAVEL_BANDWIDTH * bandwidth, step_size)
                angles = (pitch, elevation, travel)
                kept = measured_against(memory.state, torque, angles, (gains, gains, on_travel))
                memory, torque = memory._replace(state=kept.state), kept.torque
        memory = self._flown(memory, v_front, v_rear, time, step_size)
        if bandwidth > 0.0:
            kept = predicted(memory.state, torque, step_size, gains)
            memory, torque = memory._replace(state=kept.state), kept.torque
        self.memory, self.torque = memory, torque
        self.show(shown(memory.state, self.counts))
