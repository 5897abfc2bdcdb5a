"""Controllers judged around the estimated plant and around drawn plants that the data allow, and a design of two.

A design promises figures that :data:`CONFIDENCE` of the plants keep, all figures at once. The margins count the period
between reading angles and setting voltages, and the input delay.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, inf
from typing import Any

import numpy as np
from scipy.stats import rankdata

from heli_identifier.provenance import provenance
from heli_identifier.results import to_json_value
from heli_identifier.tools import margins
from heli_identifier.tools.loop import Settings, settling_time, step_response
from heli_identifier.tools.margins import LOOPS, Array
from heli_identifier.tools.plants import Plants
from heli_plant.effects import AXES

SCHEMA = "heli-controller/1"

CONFIDENCE = 0.95  # share of the plants that keep the promised figures
LONGEST = 40.0  # length [s] of the steps whose settling is judged
SHOWN = {"pitch": 12.0, "elevation": 12.0, "travel": 30.0}  # length [s] of the steps that are shown
MARGINS = margins.Margins._fields
UNSTABLE = margins.Margins(gain=1.0, phase=0.0, sensitivity=inf)  # margins of an unstable loop
SMALLER_IS_BETTER = ("sensitivity", "settling")  # figures whose names end so are better if they are smaller


@dataclass(frozen=True)
class Figure:
    """One figure of a loop: the ``value`` of the estimated plant, and the bound that is ``promised``.

    :data:`CONFIDENCE` of the plants keep all promised bounds at once.
    """

    value: float
    promised: float


@dataclass(frozen=True, eq=False)
class Judged:
    """A controller around the estimated plant and around drawn plants that the data allow."""

    settings: Settings
    figures: dict[str, Figure]
    """``LOOP.NAME`` with the names of :class:`Margins`; ``disk``, the disk margin at both actuators at once;
    ``AXIS.settling``, the time [s] of a linear reference step."""
    is_stable: bool
    """Whether the loop with the estimated plant is stable."""
    stable_share: float
    """Share of the drawn plants with a stable loop."""
    steps: dict[str, Array]
    """By axis the response of the whole plant to a step of :data:`.loop.STEP` (N,) [rad]."""
    band: dict[str, Array]
    """By axis the lowest and highest response to a unit step among 95 % of the drawn plants, shape (2, N)."""


def judge_controller(plants: Plants, settings: Settings, axes: Sequence[str]) -> Judged:
    """Judge a controller of ``axes`` around the estimated plant and around every drawn plant."""
    model, period = plants.model, plants.model.sampled.dt
    loops = [margins.close_loop(linear, settings) for linear in (model, *plants.drawn)]
    stable = np.array([margins.is_stable(loop) for loop in loops])
    response = margins.controller_response(settings, period, plants.omega)
    columns: dict[str, Array] = {}
    for index, loop_name in enumerate(LOOPS):
        gains = margins.loop_gain(plants.responses, response, index)
        of_plants = [
            margins.loop_margins(gain) if is_stable else UNSTABLE for gain, is_stable in zip(gains, stable, strict=True)
        ]
        for name, column in zip(MARGINS, np.transpose(of_plants), strict=True):
            columns[f"{loop_name}.{name}"] = column
    columns["disk"] = np.where(stable, margins.disk_margins(plants.responses, response), 0.0)
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
        stable_share=float(np.mean(stable[1:])),
        steps={axis: step_response(model, settings, axis, duration=SHOWN[axis]) for axis in axes},
        band=band,
    )


def _figures(columns: Mapping[str, Array]) -> dict[str, Figure]:
    """Return figures from columns (M + 1,), in which the estimated plant comes first."""
    rows = np.column_stack(list(columns.values()))
    sign = np.array([-1.0 if name.endswith(SMALLER_IS_BETTER) else 1.0 for name in columns])
    each = zip(columns, rows[0].tolist(), (sign * joint_bounds(sign * rows[1:])).tolist(), strict=True)
    return {name: Figure(value, promised) for name, value, promised in each}


def joint_bounds(figures: Array) -> Array:
    """Return the bounds (J,) that :data:`CONFIDENCE` of M plants keep in all figures (M, J) at once; larger is better.

    Plants are ranked in every figure. Those whose worst rank is lowest are left out, and the bounds are the smallest
    figures of the others.

    Source: J. Besag et al., Statistical Science 10 (1995) 3, section 6.3 (simultaneous credible regions from ranks).
    """
    figures = np.where(np.isnan(figures), -np.inf, figures)
    worst_rank = rankdata(figures, method="max", axis=0).min(axis=1)
    left_out = len(figures) - ceil(CONFIDENCE * len(figures))
    return np.asarray(figures[np.argsort(worst_rank, kind="stable")[left_out:]].min(axis=0))


@dataclass(frozen=True, eq=False)
class Design:
    """Two controllers of one kind around an identified plant.

    ``kind`` is pid, lqr or lqi, ``axes`` are the controlled angles, ``plants`` those over which both were judged.
    ``baseline`` is the design by the weights, or the present PID; ``robust`` is the robust design, or the retuned PID.
    ``flown`` is delivered: the robust controller, but with the present gains of PID loops whose retuned gains must not
    be flown. ``notes`` are about the plant, the search and these loops.
    """

    kind: str
    axes: tuple[str, ...]
    plants: Plants
    baseline: Judged
    robust: Judged
    flown: Settings
    notes: tuple[str, ...]

    @property
    def by_name(self) -> dict[str, Judged]:
        """Both controllers by their names; only the first if they are the same."""
        first, second = ("present", "retuned") if self.kind == "pid" else ("nominal", "robust")
        return {first: self.baseline} | ({second: self.robust} if self.robust is not self.baseline else {})

    def document(self) -> dict[str, Any]:
        """Return the content of design.json; null stands for an infinite value."""
        model, both = self.plants.model, {"nominal": self.baseline, "robust": self.robust}
        return to_json_value(
            {
                "schema": SCHEMA,
                "kind": self.kind,
                "axes": self.axes,
                "operating_point": model.point,
                "period_s": model.sampled.dt,
                "input_delay_s": model.plant.input_delay_rotors,
                "plants": len(self.plants.drawn),
                "confidence": CONFIDENCE,
                **{name: {"stable_share": x.stable_share, "figures": x.figures} for name, x in both.items()},
                "notes": self.notes,
                "provenance": provenance(),
            }
        )
