"""A controller judged around the estimated plant and around every plant that the data allow.

What a design promises is what :data:`CONFIDENCE` of the plants keep, all figures at once. The margins are those of the
loop with the period between reading and acting and with the input delay.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import ceil, inf, nan
from typing import Any

import numpy as np
from control import StateSpace
from numpy.typing import NDArray
from scipy.stats import rankdata

from heli_identifier.errors import ConfigurationError
from heli_identifier.results import ParameterSet, drawn_values
from heli_identifier.tools import margins
from heli_identifier.tools.linearisation import LinearModel, linear_model
from heli_identifier.tools.loop import Settings, StepResponse, settling_time, step_response
from heli_identifier.tools.margins import Array
from heli_plant.control import PidSettings
from heli_plant.effects import AXES
from heli_plant.parameters import BY_NAME, PlantParameters

Progress = Callable[[str, float], None]

CONFIDENCE = 0.95  # share of the plants that keep what is promised
LONGEST = 40.0  # length [s] of the steps whose settling is judged
SHOWN = {"pitch": 12.0, "elevation": 12.0, "travel": 30.0}  # length [s] of the steps that are shown
MARGINS = margins.Margins._fields
UNSTABLE = margins.Margins(gain=1.0, phase=0.0, sensitivity=inf, crossover=nan)  # nothing may change

SMALLER_IS_BETTER = ("sensitivity", "settling")
"""Last part of the names of figures that a good loop has small."""


@dataclass(frozen=True, eq=False)
class Plants:
    """The estimated plant at an operating point, and M ``drawn`` plants that the data allow, each at its own.

    ``responses`` (M + 1, N, 3, 2) are :func:`plant_response` of the estimated and the drawn plants at the frequencies
    ``omega`` (N,) [rad/s]; ``notes`` say what was drawn from its prior, and how many plants were left out.
    """

    model: LinearModel
    drawn: tuple[LinearModel, ...]
    omega: Array
    responses: margins.Responses
    notes: tuple[str, ...]


def drawn_plants(parameters: ParameterSet, count: int) -> list[PlantParameters]:
    """Draw plants that the data allow (:func:`heli_identifier.results.parameters.drawn_values`)."""
    plant, draws = parameters.plant(), drawn_values(parameters, count)
    return [plant._replace(**{BY_NAME[name].field: value for name, value in drawn.items()}) for drawn in draws]


def allowed_plants(
    parameters: ParameterSet, pitch: float | None, elevation: float, period: float, draws: int, progress: Progress
) -> Plants:
    """Linearise the estimated plant and drawn ones, each at its own equilibrium.

    ConfigurationError if the estimated plant has no equilibrium, or none of the drawn ones has one.
    """
    model, drawn = linear_model(parameters.plant(), pitch, elevation, period), list[LinearModel]()
    for number, plant in enumerate(drawn_plants(parameters, draws)):
        progress("linearising the plants that the data allow", 0.5 * number / draws)
        with suppress(ConfigurationError):
            drawn.append(linear_model(plant, pitch, elevation, period))
    if not drawn:
        raise ConfigurationError(
            f"none of {draws} plants that the data allow has an equilibrium at pitch {model.point.pitch:g} rad, "
            f"elevation {elevation:g} rad; choose a point nearer to rest."
        )
    omega, fallen = margins.frequencies(period), draws - len(drawn)
    responses = np.array([margins.plant_response(one, omega) for one in (model, *drawn)])
    notes = [parameters.drawn_from_prior] if parameters.drawn_from_prior else []
    if fallen:
        notes.append(f"{fallen} of {draws} plants that the data allow have no equilibrium there")
    return Plants(model, tuple(drawn), omega, responses, tuple(notes))


@dataclass(frozen=True)
class Figure:
    """One figure of a loop: of the estimated plant, with the interval that holds 95 % of the drawn ones.

    ``promised`` is what is kept, ``worst`` that of the worst drawn plant.
    """

    value: float
    interval: tuple[float, float]
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
    stable: float
    """Whether the loop with the estimated plant is stable; share of the drawn plants for which it is."""
    poles: NDArray[Any]
    """Of the closed loop with the estimated plant [1/s], shape (n,)."""
    disks: Array
    """Disk margin of every plant, shape (M,)."""
    steps: tuple[StepResponse, ...]
    band: dict[str, Array]
    """Steps of the whole plant; lowest and highest response to a unit step among 95 % of the plants, by axis, at the
    times of the steps after 0, shape (2, N)."""
    effort: float = 1.0
    """Factor by which the voltages were made dearer."""

    @property
    def document(self) -> dict[str, Any]:
        """What a JSON file holds of it."""
        own, figures, gains = self.settings, self.figures, {}
        if isinstance(own, PidSettings):
            gains = {"gains": {axis: getattr(own, axis)._asdict() for axis in margins.LOOPS}, "trim_V": own.trim}
        return {
            **gains,
            "effort": self.effort,
            "stable_share": self.stable,
            "disk_margin": figures["disk"],
            "margins": {loop: {name: figures[f"{loop}.{name}"] for name in MARGINS} for loop in margins.LOOPS},
            "settling_time_s": {step.axis: figures[f"{step.axis}.settling"] for step in self.steps},
            "steps": {
                step.axis: {"size_rad": step.size, "overshoot": step.overshoot, "settling_time_s": step.settling_time}
                for step in self.steps
            },
            "poles": [[pole.real, pole.imag] for pole in self.poles.tolist()],
        }


def judge(plants: Plants, settings: Settings, axes: Sequence[str], effort: float = 1.0) -> Judged:
    """Judge a controller of ``axes`` around the estimated plant and around every drawn one."""
    model, period = plants.model, plants.model.sampled.dt
    loops = [margins.closed_loop(one, settings) for one in (model, *plants.drawn)]
    stable = np.array([margins.is_stable(loop) for loop in loops])
    law = margins.controller_response(settings, period, plants.omega)
    columns: dict[str, Array] = {}
    for index, name in enumerate(margins.LOOPS):
        gains = margins.loop_gain(plants.responses, law, index)
        found = np.transpose([
            margins.loop_margins(gain, plants.omega) if is_stable else UNSTABLE
            for gain, is_stable in zip(gains, stable, strict=True)
        ])  # fmt: skip
        columns |= {f"{name}.{own}": column for own, column in zip(MARGINS, found, strict=True)}
    columns["disk"] = np.where(stable, margins.disk_margins(plants.responses, law), 0.0)
    band = {}
    with np.errstate(over="ignore", invalid="ignore"):
        for axis in axes:
            index = AXES.index(axis)
            paths = np.array([margins.unit_step(loop, index, round(LONGEST / period))[:, index] for loop in loops])
            columns[f"{axis}.settling"] = np.array([settling_time(path, period) for path in paths])
            band[axis] = np.quantile(paths[1:, : round(SHOWN[axis] / period)], (0.025, 0.975), axis=0)
    return Judged(
        settings=settings,
        figures=_figures(columns),
        is_stable=bool(stable[0]),
        stable=float(np.mean(stable[1:])),
        poles=_poles(loops[0]),
        disks=columns["disk"][1:],
        steps=tuple(step_response(model, settings, axis, duration=SHOWN[axis]) for axis in axes),
        band=band,
        effort=effort,
    )


def _figures(columns: Mapping[str, Array]) -> dict[str, Figure]:
    """Figures of columns (M + 1,), that of the estimated plant first."""
    rows = np.column_stack(list(columns.values()))
    sign = np.array([-1.0 if name.endswith(SMALLER_IS_BETTER) else 1.0 for name in columns])
    # as figures may be infinite, quantiles without interpolation
    low, high = np.quantile(rows[1:], (0.025, 0.975), axis=0, method="nearest")
    promised, worst = sign * kept_together(sign * rows[1:]), sign * (sign * rows).min(axis=0)
    each = zip(columns, rows[0].tolist(), low.tolist(), high.tolist(), promised.tolist(), worst.tolist(), strict=True)
    return {name: Figure(value, (low, high), kept, least) for name, value, low, high, kept, least in each}


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


def _poles(closed: StateSpace) -> NDArray[Any]:
    """Poles [1/s] of a sampled loop, without those of shift registers and of what nothing moves."""
    z = np.linalg.eigvals(closed.A).astype(complex)
    s = np.log(z[np.abs(z) > 1e-3]) / closed.dt
    return s[np.abs(s) > 1e-6]
