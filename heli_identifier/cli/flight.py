"""What `heli follow` does besides following: where the flight is shown, advice on the controller, and the end.

At the end the recording is diagnosed, and the plant to go on with is written. The controller is judged beside the loop
after a change; gains are offered, never applied.
"""

import signal
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np

import heli_identifier as hi
from heli_identifier import online, records, results, tools, tracing
from heli_identifier.cli import terminal
from heli_identifier.cli.arguments import controller_of
from heli_identifier.cli.on_logs import diagnose_paths
from heli_identifier.cli.terminal import note, note_written, warn
from heli_identifier.errors import ConfigurationError, IdentifierError
from heli_identifier.live.page import serve_page
from heli_identifier.live.screen import print_events, show_screen
from heli_identifier.live.session import ADVICE, EVENTS, GAINS, IN_USE, PREDICTIONS, RECORDED, Session, Show, View
from heli_plant.control import PidSettings
from heli_plant.parameters import PlantParameters

LONGEST = 600.0
"""The end of a recording that is diagnosed [s]; more takes long and adds little."""

DIAGNOSIS = "diagnosis"
"""Folder of the recording's diagnosis."""

LEAST_AFTER_CHANGE = 30.0
"""Time after the last change from which on only that is diagnosed [s]: the rig before was another one."""


def open_shows(stack: ExitStack, title: str, address: str | None) -> Show:
    """Open the screen and, at an ``address``, the page; give what shows a view on them."""
    places = [stack.enter_context(show_screen(title)) if sys.stderr.isatty() else print_events()]
    if address is not None:
        url, page = stack.enter_context(serve_page(address, title))
        note(f"open {url} in a browser")
        places.append(page)

    def show(view: View) -> None:
        for one in places:
            one(view)

    return show


@contextmanager
def catch_interrupt() -> Iterator[Callable[[], bool]]:
    """Give a function that says whether Ctrl-C has asked the block to end; a second one ends the command at once."""
    asked, before = Event(), signal.getsignal(signal.SIGINT)

    def ask(number: int, frame: Any) -> None:
        asked.set()
        signal.signal(signal.SIGINT, before)

    if before != signal.SIG_IGN:
        signal.signal(signal.SIGINT, ask)
    try:
        yield asked.is_set
    finally:
        signal.signal(signal.SIGINT, before)


class Adviser:
    """Judges the controller of a heli.toml, or of a file that outranks it, in a thread of its own; writes it."""

    def __init__(self, folder: Path, controller: Path | None, aim: records.ControllerConfiguration) -> None:
        self.folder = folder
        self.aim = replace(aim, pid=controller_of(aim.pid or PidSettings(), controller)) if controller else aim
        self.thread = ThreadPoolExecutor(1)
        self.asked: Future[tuple[dict[str, Any], hi.ParameterSet | None]] | None = None
        self.sentence = ""

    def ask(self, plant: PlantParameters, errors: Mapping[str, float], elevation: float) -> None:
        """Have the controller judged around a plant; what was asked before, and has not begun, is left."""
        if self.asked is not None:
            self.asked.cancel()
        self.asked = self.thread.submit(tools.control_advice, plant, dict(errors), elevation, self.aim)

    def look(self, wait: bool = False) -> str:
        """Return what is to be said about the controller now, after a wait for it if asked for; write what is new."""
        if self.asked is not None and (wait or self.asked.done()):
            asked, self.asked = self.asked, None
            try:
                document, gains = asked.result()
                self.sentence = document["sentence"]
                results.write_files(self.folder, {ADVICE: document, **({GAINS: gains} if gains else {})})
            except ConfigurationError as error:
                self.sentence = f"The controller cannot be judged around the changed plant: {error}"
        return self.sentence


def conclude_flight(session: Session, folder: Path, configuration: hi.RigConfiguration) -> None:
    """Diagnose the recording; leave parameters and unit of the twin, or of the recording's plant if that is better."""
    twin, path, better = session.in_use(), folder / RECORDED, None
    twin.write(folder / IN_USE)
    _deliver(twin, folder)
    times = np.loadtxt(path, delimiter=",", skiprows=1, usecols=0, ndmin=1) if session.recorded.rows else np.zeros(0)
    begin, end, why = choose_part(times, session.events)
    if end - begin < tools.SHORTEST_TO_SPLIT:
        note(f"{end - begin:.3g} s without a gap are too short for a diagnosis")
    else:
        note(f"diagnosed: {begin:.4g} s to {end:.4g} s of {path}{why}")
        try:
            better = _diagnosed_plant(path, folder / DIAGNOSIS, begin, end, configuration, twin)
        except IdentifierError as error:
            warn(f"the recording cannot be diagnosed: {error}")
    if better is not None:
        _deliver(better, folder)
    names = [EVENTS, RECORDED, PREDICTIONS, IN_USE, ADVICE, GAINS, "parameters.json", f"{twin.unit}.fmu"]
    names += [f"{DIAGNOSIS}/{name}" for name in results.RESULTS]
    there = [name for name in names if (folder / name).is_file()]
    note_written(folder, there, ", as the twin flew last" if better is None else "")


