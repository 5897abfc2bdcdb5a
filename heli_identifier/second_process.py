"""A process beside a command that diagnoses: it compiles while the command imports and reads, and draws the report.

Importing, compiling and drawing keep the interpreter to themselves, so that threads gain nothing; a second process
does. It is there for speed alone: if it ends, for whatever reason, the command does the work itself, and says what is
wrong.
"""

import os
import signal
from collections.abc import Mapping
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from types import TracebackType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from heli_identifier.diagnosis.result import Diagnosis

READY = "compiled"
"""What the process says before it gives its page."""

LOST = (EOFError, OSError)
"""What talking to a process that has ended raises."""


class SecondProcess:
    """The process, from the beginning of a ``with`` block to its end; on a single core there is none.

    It says once that the observer is compiled, and answers one order, for a page.
    """

    def __init__(self) -> None:
        self._connection: Connection | None = None

    def __enter__(self) -> "SecondProcess":
        if (os.cpu_count() or 1) > 1:
            with suppress(OSError):  # no more processes are to be had
                self._start()
        return self

    def _start(self) -> None:
        context = get_context("spawn")
        ours, theirs = context.Pipe()
        with theirs:  # closed here, or the process's end would never be noticed on this side
            self.process = context.Process(target=_serve, args=(theirs,), name="heli-second", daemon=True)
            self.process.start()
        self._connection = ours

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._connection is not None:
            self._connection.close()
            self.process.terminate()
            self.process.join()

    def wait_until_compiled(self) -> None:
        """Wait for the observer, unless an earlier run left it, and compile the whitening meanwhile."""
        from heli_identifier.diagnosis.compiling import compile_whitening, observer_is_compiled

        if self._connection is not None and not observer_is_compiled():
            compile_whitening()
            with suppress(*LOST):
                self._connection.recv()

    def report_page(self, diagnosis: "Diagnosis", provenance: Mapping[str, Any], rig: str) -> str:
        """Draw what :func:`heli_identifier.report.page.report_page` draws."""
        page = self._answer_to((diagnosis, dict(provenance), rig))
        if page is None:
            from heli_identifier.report.page import report_page

            return report_page(diagnosis, provenance, rig)
        return page

    def _answer_to(self, order: tuple[Any, ...]) -> str | None:
        """Give an order and wait for the answer; None if there is no process, or no more."""
        if self._connection is None:
            return None
        try:
            self._connection.send(order)
            while (answer := self._connection.recv()) == READY:
                pass
        except LOST:
            return None
        return str(answer)


def _serve(connection: Connection) -> None:
    """Do the second process's work; an error ends it, and the command meets the same one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the command hears it, and ends this process
    try:
        from heli_identifier.diagnosis import compiling

        if not compiling.observer_is_compiled():
            compiling.compile_observer()
        connection.send(READY)
        if not compiling.judgement_is_compiled():
            compiling.compile_judgement()
        from heli_identifier.report.page import report_page

        connection.send(report_page(*connection.recv()))
    except Exception:
        return
