"""The parts of `heli follow` around the twin: displays of the flight, and the end.

At the end the recording is diagnosed, and the better plant is written.
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
from heli_identifier import online, records, results, tools, tracing
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

LEAST_AFTER_CHANGE = 30.0
"""Flight after the last change [s] that is enough for a diagnosis; the rig before the change was another one."""


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
    """Diagnose the recording; write parameters and unit of the twin, or of the diagnosed plant if that is better."""
    twin, path, better = session.in_use(), folder / RECORDED, None
    twin.write(folder / IN_USE)
    _deliver(twin, folder)
    times = np.loadtxt(path, delimiter=",", skiprows=1, usecols=0, ndmin=1) if session.recorded.rows else np.zeros(0)
    start, end, why = choose_part(times, session.events)
    if end - start < tools.SHORTEST_TO_SPLIT:
        note(f"{end - start:.3g} s without a gap are too short for a diagnosis")
    else:
        note(f"diagnosed: {start:.4g} s to {end:.4g} s of {path}{why}")
        try:
            better = _diagnosed_plant(path, folder / DIAGNOSIS, start, end, configuration, twin)
        except IdentifierError as error:
            warn(f"the recording cannot be diagnosed: {error}")
    if better is not None:
        _deliver(better, folder)
    names = [EVENTS, RECORDED, PREDICTIONS, IN_USE, "parameters.json", f"{twin.unit}.fmu"]
    names += [f"{DIAGNOSIS}/{name}" for name in results.RESULTS]
    written = [name for name in names if (folder / name).is_file()]
    note_written(folder, written, ", as the twin flew last" if better is None else "")


def _deliver(plant: hi.ParameterSet, folder: Path) -> None:
    """Write the parameters and the unit of a plant."""
    with results.write_whole_folder(folder) as draft:
        plant.write(draft / "parameters.json")
        hi.build(plant.unit, draft, plant)


def _diagnosed_plant(
    path: Path, output: Path, start: float, end: float, configuration: hi.RigConfiguration, twin: hi.ParameterSet
) -> hi.ParameterSet | None:
    """Diagnose a part of the recording, print the result, and give its plant if it is better than the twin."""
    # The recording has the standard columns, signs and units; of the rig's format only the limits still apply.
    of_rig = configuration.format
    limits = hi.LogFormat(voltage_limit=of_rig.voltage_limit, encoder_counts=of_rig.encoder_counts)
    diagnosis, _, held_out = diagnose_paths((path,), (), replace(configuration, format=limits), output, start, end)
    terminal.print_diagnosis(diagnosis)
    better = results.corrected_parameters(diagnosis)
    gain = results.log_likelihood(diagnosis.plant_after, held_out) - results.log_likelihood(twin.plant(), held_out)
    seconds = sum(log.duration for log in held_out)
    comparison = f"makes the last {seconds:.3g} s of the recording likelier by {abs(gain):.3g} nats than the"
    if gain <= 0.0:
        note(f"the twin {comparison} diagnosis of the recording, and stays")
        return None
    if drawbacks := [*_drawbacks(diagnosis, better, twin, held_out)]:
        warn(f"the diagnosis of the recording {comparison} twin, which stays nevertheless: {'; '.join(drawbacks)}")
        return None
    note(f"the diagnosis of the recording {comparison} twin, and replaces it")
    for text in better.doubts:
        warn(text)
    return better


def _drawbacks(
    diagnosis: hi.Diagnosis, better: hi.ParameterSet, twin: hi.ParameterSet, logs: Sequence[hi.Log]
) -> Iterator[str]:
    """Name gains that the diagnosis does not determine, and axes on which it predicts worse than the twin."""
    for name, report in diagnosis.parameters.items():
        if name in online.GAINS and report.determination is tracing.Determination.NOT_DETERMINED:
            yield f"it does not determine {name} ({report.why})"
    both = (results.errors_ahead(parameters.plant(), logs, better.judged) for parameters in (twin, better))
    for (_, axis, old), (_, _, new) in zip(*both, strict=True):
        if new.value > old.high:
            ahead, error, twin_error = results.AHEAD[better.judged], results.angle_text(new), results.angle_text(old)
            yield f"its error {ahead} on the {axis} is {error} mrad, the twin's {twin_error} mrad"


def choose_part(times: Any, events: Sequence[dict[str, Any]]) -> tuple[float, float, str]:
    """Return start and end [s] of the part that is diagnosed, and the reason in words.

    It is the longest part without a gap, after the last noticed change if enough flight follows it.
    """
    if len(times) < 2:
        return 0.0, 0.0, ""
    changes = [event["since_s"] for event in events if event["what"] in ("alarm", "adopted", "rolled back")]
    first, why = times[0], ""
    if changes and times[-1] - changes[-1] >= LEAST_AFTER_CHANGE:
        first, why = changes[-1], f", after the last change at {changes[-1]:.4g} s"
    elif changes:
        why = f"; the rig may have changed within it, at {changes[-1]:.4g} s"
    part = times[times >= max(first, times[-1] - LONGEST)]
    cuts = np.flatnonzero(np.diff(part) > (records.GAP_STEPS + 0.5) * np.median(np.diff(times)))
    starts, ends = part[np.append(0, cuts + 1)], part[np.append(cuts, len(part) - 1)]
    longest = int((ends - starts).argmax())
    return float(starts[longest]), float(ends[longest]), why
