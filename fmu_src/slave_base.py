"""The common base of all units: what keeps a pythonfmu unit from crashing its host or lying to it.

* No exception leaves a callback (it would be fmi2Fatal, and the next call a segmentation fault): everything is
  caught, logged with its text, and refused with fmi2Discard.
* NaN, infinities and values out of range are refused where they come in. ``fmi2SetReal`` of a pythonfmu unit has no
  way to say no short of fmi2Fatal, therefore the value is logged and not taken, and steps are refused until the
  variable has been set to a good value.
* Parameters are read when initialisation ends, and outputs are right from the start time on; a fixed parameter that
  comes later is refused with a log message and changes nothing.
* Save and restore take the whole state (:mod:`fmu_src.slave_state`), not just the registered variables.

The three calls of every communication step, ``set_real``, ``do_step`` and ``get_real``, have a short way for a unit
that is ``_steady``: initialised, and with nothing refused. Whatever is out of the ordinary takes the thorough one.

A unit gives its ``variables`` and four methods: ``initialise``, ``advance``, ``freeze``, ``thaw``. Its ``values`` lie
in one flat list by value reference (:mod:`fmu_src.value_table`).
"""

from __future__ import annotations

import sys
from typing import Any, ClassVar
from xml.etree.ElementTree import Element

from pythonfmu.enums import Fmi2Status
from pythonfmu.fmi2slave import Fmi2Slave

from .errors import Refusal
from .slave_messages import message, printable
from .slave_state import read, restore, saved
from .value_table import EARLY, LATE, ValueTable
from .variables import Value, Variable

INSTANTIATED, INITIALISING, STEPPING, TERMINATED = "instantiated", "initialising", "stepping", "terminated"
WHOLE_UNIT = -1
"""Key of a refusal that no single variable can set right."""

_BLANKS = {"Real": float("nan"), "Integer": 0, "Boolean": False, "String": ""}
"""What a variable that does not exist reads as."""


