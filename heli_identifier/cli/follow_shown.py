"""Where a flight is shown: on the terminal, on a page, and in the lines that a command leaves behind."""

import sys
from collections.abc import Iterator
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from heli_identifier.live.listening import Status
    from heli_identifier.live.screen import Show
    from heli_identifier.live.session import Session


def shows(stack: ExitStack, title: str, address: str | None) -> "Show":
    """Open the screen and the page, and return what shows a view on them."""
    places: list[Any] = []
    if address is not None:
        from heli_identifier.cli.terminal import note
        from heli_identifier.live.server import served

        url, board = stack.enter_context(served(address, title))
        note(f"open {url} in a browser")
        places.append(board.show)
    if sys.stderr.isatty():
        from heli_identifier.live.screen import screen

        places.append(stack.enter_context(screen(title)))
    else:
        from heli_identifier.live.screen import Teller

        places.append(Teller())

    def show(view: Any, status: Any) -> None:
        for one in places:
            one(view, status)

    return show


def stream_events(status: "Status", time: float) -> Iterator[dict[str, Any]]:
    """Give the event that says how the samples came in, if any was lost, late, doubled, damaged or somebody else's."""
    from heli_identifier.cli.terminal import counted

    counts = status.counts
    names = {
        "lost": "were lost",
        "late": "came too late",
        "reordered": "were overtaken",
        "duplicated": "came twice",
        "stray": "had a damaged time",
    }
    told = [f"{getattr(counts, name)} {said}" for name, said in names.items() if getattr(counts, name)]
    told += [f"{status.refused} datagrams held no sample"] if status.refused else []
    told += [f"{status.foreign} datagrams came from others"] if status.foreign else []
    told += [f"the rig started anew {counted(counts.restarted, 'time')}"] if counts.restarted else []
    if told:
        why = f"of {counts.received + counts.lost} samples " + ", ".join(told)
        event = {
            "time_s": time,
            "what": "stream",
            "name": "",
            "or": "",
            "axis": "",
            "value": 0.0,
            "standard_error": 0.0,
        }
        yield {**event, "since_s": 0.0, "why": why}


def summary(session: "Session") -> Iterator[str]:
    """Say what happened, in a line for each event but those that were only held."""
    from heli_identifier.live.screen import event_line

    yield f"{session.last_time:.1f} s of flight, {session.recorded.rows} samples"
    for event in session.events:
        yield event_line(event)
