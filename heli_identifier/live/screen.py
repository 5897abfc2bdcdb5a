"""A twin that follows, on the terminal."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rich import box
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from heli_identifier.live.listening import SILENCE, Status
from heli_identifier.live.view import View
from heli_identifier.results import significant

EVENTS_SHOWN = 8
"""Events on the screen, the latest ones."""

_COLOURS = {"alarm": "yellow", "adopted": "green", "rolled back": "red", "stream": "magenta", "held": "dim"}

Show = Callable[[View | None, Status | None], None]


@contextmanager
def screen(title: str) -> Iterator[Show]:
    """Show the twin on the error stream while the block runs; what is seen last stays there."""
    console = Console(stderr=True, highlight=False)
    with Live(Text(title), console=console, auto_refresh=False, redirect_stdout=False, redirect_stderr=False) as live:

        def show(view: View | None, status: Status | None) -> None:
            live.update(drawn(title, view, status), refresh=True)

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


def drawn(title: str, view: View | None, status: Status | None) -> Group:
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
    parts += [Text(event_line(event), style=_COLOURS.get(event["what"], "")) for event in view.events[-EVENTS_SHOWN:]]
    if view.notice:
        parts.append(Text(view.notice, style="yellow"))
    parts.append(_values(view))  # last, as a small terminal cuts off the end
    return Group(*parts)


def stream_line(status: Status) -> str:
    """Say how a stream is doing."""
    if not status.sender:
        refused = f"; {status.refused} datagrams refused: {status.reason}" if status.refused else ""
        return f"waiting for the rig{refused}"
    counts = status.counts
    said = f"{status.sender}: {counts.received} samples"
    faults = [
        *((f"{number} {name}") for name, number in counts._asdict().items() if number and name != "received"),
        *([f"{status.refused} refused"] if status.refused else []),
        *([f"{status.foreign} of others"] if status.foreign else []),
    ]
    if faults:
        said += ", " + ", ".join(faults)
    if status.silence > SILENCE:
        said += f"; nothing for {status.silence:.1f} s"
    return said


def event_line(event: Any) -> str:
    """Say an event in one line."""
    name = f" {event['name']}" if event["name"] else ""
    other = f" (or {event['or']})" if event["or"] else ""
    value = ""
    if event["name"]:
        error = event["standard_error"]
        value = f" = {significant(event['value'])}" + (f" ± {significant(1.96 * error)}" if error else "")
    return f"{event['time_s']:8.1f} s  {event['what']}{name}{value}{other}: {event['why']}"


def _axes(view: View) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("axis")
    for name in ("measured [rad]", "predicted 1 s ago", "error [mrad]", "left alone", "declared"):
        table.add_column(name, justify="right")
    for axis in view.axes:
        worse = axis.error is not None and axis.declared is not None and axis.error > 1.3 * axis.declared
        table.add_row(
            axis.axis,
            "" if axis.measured is None else f"{axis.measured:.4f}",
            "" if axis.predicted is None else f"{axis.predicted:.4f}",
            Text(_milli(axis.error), style="yellow" if worse else ""),
            _milli(axis.error_alone),
            _milli(axis.declared),
        )
    return table


def _milli(value: float | None) -> str:
    return "" if value is None else significant(1e3 * value)


def _values(view: View) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("parameter")
    for name in ("at the start", "in use", "estimate", "± 95 %", "unit"):
        table.add_column(name, justify="left" if name == "unit" else "right")
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
