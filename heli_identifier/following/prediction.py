"""Predictions one second ahead: copies of the twins that run free from the observer's state of a second ago.

Every .2 s a copy of each twin starts from the observer's state. It runs by the plant's own step, some .05 s long, under
the mean of the voltages in this time. After 1 s its angles are compared with the measured ones. The twins are the one
in use, the one left alone with the values of the start, and a rival with the values on trial or, after an adoption, the
values before it. All start from the same state, so that only their parameters differ.
"""

from math import ceil, sqrt
from typing import NamedTuple

from heli_plant.laws import bends
from heli_plant.parameters import PlantParameters
from heli_plant.plant import measured_angles, step
from heli_plant.state import PlantState

from ..online.linear_algebra import total
from .changes import Vector
from .observer import Angles, Voltages
from .plan import FollowPlan

WINDOWS = 3
"""Windows for which errors are kept, and a trial lasts at most. In one window of steady hover a wrong gain may predict
better by chance, together with a wrong offset."""

_FAST_STEP = 0.01  # longest step of a copy whose arm bends [s]
_BATCH = 5  # comparisons in a batch, 1 s: errors of overlapping predictions are correlated
Errors = tuple[Angles, ...]  # of predictions 1 s ahead, oldest first [rad]


class Copies(NamedTuple):
    """Copies of one twin: those ``running``, oldest first; the last prediction that was due [rad]; errors so far."""

    running: tuple[PlantState, ...] = ()
    predicted: Angles = (0.0, 0.0, 0.0)
    errors: Errors = ()

    def rms(self, window: int) -> Vector:
        """Return the rms of the last ``window`` errors of each axis [rad]; 0 without errors."""
        last = self.errors[-window:]
        return tuple([sqrt(total([row[axis] * row[axis] for row in last]) / max(1, len(last))) for axis in range(3)])


class Predictions(NamedTuple):
    """Copies of the twin in use, of the one left alone and, if there is one, of a rival.

    ``arrived``: sums of the voltages that arrived since the last coarse step [V]; ``compared``: whether predictions
    were compared with this sample.
    """

    copies: tuple[Copies, ...]
    arrived: Voltages = (0.0, 0.0)
    compared: bool = False

    @property
    def used(self) -> Copies:
        """Copies of the twin in use."""
        return self.copies[0]

    @property
    def alone(self) -> Copies:
        """Copies of the twin left alone."""
        return self.copies[1]

    def drop_running(self) -> "Predictions":
        """Return the predictions without running copies."""
        return self._replace(copies=tuple([copies._replace(running=()) for copies in self.copies]))

    def move(self, twins: tuple[PlantParameters, ...], k: int, plan: FollowPlan) -> "Predictions":
        """Return the copies of ``twins`` at sample ``k``, a coarse step later."""
        length = plan.coarse * plan.settings.sample_time
        time = (k // plan.coarse - 1) * length
        voltages = self.arrived[0] / plan.coarse, self.arrived[1] / plan.coarse
        moved = []
        for copies, p in zip(self.copies, twins, strict=True):
            running = copies.running
            parts = ceil(length / _FAST_STEP) if bends(p) else 1
            for part in range(parts):
                begin, h = time + part * length / parts, length / parts
                running = tuple([step(state, *voltages, 0.0, begin, h, p) for state in running])
            moved.append(copies._replace(running=running))
        return Predictions(tuple(moved))

    def launch(self, state: PlantState, angles: Angles, fresh: bool, plan: FollowPlan) -> "Predictions":
        """Compare copies that have run for 1 s with the measured ``angles``; start new ones from the ``state``."""
        full = plan.horizon // plan.launch
        launched = []
        for copies in self.copies:
            if len(copies.running) == full:
                due = measured_angles(copies.running[0])
                error = (angles[0] - due[0], angles[1] - due[1], angles[2] - due[2])
                errors = (*copies.errors, error)[-WINDOWS * plan.window :] if fresh else copies.errors
                copies = Copies(copies.running[1:], due, errors)
            launched.append(copies._replace(running=(*copies.running, state)))
        return self._replace(copies=tuple(launched), compared=fresh and len(self.used.running) == full)


def compare_errors(rival: Errors, used: Errors, axes: tuple[int, ...]) -> tuple[float, float]:
    """Return by which share the rival's squared errors are larger than those in use, and t of this difference.

    As many of the last errors are compared as both have. On every axis the squares are divided by the mean square in
    use; the result is the mean over ``axes``. t comes from the scatter of batches of 1 s. Below 0 the rival is better.
    """
    batches = min(len(rival), len(used)) // _BATCH
    if batches < 2:
        return 0.0, 0.0
    count = batches * _BATCH
    rival, used = rival[-count:], used[-count:]
    scales = [count / total([1e-12, *(row[axis] * row[axis] for row in used)]) / len(axes) for axis in axes]
    shares = [
        total([scale * (a[axis] * a[axis] - b[axis] * b[axis]) for scale, axis in zip(scales, axes, strict=True)])
        for a, b in zip(rival, used, strict=True)
    ]
    means = [total(shares[k : k + _BATCH]) / _BATCH for k in range(0, count, _BATCH)]
    mean = total(means) / batches
    error = sqrt(total([(value - mean) * (value - mean) for value in means]) / (batches * (batches - 1)))
    return mean, mean / error if error > 0.0 else 0.0
