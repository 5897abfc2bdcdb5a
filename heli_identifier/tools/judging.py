"""Controllers judged around the estimated plant and around drawn plants that the data allow, and a design of two.

A design promises figures that :data:`CONFIDENCE` of the plants keep, all figures at once. The margins count the period
between reading angles and setting voltages, and the input delay.

It is shown as a table, a figure of steps over the plants that the data allow, and a MATLAB file. The inputs of this
file are V_s = v_front + v_rear and V_d = v_front - v_rear, as in the laboratory of TTK4115 Linear System Theory, NTNU.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, inf, isfinite
from typing import Any

import numpy as np
from scipy.stats import rankdata

from heli_identifier.provenance import provenance
from heli_identifier.results import Axes, Table, figure, figure_file, join_words, render, to_digits, to_json_value
from heli_identifier.tools import margins
from heli_identifier.tools.linearisation import linear_system
from heli_identifier.tools.loop import STEP, Settings, settling_time, step_response
from heli_identifier.tools.margins import LOOPS, Array
from heli_identifier.tools.plants import Plants
from heli_plant.effects import AXES
from heli_plant.state_feedback import FeedbackSettings

SCHEMA = "heli-controller/1"

CONFIDENCE = 0.95  # share of the plants that keep the promised figures
LONGEST = 40.0  # length [s] of the steps whose settling is judged
SHOWN = {"pitch": 12.0, "elevation": 12.0, "travel": 30.0}  # length [s] of the steps that are shown
UNSTABLE = margins.Margins(gain=1.0, phase=0.0, sensitivity=inf)  # margins of an unstable loop
SMALLER_IS_BETTER = ("sensitivity", "settling")  # figures whose names end so are better if they are smaller
_FROM_ROTORS = np.array([[1.0, 1.0], [1.0, -1.0]])
"""(V_s, V_d) of (v_front, v_rear); half of it gives (v_front, v_rear) of (V_s, V_d)."""


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
        for name, column in zip(margins.Margins._fields, np.transpose(of_plants), strict=True):
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
    ``controllers`` by name: the ``nominal`` design by the weights and the ``robust`` one, or the ``present`` PID and
    the ``retuned`` one; the second is delivered. ``notes`` are about the plant and the search.
    """

    kind: str
    axes: tuple[str, ...]
    plants: Plants
    controllers: Mapping[str, Judged]
    notes: tuple[str, ...]

    @property
    def delivered(self) -> Judged:
        """The second of the controllers."""
        return [*self.controllers.values()][-1]

    def document(self) -> dict[str, Any]:
        """Return the content of design.json; null stands for an infinite value."""
        model = self.plants.model
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
                **{
                    name: {"stable_share": judged.stable_share, "figures": judged.figures}
                    for name, judged in self.controllers.items()
                },
                "notes": self.notes,
                "provenance": provenance(),
            }
        )


# --- as files ---------------------------------------------------------------------------------------------------------


def design_table(design: Design) -> Table:
    """Return margins, settling times and stable loops of both designs: of the estimated plant, and what plants keep."""
    titles = {"disk": "disk margin, both rotors"}
    for loop in LOOPS:
        words = {"gain": "gain margin", "phase": "phase margin [deg]", "sensitivity": "peak of the sensitivity"}
        titles |= {f"{loop}.{name}": f"{loop} loop: {title}" for name, title in words.items()}
    titles |= {f"{axis}.settling": f"{axis}: settles in [s]" for axis in design.axes}
    rows = []
    for name, title in titles.items():
        figures = [judged.figures[name] for judged in design.controllers.values()]
        rows.append((title, *(_figure_text(value) for x in figures for value in (x.value, x.promised))))
    shares = (text for x in design.controllers.values() for text in ("", _figure_text(100.0 * x.stable_share)))
    rows.append(("plants with a stable loop [%]", *shares))
    for axis in LOOPS if design.kind == "pid" else ():
        gains = (getattr(judged.settings, axis) for judged in design.controllers.values())
        own = (", ".join(to_digits(gain, 4) for gain in of_axis) for of_axis in gains)
        rows.append((f"{axis} loop: P, I, D", *(text for gains_text in own for text in (gains_text, ""))))
    what = f"what {100.0 * CONFIDENCE:.0f} % of {len(design.plants.drawn)} plants keep"
    title = f"{design.kind.upper()} of {join_words(design.axes)}: {what}"
    return Table(title, ("figure", *(head for name in design.controllers for head in (name, "kept"))), rows)


def _figure_text(value: float) -> str:
    return to_digits(value) if isfinite(value) else "none"


def step_figure(design: Design) -> str:
    """Return the text of design.svg: steps of all controllers over the band of 95 % of the plants with the last one."""
    *_, (last, judged) = design.controllers.items()
    panels = []
    for axis, band in judged.band.items():
        time, (low, high) = np.arange(band.shape[1]) * design.plants.model.sampled.dt, STEP * band
        panel = Axes(f"{axis} [rad]", limits=(-STEP, 2.5 * STEP))  # drawn plants may be unstable
        panel.band(time, low, high, f"95 % of the plants, {last}")
        panel.level(STEP, "muted")
        for (name, controller), role in zip(design.controllers.items(), ("before", "after"), strict=False):
            panel.line(time, controller.steps[axis], role, name)
        panels.append(panel)
    names = " and ".join(design.controllers)
    return figure_file(figure(panels, "time since the step of the reference [s]", f"Steps, {names}", 1100.0))


def controller_m(design: Design) -> str:
    """Return the text of controller.m: the linear model and the delivered controller, for the inputs (V_s, V_d)."""
    model, point = design.plants.model, design.plants.model.point
    system = linear_system(model.plant, point)
    return render(
        "controller.m.j2",
        point=point,
        held=_FROM_ROTORS @ (point.v_front, point.v_rear),
        system=system,
        B=system.B @ (0.5 * _FROM_ROTORS),
        x0=[*point.state(model.plant)[:8], *[0.0] * (system.nstates - 8)],
        input_delay=model.plant.input_delay_rotors,
        design=design,
        confidence=CONFIDENCE,
        matrices=_matrices,
    )


def _matrices(settings: FeedbackSettings) -> dict[str, Array]:
    """Return the matrices of a state feedback by the symbols of its equations, for the inputs (V_s, V_d)."""
    return {
        "K": _FROM_ROTORS @ np.array(settings.gain),
        "K_z": _FROM_ROTORS @ np.array(settings.integral),
        "N": _FROM_ROTORS @ np.array(settings.reference),
        "F": np.array(settings.transition),
        "G": np.array(settings.drive) @ (0.5 * _FROM_ROTORS),
        "L": np.array(settings.innovation),
    }
