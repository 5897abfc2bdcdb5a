"""``heli follow``, a twin that follows a rig in flight and corrects itself; ``heli stream``, which sends a log."""

import os
import signal
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import heli_identifier as hi
from heli_identifier import online, records, results, tools, tracing
from heli_identifier.cli import arguments as args
from heli_identifier.cli import terminal
from heli_identifier.cli.arguments import argument, option
from heli_identifier.cli.guard import refuse
from heli_identifier.cli.terminal import note, note_written, progress_bar, warn
from heli_identifier.errors import ConfigurationError, IdentifierError
from heli_identifier.files import write_atomically
from heli_identifier.processes import end_with_parent, undone, unheard
from heli_identifier.provenance import from_command_line

if TYPE_CHECKING:
    from concurrent.futures import Future, ProcessPoolExecutor

    from heli_identifier.live.listening import Listening
    from heli_identifier.live.session import Session, Show, View
    from heli_plant.parameters import PlantParameters

SERVED_AT = "127.0.0.1:8042"
"""Where the page is shown by default."""

INTERRUPTED = 130
"""Exit code after Ctrl-C, as that of every other command."""

ADVICE, GAINS = "control_advice.json", "controller.json"
"""Files: how the margins stand, and the gains that are offered, as parameters of the PidController."""

RATE = "The rig's sampling rate; by default, found from its time stamps."


def follow(
    log: Annotated[Path | None, argument("Log to play, in place of a rig.", "LOG")] = None,
    listen: Annotated[
        str | None, option("Address of this computer to which the rig sends.", metavar="HOST:PORT")
    ] = None,
    parameters: Annotated[
        Path, option("parameters.json of the twin at the start.", "--parameters", "-p", metavar="FILE")
    ] = args.PLANT_FILE,
    output: Annotated[
        Path, option("Folder of the flight; without an earlier one in it.", "--output", "-o", metavar="DIR")
    ] = Path("flight"),
    speed: Annotated[float | None, option("Play the log N times faster; 0: as fast as it goes.", metavar="N")] = None,
    serve: Annotated[bool, option("Show the twin in a browser on this computer as well.", "--serve")] = False,
    serve_at: Annotated[str, option("Where --serve shows it.", "--serve-at", metavar="HOST:PORT")] = SERVED_AT,
    sender: Annotated[str, option("The rig; by default, the first that sends a sample.", metavar="HOST[:PORT]")] = "",
    layout: args.Layout = None,
    rate: Annotated[float | None, option(RATE, metavar="HZ")] = None,
    controller: args.Controller = None,
    start: args.From = None,
    end: args.To = None,
    config: args.Config = None,
) -> None:
    """Follow a rig while it flies: notice that the twin no longer fits, say why, correct it, and say so.

    The rig sends by UDP (--listen), or a log is played. Ctrl-C ends the flight.

    Writes events.json, recorded.csv, predictions.csv and following.json (the twin's parameters) while it flies; then
    parameters.json and HelicopterPlant.fmu of the twin as it flew last, and what `heli diagnose` writes of the
    recording, in a folder of its own. The twin is replaced by that if the recording says that it is better. After an
    adoption the controller's margins are computed again: control_advice.json, and controller.json with gains that are
    offered, not applied.
    """
    from heli_identifier.live.screen import event_line
    from heli_identifier.live.session import Session, check_unused
    from heli_identifier.live.sources import Player

    one = (log is None) != (listen is None)
    refuse(not one, "name a log to play, or --listen HOST:PORT for a rig that sends; one of the two.")
    of_rig = bool(sender or layout or rate is not None)
    refuse(listen is None and of_rig, "--sender, --layout and --rate belong to --listen.")
    of_log = any(value is not None for value in (speed, start, end))
    refuse(log is None and of_log, "--speed, --from and --to belong to a log; a rig sends at its own pace.")
    refuse(serve_at != SERVED_AT and not serve, "--serve-at says where --serve shows the twin; add --serve.")
    for read in (parameters, controller):
        inside = read is not None and os.path.realpath(read.parent) == os.path.realpath(output)
        refuse(inside, f"{read} lies in the folder of the flight, whose files would replace it; name another folder.")
    check_unused(output)
    twin, adviser = args.read_with_doubts(parameters), Adviser(output, controller)
    with ExitStack() as stack:
        source: Player | Listening
        if log is not None:
            ((recorded,), configuration) = args.logs_of([log], config, start, end)
            source = Player(recorded, 1.0 if speed is None else speed)
        else:
            configuration = args.found_configuration(config)
            source = _listener(stack, str(listen), sender, layout, rate, configuration)
        title = f"heli follow: {log if log is not None else f'a rig that sends to {listen}'}, twin of {parameters}"
        show = _shows(stack, title, serve_at if serve else None)
        session = Session(output, twin, adviser.ask)
        stack.enter_context(undone(session.close))
        stack.callback(adviser.close)
        stopped = stack.enter_context(first_interrupt())

        def show_all(view: "View") -> None:
            session.notice = adviser.look()
            show(view)

        session.run(source, stopped, show_all)
        interrupted = stopped()
        session.notice = adviser.look(wait=True)
    typer.echo(f"{session.last_time:.1f} s of flight, {session.recorded.rows} samples")
    for event in session.events:
        typer.echo(event_line(event))
    if session.notice:
        typer.echo(session.notice)
    if interrupted:
        note("stopped by Ctrl-C; the recording is being diagnosed (Ctrl-C again leaves that out)")
    _conclude(session, output, configuration)
    if interrupted:
        raise typer.Exit(INTERRUPTED)


