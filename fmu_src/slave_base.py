"""The common base of all units: what keeps a pythonfmu unit from crashing its host or lying to it.

* No exception leaves a callback (it would be fmi2Fatal, and the next call a segmentation fault): everything is
  caught, logged with its text, and refused with fmi2Discard.
* NaN, infinities and values out of range are refused where they come in. ``fmi2SetReal`` of a pythonfmu unit has no
  way to say no short of fmi2Fatal, therefore the value is logged and not taken, and steps are refused until the
  variable has been set to a good value.
* Parameters are read when initialisation ends, and outputs are right from the start time on; a fixed parameter that
  comes later is refused with a log message and changes nothing.
* Save and restore take the whole state (the unit's ``freeze`` and ``thaw``), not just the registered variables.
* Values lie in flat dictionaries by value reference (:mod:`fmu_src.value_table`).

A unit gives its ``variables`` and four methods: ``initialise``, ``advance``, ``freeze``, ``thaw``.
"""

from __future__ import annotations

import sys
from traceback import format_exc
from typing import Any, ClassVar
from xml.etree.ElementTree import Element

from pythonfmu.enums import Fmi2Status
from pythonfmu.fmi2slave import Fmi2Slave

from .errors import Refusal
from .value_table import EARLY, LATE, ValueTable
from .variables import Value, Variable

