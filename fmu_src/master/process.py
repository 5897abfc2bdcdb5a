"""Run the master in a separate process.

pythonfmu's binary uses freed memory when the interpreter exits (its issue 229), so that the process sometimes aborts
after the results are complete. The child therefore writes its result, flushes, and leaves by ``os._exit``, which skips
the end of the interpreter. The parent never loads an FMU and survives whatever happens to the child: a crash, an exit,
a call that never returns. The child ends when its parent ends, for whatever reason.
"""

from __future__ import annotations

import faulthandler
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from threading import Thread
from typing import Any, NoReturn

from heli_identifier.files import draft_folder
from heli_identifier.processes import LONGEST_WAIT, NEW_GROUP, end_process, python_command, undo_at_end

from ..errors import FmuError, MasterError
from ..variables import Value
from ..wiring import Scenario
from .result import Result

PATIENCE = 120.0  # a unit that does not answer a call or a thousand steps for so long hangs [s]


def run_apart(
    scenario_name: str | Scenario,
    duration: float,
    step: float = 0.01,
    parameters: Mapping[str, Value] | None = None,
    fmus: Mapping[str, str | Path] | None = None,
    **more: Any,
) -> Result:
    """Run a scenario as :func:`fmu_src.master.run` does, in a separate process.

    MasterError is also raised if the child ends without a result, or a unit hangs.
    """
    order = {"scenario_name": scenario_name, "duration": duration, "step": step, "parameters": parameters, **more}
    with draft_folder() as folder:
        (folder / "order").write_bytes(pickle.dumps(order | {"fmus": fmus}))
        with (
            open(folder / "errors", "wb") as errors,
            subprocess.Popen(
                python_command(f"from {__name__} import main; main()", str(folder)),
                stdin=subprocess.PIPE,  # ends with this process, and then the child does
                stdout=subprocess.DEVNULL,
                stderr=None if more.get("progress") else errors,
                env={**os.environ, "TMPDIR": str(folder)},
                **NEW_GROUP,  # Ctrl-C is for the parent, which then ends this one
            ) as process,
            undo_at_end(partial(end_process, process)),
        ):
            while process.returncode is None:
                with suppress(subprocess.TimeoutExpired):
                    process.wait(LONGEST_WAIT)
        if (folder / "answer").is_file():
            answer = pickle.loads((folder / "answer").read_bytes())
            if isinstance(answer, FmuError):
                raise answer
            return answer
        hung = folder / "hung"
        files = [str(file) for file in (fmus or {}).values()]
        printed = (folder / "errors").read_bytes()
        raise MasterError(_describe_end(process.returncode, printed, hung.is_file() and hung.stat().st_size > 0, files))


def _describe_end(code: int, printed: bytes, hung: bool, files: list[str]) -> str:
    """Return a sentence on how a child without an answer has ended."""
    if hung:
        how = f"a unit gave no answer within {PATIENCE:g} s and was ended"
    elif code < 0:
        how = f"the process of the units was ended by signal {-code} ({signal.strsignal(-code)})"
    else:
        how = f"the process of the units ended with code {code} and no result"
    if files:
        return f"{how}; run without --fmu to see which file is at fault, of {', '.join(files)}"
    lines = printed.decode("utf-8", "replace").strip().splitlines()
    return f"{how}: {lines[-1][:300] if lines else 'it printed no error'}"


def main() -> NoReturn:
    """Run in the child: the first argument is the folder that contains the order and gets the answer."""
    Thread(target=lambda: os._exit(len(os.read(0, 1))), daemon=True).start()  # as soon as the parent has ended
    from . import instance, loop  # load FMI tools

    folder = Path(sys.argv[1])
    order = pickle.loads((folder / "order").read_bytes())
    with open(folder / "hung", "w") as hung:
        instance.restart_watchdog = partial(faulthandler.dump_traceback_later, PATIENCE, exit=True, file=hung)
        try:
            answer: Result | FmuError = loop.run(**order)
        except FmuError as error:
            answer = error
        except OSError as error:
            answer = MasterError(f"{error.filename or folder.parent}: {error.strerror or error}")
        except MemoryError:
            answer = MasterError("there is not enough memory for the results of this run; take a shorter one")
        faulthandler.cancel_dump_traceback_later()
    with open(folder / "draft", "wb") as file:
        pickle.dump(answer, file)
    os.replace(folder / "draft", folder / "answer")
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)