def _deliver(plant: hi.ParameterSet, folder: Path) -> None:
    """Write the parameters and the unit of a plant."""
    with results.whole_folder(folder) as draft:
        plant.write(draft / "parameters.json")
        hi.build(plant.unit, draft, plant)


def _diagnosed_plant(
    path: Path, output: Path, begin: float, end: float, configuration: hi.RigConfiguration, twin: hi.ParameterSet
) -> hi.ParameterSet | None:
    """Diagnose a part of the recording, print the result, and give its plant if it is better than the twin."""
    # The recording has the contract's columns, signs and units; what is left of the rig's own are its limits.
    own = configuration.format
    limits = hi.LogFormat(voltage_limit=own.voltage_limit, encoder_counts=own.encoder_counts)
    diagnosis, _, held_out = diagnose_paths((path,), (), replace(configuration, format=limits), output, begin, end)
    terminal.print_diagnosis(diagnosis)
    better = results.corrected_parameters(diagnosis)
    gain = results.log_likelihood(diagnosis.plant_after, held_out) - results.log_likelihood(twin.plant(), held_out)
    seconds = sum(log.duration for log in held_out)
    compared = f"makes the last {seconds:.3g} s of the recording likelier by {abs(gain):.3g} nats than the"
    if gain <= 0.0:
        note(f"the twin {compared} diagnosis of the recording, and stays")
        return None
    if drawbacks := [*_drawbacks(diagnosis, better, twin, held_out)]:
        warn(f"the diagnosis of the recording {compared} twin, which stays nevertheless: {'; '.join(drawbacks)}")
        return None
    note(f"the diagnosis of the recording {compared} twin, and replaces it")
    for text in better.doubts:
        warn(text)
    return better


def _drawbacks(
    diagnosis: hi.Diagnosis, better: hi.ParameterSet, twin: hi.ParameterSet, logs: Sequence[hi.Log]
) -> Iterator[str]:
    """Say which gains the diagnosis does not determine, and on which axes it predicts worse than the twin."""
    for name, own in diagnosis.parameters.items():
        if name in online.GAINS and own.determination is tracing.Determination.NOT_DETERMINED:
            yield f"it does not determine {name} ({own.why})"
    both = (results.errors_ahead(own.plant(), logs, better.judged) for own in (twin, better))
    for (_, axis, old), (_, _, new) in zip(*both, strict=True):
        if new.value > old.high:
            worse, than = (results.angle_text(own) for own in (new, old))
            yield f"its error {results.AHEAD[better.judged]} on the {axis} is {worse} mrad, the twin's {than} mrad"


def choose_part(times: Any, events: Sequence[dict[str, Any]]) -> tuple[float, float, str]:
    """Return begin and end [s] of what is diagnosed, and the reason in words.

    It is the longest stretch without a gap, after the last change that was noticed if enough flight follows it.
    """
    if len(times) < 2:
        return 0.0, 0.0, ""
    changes = [event["since_s"] for event in events if event["what"] in ("alarm", "adopted", "rolled back")]
    first, why = times[0], ""
    if changes and times[-1] - changes[-1] >= LEAST_AFTER_CHANGE:
        first, why = changes[-1], f", after the last change at {changes[-1]:.4g} s"
    elif changes:
        why = f"; the rig may have changed within it, at {changes[-1]:.4g} s"
    kept = times[times >= max(first, times[-1] - LONGEST)]
    cuts = np.flatnonzero(np.diff(kept) > (records.GAP_STEPS + 0.5) * np.median(np.diff(times)))
    begins, ends = kept[np.append(0, cuts + 1)], kept[np.append(cuts, len(kept) - 1)]
    longest = int((ends - begins).argmax())
    return float(begins[longest]), float(ends[longest]), why
