"""The common base of all units: it keeps a pythonfmu unit from crashing its host and from wrong results.

* No exception leaves a callback: pythonfmu makes fmi2Fatal of it, and after the second one the next call is a
  segmentation fault. Every exception is caught and logged with its text, and a step is refused with fmi2Discard.
* NaN, infinities and values out of range are refused. ``fmi2SetReal`` of a pythonfmu unit cannot answer anything but
  fmi2OK or fmi2Fatal; therefore a bad value is logged and ignored, and steps are refused until the variable has a
  good value.
* Parameters are read when the initialisation ends. A fixed parameter that is set later is logged and ignored.
* A step that does not begin where the one before ended is refused: the state would belong to another time. Units
  whose outputs follow from the time alone take it.
* Saving and restoring takes the whole state (:meth:`fmu_src.lifecycle.Lifecycle.saved`). pythonfmu alone saves the
  registered variables, so that a hidden integrator would roll back wrong.

``set_real``, ``do_step`` and ``get_real`` are called in every communication step. They have a short way for a unit
that is stepping and has no refused value (``_steady``); everything else takes the thorough way.
"""

from __future__ import annotations

import json
import sys
from math import isfinite
from traceback import format_exc
from typing import Any, ClassVar

from pythonfmu.enums import Fmi2Status
from pythonfmu.fmi2slave import Fmi2Slave

from .errors import Refusal
from .lifecycle import INITIALISING, INSTANTIATED, STEPPING, TERMINATED, Lifecycle

LONGEST_STEP = 1e9
"""Communication steps must be shorter [s]; this also keeps infinity out."""

MOST_SUBSTEPS = 100_000
"""Steps that a unit takes inside of one communication step: some seconds of computing. More are refused, because a
mistaken step of days would keep the host waiting for as long."""

CLOCK_TOLERANCE = 1e-3
"""Distance of a step's begin from the end of the step before, as a share of the step, that hosts' rounding explains."""

_WHOLE_UNIT = -1
"""Key of a refusal that belongs to no single variable."""

_BLANKS = {"Real": float("nan"), "Integer": 0, "Boolean": False, "String": ""}
"""Value that is returned for a variable that does not exist."""


