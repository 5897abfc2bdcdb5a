"""A twin that follows, on the terminal."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rich import box
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from heli_identifier.live.session import Show, View
from heli_identifier.live.sources import SILENCE, Status
from heli_identifier.results import significant
from heli_plant.effects import AXES

_EVENTS_SHOWN = 8  # the latest ones
_COLOURS = {"alarm": "yellow", "adopted": "green", "rolled back": "red", "stream": "magenta", "held": "dim"}


@contextmanager
def screen(title: str) -> Iterator[Show]:
    """Show the twin on the error stream while the block runs; what is seen last stays there."""
    console = Console(stderr=True, highlight=False)
    with Live(Text(title), console=console, auto_refresh=False, redirect_stdout=False, redirect_stderr=False) as live:

        def show(view: View | None, status: Status | None) -> None:
            live.update(draw_screen(title, view, status), refresh=True)

        yield show


class Teller:
    """Prints every event once on the error stream, where that is no terminal."""

    def __init__(self) -> None:
        self.told = 0

    def __call__(self, view: View | None, status: Status | None) -> None:
        """Print the events that are new."""
        new = 0 if view is None else view.number_of_events - self.told
        if view is not None and new:
            for event in view.events[-new:]:
                print(event_line(event), file=sys.stderr, flush=True)
            self.told += new


def draw_screen(title: str, view: View | None, status: Status | None) -> Group:
    """Give the screen."""
    head = Text(title, style="bold")
    if view is None:
        return Group(head, Text(stream_line(status) if status else "starting", style="dim"))
    line = Text(f"{view.time:8.1f} s   ")
    line.append(view.mode, style="yellow" if view.mode in ("alarmed", "on trial", "suspended") else "green")
    line.append(f"   detector at {100.0 * min(view.alarm, 9.99):.0f} % of its threshold")
    if view.suspect:
        line.append(f", likeliest: {view.suspect}", style="yellow")
    parts: list[Any] = [head, line]
    if status is not None:
        parts.append(Text(stream_line(status), style="red" if status.silence > SILENCE else "dim"))
    parts.append(_axes(view))
    parts += [Text(event_line(event), style=_COLOURS.get(event["what"], "")) for event in view.events[-_EVENTS_SHOWN:]]
    if view.notice:
        parts.append(Text(view.notice, style="yellow"))
    parts.append(_values(view))  # last, as a small terminal cuts off the end
    return Group(*parts)


def stream_line(status: Status) -> str:
    """Say how a stream is doing."""
    if not status.sender:
        refused = f"; {status.refused} datagrams refused: {status.reason}" if status.refused else ""
        return f"waiting for the rig{refused}"
    counts = {**status.counts._asdict(), "refused": status.refused, "of others": status.foreign}
    faults = [f"{number} {name}" for name, number in counts.items() if number and name != "received"]
    said = [", ".join([f"{status.sender}: {status.counts.received} samples", *faults]), *status.notes]
    if status.silence > SILENCE:
        said.append(f"nothing for {status.silence:.1f} s")
    return "; ".join(said)


def event_line(event: Any) -> str:
    """Say an event in one line."""
    name = f" {event['name']}" if event["name"] else ""
    other = f" (or {event['or']})" if event["or"] else ""
    value = ""
    if event["name"]:
        error = event["standard_error"]
        value = f" = {significant(event['value'])}" + (f" ± {significant(1.96 * error)}" if error else "")
    return f"{event['time_s']:8.1f} s  {event['what']}{name}{value}{other}: {event['why']}"


def _table(first: str, *others: str) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column(first)
    for name in others:
        table.add_column(name, justify="left" if name == "unit" else "right")
    return table


def _axes(view: View) -> Table:
    table = _table("axis", "measured [rad]", "predicted 1 s ago", "error [mrad]", "left alone", "declared")
    last = view.last
    for i, axis in enumerate(AXES):
        declared = view.declared[i]
        if last is None:
            table.add_row(axis, "", "", "", "", _milli(declared))
            continue
        error = last.error[i]
        worse = error is not None and declared is not None and error > 1.3 * declared
        table.add_row(
            axis,
            "" if last.measured is None else f"{last.measured[i]:.4f}",
            f"{last.predicted[i]:.4f}",
            Text(_milli(error), style="yellow" if worse else ""),
            _milli(last.error_alone[i]),
            _milli(declared),
        )
    return table


def _milli(value: float | None) -> str:
    return "" if value is None else significant(1e3 * value)


def _values(view: View) -> Table:
    table = _table("parameter", "at the start", "in use", "estimate", "± 95 %", "unit")
    for value in view.values:
        table.add_row(
            value.name,
            significant(value.start),
            Text(significant(value.used), style="green" if value.used != value.start else ""),
            "" if value.estimate is None else significant(value.estimate),
            "" if value.band is None else significant(value.band),
            value.unit,
        )
    return table
