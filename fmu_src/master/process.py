"""Run the master in a process of its own.

pythonfmu's binary uses freed memory when the interpreter exits (its issue 229), so that the process sometimes aborts
after the results are complete. The child therefore writes its result, flushes, and leaves by ``os._exit``, which skips
the interpreter's own end. The parent never loads an FMU and survives whatever happens to the child: a crash, an exit,
a call that never returns. The child ends with its parent, however that ends.

Order and answer are JSON and NumPy's format for arrays; nothing is unpickled.
"""

from __future__ import annotations

import faulthandler
import json
import os
import signal
import subprocess
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import numpy as np

from heli_identifier.files import draft_folder
from heli_identifier.platform import NEW_GROUP, end_process, end_with_parent
from heli_identifier.signals import undone

from .. import errors
from ..errors import FmuError, MasterError
from ..variables import Value
from ..wiring import Connection, Scenario, whole_steps
from .result import Bands, Result

PATIENCE = 120.0
"""Longest time without an answer of a unit to a call or to a thousand steps [s]; a unit that takes longer hangs."""


def leave(code: int) -> NoReturn:
    """End a process that has run FMUs: flush, then skip the interpreter's own end."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


class Child(NamedTuple):
    """A process that has been started and waits for its order, one run; it leaves its answer in ``folder``."""

    folder: Path
    process: subprocess.Popen[bytes]


@contextmanager
def waiting_child(progress: bool = False) -> Iterator[Child]:
    """Start a process that imports what a run needs, and waits for its order; it ends with the block.

    Raises
    ------
    OSError
        There is no room for temporary files, or no process can be started.
    """
    with draft_folder() as folder:
        command = [sys.executable, "-m", "fmu_src.master.process", str(folder), str(os.getpid())]
        with (
            subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=None if progress else subprocess.PIPE,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "TMPDIR": str(folder)},
                **NEW_GROUP,  # Ctrl-C is for the parent, which then ends this one
            ) as process,
            undone(partial(end_process, process)),
        ):
            yield Child(folder, process)


def run_apart(
    scenario_name: str | Scenario,
    duration: float,
    step: float = 0.01,
    parameters: Mapping[str, Value] | None = None,
    fmus: Mapping[str, str | Path] | None = None,
    progress: bool = False,
    record: Collection[str] | None = None,
    native: bool = False,
    child: Child | None = None,
) -> Result:
    """Run a scenario in a child process; parameters and result are those of :func:`fmu_src.master.run`.

    ``child`` is one of :func:`waiting_child` that has had no order yet; by default one is started.

    Raises
    ------
    WiringError, MasterError, BuildError
        As ``run``; MasterError also if the child ends without a result, or a unit does not answer.
    OSError
        There is no room for temporary files.
    """
    order = _order(scenario_name, duration, step, parameters or {}, fmus or {}, record)
    order |= {"progress": progress, "native": native}
    if child is not None:
        return _answer(child, order)
    with waiting_child(progress) as new:
        return _answer(new, order)


def run_many_apart(
    scenario_name: str | Scenario,
    duration: float,
    step: float,
    parameters: Mapping[str, Value],
    variations: Sequence[Mapping[str, Value]],
    fmus: Mapping[str, str | Path] | None = None,
    record: Collection[str] | None = None,
) -> Bands:
    """Run a scenario many times in a child process; as :func:`fmu_src.master.loop.run_many`, with its errors."""
    order = _order(scenario_name, duration, step, parameters, fmus or {}, record)
    order["variations"] = [_plain(one) for one in variations]
    with waiting_child() as child:
        return _answer(child, order)


def _order(
    scenario_name: str | Scenario,
    duration: float,
    step: float,
    parameters: Mapping[str, Value],
    fmus: Mapping[str, str | Path],
    record: Collection[str] | None,
) -> dict[str, Any]:
    """Return what both kinds of run are told, as JSON holds it."""
    whole_steps(duration, step)
    return {
        "scenario_name": asdict(scenario_name) if isinstance(scenario_name, Scenario) else scenario_name,
        "duration": float(duration),
        "step": float(step),
        "parameters": _plain(parameters),
        "fmus": {name: os.path.abspath(file) for name, file in fmus.items()},
        "record": None if record is None else list(record),
    }


def _plain(parameters: Mapping[str, Any]) -> dict[str, Value]:
    """Give values that may be NumPy's as JSON holds them."""
    return {name: value.item() if isinstance(value, np.generic) else value for name, value in parameters.items()}


def _answer(child: Child, order: dict[str, Any]) -> Any:
    """Let a child do what is ordered; return the Result or the Bands that it leaves."""
    folder, process = child
    said = process.communicate(json.dumps(order).encode())[1]
    if (folder / "answer.npz").is_file():
        with np.load(folder / "answer.npz", allow_pickle=False) as found:
            values: dict[str, Any] = {
                name: tuple(array.tolist()) if array.dtype.kind == "U" else array if array.ndim else array.item()
                for name, array in found.items()
            }
        return (Bands if "low" in values else Result)(**values)
    if (folder / "problem.json").is_file():
        kind, sentence = json.loads((folder / "problem.json").read_text())
        raise getattr(errors, kind)(sentence)
    hung = folder / "hung"
    given = list(order["fmus"].values())
    raise MasterError(_end(process.returncode, said, hung.is_file() and hung.stat().st_size > 0, given))


def _end(code: int, printed: bytes | None, hung: bool, files: list[str]) -> str:
    """Say how a child ended that gave no answer."""
    if hung:
        how = f"a unit gave no answer within {PATIENCE:g} s and was ended"
    elif code < 0:
        number = -code
        how = f"the process of the units was ended by signal {number} ({signal.strsignal(number)})"
    else:
        how = f"the process of the units ended with code {code} and no result"
    if files:
        return f"{how}; run without --fmu to see which file is at fault, of {', '.join(files)}"
    said = (printed or b"").decode("utf-8", "replace").strip().splitlines()
    return f"{how}: {said[-1][:300] if said else 'it printed no error'}"


def main(folder: Path, parent: int) -> NoReturn:
    """Run in the child: read the order from standard input, write the answer into ``folder``."""
    end_with_parent(parent)
    from .loop import run, run_many

    said = sys.stdin.buffer.read()
    if not said:  # the parent has ended, or needs no run
        leave(0)
    order = json.loads(said)
    if isinstance(wiring := order["scenario_name"], dict):
        wires = [Connection(**wire) for wire in wiring["connections"]]
        order["scenario_name"] = Scenario(**{**wiring, "connections": wires})
    with open(folder / "hung", "w") as hung:

        def alive() -> None:
            faulthandler.dump_traceback_later(PATIENCE, exit=True, file=hung)

        problem = None
        try:
            done = run_many(**order, alive=alive) if "variations" in order else run(**order, alive=alive)
            faulthandler.cancel_dump_traceback_later()
            arrays: dict[str, Any] = {
                name: np.array(value, dtype=str if isinstance(value, tuple) else None)
                for name, value in vars(done).items()
            }
            np.savez(folder / "draft.npz", **arrays)
            os.replace(folder / "draft.npz", folder / "answer.npz")
        except FmuError as error:
            problem = type(error).__name__, str(error)
        except OSError as error:
            problem = "MasterError", f"{error.filename or folder.parent}: {error.strerror or error}"
        except MemoryError:
            problem = "MasterError", "there is not enough memory for the results of this run; take a shorter one"
        faulthandler.cancel_dump_traceback_later()
    if problem is not None:
        (folder / "problem.json").write_text(json.dumps(problem))
    leave(0)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
