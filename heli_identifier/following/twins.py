"""The twins beside each other: in use, left alone, a rival; each predicts 1 s ahead from what the observer sees.

The twin in use has the values in use, the one left alone those of the start, a rival those that are on trial or, after
an adoption, those before it. Their copies run in coarse steps (:mod:`.ahead`).
"""

from typing import NamedTuple

from heli_plant.correction import with_share
from heli_plant.state import PlantState

from .ahead import advanced, read
from .errors import Row
from .plan import FollowPlan
from .values import Values

WINDOWS = 3
"""Windows for which the errors of the twins in use and left alone are kept. In one window of steady hover a gain that
is wrong may predict better by chance, together with an offset that is wrong as well."""


class Twins(NamedTuple):
    """Running copies and errors of the twins: in use, left alone, rival (empty without one).

    ``used``, ``alone``: errors of the last :data:`WINDOWS` windows [rad]; ``against`` and ``rival``: pairs of errors
    since a rival runs; the last predictions that fell due [rad].
    """

    copies: tuple[PlantState, ...]
    copies_alone: tuple[PlantState, ...]
    copies_rival: tuple[PlantState, ...]
    used: tuple[Row, ...]
    alone: tuple[Row, ...]
    against: tuple[Row, ...]
    rival: tuple[Row, ...]
    predicted: Row
    predicted_alone: Row


def first_twins(angles: Row) -> Twins:
    """Return the twins before any copy has begun; ``angles`` of sample 0 [rad]."""
    return Twins((), (), (), (), (), (), (), angles, angles)


def without_rival(twins: Twins) -> Twins:
    """Return the twins without a rival."""
    return twins._replace(copies_rival=(), against=(), rival=())


def scaled(voltages: tuple[float, float], values: tuple[float, ...], limit: float) -> tuple[float, float]:
    """Return the voltages [V] of rotors that have the last two of ``values`` as shares of their thrust left."""
    return with_share(voltages[0], values[-2], limit), with_share(voltages[1], values[-1], limit)


def moved(
    twins: Twins, voltages: tuple[float, float], time: float, length: float, values: Values, plan: FollowPlan
) -> Twins:
    """Return the twins with their copies one coarse step later.

    Parameters
    ----------
    twins : Twins
    voltages : tuple
        Front and rear, as they arrive, in the mean over the step [V].
    time, length : float
        Begin of the step and its length [s].
    values : Values
    plan : FollowPlan
    """
    first, p = plan.settings.parameters, values.parameters
    rival: tuple[PlantState, ...] = ()
    if values.rival:
        q = values.rival_parameters
        own = scaled(voltages, values.rival, q.v_max)
        rival = advanced(twins.copies_rival, own, time, length, q, plan.step)
    return twins._replace(
        copies=advanced(twins.copies, scaled(voltages, values.now, p.v_max), time, length, p, plan.step),
        copies_alone=advanced(twins.copies_alone, voltages, time, length, first, plan.step),
        copies_rival=rival,
    )


def launched(
    twins: Twins, seen: PlantState, angles: Row, fresh: bool, has_rival: bool, plan: FollowPlan
) -> tuple[Twins, bool]:
    """Compare the oldest copies if they have run for 1 s; start new ones from what the observer sees.

    Parameters
    ----------
    twins : Twins
    seen : PlantState
        As the observer sees it.
    angles : tuple
        Measured [rad].
    fresh, has_rival : bool
    plan : FollowPlan

    Returns
    -------
    twins : Twins
    compared : bool
        Whether predictions fell due.
    """
    full = plan.horizon // plan.per_launch
    compared = len(twins.copies) == full
    if compared:
        predicted, alone = read(twins.copies[0]), read(twins.copies_alone[0])
        used_error = _difference(angles, predicted)
        if fresh:
            twins = twins._replace(
                used=(*twins.used, used_error)[-WINDOWS * plan.window :],
                alone=(*twins.alone, _difference(angles, alone))[-WINDOWS * plan.window :],
            )
        twins = twins._replace(
            copies=twins.copies[1:], copies_alone=twins.copies_alone[1:], predicted=predicted, predicted_alone=alone
        )
        if len(twins.copies_rival) == full:
            if fresh:
                error = _difference(angles, read(twins.copies_rival[0]))
                twins = twins._replace(against=(*twins.against, used_error), rival=(*twins.rival, error))
            twins = twins._replace(copies_rival=twins.copies_rival[1:])
    return twins._replace(
        copies=(*twins.copies, seen),
        copies_alone=(*twins.copies_alone, seen),
        copies_rival=(*twins.copies_rival, seen) if has_rival else (),
    ), compared and fresh


def _difference(a: Row, b: Row) -> Row:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]
