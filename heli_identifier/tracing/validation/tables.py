"""Which unknown curves go into the corrected plant: those that improve its predictions of the held-out logs.

A curve enters as a table, with the values that the likelihood gave, and the parameters are fitted beside it by
multi-step errors. It was detected by errors one step ahead; whether it also predicts is asked here. A curve that does
not stays reported as an unknown torque, and the plant is handed back without it.
"""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import Estimate
from heli_identifier.tracing.search.model import Model
from heli_identifier.tracing.search.tabulation import table_of
from heli_identifier.tracing.search.unknown import Unknown
from heli_identifier.tracing.validation.held_out import HeldOut
from heli_identifier.tracing.validation.plants import FittedPlant, Plants
from heli_identifier.tracing.validation.withdrawal import TOLERATED
from heli_plant.effects import AXES


@dataclass(frozen=True, eq=False)
class Tabled:
    """A plant with the unknown curves that improve it.

    Attributes
    ----------
    plant : FittedPlant
        The plant that was given if no curve improves it.
    curves : tuple of Unknown
        What it has as tables.
    left_out : tuple of (Unknown, str)
        Curves that it does not have, and why.
    """

    plant: FittedPlant
    curves: tuple[Unknown, ...] = ()
    left_out: tuple[tuple[Unknown, str], ...] = ()


def with_tables(model: Model, plant: FittedPlant, plants: Plants, held_out: HeldOut) -> Tabled:
    """Add the unknown curves of a model to its plant, strongest first, as far as the held-out logs bear them out.

    Parameters
    ----------
    model : Model
    plant : FittedPlant
        Its plant without tables.
    plants : Plants
    held_out : HeldOut
    """
    tables: dict[str, Estimate] = {}
    curves: list[Unknown] = []
    left_out: list[tuple[Unknown, str]] = []
    of_curves = [index for index, unknown in enumerate(model.unknowns) if unknown.frequency is None]
    for index in sorted(of_curves, key=lambda i: -model.unknowns[i].likelihood_ratio):
        unknown = model.unknowns[index]
        if (first := next((curve for curve in curves if curve.axis == unknown.axis), None)) is not None:
            left_out.append((unknown, f"the {unknown.axis} has a table already, over the {first.variable}"))
            continue
        tried = plants.of(model, larger := {**tables, **table_of(model, index)})
        why = _worse(tried, plant, unknown.axis, held_out)
        if why:
            left_out.append((unknown, why))
        else:
            plant, tables = tried, larger
            curves.append(unknown)
    return Tabled(plant, tuple(curves), tuple(left_out))


def _worse(tried: FittedPlant, plant: FittedPlant, axis: str, held_out: HeldOut) -> str:
    """Why a plant with a table on ``axis`` is not handed back; empty if it is better than that without."""
    if tried.fit is None:
        return "the plant with it runs away within two seconds"
    return reason_against(held_out.ratios(tried.parameters, plant.parameters), (axis,))


def reason_against(ratio: NDArray[np.float64], axes: Collection[str], other: str = "that without it") -> str:
    """Why tables on ``axes`` are no improvement; empty if they are one.

    Parameters
    ----------
    ratio : NDArray, shape (3,)
        Mean squared prediction errors on the held-out logs, over those without the tables.
    axes : collection of str
        On these no error may grow, on the others it may by what is chance.
    other : str
        Words for the error that it is compared with.
    """
    limits = np.array([1.0 if axis in axes else TOLERATED for axis in AXES])
    worst = int(np.argmax(ratio / limits))
    if ratio[worst] <= limits[worst]:
        return ""
    return (
        f"with it the mean squared prediction error of the {AXES[worst]} on the held-out logs is {ratio[worst]:.2f} "
        f"times {other}"
    )
