"""design.html and the table of a terminal: steps over the plants that the data allow, their margins, the poles."""

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np

from heli_identifier.results import Axes, Table, figure, listed, page, significant
from heli_identifier.tools.controller import CONFIDENCE, ControllerDesign, Judged, PidDesign

_SHOWN = 40.0
"""Largest pole [1/s] that is drawn: faster ones say nothing of the flight."""


def design_table(design: ControllerDesign) -> Table:
    """Give margins, settling and stable loops of both designs: of the estimated plant, and what the plants keep."""
    both = (design.nominal, design.robust)
    rows = [_row("disk margin, both rotors", [(own.disk, own.promised_disk) for own in both])]
    for loop in design.nominal.margins:
        pairs = [(own.margins[loop], own.promised[loop]) for own in both]
        rows.append(_row(f"{loop} loop: gain margin", [(m.gain, p.gain) for m, p in pairs]))
        rows.append(_row(f"{loop} loop: phase margin [deg]", [(m.phase, p.phase) for m, p in pairs]))
    for axis in design.axes:
        times = [(own.settling[axis], own.promised_settling[axis]) for own in both]
        rows.append(_row(f"{axis}: settles in [s]", times))
        rows.append(_row(f"{axis}: slowest plant settles in [s]", [(None, own.worst_settling[axis]) for own in both]))
    rows.append(_row("plants with a stable loop [%]", [(None, 100.0 * own.stable) for own in both]))
    kept = f"what {100.0 * CONFIDENCE:.0f} % of {design.plants} plants keep"
    title = f"{design.kind.upper()} of {listed(design.axes)}: {kept}"
    return Table(title, ("figure", "nominal", "kept", "robust", "kept"), rows)


def margin_table(made: PidDesign) -> Table:
    """Give the margins of the present and the retuned PID with their intervals over the plants, and their steps."""
    rows = []
    for name, loop in (("present", made.before), ("retuned", made.after)):
        for (axis, found), step in zip(loop.margins.items(), loop.steps, strict=True):
            low, high = loop.low[axis], loop.high[axis]
            gains = ", ".join(significant(gain, 4) for gain in getattr(loop.settings, axis))
            margins = (
                f"{found.gain:.2f} ({low.gain:.2f} to {high.gain:.2f})",
                f"{found.phase:.0f} ({low.phase:.0f} to {high.phase:.0f})",
                f"{found.sensitivity:.2f} ({low.sensitivity:.2f} to {high.sensitivity:.2f})",
            )
            settled = significant(step.settling_time, 2)
            rows.append((axis, name, gains, *margins, f"{100.0 * step.overshoot:.0f}", settled))
    columns = ("loop", "PID", "P, I, D", "gain margin", "phase [deg]", "sensitivity", "overshoot [%]", "settles [s]")
    return Table("Margins with their 95 % intervals over the plants that the data allow", columns, rows)


def _row(name: str, pairs: Sequence[tuple[float | None, float]]) -> tuple[str, ...]:
    texts = ("" if x is None else significant(x) if isfinite(x) else "none" for pair in pairs for x in pair)
    return (name, *texts)


def controller_html(design: ControllerDesign, provenance: Mapping[str, Any]) -> str:
    """Give the text of design.html."""
    point = design.model.point
    robust = design.robust
    sentence = (
        f"{CONFIDENCE:.0%} of {design.plants} plants that the data allow keep a disk margin of "
        f"{robust.promised_disk:.2f} with the robust design, {design.nominal.promised_disk:.2f} with the nominal one."
    )
    return page(
        "design.html.j2",
        f"{design.kind.upper()} of {listed(design.axes)}",
        provenance,
        sentence=sentence,
        point=f"pitch {point.pitch:.3f} rad, elevation {point.elevation:.3f} rad, v_front {point.v_front:.2f} V, "
        f"v_rear {point.v_rear:.2f} V, every {1e3 * design.model.sampled.dt:g} ms",
        table=design_table(design).html(),
        steps=_steps(design),
        margins=_margins(design),
        poles=_poles(design),
        notes=design.notes,
    )


def _steps(design: ControllerDesign) -> str:
    """Step responses of .1 rad with the whole plant, over the band of the linear ones of 95 % of the plants."""
    panels = []
    for own, other in zip(design.robust.steps, design.nominal.steps, strict=True):
        panel = Axes(f"{own.axis} [rad]")
        low, high = own.size * design.robust.band[own.axis]
        after = own.time[own.time >= -1e-9][: len(low)]
        panel.band(after, low[: len(after)], high[: len(after)], "95 % of the plants, robust")
        panel.line(other.time, other.angle, "before", "nominal")
        panel.line(own.time, own.angle, "after", "robust")
        panels.append(panel)
    return figure(panels, "time since the step of the reference [s]", "Step responses of both designs")


def _margins(design: ControllerDesign) -> str:
    """How many plants have at most a disk margin."""
    panel = Axes("plants [%]")
    for judged, role, name in _both(design):
        disks = np.sort(judged.disks)
        panel.line(disks, 100.0 * np.arange(1, len(disks) + 1) / len(disks), role, name)
    return figure([panel], "disk margin of at most", "Distribution of the disk margin over the plants")


def _poles(design: ControllerDesign) -> str:
    """Poles of the closed loops with the estimated plant, without those faster than the rest by far."""
    panel = Axes("imaginary part [1/s]")
    for judged, role, name in _both(design):
        near = judged.poles[np.abs(judged.poles) < _SHOWN]
        panel.points(near.real, near.imag, role, name)
    return figure([panel], "real part [1/s]", "Poles of the closed loops")


def _both(design: ControllerDesign) -> tuple[tuple[Judged, str, str], ...]:
    return (design.nominal, "before", "nominal"), (design.robust, "after", "robust")
