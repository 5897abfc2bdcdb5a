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

from heli_identifier.live.listening import SILENCE, Status
from heli_identifier.live.session import Show, View
from heli_identifier.online import Estimate
from heli_identifier.results import significant, with_interval
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


def print_news(view: View | None, status: Status | None) -> None:
    """Print the events that are new on the error stream, where that is no terminal."""
    for event in view["news"] if view is not None else ():
        print(event_line(event), file=sys.stderr, flush=True)


def draw_screen(title: str, view: View | None, status: Status | None) -> Group:
    """Give the screen."""
    head = Text(title, style="bold")
    if view is None:
        return Group(head, Text(stream_line(status) if status else "starting", style="dim"))
    line = Text(f"{view['time']:8.1f} s   ")
    line.append(view["mode"], style="yellow" if view["mode"] in ("alarmed", "on trial", "suspended") else "green")
    line.append(f"   detector at {100.0 * min(view['alarm'], 9.99):.0f} % of its threshold")
    if view["suspect"]:
        line.append(f", likeliest: {view['suspect']}", style="yellow")
    parts: list[Any] = [head, line]
    if status is not None:
        parts.append(Text(stream_line(status), style="red" if status.silence > SILENCE else "dim"))
    parts.append(_axes(view))
    shown = view["events"][-_EVENTS_SHOWN:]
    parts += [Text(event_line(event), style=_COLOURS.get(event["what"], "")) for event in shown]
    if view["notice"]:
        parts.append(Text(view["notice"], style="yellow"))
    parts.append(_values(view))  # last, as a small terminal cuts off the end
    return Group(*parts)


def stream_line(status: Status) -> str:
    """Say how a stream is doing."""
    if not status.sender:
        refused = f"; {status.refused} datagrams refused: {status.reason}" if status.refused else ""
        return f"waiting for the rig{refused}"
    said = [f"{status.sender}: {faults_of(status) or f'{status.counts.received} samples'}", *status.notes]
    if status.silence > SILENCE:
        said.append(f"nothing for {status.silence:.1f} s")
    return "; ".join(said)


def faults_of(status: Status | None) -> str:
    """Say how samples came in, if any was lost, late, doubled, damaged or somebody else's."""
    if status is None:
        return ""
    counts = status.counts
    said = {
        "were lost": counts.lost,
        "came too late": counts.late,
        "were overtaken": counts.reordered,
        "came twice": counts.duplicated,
        "had a damaged time": counts.stray,
        "datagrams held no sample": status.refused,
        "datagrams came from others": status.foreign,
        "starts of the rig": counts.restarted + 1 if counts.restarted else 0,
    }
    told = ", ".join(f"{number} {what}" for what, number in said.items() if number)
    return f"of {counts.received + counts.lost} samples {told}" if told else ""


def event_line(event: Any) -> str:
    """Say an event in one line."""
    name = f" {event['name']}" if event["name"] else ""
    other = f" (or {event['or']})" if event["or"] else ""
    estimate = Estimate(event["value"], event["standard_error"], "1")
    value = f" = {with_interval(estimate)}" if event["name"] else ""
    return f"{event['time_s']:8.1f} s  {event['what']}{name}{value}{other}: {event['why']}"


def _table(*columns: str) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for number, name in enumerate(columns):
        table.add_column(name, justify="left" if number == 0 or name == "unit" else "right")
    return table


def _axes(view: View) -> Table:
    table = _table("axis", "measured [rad]", "predicted 1 s ago", "error [mrad]", "left alone", "declared")
    last = view["last"]
    for i, (axis, declared) in enumerate(zip(AXES, view["declared"], strict=True)):
        if last is None:
            table.add_row(axis, "", "", "", "", _text(declared, 1e3))
            continue
        error = last["error"][i]
        worse = error is not None and declared is not None and error > 1.3 * declared
        angles = [f"{last[which][i]:.4f}" for which in ("measured", "predicted")]
        shown = Text(_text(error, 1e3), style="yellow" if worse else "")
        table.add_row(axis, *angles, shown, _text(last["error_alone"][i], 1e3), _text(declared, 1e3))
    return table


def _text(value: float | None, times: float = 1.0) -> str:
    return "" if value is None else significant(times * value)


def _values(view: View) -> Table:
    table = _table("parameter", "at the start", "in use", "estimate, 95 %", "unit")
    for value in view["values"]:
        used = Text(significant(value["used"]), style="green" if value["used"] != value["start"] else "")
        known = value["estimate"] is not None
        text = with_interval(Estimate(value["estimate"], value["band"] / 1.96, "1")) if known else ""
        table.add_row(value["name"], significant(value["start"]), used, text, value["unit"])
    return table
