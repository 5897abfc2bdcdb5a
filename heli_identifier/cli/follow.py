"""``heli follow``: a twin that follows a rig in flight and corrects itself."""

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from heli_identifier.cli.options import Config, From, Layout, To

if TYPE_CHECKING:
    from heli_identifier.live.screen import Show
    from heli_identifier.live.session import Session
    from heli_identifier.records import RigConfiguration

SERVED_AT = "127.0.0.1:8042"
"""Where the page is shown by itself."""

INTERRUPTED = 130
"""Exit code after Ctrl-C, as that of every other command."""


def follow(
    log: Annotated[
        Path | None, typer.Argument(metavar="[LOG]", help="Log to play, in place of a rig.", show_default=False)
    ] = None,
    listen: Annotated[
        str | None,
        typer.Option(metavar="HOST:PORT", help="Address of this computer to which the rig sends.", show_default=False),
    ] = None,
    parameters: Annotated[
        Path, typer.Option("--parameters", "-p", metavar="FILE", help="parameters.json of the twin at the start.")
    ] = Path("parameters.json"),
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of the flight; without an earlier one in it.")
    ] = Path("flight"),
    speed: Annotated[
        float | None,
        typer.Option(metavar="N", help="Play the log N times faster; 0: as fast as it goes.", show_default=False),
    ] = None,
    serve: Annotated[
        bool, typer.Option("--serve", help="Show the twin in a browser on this computer as well.")
    ] = False,
    serve_at: Annotated[
        str, typer.Option("--serve-at", metavar="HOST:PORT", help="Where --serve shows it.")
    ] = SERVED_AT,
    sender: Annotated[
        str,
        typer.Option(
            metavar="HOST[:PORT]", help="The rig; by itself, the first that sends a sample.", show_default=False
        ),
    ] = "",
    layout: Layout = None,
    rate: Annotated[
        float | None,
        typer.Option(
            metavar="HZ", help="The rig's sampling rate; by itself, found from its time stamps.", show_default=False
        ),
    ] = None,
    controller: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Parameters of the PidController that flies the rig; by itself, those of the unit.",
            show_default=False,
        ),
    ] = None,
    start: From = None,
    end: To = None,
    config: Config = None,
) -> None:
    """Follow a rig while it flies: notice that the twin no longer fits, say why, correct it, and say so.

    The rig sends by UDP (--listen), or a log is played. Ctrl-C ends the flight.

    Writes events.json, recorded.csv, predictions.csv and following.json (the twin's parameters) while it flies, and
    then what `heli diagnose` writes of the recording. After an adoption the controller's margins are computed anew:
    control_advice.json, and controller.json with gains that are offered, not applied.
    """
    from heli_identifier.cli.follow_advice import Adviser, controller_of
    from heli_identifier.cli.follow_end import conclude
    from heli_identifier.cli.follow_shown import shows, summary
    from heli_identifier.cli.logs import found_configuration
    from heli_identifier.cli.terminal import note
    from heli_identifier.errors import ConfigurationError
    from heli_identifier.live.session import Session, check_unused
    from heli_identifier.results import read_parameters

    if (log is None) == (listen is None):
        raise ConfigurationError("name a log to play, or --listen HOST:PORT for a rig that sends; one of the two.")
    if listen is None and (sender or layout or rate is not None):
        raise ConfigurationError("--sender, --layout and --rate belong to --listen.")
    if log is None and (speed is not None or start is not None or end is not None):
        raise ConfigurationError("--speed, --from and --to belong to a log; a rig sends at its own pace.")
    if serve_at != SERVED_AT and not serve:
        raise ConfigurationError("--serve-at says where --serve shows the twin; add --serve.")
    for read in (parameters, controller):
        if read is not None and os.path.realpath(read.parent) == os.path.realpath(output):
            raise ConfigurationError(
                f"{read} lies in the folder of the flight, whose files would replace it; name another folder."
            )
    check_unused(output)
    twin, adviser = read_parameters(parameters), Adviser(output, controller_of(controller))
    configuration = found_configuration(config)
    with ExitStack() as stack:
        if log is not None:
            source = _player(log, configuration, 1.0 if speed is None else speed, start, end)
        else:
            source = _listener(stack, str(listen), sender, layout, rate, configuration)
        title = f"heli follow: {log if log is not None else f'a rig that sends to {listen}'}, twin of {parameters}"
        show = shows(stack, title, serve_at if serve else None)
        session = Session(output, twin, adviser.ask)
        stack.callback(session.close)
        stack.callback(adviser.close)
        stopped = stack.enter_context(first_interrupt())

        def show_all(view: Any, status: Any) -> None:
            session.notice = adviser.look()
            show(view, status)

        source(session, stopped, show_all)
        interrupted = stopped()
        session.notice = adviser.look(wait=True)
    for line in summary(session):
        typer.echo(line)
    if session.notice:
        typer.echo(session.notice)
    if interrupted:
        note("stopped by Ctrl-C; the recording is being diagnosed (Ctrl-C again leaves that out)")
    conclude(session, output, configuration)
    if interrupted:
        raise typer.Exit(INTERRUPTED)


def _player(
    path: Path, configuration: "RigConfiguration", speed: float, start: float | None, end: float | None
) -> "Callable[[Session, Callable[[], bool], Show], None]":
    """Return a function that lets a session follow a log."""
    from heli_identifier.cli.logs import print_notes
    from heli_identifier.errors import require_range
    from heli_identifier.live.playing import played
    from heli_identifier.live.sending import SPEEDS
    from heli_identifier.records import read_log

    if speed != 0.0:
        require_range("--speed", speed, "times real time", *SPEEDS)
    recorded = read_log(path, configuration.format, start, end)
    print_notes((recorded,))

    def run(session: "Session", stopped: Callable[[], bool], show: "Show") -> None:
        session.run(played(recorded, speed, session.keep), lambda: recorded.step, stopped, show)

    return run


def _listener(
    stack: ExitStack,
    listen: str,
    sender: str,
    layout: str | None,
    rate: float | None,
    configuration: "RigConfiguration",
) -> "Callable[[Session, Callable[[], bool], Show], None]":
    """Open the port and return a function that lets a session follow what comes in."""
    from heli_identifier.cli.follow_shown import stream_events
    from heli_identifier.cli.terminal import note
    from heli_identifier.errors import ConfigurationError
    from heli_identifier.live import USUAL_LAYOUT, Port, read_address, read_layout
    from heli_identifier.live.listening import Listening, check_rate

    address, number = read_address(listen, "--listen")
    if number < 0:
        raise ConfigurationError(f"--listen {listen} names no port; give HOST:PORT, as 127.0.0.1:25000.")
    form = read_layout(layout or USUAL_LAYOUT)
    check_rate(form, rate)
    port = Port(address, number, sender, form)
    stack.callback(port.close)
    note(f"listening on {port.address[0]}:{port.address[1]}")

    def run(session: "Session", stopped: Callable[[], bool], show: "Show") -> None:
        rig = Listening(port, rate, configuration.format, session.keep)
        session.run(rig.instants(), lambda: 1.0 / (rig.rate or 1.0), stopped, show, lambda: rig.status)
        for event in stream_events(rig.status, session.time):
            session.say(event)

    return run


@contextmanager
def first_interrupt() -> Iterator[Callable[[], bool]]:
    """Give a function that says whether Ctrl-C has asked the block to end; a second one ends the command at once."""
    import signal

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