def stream(
    log: Annotated[Path, argument("Measured log to send.", "LOG")],
    to: Annotated[str, option("Where to send it, by UDP, as 127.0.0.1:25000.", metavar="HOST:PORT")],
    speed: Annotated[float, option("How many times faster than the rig was.", metavar="N")] = 1.0,
    layout: args.Layout = None,
    config: args.Config = None,
) -> None:
    """Send a log as a running rig would: one datagram per sample, at the log's own instants.

    For trying `heli follow --listen` and the unit RigLink without a rig.
    """
    from heli_identifier.live import USUAL_LAYOUT, read_layout
    from heli_identifier.live.sources import send

    form = read_layout(layout or USUAL_LAYOUT)
    ((recorded,), _) = args.logs_of([log], config)
    with progress_bar() as progress:
        late = send(recorded, to, speed, form, progress)
    typer.echo(f"{recorded.samples} samples, {recorded.duration:.4g} s of flight, sent to {to}")
    if late > 0.05:
        warn(f"the last datagrams were sent {late:.2g} s too late: this computer is too slow for --speed {speed:g}")


# --- where samples come from, and where the flight is shown ----------------------------------------------------------


def _listener(
    stack: ExitStack, listen: str, sender: str, layout: str | None, rate: float | None, config: "hi.RigConfiguration"
) -> "Listening":
    """Open the port at which the rig is heard."""
    from heli_identifier.live import USUAL_LAYOUT, Port, read_address, read_layout
    from heli_identifier.live.listening import Listening, check_rate

    address, number = read_address(listen, "--listen", 0)
    form = read_layout(layout or USUAL_LAYOUT)
    check_rate(form, rate)
    port = Port(address, number, sender, form)
    stack.callback(port.close)
    note(f"listening on {port.address[0]}:{port.address[1]}")
    return Listening(port, rate, config.format)


def _shows(stack: ExitStack, title: str, address: str | None) -> "Show":
    """Open the screen and the page, and return what shows a view on them."""
    from heli_identifier.live.screen import print_events, screen

    places: list[Show] = []
    if address is not None:
        from heli_identifier.live.page import served

        url, shown = stack.enter_context(served(address, title))
        note(f"open {url} in a browser")
        places.append(shown)
    places.append(stack.enter_context(screen(title)) if sys.stderr.isatty() else print_events())

    def show(view: "View") -> None:
        for one in places:
            one(view)

    return show


