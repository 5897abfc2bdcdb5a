"""The page, tables and figures of designs: steps over the plants that the data allow, their margins, the poles."""

from math import isfinite

import numpy as np

from heli_identifier.provenance import provenance
from heli_identifier.results import Axes, Table, figure, listed, rendered, significant
from heli_identifier.tools.controller import Design
from heli_identifier.tools.judging import CONFIDENCE
from heli_identifier.tools.margins import LOOPS

_SHOWN = 40.0  # largest pole [1/s] that is drawn: faster ones say nothing of the flight


def design_table(design: Design) -> Table:
    """Give margins, settling and stable loops of both designs: of the estimated plant, and what the plants keep."""
    named = {"disk": "disk margin, both rotors"}
    for loop in LOOPS:
        named |= {f"{loop}.gain": f"{loop} loop: gain margin", f"{loop}.phase": f"{loop} loop: phase margin [deg]"}
    named |= {f"{axis}.settling": f"{axis}: settles in [s]" for axis in design.axes}
    rows = []
    for name, title in named.items():
        figures = [own.figures[name] for own in design.by_name.values()]
        rows.append((title, *(_text(x) for own in figures for x in (own.value, own.promised))))
        if name.endswith("settling"):
            slowest = title.replace("settles", "slowest plant settles")
            rows.append((slowest, *(text for own in figures for text in ("", _text(own.worst)))))
    stable = (text for own in design.by_name.values() for text in ("", _text(100.0 * own.stable)))
    rows.append(("plants with a stable loop [%]", *stable))
    kept = f"what {100.0 * CONFIDENCE:.0f} % of {len(design.plants.drawn)} plants keep"
    title = f"{design.kind.upper()} of {listed(design.axes)}: {kept}"
    return Table(title, ("figure", *(head for name in design.by_name for head in (name, "kept"))), rows)


def _text(value: float) -> str:
    return significant(value) if isfinite(value) else "none"


def margin_table(design: Design) -> Table:
    """Give the margins of the present and the retuned PID with their intervals over the plants, and their steps."""
    rows = []
    for name, judged in design.by_name.items():
        for step in judged.steps:
            gains = ", ".join(significant(gain, 4) for gain in getattr(judged.settings, step.axis))
            margins = []
            for figure_name, digits in (("gain", 2), ("phase", 0), ("sensitivity", 2)):
                own = judged.figures[f"{step.axis}.{figure_name}"]
                value, low, high = (f"{x:.{digits}f}" for x in (own.value, *own.interval))
                margins.append(f"{value} ({low} to {high})".replace("inf", "∞"))
            settled = significant(step.settling_time, 2)
            rows.append((step.axis, name, gains, *margins, f"{100.0 * step.overshoot:.0f}", settled))
    columns = ("loop", "PID", "P, I, D", "gain margin", "phase [deg]", "sensitivity", "overshoot [%]", "settles [s]")
    return Table("Margins with their 95 % intervals over the plants that the data allow", columns, rows)


def controller_html(design: Design) -> str:
    """Give the text of design.html: steps, how many plants have at most a disk margin, poles with the estimated one."""
    kept = [f"{own.figures['disk'].promised:.2f} with the {name} design" for name, own in design.by_name.items()]
    margins, poles = Axes("plants [%]"), Axes("imaginary part [1/s]")
    for (name, judged), role in zip(design.by_name.items(), ("before", "after"), strict=False):
        disks, near = np.sort(judged.disks), judged.poles[np.abs(judged.poles) < _SHOWN]
        margins.line(disks, 100.0 * np.arange(1, len(disks) + 1) / len(disks), role, name)
        poles.points(near.real, near.imag, role, name)
    return rendered(
        "design.html.j2",
        title=f"{design.kind.upper()} of {listed(design.axes)}",
        provenance=provenance(),
        sentence=f"{100.0 * CONFIDENCE:.0f} % of {len(design.plants.drawn)} plants that the data allow keep a disk "
        f"margin of {listed(kept)}.",
        design=design,
        table=design_table(design),
        steps=step_figure(design),
        margins=figure([margins], "disk margin of at most", "Distribution of the disk margin over the plants"),
        poles=figure([poles], "real part [1/s]", "Poles of the closed loops"),
    )


def step_figure(design: Design) -> str:
    """Draw the steps of the controllers, a panel for each axis, over the band of 95 % of the plants of the last one."""
    *_, (last, judged) = design.by_name.items()
    panels = []
    for number, step in enumerate(judged.steps):
        low, high = step.size * judged.band[step.axis]
        panel = Axes(f"{step.axis} [rad]")
        panel.band(np.arange(len(low)) * design.plants.model.sampled.dt, low, high, f"95 % of the plants, {last}")
        panel.level(step.size, "muted")
        for (name, own), role in zip(design.by_name.items(), ("before", "after"), strict=False):
            panel.line(own.steps[number].time, own.steps[number].angle, role, name)
        panels.append(panel)
    names = " and ".join(design.by_name)
    return figure(panels, "time since the step of the reference [s]", f"Steps, {names}", 1100.0)
