"""A twin that follows, on the terminal."""

from collections.abc import Iterator
from contextlib import contextmanager
from math import inf
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.text import Text

from heli_identifier.live.session import Show, View
from heli_identifier.online import Estimate
from heli_identifier.results import Table, to_digits, with_interval
from heli_plant.effects import AXES

_EVENTS_SHOWN = 8  # the latest ones
_COLOURS = {"alarm": "yellow", "adopted": "green", "rolled back": "red", "stream": "magenta", "held": "dim"}


@contextmanager
def show_screen(title: str) -> Iterator[Show]:
    """Show the twin on the error stream while the block runs; the last view stays there."""
    console = Console(stderr=True, highlight=False)
    with Live(Text(title), console=console, auto_refresh=False, redirect_stdout=False, redirect_stderr=False) as live:
        yield lambda view: live.update(draw_screen(title, view, console.width), refresh=True)


def draw_screen(title: str, view: View, width: float = inf) -> Group:
    """Return the screen, ``width`` characters wide."""
    head = Text(title, style="bold")
    if not view.values:
        return Group(head, Text(view.stream.line or "starting", style="dim"))
    line = Text(f"{view.time:8.1f} s   ")
    line.append(view.mode, style="yellow" if view.mode in ("alarmed", "on trial", "suspended") else "green")
    line.append(f"   detector at {100.0 * min(view.alarm, 9.99):.0f} % of its threshold")
    if view.suspect:
        line.append(f", likeliest: {view.suspect}", style="yellow")
    parts: list[Any] = [head, line]
    if view.stream.line:
        parts.append(Text(view.stream.line, style="red" if view.stream.silent else "dim"))
    parts.append(Text(_axes(view).text(width)))
    parts += [Text(event_line(event), style=_COLOURS.get(event["what"], "")) for event in view.events[-_EVENTS_SHOWN:]]
    parts.append(Text(_values(view).text(width)))  # last, as a small terminal cuts off the end
    return Group(*parts)


def event_line(event: Any) -> str:
    """Return an event as one line of text."""
    name = f" {event['name']}" if event["name"] else ""
    other = f" (or {event['other']})" if event["other"] else ""
    estimate = Estimate(event["value"], event["standard_error"], "1")
    value = f" = {with_interval(estimate)}" if event["name"] else ""
    return f"{event['time_s']:8.1f} s  {event['what']}{name}{value}{other}: {event['why']}"


def _axes(view: View) -> Table:
    rows = []
    for i, (axis, declared) in enumerate(zip(AXES, view.declared, strict=True)):
        cells = [""] * 4
        if view.past:
            last = view.past[-1]
            angles = [f"{last[key][i]:.4f}".replace("-", "−") for key in ("measured", "predicted")]
            cells = [*angles, _milli(last["error"][i]), _milli(last["error_alone"][i])]
        rows.append((axis, *cells, _milli(declared)))
    return Table("", ("axis", "measured [rad]", "predicted 1 s ago", "error [mrad]", "left alone", "declared"), rows)


def _milli(value: float | None) -> str:
    return "" if value is None else to_digits(1e3 * value)


def _values(view: View) -> Table:
    rows = []
    for value in view.values:
        used = with_interval(Estimate(value["used"], value["band"] / 1.96 or None, "1"))
        rows.append((value["name"], to_digits(value["start"]), used, value["unit"]))
    return Table("", ("parameter", "at the start", "in use, 95 %", "unit"), rows)
