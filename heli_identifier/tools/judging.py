"""A controller judged around the estimated plant and around every plant that the data allow.

What a design promises is what :data:`CONFIDENCE` of the plants keep, all figures at once. The margins are those of the
loop with the period between reading and acting and with the input delay.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import ceil
from typing import Any, NamedTuple

import numpy as np
from control import StateSpace
from numpy.typing import NDArray
from scipy.stats import rankdata

from heli_identifier.errors import ConfigurationError
from heli_identifier.results import ParameterSet, drawn_values
from heli_identifier.tools.linearisation import LinearModel, OperatingPoint, linear_model
from heli_identifier.tools.loop import (
    LOOPS,
    Margins,
    Responses,
    Settings,
    StepResponse,
    closed_loop,
    controller_parameters,
    controller_response,
    disk_margins,
    frequencies,
    is_stable,
    margins_over,
    plant_response,
    settling_time,
    step_response,
    unit_step,
)
from heli_plant.control import PidSettings
from heli_plant.effects import AXES
from heli_plant.parameters import BY_NAME, PlantParameters

Array = NDArray[np.float64]
Find = Callable[[PlantParameters], OperatingPoint]
Progress = Callable[[str, float], None]

CONFIDENCE = 0.95
"""Share of the plants that keep what is promised."""

LONGEST = 40.0
"""Length [s] of the steps whose settling is judged."""

SHOWN = {"pitch": 12.0, "elevation": 12.0, "travel": 30.0}
"""Length [s] of the steps that are shown."""

SMALLER_IS_BETTER = ("gain_down", "sensitivity", "settling")
"""Last part of the names of figures that a good loop has small."""


@dataclass(frozen=True, eq=False)
class Plants:
    """The estimated plant at an operating point, and the plants that the data allow, each at its own."""

    plant: PlantParameters
    """The estimated one."""
    model: LinearModel
    """Of it."""
    drawn: tuple[PlantParameters, ...]
    drawn_models: tuple[LinearModel, ...]
    """drawn, drawn_models: those that the data allow, and their linear models."""
    omega: Array
    """Frequencies [rad/s], shape (N,)."""
    responses: Responses
    """:func:`plant_response` of the estimated plant and of the M drawn ones, shape (M + 1, N, 3, 2)."""
    notes: tuple[str, ...]
    """How many plants were left out."""


def drawn_plants(parameters: ParameterSet, count: int, seed: int = 0) -> list[PlantParameters]:
    """Draw plants that the data allow (:func:`heli_identifier.results.parameters.drawn_values`)."""
    plant = parameters.plant()
    return [
        plant._replace(**{BY_NAME[name].field: value for name, value in drawn.items()})
        for drawn in drawn_values(parameters, count, seed)
    ]


def allowed_plants(parameters: ParameterSet, find: Find, period: float, draws: int, progress: Progress) -> Plants:
    """Linearise the estimated plant and drawn ones where ``find`` finds each in equilibrium.

    Raises
    ------
    ConfigurationError
        The estimated plant has no equilibrium, or none of the drawn ones has one.
    """
    plant = parameters.plant()
    point, found = find(plant), []
    model = linear_model(plant, point, period)
    for number, own in enumerate(drawn_plants(parameters, draws)):
        progress("linearising the plants that the data allow", 0.5 * number / draws)
        with suppress(ConfigurationError):
            found.append((own, linear_model(own, find(own), period)))
    if not found:
        raise ConfigurationError(
            f"none of {draws} plants that the data allow has an equilibrium at pitch {point.pitch:g} rad, elevation "
            f"{point.elevation:g} rad; choose a point nearer to rest."
        )
    drawn, models = zip(*found, strict=True)
    omega, fallen = frequencies(period), draws - len(found)
    responses = np.array([plant_response(one, omega) for one in (model, *models)])
    notes = (f"{fallen} of {draws} plants that the data allow have no equilibrium there",) if fallen else ()
    return Plants(plant, model, drawn, models, omega, responses, notes)


class Figure(NamedTuple):
    """A figure of the estimated plant, its 95 % interval over the drawn ones, what is promised of it, and the worst."""

    value: float
    low: float
    high: float
    promised: float
    worst: float


@dataclass(frozen=True, eq=False)
class Judged:
    """A controller around the plant and around every plant that the data allow."""

    settings: Settings
    figures: dict[str, Figure]
    """``LOOP.NAME`` with the names of :class:`Margins`; ``disk``, the disk margin at both actuators at once;
    ``AXIS.settling``, the time [s] of a linear reference step."""
    is_stable: bool
    """Whether the loop with the estimated plant is."""
    stable: float
    """Share of the plants for which the loop is stable."""
    poles: NDArray[Any]
    """Of the closed loop with the estimated plant [1/s], shape (n,)."""
    disks: Array
    """Disk margin of every plant, shape (M,)."""
    steps: tuple[StepResponse, ...]
    """Of the whole plant."""
    band: dict[str, Array]
    """Lowest and highest response to a unit step among 95 % of the plants, by axis, at the times of the steps after 0,
    shape (2, N)."""
    effort: float = 1.0
    """Factor by which the voltages were made dearer."""

    @property
    def document(self) -> dict[str, Any]:
        """What a JSON file holds of it."""
        own, found, gains = self.settings, self.figures, {}
        if isinstance(own, PidSettings):
            gains = {"gains": {axis: getattr(own, axis)._asdict() for axis in LOOPS}, "trim_V": own.trim}
        margins: dict[str, dict[str, Any]] = {loop: {} for loop in LOOPS}
        for loop in LOOPS:
            for name in Margins._fields:
                value, low, high, promised, _ = found[f"{loop}.{name}"]
                margins[loop][name] = {"value": value, "interval": [low, high], "promised": promised}
        settling = {step.axis: found[f"{step.axis}.settling"] for step in self.steps}
        return {
            **gains,
            "effort": self.effort,
            "stable_share": self.stable,
            "disk_margin": {"value": found["disk"].value, "promised": found["disk"].promised},
            "margins": margins,
            "settling_time_s": {
                axis: {"value": own.value, "promised": own.promised, "worst": own.worst}
                for axis, own in settling.items()
            },
            "steps": {
                step.axis: {"size_rad": step.size, "overshoot": step.overshoot, "settling_time_s": step.settling_time}
                for step in self.steps
            },
            "poles": [[pole.real, pole.imag] for pole in self.poles.tolist()],
        }

    def parameters(self, point: OperatingPoint, provenance: Mapping[str, Any]) -> ParameterSet:
        """Return the controller that holds ``point`` as parameters that ``heli build UNIT --parameters`` takes."""
        return controller_parameters(self.settings, point, provenance)


def judge(plants: Plants, settings: Settings, axes: Sequence[str], effort: float = 1.0) -> Judged:
    """Judge a controller of ``axes`` around the estimated plant and around every drawn one."""
    model, period = plants.model, plants.model.sampled.dt
    loops = [closed_loop(one, settings) for one in (model, *plants.drawn_models)]
    stable = np.array([is_stable(loop) for loop in loops])
    law = controller_response(settings, period, plants.omega)
    columns: dict[str, Array] = {}
    band = {}
    for loop, margins in margins_over(plants.responses, law, plants.omega).items():
        columns |= {f"{loop}.{name}": own for name, own in zip(Margins._fields, np.transpose(margins), strict=True)}
    columns["disk"] = np.where(stable, disk_margins(plants.responses, law), 0.0)
    with np.errstate(over="ignore", invalid="ignore"):
        for axis in axes:
            index = AXES.index(axis)
            paths = np.array([unit_step(loop, index, round(LONGEST / period))[:, index] for loop in loops])
            columns[f"{axis}.settling"] = np.array([settling_time(path, period) for path in paths])
            band[axis] = np.quantile(paths[1:, : round(SHOWN[axis] / period)], (0.025, 0.975), axis=0)
    steps = tuple(step_response(plants.plant, model.point, settings, axis, 0.1, SHOWN[axis], period) for axis in axes)
    poles, disks = _poles(loops[0], period), columns["disk"][1:]
    return Judged(
        settings, _figures(columns), bool(stable[0]), float(np.mean(stable[1:])), poles, disks, steps, band, effort
    )


def _figures(columns: Mapping[str, Array]) -> dict[str, Figure]:
    """Figures of columns (M + 1,), that of the estimated plant first."""
    rows = np.column_stack(list(columns.values()))
    sign = np.array([-1.0 if name.endswith(SMALLER_IS_BETTER) else 1.0 for name in columns])
    # as figures may be infinite, quantiles without interpolation
    low, high = np.quantile(rows[1:], (0.025, 0.975), axis=0, method="nearest")
    promised, worst = sign * kept_together(sign * rows[1:]), sign * (sign * rows).min(axis=0)
    found = np.column_stack((rows[0], low, high, promised, worst)).tolist()
    return {name: Figure(*own) for name, own in zip(columns, found, strict=True)}


def kept_together(figures: Array) -> Array:
    """Return what :data:`CONFIDENCE` of M plants keep of all figures (M, J) at once, shape (J,); larger is better.

    Plants are ranked in every figure; those whose worst rank is lowest are left out, and the least that the others have
    is kept by all of them.

    Source: J. Besag et al., Statistical Science 10 (1995) 3, section 6.3 (simultaneous credible regions from ranks).
    """
    known = np.where(np.isnan(figures), -np.inf, figures)
    worst_rank = rankdata(known, method="max", axis=0).min(axis=1)
    few = len(known) - ceil(CONFIDENCE * len(known))
    return np.asarray(known[np.argsort(worst_rank, kind="stable")[few:]].min(axis=0))


def _poles(closed: StateSpace, period: float) -> NDArray[Any]:
    """Poles [1/s] of a sampled loop, without those of shift registers and of what nothing moves."""
    z = np.linalg.eigvals(closed.A).astype(complex)
    s = np.log(z[np.abs(z) > 1e-3]) / period
    return s[np.abs(s) > 1e-6]
