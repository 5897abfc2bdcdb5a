"""``heli follow``, a twin that follows a rig in flight and corrects itself; ``heli stream``, which sends a log."""

import os
import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import heli_identifier as hi
from heli_identifier import results, tools
from heli_identifier.cli import arguments as args
from heli_identifier.cli.arguments import argument, option
from heli_identifier.cli.guard import refuse
from heli_identifier.cli.terminal import note, progress_bar, warn
from heli_identifier.errors import ConfigurationError
from heli_identifier.processes import undone

if TYPE_CHECKING:
    from concurrent.futures import Future

    from heli_identifier.live.listening import Listening
    from heli_identifier.live.session import Show, View
    from heli_plant.parameters import PlantParameters

SERVED_AT = "127.0.0.1:8042"
"""Where the page is shown by default."""

INTERRUPTED = 130
"""Exit code after Ctrl-C, as that of every other command."""

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
    recording, in a folder of its own. The twin is replaced by that if it is better in every respect. After an
    adoption the controller's margins are computed again: control_advice.json, and controller.json with gains that are
    offered, not applied.
    """
    from heli_identifier.cli.after_flight import conclude
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
        stack.callback(adviser.thread.shutdown, wait=False, cancel_futures=True)
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
    conclude(session, output, configuration)
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
    """Judges the controller of a parameters.json, by default the project's PID, in a thread of its own; writes it."""

    def __init__(self, folder: Path, controller: Path | None) -> None:
        from concurrent.futures import ThreadPoolExecutor

        from heli_plant.control import PidSettings

        self.folder = folder
        self.settings = args.controller_of(PidSettings(), controller) if controller else None
        self.thread = ThreadPoolExecutor(1)
        self.asked: Future[tuple[dict[str, Any], hi.ParameterSet | None]] | None = None
        self.sentence = ""

    def ask(self, plant: "PlantParameters", errors: Mapping[str, float], elevation: float) -> None:
        """Have the controller judged around a plant; what was asked before, and has not begun, is left."""
        if self.asked is not None:
            self.asked.cancel()
        self.asked = self.thread.submit(tools.control_advice, plant, dict(errors), elevation, self.settings)

    def look(self, wait: bool = False) -> str:
        """Return what is to be said about the controller now, after a wait for it if asked for; write what is new."""
        from heli_identifier.live.session import ADVICE, GAINS

        if self.asked is not None and (wait or self.asked.done()):
            asked, self.asked = self.asked, None
            try:
                document, gains = asked.result()
                self.sentence = document["sentence"]
                results.write_files(self.folder, {ADVICE: document, **({GAINS: gains} if gains else {})})
            except ConfigurationError as error:
                self.sentence = f"The controller cannot be judged around the changed plant: {error}"
        return self.sentence