@contextmanager
def first_interrupt() -> Iterator[Callable[[], bool]]:
    """Give a function that says whether Ctrl-C has asked the block to end; a second one ends the command at once."""
    asked = False
    before = signal.getsignal(signal.SIGINT)

    def ask(number: int, frame: Any) -> None:
        nonlocal asked
        asked = True
        signal.signal(signal.SIGINT, before)

    if before != signal.SIG_IGN:
        signal.signal(signal.SIGINT, ask)
    try:
        yield lambda: asked
    finally:
        signal.signal(signal.SIGINT, before)


# --- the controller after a change: judged beside the loop, gains offered, never applied -----------------------------


class Adviser:
    """Judges the controller of a parameters.json, by default the project's PID, in a process of its own; writes it."""

    def __init__(self, folder: Path, controller: Path | None) -> None:
        from heli_plant.control import PidSettings

        self.folder = folder
        self.settings = args.controller_of(PidSettings(), controller) if controller else None
        self.pool: ProcessPoolExecutor | None = None
        self.asked: Future[tuple[dict[str, Any], hi.ParameterSet | None]] | None = None
        self.sentence = ""

    def ask(self, plant: "PlantParameters", errors: Mapping[str, float], elevation: float) -> None:
        """Have the controller judged around a plant; what was asked before is left."""
        from concurrent.futures import ProcessPoolExecutor
        from multiprocessing import get_context

        self.close()
        with unheard(signal.SIGINT):  # Ctrl-C is for the command
            self.pool = ProcessPoolExecutor(1, get_context("spawn"), end_with_parent, (os.getpid(),))
            self.asked = self.pool.submit(tools.control_advice, plant, dict(errors), elevation, self.settings)

    def look(self, wait: bool = False) -> str:
        """Return what is to be said about the controller now, after a wait for it if asked for; write what is new."""
        from concurrent.futures import BrokenExecutor

        if self.asked is not None and (wait or self.asked.done()):
            asked, self.asked = self.asked, None
            try:
                document, gains = asked.result()
            except ConfigurationError as error:
                self.sentence = f"The controller cannot be judged around the changed plant: {error}"
            except BrokenExecutor:
                self.sentence = (
                    "The controller was not judged around the changed plant: the process that does so was ended from "
                    "outside, for want of memory perhaps. `heli linearise` does it afterwards."
                )
            else:
                self.sentence = document["sentence"]
                write_atomically(self.folder / ADVICE, results.document_text(document))
                if gains is not None:
                    replace(gains, provenance=from_command_line()).write(self.folder / GAINS)
        return self.sentence

    def close(self) -> None:
        """Let the process end, at once or with the question that it is at."""
        if self.pool is not None:
            self.pool.shutdown(wait=False, cancel_futures=True)


# --- the end of a flight: its recording is diagnosed -----------------------------------------------------------------

LONGEST = 600.0
"""The end of a recording that is diagnosed [s]; more takes long and adds little."""

DIAGNOSIS = "diagnosis"
"""Folder of the recording's diagnosis."""

LEAST_AFTER_CHANGE = 30.0
"""Time after the last change from which on only that is diagnosed [s]: the rig before was another one."""