class SlaveBase(Fmi2Slave):
    """A co-simulation unit that never raises through the C boundary."""

    variables: ClassVar[tuple[Variable, ...]] = ()
    start_values: ClassVar[dict[str, Value]] = {}
    summary: ClassVar[str] = ""
    equations: ClassVar[str] = ""
    source: ClassVar[str] = ""
    step_size: ClassVar[float] = 0.01
    references: ClassVar[dict[str, int]] = {}

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.references = {variable.name: reference for reference, variable in enumerate(cls.variables)}

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.start_time = 0.0
        self.table = ValueTable(self.variables, self.start_values)
        self.values = self.table.values
        self.prepared_for: list[Any] | None = None
        self._real_pickers = self.table.pickers["Real"]
        self.enter(INSTANTIATED)
        self._keep_one_path_entry()

    def _keep_one_path_entry(self) -> None:
        """Drop the copies of the resources' folder that the binary adds to ``sys.path`` with every instance."""
        if self.resources and sys.path.count(self.resources) > 1:
            first = sys.path.index(self.resources)
            sys.path[first + 1 :] = [entry for entry in sys.path[first + 1 :] if entry != self.resources]

    # What a unit fills in

    def initialise(self, time: float) -> None:
        """Take the parameters and set the state and all outputs for the start ``time`` [s]; may be called again."""

    def advance(self, time: float, step: float) -> None:
        """Go from ``time`` to ``time + step`` [s] and set all outputs, or raise :class:`Refusal` unchanged."""

    def freeze(self) -> Any:
        """Return the hidden state as lists, numbers, texts and None, sharing nothing that changes."""

    def thaw(self, frozen: Any) -> None:
        """Take back what :meth:`freeze` returned; parameters and outputs are taken care of by the base."""

    # From instantiation to the first step

    def enter(self, phase: str) -> None:
        """Be in ``phase`` from now on."""
        self.phase = phase
        self._stale = phase == INITIALISING
        self.table.open_for(LATE if self.is_initialised() else EARLY)
        self._settle()

    def is_initialised(self) -> bool:
        """Whether initialisation has ended."""
        return self.phase in (STEPPING, TERMINATED)

    def _settle(self) -> None:
        """Note whether there is anything out of the ordinary."""
        self._steady = self.phase == STEPPING and not self.table.refused

    def setup_experiment(self, start_time: float, stop_time: float | None = None, tolerance: float | None = None):
        """Note the start time [s]."""
        self.start_time = start_time

    def enter_initialization_mode(self) -> None:
        """Let outputs be asked for from here on."""
        self.enter(INITIALISING)

    def exit_initialization_mode(self) -> None:
        """Fix the parameters and compute the outputs at the start time."""
        try:
            self.prepare()
        except BaseException as problem:
            self._tell("exitInitializationMode", problem)
            self.table.refused[WHOLE_UNIT] = f"{problem} (initialisation failed; reset the unit)"
        self.enter(STEPPING)

    def prepare(self) -> None:
        """Bring the state and the outputs up to date with what was set during initialisation."""
        self._stale = False
        self.prepared_for = None
        self.initialise(self.start_time)
        self.prepared_for = self.initial_conditions()

    def initial_conditions(self) -> list[Any]:
        """Return the start time and the value of every parameter: what ``initialise`` depends on."""
        return [self.start_time, *self.table.parameters()]

    def terminate(self) -> None:
        """Take no further steps."""
        self.enter(TERMINATED)

    # Every step

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Take Real values that are in range, log and refuse the others."""
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
        except BaseException:  # a reference that cannot be set: the thorough way says so
            pass
        self._set("Real", vrs, values)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Step, or refuse and stay where the unit is."""
        try:
            if not (self._steady and 0.0 < step_size < 1e9):
                self._check_step(current_time, step_size)
            self.advance(current_time, step_size)
            return True
        except BaseException as problem:  # also KeyboardInterrupt: through the C boundary it would kill the host
            self._tell("doStep", problem)
            return False

    def get_real(self, vrs: list[int]) -> list[float]:
        """Values of Real variables by reference."""
        try:
            if self._stale:
                self.prepare()
            return self._real_pickers[tuple(vrs)](self.values)
        except BaseException as problem:
            return self._blanks("Real", vrs, problem)

    def _check_step(self, time: float, step: float) -> None:
        if self.phase != STEPPING:
            raise Refusal(f"a step from t = {time:g} s needs initialisation before it; the unit is {self.phase}")
        if self.table.refused:
            raise Refusal(
                f"no step from t = {time:g} s before this is set right: " + "; ".join(self.table.refused.values())
            )
        raise Refusal(f"communication step {step!r} s at t = {time:g} s must be positive and finite")

    # Other types, and whatever is out of the ordinary

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
            if self._stale:
                self.prepare()
            return self.table.pickers[kind][tuple(vrs)](self.values)
        except BaseException as problem:
            return self._blanks(kind, vrs, problem)

    def _blanks(self, kind: str, vrs: list[int], problem: BaseException) -> list[Any]:
        """As many values as were asked for, since the binary reads that many: a blank for what does not exist."""
        self._tell(f"get{kind}", problem)
        known = self.table.of_type[kind]
        return [self.values[reference] if reference in known else _BLANKS[kind] for reference in vrs]

    def set_integer(self, vrs: list[int], values: list[int]) -> None:
        """Take Integer values that are in range, log and refuse the others."""
        self._set("Integer", vrs, values)

    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        """Take Boolean values."""
        self._set("Boolean", vrs, values)

    def set_string(self, vrs: list[int], values: list[str]) -> None:
        """Take String values."""
        self._set("String", vrs, values)

    def _set(self, kind: str, vrs: list[int], values: list[Any]) -> None:
        try:
            for text in self.table.take(kind, vrs, values):
                self._tell(f"set{kind}", Refusal(text))
            self._stale = self.phase == INITIALISING
            self._settle()
        except BaseException as problem:
            self._tell(f"set{kind}", problem)

    def _get_fmu_state(self) -> dict[str, Any]:
        try:
            if self._stale:
                self.prepare()
            return saved(self)
        except BaseException as problem:
            self._tell("getFMUstate", problem)
            return {}

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        try:
            restore(self, state)
        except BaseException as problem:
            self._tell("setFMUstate", problem)

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        """Read a serialised state."""
        return read(state)

    # Messages

    def _tell(self, call: str, problem: BaseException) -> None:
        """Log what went wrong in ``call``."""
        self.log(*message(call, problem))

    def log(self, msg: str, status: Fmi2Status = Fmi2Status.ok, category: str | None = None, debug: Any = None) -> None:
        """Queue a message for the host."""
        super().log(printable(msg), status, category)

    def to_xml(self, model_options: dict[str, str] | None = None) -> Element:
        """Model description of this unit."""
        from .packaging.model_description import model_description

        return model_description(type(self))
