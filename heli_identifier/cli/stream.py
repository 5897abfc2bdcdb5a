"""``heli stream``: a log sent as a rig would send it."""

from pathlib import Path
from typing import Annotated

import typer

from heli_identifier.cli.options import Config, Layout

NOTICED = 0.05
"""Delay of the last datagrams [s] from which it is said that the log was sent too slowly."""


def stream(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Measured log to send.", show_default=False)],
    to: Annotated[
        str, typer.Option(metavar="HOST:PORT", help="Where to send it, by UDP, as 127.0.0.1:25000.", show_default=False)
    ],
    speed: Annotated[float, typer.Option(metavar="N", help="How many times faster than the rig was.")] = 1.0,
    layout: Layout = None,
    config: Config = None,
) -> None:
    """Send a log as a running rig would: one datagram per sample, at the log's own instants.

    For trying `heli follow --listen` and the unit RigLink without a rig.
    """
    from heli_identifier.cli.logs import found_configuration, print_notes
    from heli_identifier.cli.terminal import progress_bar, warn
    from heli_identifier.live import USUAL_LAYOUT, read_layout
    from heli_identifier.live.sending import send
    from heli_identifier.records import read_log

    form = read_layout(layout or USUAL_LAYOUT)
    recorded = read_log(log, found_configuration(config).format)
    print_notes((recorded,))
    with progress_bar() as progress:
        late = send(recorded, to, speed, form, progress)
    typer.echo(f"{recorded.samples} samples, {recorded.duration:.4g} s of flight, sent to {to}")
    if late > NOTICED:
        warn(f"the last datagrams were sent {late:.2g} s too late: this computer is too slow for --speed {speed:g}")