def _conclude(session: "Session", folder: Path, configuration: "hi.RigConfiguration") -> None:
    """Diagnose the recording; leave parameters and unit of the twin, or of the recording's plant if that is better."""
    import numpy as np

    from heli_identifier.live.session import EVENTS, IN_USE, PREDICTIONS, RECORDED

    twin, path, better = session.in_use(), folder / RECORDED, None
    twin.write(folder / IN_USE)
    _deliver(twin, folder)
    few = path.read_bytes().count(b"\n", 0, 4096) < 2
    times = np.zeros(0) if few else np.loadtxt(path, delimiter=",", skiprows=1, usecols=0, ndmin=1)
    begin, end, why = part(times, session.events)
    if end - begin < tools.SHORTEST_TO_SPLIT:
        note(f"{end - begin:.3g} s without a gap are too short for a diagnosis")
    else:
        note(f"diagnosed: {begin:.4g} s to {end:.4g} s of {path}{why}")
        try:
            better = _diagnosed_plant(path, folder, begin, end, configuration, twin)
        except IdentifierError as error:
            warn(f"the recording cannot be diagnosed: {error}")
    names = [name for name in (EVENTS, RECORDED, PREDICTIONS, IN_USE, ADVICE, GAINS) if (folder / name).is_file()]
    names += ["parameters.json", f"{twin.unit}.fmu"]
    if better is None:
        note_written(folder, names, ", as the twin flew last")
    else:
        _deliver(better, folder)
        note_written(folder, (*names, *(f"{DIAGNOSIS}/{name}" for name in results.RESULTS)))


def _deliver(plant: "hi.ParameterSet", folder: Path) -> None:
    """Write the parameters and the unit of a plant."""
    with results.whole_folder(folder) as draft:
        plant.write(draft / "parameters.json")
        hi.build(plant.unit, draft, plant)


def _diagnosed_plant(
    path: Path, folder: Path, begin: float, end: float, configuration: "hi.RigConfiguration", twin: "hi.ParameterSet"
) -> "hi.ParameterSet | None":
    """Diagnose a part of the recording, print the result, and give its plant if it is better than the twin."""
    from heli_identifier.cli.on_logs import diagnosed

    # The recording has the contract's columns, signs and units; what is left of the rig's own are its limits.
    own = configuration.format
    limits = hi.LogFormat(voltage_limit=own.voltage_limit, encoder_counts=own.encoder_counts)
    rig = replace(configuration, format=limits)
    diagnosis, _, held_out = diagnosed((path,), (), rig, folder / DIAGNOSIS, begin, end)
    terminal.print_diagnosis(diagnosis)
    gain = tracing.log_likelihood(diagnosis.plant_after, held_out) - tracing.log_likelihood(twin.plant(), held_out)
    seconds = sum(log.duration for log in held_out)
    compared = f"makes the last {seconds:.3g} s of the recording likelier by {abs(gain):.3g} nats than the"
    if gain <= 0.0:
        note(f"the twin {compared} diagnosis of the recording, and stays")
        return None
    note(f"the diagnosis of the recording {compared} twin, and replaces it")
    better = results.corrected_parameters(diagnosis)
    for text in (*better.doubts, *_drawbacks(diagnosis, better, twin, held_out)):
        warn(f"although it replaces the twin, {text}")
    return better


def _drawbacks(
    diagnosis: "hi.Diagnosis", better: "hi.ParameterSet", twin: "hi.ParameterSet", logs: "Sequence[hi.Log]"
) -> Iterator[str]:
    """Say which gains the diagnosis does not determine, and on which axes it predicts worse than the twin."""
    for name, own in diagnosis.parameters.items():
        if name in online.GAINS and own.determination is tracing.Determination.NOT_DETERMINED:
            yield f"it does not determine {name}: {own.why}"
    limits = dict.fromkeys(better.expected, inf)
    both = (tracing.hold_to(own.plant(), limits, logs, better.judged) for own in (twin, better))
    for old, new in zip(*both, strict=True):
        if new.error.value > old.error.high:
            worse, than = (results.angle_text(own.error) for own in (new, old))
            yield f"the {new.axis}'s error {results.AHEAD[better.judged]} is {worse} mrad, the twin's {than} mrad"


def part(times: Any, events: Sequence[dict[str, Any]]) -> tuple[float, float, str]:
    """Return begin and end [s] of what is diagnosed, and the reason in words.

    It is the longest stretch without a gap, after the last change that was noticed if enough flight follows it.
    """
    import numpy as np

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