INSTANTIATED, INITIALISING, STEPPING, TERMINATED = "instantiated", "initialising", "stepping", "terminated"
WHOLE_UNIT = -1
"""Key of a refusal that no single variable can set right."""


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
        self.phase = INSTANTIATED
        self.start_time = 0.0
        self.table = ValueTable(self.variables, self.start_values)
        self.reals, self.integers = self.table.reals, self.table.integers
        self.booleans, self.strings = self.table.booleans, self.table.strings
        self._stale = False
        self._prepared_for: list[Any] | None = None
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

    # Calls of the host

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Step, or refuse and stay where the unit is."""
        try:
            if self.phase is not STEPPING or self.table.refused or not 0.0 < step_size < 1e9:
                self._check_step(current_time, step_size)
            self.advance(current_time, step_size)
            return True
        except BaseException as problem:  # also KeyboardInterrupt: through the C boundary it would kill the host
            self._tell("doStep", problem)
            return False

    def _check_step(self, time: float, step: float) -> None:
        if self.phase is not STEPPING:
            raise Refusal(f"a step from t = {time:g} s needs initialisation before it; the unit is {self.phase}")
        if self.table.refused:
            raise Refusal(
                f"no step from t = {time:g} s before this is set right: " + "; ".join(self.table.refused.values())
            )
        raise Refusal(f"communication step {step!r} s at t = {time:g} s must be positive and finite")

    def setup_experiment(self, start_time: float, stop_time: float | None = None, tolerance: float | None = None):
        """Note the start time [s]."""
        self.start_time = start_time

    def enter_initialization_mode(self) -> None:
        """Let outputs be asked for from here on."""
        self.phase = INITIALISING
        self._stale = True

    def exit_initialization_mode(self) -> None:
        """Fix the parameters and compute the outputs at the start time."""
        try:
            self._stale = True
            self._prepare()
        except BaseException as problem:
            self._tell("exitInitializationMode", problem)
            self.table.refused[WHOLE_UNIT] = f"{problem} (initialisation failed; reset the unit)"
        self.table.open_for(LATE)
        self.phase = STEPPING

    def _prepare(self) -> None:
        """Bring the state and the outputs up to date with what was set during initialisation."""
        self._stale = False
        self._prepared_for = None
        self.initialise(self.start_time)
        self._prepared_for = self._settings()

    def _settings(self) -> list[Any]:
        """Return the start time and the value of every parameter: what ``initialise`` depends on."""
        return [self.start_time, *self.table.parameters()]

    def terminate(self) -> None:
        """Take no further steps."""
        self.phase = TERMINATED

    def get_real(self, vrs: list[int]) -> list[float]:
        """Values of Real variables by reference."""
        try:
            if self._stale:
                self._prepare()
            return [*map(self.reals.__getitem__, vrs)]
        except BaseException as problem:
            return self._blanks("getReal", self.reals, vrs, float("nan"), problem)

    def get_integer(self, vrs: list[int]) -> list[int]:
        """Values of Integer variables by reference."""
        return self._get("getInteger", self.integers, vrs, 0)

    def get_boolean(self, vrs: list[int]) -> list[bool]:
        """Values of Boolean variables by reference."""
        return self._get("getBoolean", self.booleans, vrs, False)

    def get_string(self, vrs: list[int]) -> list[str]:
        """Values of String variables by reference."""
        return self._get("getString", self.strings, vrs, "")

    def _get(self, call: str, store: dict[int, Any], vrs: list[int], blank: Any) -> list[Any]:
        try:
            if self._stale:
                self._prepare()
            return [store[reference] for reference in vrs]
        except BaseException as problem:
            return self._blanks(call, store, vrs, blank, problem)

    def _blanks(self, call: str, store: dict[int, Any], vrs: list[int], blank: Any, problem: BaseException) -> list:
        """As many values as were asked for, since the binary reads that many: ``blank`` for what does not exist."""
        self._tell(call, problem)
        return [store.get(reference, blank) for reference in vrs]

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Take Real values that are in range, log and refuse the others."""
        try:
            problems = self.table.take_reals(vrs, values)
            if problems:
                self._tell_all("setReal", problems)
            if self.phase is INITIALISING:
                self._stale = True
        except BaseException as problem:
            self._tell("setReal", problem)

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
            self._tell_all(f"set{kind}", self.table.take(kind, vrs, values))
            self._stale = self.phase is INITIALISING
        except BaseException as problem:
            self._tell(f"set{kind}", problem)

    # State

    def _get_fmu_state(self) -> dict[str, Any]:
        try:
            if self._stale:
                self._prepare()
            return {
                "unit": self._signature(),
                "phase": self.phase,
                "start_time": self.start_time,
                "values": self.table.dump(),
                "refused": list(self.table.refused.items()),
                "hidden": self.freeze(),
            }
        except BaseException as problem:
            self._tell("getFMUstate", problem)
            return {}

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        try:
            if not state or state["unit"] != self._signature():
                raise Refusal("this is no complete state of this unit; nothing was changed")
            self.table.restore(state["values"])
            self.start_time = state["start_time"]
            phases = (INSTANTIATED, INITIALISING, STEPPING, TERMINATED)
            self.phase = phases[phases.index(state["phase"])]  # the same objects again: phases are compared by identity
            self.table.refused = {reference: text for reference, text in state["refused"]}
            early = self.phase in (INSTANTIATED, INITIALISING)
            self.table.open_for(EARLY if early else LATE)
            self._stale = self.phase is INITIALISING
            if not early:
                if self._prepared_for != self._settings():
                    self._prepare()
                    self.table.restore(state["values"])  # since ``initialise`` has shown the outputs of the start
                self.thaw(state["hidden"])
        except BaseException as problem:
            self._tell("setFMUstate", problem)

    def _signature(self) -> list[Any]:
        return [type(self).__name__, len(self.variables)]

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        """Read a serialised state; bytes that are none give an empty state, which ``setFMUstate`` refuses."""
        try:
            return Fmi2Slave._fmu_state_from_bytes(state)
        except (ValueError, RecursionError):
            return {}

    # Messages

    def _tell(self, call: str, problem: BaseException) -> None:
        """Log a refusal with its text, anything unforeseen with its traceback."""
        if isinstance(problem, Refusal):
            self.log(f"{call}: {problem}", Fmi2Status.discard)
        else:
            self.log(f"{call}: {type(problem).__name__}: {problem}\n{format_exc()}", Fmi2Status.error)

    def _tell_all(self, call: str, refusals: list[str]) -> None:
        for text in refusals:
            self._tell(call, Refusal(text))

    def log(self, msg: str, status: Fmi2Status = Fmi2Status.ok, category: str | None = None, debug: Any = None) -> None:
        """Queue a message for the host, which reads it as a printf format and as UTF-8."""
        clean = msg.replace("%", "%%").encode("utf-8", "backslashreplace").decode("utf-8")
        super().log(clean, status, category)

    def to_xml(self, model_options: dict[str, str] | None = None) -> Element:
        """Model description of this unit."""
        from .packaging.model_description import model_description

        return model_description(type(self))
