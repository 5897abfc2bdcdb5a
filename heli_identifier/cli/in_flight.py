"""``heli follow``, a twin that follows a rig in flight and corrects itself; ``heli stream``, which sends a log."""

from contextlib import ExitStack
from pathlib import Path

import typer

from heli_identifier.cli import arguments as args
from heli_identifier.cli.arguments import argument, option
from heli_identifier.cli.guard import INTERRUPTED, only_with
from heli_identifier.cli.terminal import note, progress_bar, warn
from heli_identifier.errors import refuse
from heli_identifier.live import Port, read_address
from heli_identifier.processes import undo_at_end

AT_START = "parameters.json of the twin at the start."
UNUSED = "Folder of the flight; it must not hold an earlier one."


@only_with(sender="listen", rate="listen", start="not listen", end="not listen")
def follow(
    log: Path | None = argument(None, "Log to play, in place of a rig.", "LOG"),
    listen: str | None = option(None, "Address of this computer to which the rig sends.", "HOST:PORT"),
    parameters: Path = option(args.PLANT_FILE, AT_START, "FILE", "--parameters", "-p"),
    output: Path = option(Path("flight"), UNUSED, "DIR", "--output", "-o"),
    serve: str | None = option(None, "Show the twin in a browser as well, at this address.", "HOST:PORT"),
    sender: str = option("", "Address of the rig; by default, the first that sends a sample.", "HOST"),
    rate: float | None = option(None, "The rig's sampling rate; by default, found from its time stamps.", "HZ"),
    start: float | None = args.FROM,
    end: float | None = args.TO,
    config: Path | None = args.CONFIG,
) -> None:
    """Follow a rig while it flies: notice that the twin no longer fits, say why, and correct it.

    The rig sends by UDP (--listen), or a log is played as fast as it goes. Ctrl-C ends the flight.

    Writes events.json, recorded.csv, predictions.csv and following.json (the twin's parameters) while it flies; then
    HelicopterPlant.fmu of the twin as it flew last, and what `heli diagnose` writes of the recording, in a folder of
    its own.
    """
    from heli_identifier.cli.flight import catch_interrupt, conclude_flight, open_shows
    from heli_identifier.live.listening import Listening
    from heli_identifier.live.screen import event_line
    from heli_identifier.live.session import IN_USE, Session
    from heli_identifier.live.sources import Player

    one_source = (log is None) != (listen is None)
    refuse(not one_source, "name a log to play, or --listen HOST:PORT for a rig that sends; one of the two.")
    twin = args.read_parameters_and_warn(parameters)
    with ExitStack() as stack:
        source: Player | Listening
        if log is not None:
            ((recorded,), configuration) = args.read_logs_of_rig([log], config, start, end)
            source = Player(recorded)
        else:
            configuration = args.find_configuration(config)
            port = Port(*read_address(str(listen), "--listen", 0), sender)
            stack.callback(port.close)
            source = Listening(port, rate, configuration.format)
            note("listening on {}:{}".format(*port.address))
        title = f"heli follow: {log if log is not None else f'a rig that sends to {listen}'}, twin of {parameters}"
        show = open_shows(stack, title, serve)
        session = Session(output, twin)
        stack.enter_context(undo_at_end(session.close))
        stopped = stack.enter_context(catch_interrupt())
        session.run(source, stopped, show)
        interrupted = stopped()
    typer.echo(f"{session.last_time:.1f} s of flight, {session.recorded.rows} samples")
    for event in session.events:
        typer.echo(event_line(event))
    if any(event["what"] == "adopted" for event in session.events):
        in_use = output / IN_USE
        note(f"`heli design-controller {in_use} --kind pid --axis pitch` says which margins the controller has left")
    if interrupted:
        note("stopped by Ctrl-C; the recording is being diagnosed (Ctrl-C again leaves that out)")
    conclude_flight(session, output, configuration)
    if interrupted:
        raise typer.Exit(INTERRUPTED)


def stream(
    log: Path = argument(..., "Measured log to send.", "LOG"),
    address: str = option(..., "Where to send it, by UDP, as 127.0.0.1:25000.", "HOST:PORT"),
    speed: float = option(1.0, "How many times faster than the rig was.", "N"),
    config: Path | None = args.CONFIG,
) -> None:
    """Send a log as a running rig would: one datagram per sample, at the log's own instants.

    For trying `heli follow --listen` and the unit RigLink without a rig.
    """
    from heli_identifier.live.sources import send

    ((recorded,), _) = args.read_logs_of_rig([log], config)
    with progress_bar() as progress:
        late = send(recorded, address, speed, progress)
    typer.echo(f"{recorded.samples} samples, {recorded.duration:.4g} s of flight, sent to {address}")
    if late > 0.05:
        warn(f"the last datagrams were sent {late:.2g} s too late: this computer is too slow for --speed {speed:g}")
