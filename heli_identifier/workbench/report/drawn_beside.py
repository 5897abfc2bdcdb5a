"""The report drawn by a process beside the command: it imports what draws while the command still computes.

Importing and drawing keep the interpreter to themselves, so that a thread would gain nothing. The process is there for
speed alone: if it ends, for whatever reason, the command draws the report itself.
"""

import gc
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import fields
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from heli_identifier.tracing import Diagnosis

Draw = Callable[["Diagnosis", Mapping[str, Any], str], str]
"""As :func:`heli_identifier.workbench.report.page.report_page`."""


@contextmanager
def drawn_beside() -> Iterator[Draw]:
    """Start the process, and give a function that has it draw one report; the process ends with the block.

    On a single core, or where no process can be started, the function draws the report itself.
    """
    process = _started() if (os.cpu_count() or 1) > 1 else None
    try:
        yield lambda diagnosis, provenance, rig: _page(process, diagnosis, provenance, rig)
    finally:
        if process is not None:
            _end(process)
            with process:  # closes its pipes and waits for its end
                pass


def _end(process: "subprocess.Popen[bytes]") -> None:
    """Kill the process, and the copy of itself that may draw half of the figures."""
    if process.poll() is None and hasattr(os, "killpg"):
        os.killpg(process.pid, signal.SIGKILL)  # it began a session, so that its group has its number
    else:
        process.kill()


def _started() -> "subprocess.Popen[bytes] | None":
    with suppress(OSError):
        return subprocess.Popen(
            [sys.executable, "-m", __name__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,  # what is wrong with a diagnosis, the command says when it draws it itself
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            start_new_session=True,  # Ctrl-C is for the command, which then ends this process
        )
    return None


def _page(
    process: "subprocess.Popen[bytes] | None", diagnosis: "Diagnosis", provenance: Mapping[str, Any], rig: str
) -> str:
    """Let the process draw, or draw here."""
    if process is not None:
        from heli_identifier.tracing import Diagnosis

        # the plain value: the class of `import heli_identifier` would have the process import all that a search needs
        plain = Diagnosis(**{entry.name: getattr(diagnosis, entry.name) for entry in fields(Diagnosis)})
        page = process.communicate(pickle.dumps((plain, dict(provenance), rig)))[0]
        if process.returncode == 0:
            return page.decode()
    return drawn_here(diagnosis, provenance, rig)


def drawn_here(diagnosis: "Diagnosis", provenance: Mapping[str, Any], rig: str) -> str:
    """Draw a report in this process."""
    from heli_identifier.workbench.report.page import report_page  # late: what draws takes .4 s to import

    return report_page(diagnosis, provenance, rig)


def main() -> None:
    """Import what draws, read one diagnosis from standard input, and write its report to standard output."""
    gc.disable()  # this process ends long before cycles fill its memory
    from heli_identifier.workbench.report.halved import halved
    from heli_identifier.workbench.report.page import prepare, report_page

    prepare()
    order = sys.stdin.buffer.read()
    if order:  # nothing comes if the command has ended
        diagnosis, provenance, rig = pickle.loads(order)
        sys.stdout.buffer.write(report_page(diagnosis, provenance, rig, each=halved).encode())
    sys.stdout.flush()
    os._exit(0)  # there is nothing to tidy up, which would take a tenth of a second


if __name__ == "__main__":
    main()
