"""A twin that follows, as a page in the folder of the flight.

The page is a file, so that nothing has to be served. While the twin flies, it loads itself again every second.
"""

from math import nan
from typing import Any

import numpy as np

from heli_identifier.files import write_atomically
from heli_identifier.live.session import PAGE, Session
from heli_identifier.online import Estimate
from heli_identifier.provenance import __version__
from heli_identifier.results import Axes, Table, figure, render, to_digits, unit_text, with_interval
from heli_plant.effects import AXES
from heli_plant.observer import CORRECTED

GAP = 0.5  # time without a comparison [s] over which a line of the page is broken


def write_page(title: str, session: Session) -> None:
    """Write the page into the folder of the flight."""
    angles = (("measured", "measured", "measured"), ("predicted", "after", "twin that follows"),
              ("predicted_alone", "before", "twin left alone"))  # fmt: skip
    errors = ("error", "after", "twin that follows"), ("error_alone", "before", "twin left alone")
    page = render(
        "flight.html.j2",
        title=title,
        provenance={"versions": {"heli-twin": __version__}},
        sentence=state_text(session),
        session=session,
        angles=_draw_past(session, "rad", 1.0, *angles),
        errors=_draw_past(session, "mrad", 1e3, *errors),
        events=[event_line(event) for event in reversed(session.events)],
        axes=axes_table(session),
        values=values_table(session),
    )
    write_atomically(session.folder / PAGE, page)


def _draw_past(session: Session, unit: str, factor: float, *lines: tuple[str, str, str]) -> str:
    """Draw the last comparisons: ``lines`` are key, role and label."""
    time = np.array([compared["time"] for compared in session.past])
    is_gap, panels = np.diff(time, prepend=time[:1]) > GAP, []
    for i, axis in enumerate(AXES):
        panel = Axes(f"{axis} [{unit}]", 130.0)
        for key, role, label in lines:
            values = np.array([compared[key][i] for compared in session.past], dtype=float)
            panel.line(time, np.where(is_gap, nan, factor * values), role, label)
        if key == "error_alone" and (declared := session.declared[i]) is not None:
            panel.level(factor * declared, "muted", "declared by the diagnosis")
        panel.spans = [(event["time_s"],) * 2 for event in session.events if event["time_s"] > min(time, default=0.0)]
        panels.append(panel)
    return figure(panels, "time [s]", f"The last {len(time)} comparisons", 560.0)


def state_text(session: Session) -> str:
    """Return time, mode, detector, the likeliest change and the stream as a line of text."""
    stream = session.stream.line
    if session.twin is None:
        return stream or "waiting for the first sample"
    plan, now = session.twin
    suspect = f", likeliest: {plan.changes[now.finding.change].name}" if now.finding.change >= 0 else ""
    detector = f"detector at {100.0 * min(now.alarm, 9.99):.0f} % of its threshold"
    return f"{session.time:.1f} s, {now.shown_mode}; {detector}{suspect}{stream and f'; {stream}'}"


def event_line(event: Any) -> str:
    """Return an event as one line of text."""
    name = f" {event['name']}" if event["name"] else ""
    other = f" (or {event['other']})" if event["other"] else ""
    estimate = Estimate(event["value"], event["standard_error"], "1")
    value = f" = {with_interval(estimate)}" if event["name"] else ""
    return f"{event['time_s']:8.1f} s  {event['what']}{name}{value}{other}: {event['why']}"


def axes_table(session: Session) -> Table:
    """Return measured and predicted angles of the last comparison, and the errors of both twins."""
    heads = ("axis", "measured [rad]", "predicted 1 s ago", "error [mrad]", "left alone", "declared")
    last, rows = session.past[-1] if session.past else {}, list[tuple[str, ...]]()
    for i, axis in enumerate(AXES):
        angles = [f"{last[key][i]:.4f}".replace("-", "−") if last else "" for key in ("measured", "predicted")]
        errors = [last[key][i] if last else None for key in ("error", "error_alone")]
        milli = ("" if error is None else to_digits(1e3 * error) for error in (*errors, session.declared[i]))
        rows.append((axis, *angles, *milli))
    return Table("Angles", heads, rows)


def values_table(session: Session) -> Table:
    """Return the parameters that are not 0, at the start and in use; an adopted one has the error of its adoption."""
    rows = list[tuple[str, ...]]()
    if session.twin is not None:
        plan, now = session.twin
        columns = zip(CORRECTED, plan.alone.values, now.twin.values, now.errors, strict=True)
        for (name, unit), start, used, error in columns:
            if start != 0.0 or used != 0.0:
                estimate = Estimate(used, error or session.errors.get(name), unit)
                rows.append((name, to_digits(start), with_interval(estimate, unit=False), unit_text(unit)))
    return Table("Parameters", ("parameter", "at the start", "in use, 95 %", "unit"), rows)
