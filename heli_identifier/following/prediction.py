"""Predictions one second ahead: copies of the twins that run free from where the observer saw the rig a second ago.

A copy starts every .2 s from the observer's state and runs under the voltages that came in since, by the plant's own
step, in steps of some .05 s under their mean. After 1 s its angles are compared with the measured ones. Every twin
that is compared (the one in use, the one left alone with the values of the start, a rival with those that are on trial
or, after an adoption, with those before it) starts from the same state, so that only their parameters differ.
"""

from math import sqrt
from typing import NamedTuple

from heli_plant.plant import measured_angles, step
from heli_plant.state import PlantState

from .observer import Angles, Twin, Voltages, apply_shares
from .plan import FollowPlan

WINDOWS = 3
"""Windows for which the errors of the twins in use and left alone are kept. In one window of steady hover a gain that
is wrong may predict better by chance, together with an offset that is wrong as well."""

_BATCH = 5
"""Comparisons in a batch, 1 s: errors 1 s ahead that overlap are correlated."""

_NOTHING = (0.0, 0.0, 0.0)

Errors = tuple[Angles, ...]
"""Errors of predictions 1 s ahead, oldest first [rad]."""


class Predictions(NamedTuple):
    """Running copies, oldest first, and errors of the twins: in use, left alone, rival (empty without one).

    ``arrived``: sums of the voltages that arrived since the last coarse step [V]; ``steps``: coarse steps so far;
    ``used``, ``alone``: errors of the last :data:`WINDOWS` windows; ``against`` and ``rival``: pairs of errors since a
    rival runs; ``predicted`` and ``predicted_alone``: the last predictions that fell due [rad].
    """

    predicted: Angles
    predicted_alone: Angles
    arrived: Voltages = (0.0, 0.0)
    steps: int = 0
    copies: tuple[PlantState, ...] = ()
    copies_alone: tuple[PlantState, ...] = ()
    copies_rival: tuple[PlantState, ...] = ()
    used: Errors = ()
    alone: Errors = ()
    against: Errors = ()
    rival: Errors = ()


def drop_copies(now: Predictions) -> Predictions:
    """Return the predictions without running copies."""
    return now._replace(copies=(), copies_alone=(), copies_rival=())


def drop_rival(now: Predictions) -> Predictions:
    """Return the predictions without a rival."""
    return now._replace(copies_rival=(), against=(), rival=())


def move_copies(now: Predictions, used: Twin, alone: Twin, rivals: tuple[Twin, ...], plan: FollowPlan) -> Predictions:
    """Return the copies one coarse step later; ``rivals`` is empty or one."""
    length = plan.coarse * plan.settings.sample_time
    time = now.steps * length
    voltages = now.arrived[0] / plan.coarse, now.arrived[1] / plan.coarse

    def moved(copies: tuple[PlantState, ...], twin: Twin) -> tuple[PlantState, ...]:
        front, rear = apply_shares(voltages, twin)
        return tuple([step(one, front, rear, 0.0, time, length, twin.parameters) for one in copies])

    return now._replace(
        arrived=(0.0, 0.0),
        steps=now.steps + 1,
        copies=moved(now.copies, used),
        copies_alone=moved(now.copies_alone, alone),
        copies_rival=moved(now.copies_rival, rivals[0]) if rivals else (),
    )


def launch_copies(
    now: Predictions, seen: PlantState, angles: Angles, fresh: bool, has_rival: bool, plan: FollowPlan
) -> tuple[Predictions, bool]:
    """Compare the oldest copies with the measured ``angles`` if they have run for 1 s; start new ones from ``seen``.

    The second value is whether a comparison was made.
    """
    full = plan.horizon // plan.per_launch
    due = len(now.copies) == full
    if due:
        predicted, alone = measured_angles(now.copies[0]), measured_angles(now.copies_alone[0])
        error = _difference(angles, predicted)
        if fresh:
            kept = -WINDOWS * plan.window
            now = now._replace(used=(*now.used, error)[kept:], alone=(*now.alone, _difference(angles, alone))[kept:])
        now = now._replace(
            copies=now.copies[1:], copies_alone=now.copies_alone[1:], predicted=predicted, predicted_alone=alone
        )
        if len(now.copies_rival) == full:
            if fresh:
                other = _difference(angles, measured_angles(now.copies_rival[0]))
                now = now._replace(against=(*now.against, error), rival=(*now.rival, other))
            now = now._replace(copies_rival=now.copies_rival[1:])
    return now._replace(
        copies=(*now.copies, seen),
        copies_alone=(*now.copies_alone, seen),
        copies_rival=(*now.copies_rival, seen) if has_rival else (),
    ), due and fresh


def _difference(a: Angles, b: Angles) -> Angles:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def rms(errors: Errors) -> Angles:
    """Return the rms error of each axis [rad]; zero without errors."""
    if not errors:
        return _NOTHING
    squares = [0.0, 0.0, 0.0]
    for row in errors:
        for axis in range(3):
            squares[axis] += row[axis] * row[axis]
    a, b, c = [sqrt(square / len(errors)) for square in squares]
    return a, b, c


def compare_errors(rival: Errors, used: Errors, axes: tuple[int, ...]) -> tuple[float, float]:
    """Return how much larger the rival's squared errors are, as a share of those in use, and t of this difference.

    On every axis the squares are divided by the mean square in use; the mean over ``axes`` is taken. t comes from the
    scatter of batches of 1 s. Negative: the rival predicts better.
    """
    batches = len(used) // _BATCH
    if batches < 2:
        return 0.0, 0.0
    first = len(used) - batches * _BATCH
    scales = [1.0, 1.0, 1.0]
    for axis in axes:
        total = 1e-12
        for i in range(first, len(used)):
            total += used[i][axis] * used[i][axis]
        scales[axis] = (len(used) - first) / total
    means: list[float] = []
    for batch in range(batches):
        total = 0.0
        for i in range(first + batch * _BATCH, first + (batch + 1) * _BATCH):
            for axis in axes:
                a, b = rival[i][axis], used[i][axis]
                total += scales[axis] * (a * a - b * b)
        means.append(total / (_BATCH * len(axes)))
    mean = square = 0.0
    for value in means:
        mean += value / batches
    for value in means:
        square += (value - mean) * (value - mean)
    error = sqrt(square / (batches * (batches - 1)))
    return mean, mean / error if error > 0.0 else 0.0