class SlaveBase(Lifecycle, Fmi2Slave):
    """A co-simulation unit that never raises through the C boundary."""

    summary: ClassVar[str] = ""
    equations: ClassVar[str] = ""
    source: ClassVar[str] = ""
    has_past: ClassVar[bool] = True
    """Whether outputs depend on earlier steps; if not, a step may begin at any time."""
    saves_state: ClassVar[bool] = True
    """Whether the state can be saved and restored; if not, ``freeze`` refuses."""

    def __init__(self, **kwargs: Any) -> None:
        Fmi2Slave.__init__(self, **kwargs)
        Lifecycle.__init__(self)
        self._pick_reals = self.table.pickers["Real"]
        self._remove_repeated_path_entries()

    def _remove_repeated_path_entries(self) -> None:
        """Remove the copies of the resources' folder that the binary adds to ``sys.path`` with every instance."""
        if self.resources and sys.path.count(self.resources) > 1:
            first = sys.path.index(self.resources)
            sys.path[first + 1 :] = [entry for entry in sys.path[first + 1 :] if entry != self.resources]

    # From instantiation to the first step, and the end

    def setup_experiment(self, start_time: float, stop_time: float | None = None, tolerance: float | None = None):
        """Keep the start time [s]; once the initialisation has begun it stays what it is."""
        if self.phase != INSTANTIATED or not isfinite(start_time):
            self._report(
                "setupExperiment",
                Refusal(
                    f"the start time {start_time!r} s was ignored: it must be finite, "
                    "and set before the initialisation begins"
                ),
            )
            return
        self.start_time = start_time

    def enter_initialization_mode(self) -> None:
        """Start the initialisation; outputs may be read from now on."""
        if self._is_in(INSTANTIATED, "enterInitializationMode"):
            self.enter(INITIALISING)

    def exit_initialization_mode(self) -> None:
        """Fix the parameters and compute the outputs at the start time."""
        if not self._is_in(INITIALISING, "exitInitializationMode"):
            return
        try:
            self.prepare()
        except BaseException as problem:
            self._report("exitInitializationMode", problem)
            self.table.refused[_WHOLE_UNIT] = f"{problem} (the initialisation failed; reset the unit)"
        self.enter(STEPPING)

    def _is_in(self, phase: str, call: str) -> bool:
        """Whether the unit is in the phase that a call needs; log the call as ignored if it is not."""
        if self.phase != phase:
            self._report(call, Refusal(f"it is not allowed while the unit is {self.phase}, and was ignored"))
        return self.phase == phase

    def terminate(self) -> None:
        """Refuse all further steps."""
        self.enter(TERMINATED)

    # Every step

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set Real variables; log and ignore values out of range."""
        try:
            limits, mine = self.table.real_limits, self.values
            for reference, value in zip(vrs, values, strict=True):
                low, high = limits[reference]
                if not low <= value <= high:  # true of a NaN as well
                    break
                mine[reference] = value
            else:
                if self._steady:
                    return
        except BaseException:  # this reference cannot be set; the thorough way logs the reason
            pass
        self._set("Real", vrs, values)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Advance from ``current_time`` by ``step_size`` [s]; a refused step leaves the unit where it was."""
        try:
            if not (
                self._steady
                and 0.0 < step_size < LONGEST_STEP
                and (
                    abs(current_time - self.reached) <= CLOCK_TOLERANCE * step_size
                    or (not self.has_past and isfinite(current_time))
                )
            ):
                self._refuse_step(current_time, step_size)
            self.advance(current_time, step_size)
            self.reached = current_time + step_size
            return True
        except BaseException as problem:  # KeyboardInterrupt as well: through the C boundary it would kill the host
            self._report("doStep", problem)
            return False

    def get_real(self, vrs: list[int]) -> list[float]:
        """Values of Real variables by reference."""
        try:
            if self._outdated:
                self.prepare()
            return self._pick_reals[tuple(vrs)](self.values)
        except BaseException as problem:
            return self._blanks("Real", vrs, problem)

    def _refuse_step(self, time: float, step: float) -> None:
        if self.phase != STEPPING:
            raise Refusal(
                f"the unit is {self.phase} and cannot step from t = {time:g} s: finish its initialisation first"
            )
        if self.table.refused:
            raise Refusal(
                f"the step from t = {time:g} s is refused until this is corrected: "
                + "; ".join(text for _, text in sorted(self.table.refused.items()))
            )
        if not 0.0 < step < LONGEST_STEP:
            raise Refusal(
                f"communication step = {step!r} s at t = {time:g} s must be positive and below {LONGEST_STEP:g} s"
            )
        raise Refusal(
            f"the step begins at t = {time!r} s, the one before ended at {self.reached!r} s: time must neither repeat "
            "nor jump; to go back, restore a state from then"
        )

    # The other types

    def get_integer(self, vrs: list[int]) -> list[int]:
        """Values of Integer variables by reference."""
        return self._get("Integer", vrs)

    def get_boolean(self, vrs: list[int]) -> list[bool]:
        """Values of Boolean variables by reference."""
        return self._get("Boolean", vrs)

    def get_string(self, vrs: list[int]) -> list[str]:
        """Values of String variables by reference."""
        return self._get("String", vrs)

    def _get(self, kind: str, vrs: list[int]) -> list[Any]:
        try:
            if self._outdated:
                self.prepare()
            return self.table.pickers[kind][tuple(vrs)](self.values)
        except BaseException as problem:
            return self._blanks(kind, vrs, problem)

    def _blanks(self, kind: str, vrs: list[int], problem: BaseException) -> list[Any]:
        """Log the problem; return one value per reference all the same, because the binary reads that many."""
        self._report(f"get{kind}", problem)
        known = self.table.of_type[kind]
        return [self.values[reference] if reference in known else _BLANKS[kind] for reference in vrs]

    def set_integer(self, vrs: list[int], values: list[int]) -> None:
        """Set Integer variables; log and ignore values out of range."""
        self._set("Integer", vrs, values)

    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        """Set Boolean variables."""
        self._set("Boolean", vrs, values)

    def set_string(self, vrs: list[int], values: list[str]) -> None:
        """Set String variables."""
        self._set("String", vrs, values)

    def _set(self, kind: str, vrs: list[int], values: list[Any]) -> None:
        try:
            for text in self.take(kind, vrs, values):
                self._report(f"set{kind}", Refusal(text))
        except BaseException as problem:
            self._report(f"set{kind}", problem)

    # The whole state

    def _get_fmu_state(self) -> dict[str, Any]:
        try:
            return self.saved()
        except BaseException as problem:
            self._report("getFMUstate", problem)
            return {}

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        try:
            self.restore(state)
        except BaseException as problem:
            self._report("setFMUstate", problem)

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        """Read a serialised state; bytes that hold none give an empty state, which ``restore`` refuses."""
        try:
            return json.loads(state.decode("utf-8"))
        except (ValueError, RecursionError):
            return {}

    # Messages to the host

    def _report(self, call: str, problem: BaseException) -> None:
        """Log a problem in ``call``: a refusal by its text, any other exception with its traceback."""
        if isinstance(problem, Refusal):
            self.log(f"{call}: {problem}", Fmi2Status.discard)
        else:
            self.log(f"{call}: {type(problem).__name__}: {problem}\n{format_exc()}", Fmi2Status.error)

    def log(self, msg: str, status: Fmi2Status = Fmi2Status.ok, category: str | None = None, debug: Any = None) -> None:
        """Queue a message for the host, which reads it as a printf format and as UTF-8."""
        text = msg.replace("%", "%%").encode("utf-8", "backslashreplace").decode("utf-8")
        super().log(text, status, category)
