"""Run the master in a process of its own.

pythonfmu's binary uses freed memory when the interpreter exits (its issue 229), so that the process sometimes aborts
after the results are complete. The child therefore writes its result, flushes, and leaves by ``os._exit``, which skips
the interpreter's own end. The parent never loads an FMU and survives whatever happens to the child.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Collection, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NoReturn

from .. import errors
from ..errors import FmuError, MasterError
from ..variables import Value
from ..wiring import Scenario
from .result import Result


def leave(code: int) -> NoReturn:
    """End a process that has run FMUs: flush, then skip the interpreter's own end."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def run_apart(
    scenario_name: str | Scenario,
    duration: float,
    step: float = 0.01,
    parameters: Mapping[str, Value] | None = None,
    fmus: Mapping[str, str | Path] | None = None,
    progress: bool = False,
    record: Collection[str] | None = None,
    native: bool = False,
) -> Result:
    """Run a scenario in a child process; parameters and result are those of :func:`fmu_src.master.run`.

    Raises
    ------
    WiringError, MasterError, BuildError
        As ``run``; MasterError also if the child ends without a result.
    """
    files = {name: str(Path(file).absolute()) for name, file in (fmus or {}).items()}
    order = (scenario_name, duration, step, dict(parameters or {}), files, progress, record, native)
    with TemporaryDirectory(prefix="heli-run-") as folder:
        answer = Path(folder) / "answer"
        child = subprocess.run(
            [sys.executable, "-m", "fmu_src.master.process", str(answer)],
            input=pickle.dumps(order),
            stdout=subprocess.DEVNULL,
            stderr=None if progress else subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            check=False,
        )
        if not answer.is_file():
            said = (child.stderr or b"").decode("utf-8", "replace").strip()[-2000:]
            raise MasterError(
                f"the process of the master ended with code {child.returncode} and no result: "
                f"{said or 'it printed no error'}"
            )
        problem, content = pickle.loads(answer.read_bytes())
    if problem is not None:
        raise getattr(errors, problem)(content)
    return Result(*content)


def main(answer: Path) -> NoReturn:
    """Run in the child: read the order from standard input, write the answer to a file."""
    from .loop import run

    order = pickle.loads(sys.stdin.buffer.read())
    try:
        result = run(*order)
        content = None, (result.names, result.units, result.time, result.values, result.seconds)
    except FmuError as problem:
        content = type(problem).__name__, str(problem)  # type: ignore[assignment]
    answer.write_bytes(pickle.dumps(content))
    leave(0)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
