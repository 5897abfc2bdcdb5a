"""The parts of `heli follow` around the twin: displays of the flight, and the end.

At the end the twin is written as it flew last, and the recording is diagnosed.
"""

import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np

import heli_identifier as hi
from heli_identifier import records, results, tools
from heli_identifier.cli import terminal
from heli_identifier.cli.on_logs import diagnose_paths
from heli_identifier.cli.terminal import note, note_written, warn
from heli_identifier.errors import IdentifierError
from heli_identifier.live.page import serve_page
from heli_identifier.live.screen import show_screen
from heli_identifier.live.session import EVENTS, IN_USE, PREDICTIONS, RECORDED, Session, Show, View

LONGEST = 600.0
"""Longest part of a recording, at its end, that is diagnosed [s]; more takes long and adds little."""

DIAGNOSIS = "diagnosis"
"""Folder of the recording's diagnosis."""


def open_shows(stack: ExitStack, title: str, address: str | None) -> Show:
    """Open the screen on a terminal and, at an ``address``, the page; give a function that shows a view on them."""
    displays = [stack.enter_context(show_screen(title))] if sys.stderr.isatty() else []
    if address is not None:
        url, page = stack.enter_context(serve_page(address, title))
        note(f"open {url} in a browser")
        displays.append(page)

    def show(view: View) -> None:
        for display in displays:
            display(view)

    return show


@contextmanager
def catch_interrupt() -> Iterator[Callable[[], bool]]:
    """Return a function that tells whether Ctrl-C was pressed; a second Ctrl-C ends the command at once."""
    interrupted, old_handler = Event(), signal.getsignal(signal.SIGINT)

    def handle(number: int, frame: Any) -> None:
        interrupted.set()
        signal.signal(signal.SIGINT, old_handler)

    if old_handler != signal.SIG_IGN:
        signal.signal(signal.SIGINT, handle)
    try:
        yield interrupted.is_set
    finally:
        signal.signal(signal.SIGINT, old_handler)


def conclude_flight(session: Session, folder: Path, configuration: hi.RigConfiguration) -> None:
    """Write parameters and unit of the twin, and diagnose the recording."""
    twin, path = session.in_use(), folder / RECORDED
    twin.write(folder / IN_USE)
    hi.build(twin.unit, folder, twin)
    times = np.loadtxt(path, delimiter=",", skiprows=1, usecols=0, ndmin=1) if session.recorded.rows else np.zeros(0)
    start, end = choose_part(times, session.events)
    if end - start < tools.SHORTEST_TO_SPLIT:
        note(f"{end - start:.3g} s without a change or a gap are too short for a diagnosis")
    else:
        note(f"diagnosed: {start:.4g} s to {end:.4g} s of {path}")
        # The recording has the standard columns, signs and units; of the rig's format only the limits still apply.
        of_rig = configuration.format
        limits = hi.LogFormat(voltage_limit=of_rig.voltage_limit, encoder_counts=of_rig.encoder_counts)
        of_recording = replace(configuration, format=limits)
        try:
            diagnosis = diagnose_paths((path,), (), of_recording, folder / DIAGNOSIS, start, end)
            terminal.print_diagnosis(diagnosis)
        except IdentifierError as error:
            warn(f"the recording cannot be diagnosed: {error}")
    names = [EVENTS, RECORDED, PREDICTIONS, IN_USE, f"{twin.unit}.fmu"]
    names += [f"{DIAGNOSIS}/{name}" for name in results.RESULTS]
    note_written(folder, [name for name in names if (folder / name).is_file()])


def choose_part(times: Any, events: Sequence[dict[str, Any]]) -> tuple[float, float]:
    """Return start and end [s] of the part that is diagnosed: the longest without a gap after the last change."""
    if len(times) < 2:
        return 0.0, 0.0
    changes = [event["since_s"] for event in events if event["what"] in ("alarm", "adopted", "rolled back")]
    first = min(max([*changes[-1:], times[-1] - LONGEST]), times[-1])
    part = times[times >= first]
    cuts = np.flatnonzero(np.diff(part) > (records.GAP_STEPS + 0.5) * np.median(np.diff(times)))
    starts, ends = part[np.append(0, cuts + 1)], part[np.append(cuts, len(part) - 1)]
    longest = int((ends - starts).argmax())
    return float(starts[longest]), float(ends[longest])
