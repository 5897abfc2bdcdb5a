"""A design as files: its page, table and figures, and a MATLAB file with the names of a course.

The page shows steps over the plants that the data allow, and the margins of these plants.

The course writes, with V_s = v_front + v_rear and V_d = v_front - v_rear about the hover V_s0,

    p'' = K_1 V_d,    e'' = K_2 V_s,    lambda'' = K_3 p

Source: laboratory of TTK4115 Linear System Theory, NTNU, "Helicopter lab assignment", parts I to III.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import Estimate
from heli_identifier.provenance import provenance
from heli_identifier.results import Axes, ParameterSet, Table, figure, join_words, render, to_digits
from heli_identifier.tools.judging import CONFIDENCE, Design, Judged
from heli_identifier.tools.linearisation import LinearModel, linear_system
from heli_identifier.tools.margins import LOOPS
from heli_plant.state_feedback import FeedbackSettings

_FROM_ROTORS = np.array([[1.0, 1.0], [1.0, -1.0]])
"""(V_s, V_d) of (v_front, v_rear); half of it gives (v_front, v_rear) of (V_s, V_d)."""


def design_table(design: Design) -> Table:
    """Return margins, settling times and stable loops of both designs: of the estimated plant, and what plants keep."""
    titles = {"disk": "disk margin, both rotors"}
    for loop in LOOPS:
        margins = {"gain": "gain margin", "phase": "phase margin [deg]", "sensitivity": "peak of the sensitivity"}
        titles |= {f"{loop}.{name}": f"{loop} loop: {title}" for name, title in margins.items()}
    titles |= {f"{axis}.settling": f"{axis}: settles in [s]" for axis in design.axes}
    rows = []
    for name, title in titles.items():
        figures = [judged.figures[name] for judged in design.by_name.values()]
        rows.append((title, *(_figure_text(value) for x in figures for value in (x.value, x.promised))))
        if name.endswith("settling"):
            slowest = title.replace("settles", "slowest plant settles")
            rows.append((slowest, *(text for x in figures for text in ("", _figure_text(x.worst)))))
    shares = (text for x in design.by_name.values() for text in ("", _figure_text(100.0 * x.stable_share)))
    rows.append(("plants with a stable loop [%]", *shares))
    for axis in LOOPS if design.kind == "pid" else ():
        gains = (getattr(judged.settings, axis) for judged in design.by_name.values())
        own = (", ".join(to_digits(gain, 4) for gain in of_axis) for of_axis in gains)
        rows.append((f"{axis} loop: P, I, D", *(text for gains_text in own for text in (gains_text, ""))))
    what = f"what {100.0 * CONFIDENCE:.0f} % of {len(design.plants.drawn)} plants keep"
    title = f"{design.kind.upper()} of {join_words(design.axes)}: {what}"
    return Table(title, ("figure", *(head for name in design.by_name for head in (name, "kept"))), rows)


def _figure_text(value: float) -> str:
    return to_digits(value) if math.isfinite(value) else "none"


def controller_html(design: Design) -> str:
    """Return the text of design.html: steps, and the distribution of the disk margin over the plants."""
    promises = [f"{x.figures['disk'].promised:.2f} with the {name} design" for name, x in design.by_name.items()]
    margins = Axes("plants [%]")
    for (name, judged), role in zip(design.by_name.items(), ("before", "after"), strict=False):
        disks = np.sort(judged.disks)
        margins.line(disks, 100.0 * np.arange(1, len(disks) + 1) / len(disks), role, name)
    return render(
        "design.html.j2",
        title=f"{design.kind.upper()} of {join_words(design.axes)}",
        provenance=provenance(),
        sentence=f"{100.0 * CONFIDENCE:.0f} % of {len(design.plants.drawn)} plants that the data allow keep a disk "
        f"margin of {join_words(promises)}.",
        design=design,
        table=design_table(design),
        steps=step_figure(design),
        margins=figure([margins], "disk margin of at most", "Distribution of the disk margin over the plants"),
    )


def step_figure(design: Design) -> str:
    """Draw the steps of all controllers, a panel per axis, over the band of 95 % of the plants with the last one."""
    *_, (last, judged) = design.by_name.items()
    panels = []
    for number, step in enumerate(judged.steps):
        low, high = step.size * judged.band[step.axis]
        panel = Axes(f"{step.axis} [rad]", limits=(-step.size, 2.5 * step.size))  # drawn plants may be unstable
        panel.band(np.arange(len(low)) * design.plants.model.sampled.dt, low, high, f"95 % of the plants, {last}")
        panel.level(step.size, "muted")
        for (name, controller), role in zip(design.by_name.items(), ("before", "after"), strict=False):
            panel.line(controller.steps[number].time, controller.steps[number].angle, role, name)
        panels.append(panel)
    names = " and ".join(design.by_name)
    return figure(panels, "time since the step of the reference [s]", f"Steps, {names}", 1100.0)


# --- MATLAB -----------------------------------------------------------------------------------------------------------


def course_gains(parameters: ParameterSet, model: LinearModel) -> dict[str, Estimate]:
    """Return K_1, K_2, K_3 of the course's equations and the hover V_s0: slopes at the operating point."""
    A = linear_system(model.plant, model.point).A  # columns 6 and 7 are those of the rotors
    slopes = {"pitch": 0.5 * (A[3, 6] - A[3, 7]), "elevation": 0.5 * (A[4, 6] + A[4, 7]), "travel": A[5, 0]}
    gains = {"V_s0": Estimate(model.point.lift, None, "V")}
    for number, (axis, slope) in enumerate(slopes.items(), start=1):
        gain = parameters.values[f"{axis}.gain"]
        error = gain.standard_error and gain.standard_error * abs(slope / gain.value)
        gains[f"K_{number}"] = Estimate(float(slope), error, "")
    return gains


def controller_m(design: Design, parameters: ParameterSet) -> str:
    """Return the text of controller.m: the linear model, the nominal and the robust design, for the inputs (V_s, V_d).

    Names of the nominal design end with ``_nominal``.
    """
    robust, designs = design.robust, list[tuple[Judged, str, str]]()
    for name, judged in design.by_name.items():
        delivered = replace(judged, settings=design.flown) if judged is robust else judged
        designs.append((delivered, name, "" if judged is robust else f"_{name}"))
    model, point = design.plants.model, design.plants.model.point
    system = linear_system(model.plant, point)
    return render(
        "controller.m.j2",
        point=point,
        held=_FROM_ROTORS @ (point.v_front, point.v_rear),
        gains=course_gains(parameters, model),
        system=system,
        B=system.B @ (0.5 * _FROM_ROTORS),
        x0=[*point.state(model.plant)[:8], *[0.0] * (system.nstates - 8)],
        input_delay=model.plant.input_delay_rotors,
        design=design,
        designs=designs,
        confidence=CONFIDENCE,
        matrices=_matrices,
    )


def _matrices(settings: FeedbackSettings) -> dict[str, NDArray[np.float64]]:
    """Return the matrices of a state feedback by the symbols of its equations, for the inputs (V_s, V_d)."""
    return {
        "K": _FROM_ROTORS @ np.array(settings.gain),
        "K_z": _FROM_ROTORS @ np.array(settings.integral),
        "N": _FROM_ROTORS @ np.array(settings.reference),
        "F": np.array(settings.transition),
        "G": np.array(settings.drive) @ (0.5 * _FROM_ROTORS),
        "L": np.array(settings.innovation),
    }
