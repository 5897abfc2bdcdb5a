"""Linear model, margins and retuned PID of one parameter set at one operating point, with their intervals."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import ConfigurationError
from heli_identifier.workbench.delivery.draws import drawn_values
from heli_identifier.workbench.delivery.parameter_set import ParameterSet
from heli_identifier.workbench.linearise.closed_loop import closed_loop
from heli_identifier.workbench.linearise.linear_model import NOT_LINEAR, PERIOD, LinearModel, linear_model
from heli_identifier.workbench.linearise.margins import (
    LOOPS,
    Margins,
    frequencies,
    margins,
    margins_over,
    plant_response,
)
from heli_identifier.workbench.linearise.operating_point import operating_point
from heli_identifier.workbench.linearise.retuning import retuned
from heli_identifier.workbench.linearise.step_response import StepResponse, step_response
from heli_plant.control import PidSettings
from heli_plant.parameter_table import BY_FIELD, BY_NAME
from heli_plant.parameters import PlantParameters

FIGURES = tuple(Margins.__dataclass_fields__)
"""Figures of a loop, in the order of their intervals."""

DRAWS = 60
"""Number of drawn plants: the ends of a 95 % interval are then known to a tenth of its width."""

ROBUST = 30
"""Number of drawn plants for which the retuned PID has to keep its margins."""

Ends = tuple[NDArray[np.float64], NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class Loop:
    """One PID around the plant.

    ``margins`` are those of the estimated plant by loop; ``low`` and ``high`` are the ends of their 95 % intervals over
    the plants that the data allow; ``stable`` is the share of these plants for which the loop is stable.
    """

    settings: PidSettings
    margins: dict[str, Margins]
    low: dict[str, Margins]
    high: dict[str, Margins]
    stable: float
    steps: tuple[StepResponse, ...]


@dataclass(frozen=True, eq=False)
class Design:
    """A linear model, the margins of two PIDs around it, and their intervals.

    Attributes
    ----------
    model : LinearModel
    A_interval, B_interval : (low, high), shapes (n, n), (n, 2)
        95 % intervals of the continuous matrices, entry by entry.
    before, after : Loop
        With the present PID and with the retuned one.
    notes : tuple of str
        What the linear model leaves out.
    """

    model: LinearModel
    A_interval: Ends
    B_interval: Ends
    before: Loop
    after: Loop
    notes: tuple[str, ...]


def drawn_plants(parameters: ParameterSet, count: int = DRAWS, seed: int = 0) -> list[PlantParameters]:
    """Draw plants that the data allow (:mod:`heli_identifier.workbench.delivery.draws`)."""
    plant = parameters.plant()
    return [
        plant._replace(**{BY_NAME[name].field: value for name, value in drawn.items()})
        for drawn in drawn_values(parameters, count, seed)
    ]


def design(
    parameters: ParameterSet,
    pitch: float = 0.0,
    elevation: float = 0.0,
    settings: PidSettings | None = None,
    draws: int = DRAWS,
    progress: Callable[[str, float], None] = lambda what, share: None,
) -> Design:
    """Linearise a plant at a pitch and elevation [rad], find the margins of the present PID there, and retune it.

    Raises
    ------
    ConfigurationError
        There is no equilibrium, of the plant or of any plant that the data allow; the motors have no lag; or the
        parameters are those of another unit than the plant.
    """
    plant, present = parameters.plant(), settings or PidSettings()
    point = operating_point(plant, pitch, elevation)
    model = linear_model(plant, point)
    models = []
    for number, one in enumerate(drawn_plants(parameters, draws)):
        progress("linearising the plants that the data allow", 0.6 * number / draws)
        try:
            models.append(linear_model(one, operating_point(one, pitch, elevation)))
        except ConfigurationError:
            continue
    if not models:
        raise ConfigurationError(
            f"none of {draws} plants that the data allow has an equilibrium at pitch {pitch:g} rad, elevation "
            f"{elevation:g} rad; choose a point nearer to rest."
        )
    progress("retuning", 0.6)
    new = retuned(model, present, models[:ROBUST], point.v_front + point.v_rear)
    progress("margins", 0.8)
    omega = frequencies(PERIOD)
    plants = np.array([plant_response(one, omega) for one in models])
    before, after = (
        _loop(parameters, model, models, one, margins_over(plants, one, PERIOD, omega)) for one in (present, new)
    )
    return Design(
        model,
        _ends([one.continuous.A for one in models]),
        _ends([one.continuous.B for one in models]),
        before,
        after,
        _notes(parameters, len(models), draws),
    )


def _loop(
    parameters: ParameterSet,
    model: LinearModel,
    models: Sequence[LinearModel],
    pid: PidSettings,
    found: Mapping[str, Sequence[Margins]],
) -> Loop:
    """Collect the figures of a PID; ``found`` are its margins around each of ``models``, by loop."""
    ends: tuple[dict[str, Margins], dict[str, Margins]] = {}, {}
    for name in LOOPS:
        rows = np.array([[getattr(one, figure) for figure in FIGURES] for one in found[name]])
        # quantiles without interpolation, since a gain margin may be infinite
        for end, share in zip(ends, (0.025, 0.975), strict=True):
            end[name] = Margins(*np.quantile(rows, share, axis=0, method="nearest").tolist())
    steps = tuple(step_response(parameters.plant(), model.point, pid, axis) for axis in LOOPS)
    stable = float(np.mean([closed_loop(one, pid).is_stable for one in models]))
    return Loop(pid, margins(model, pid), *ends, stable, steps)


def _ends(matrices: Sequence[NDArray[np.float64]]) -> Ends:
    low, high = np.quantile(matrices, (0.025, 0.975), axis=0)
    return low, high


def _notes(parameters: ParameterSet, kept: int, draws: int) -> tuple[str, ...]:
    plant = parameters.plant()
    notes = [
        f"the linear model leaves out {BY_FIELD[field].name}: friction that sticks has no slope at rest"
        for field in NOT_LINEAR
        if getattr(plant, field) != 0.0
    ]
    if plant.input_delay_rotors:
        notes.append(f"an input delay of {plant.input_delay_rotors:.3g} s is in the margins, not in the matrices")
    if kept < draws:
        notes.append(f"{draws - kept} of {draws} plants that the data allow have no equilibrium there")
    return tuple(notes)
