"""Run the master in a separate process.

pythonfmu's binary uses freed memory when the interpreter exits (its issue 229), so that the process sometimes aborts
after the results are complete; :func:`heli_identifier.processes.call_apart` skips the end of the interpreter. The
parent never loads an FMU and survives whatever happens to the child: a crash, an exit, a call that never returns.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from heli_identifier.files import draft_folder
from heli_identifier.processes import NoAnswer, call_apart

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
        try:
            return call_apart(
                folder, _run, order | {"fmus": fmus}, str(folder.parent), error=FmuError, patience=PATIENCE,
                shows_errors=bool(more.get("progress")),
            )  # fmt: skip
        except NoAnswer as end:
            how, printed = end.args
    if fmus:
        printed = f"run without --fmu to see which file is at fault, of {', '.join(map(str, fmus.values()))}"
    raise MasterError(f"the process of the units {how}{'; ' if fmus else ': '}{printed}")


def _run(order: Mapping[str, Any], place: str) -> Result:
    """Run in the child, which alone loads FMI tools; ``place`` is the folder of its temporary files."""
    from . import loop

    try:
        return loop.run(**order)
    except OSError as error:
        raise MasterError(f"{error.filename or place}: {error.strerror or error}") from error
    except MemoryError as error:
        raise MasterError("there is not enough memory for the results of this run; take a shorter one") from error
