"""The common base of all units: what keeps a pythonfmu unit from crashing its host or lying to it.

* No exception leaves a callback (it would be fmi2Fatal, and the next call a segmentation fault): everything is
  caught, logged with its text, and refused with fmi2Discard.
* NaN, infinities and values out of range are refused where they come in. ``fmi2SetReal`` of a pythonfmu unit has no
  way to say no short of fmi2Fatal, therefore the value is logged and not taken, and steps are refused until the
  variable has been set to a good value.
* Parameters are read when initialisation ends, and outputs are right from the start time on; a fixed parameter that
  comes later is refused with a log message and changes nothing.
* Save and restore take the whole state (the unit's ``freeze`` and ``thaw``), not just the registered variables.
* Values lie in one flat dictionary per type, by value reference, so that a get or set is a look-up per value.

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
from .variables import Value, Variable, problem_with

INSTANTIATED, INITIALISING, STEPPING, TERMINATED = "instantiated", "initialising", "stepping", "terminated"
WHOLE_UNIT = -1
"""Key of a refusal that no single variable can set right."""
TYPES = {"Real": float, "Integer": int, "Boolean": bool, "String": str}


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
        self.reals: dict[int, float] = {}
        self.integers: dict[int, int] = {}
        self.booleans: dict[int, bool] = {}
        self.strings: dict[int, str] = {}
        self._stores: dict[str, dict[int, Any]] = {
            "Real": self.reals, "Integer": self.integers, "Boolean": self.booleans, "String": self.strings,
        }  # fmt: skip
        for reference, variable in enumerate(self.variables):
            start = self.start_values.get(variable.name, variable.start)
            kind = TYPES[variable.type]
            self._stores[variable.type][reference] = kind() if start is None else kind(start)
        self._refused: dict[int, str] = {}
        self._stale = False
        self._prepared_for: list[Any] | None = None
        self._open_settings(("input", "parameter"))
        self._keep_one_path_entry()

    def _keep_one_path_entry(self) -> None:
        """Drop the copies of the resources' folder that the binary adds to ``sys.path`` with every instance."""
        if self.resources and sys.path.count(self.resources) > 1:
            first = sys.path.index(self.resources)
            sys.path[first + 1 :] = [entry for entry in sys.path[first + 1 :] if entry != self.resources]

    def _open_settings(self, causalities: tuple[str, ...]) -> None:
        """Let inputs, tunable parameters and variables of these causalities be set from now on."""
        self._limits = {
            reference: variable.bounds
            for reference, variable in enumerate(self.variables)
            if variable.causality in causalities or variable.variability == "tunable"
        }

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
            if self.phase is not STEPPING or self._refused or not 0.0 < step_size < 1e9:
                self._check_step(current_time, step_size)
            self.advance(current_time, step_size)
            return True
        except BaseException as problem:  # also KeyboardInterrupt: through the C boundary it would kill the host
            self._tell("doStep", problem)
            return False

    def _check_step(self, time: float, step: float) -> None:
        if self.phase is not STEPPING:
            raise Refusal(f"a step from t = {time:g} s needs initialisation before it; the unit is {self.phase}")
        if self._refused:
            raise Refusal(f"no step from t = {time:g} s before this is set right: " + "; ".join(self._refused.values()))
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
            self._refused[WHOLE_UNIT] = f"{problem} (initialisation failed; reset the unit)"
        self._open_settings(("input",))
        self.phase = STEPPING

    def _prepare(self) -> None:
        """Bring the state and the outputs up to date with what was set during initialisation."""
        self._stale = False
        self._prepared_for = None
        self.initialise(self.start_time)
        self._prepared_for = self._settings()

    def _settings(self) -> list[Any]:
        """Return the start time and the value of every parameter: what ``initialise`` depends on."""
        return [
            self.start_time,
            *(
                self._stores[variable.type][reference]
                for reference, variable in enumerate(self.variables)
                if variable.causality == "parameter"
            ),
        ]

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
            limits, reals = self._limits, self.reals
            for reference, value in zip(vrs, values, strict=True):
                if reference in limits and reference in reals:
                    low, high = limits[reference]
                    if low <= value <= high:
                        reals[reference] = value
                        if self._refused:
                            self._refused.pop(reference, None)
                        continue
                self._refuse("setReal", reference, value, reals)
            if self.phase is not STEPPING:
                self._stale = self.phase is INITIALISING
        except BaseException as problem:
            self._tell("setReal", problem)

    def set_integer(self, vrs: list[int], values: list[int]) -> None:
        """Take Integer values that are in range, log and refuse the others."""
        self._set("setInteger", self.integers, vrs, values)

    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        """Take Boolean values."""
        self._set("setBoolean", self.booleans, vrs, values)

    def set_string(self, vrs: list[int], values: list[str]) -> None:
        """Take String values."""
        self._set("setString", self.strings, vrs, values)

    def _set(self, call: str, store: dict[int, Any], vrs: list[int], values: list[Any]) -> None:
        try:
            for reference, value in zip(vrs, values, strict=True):
                known = reference in self._limits and reference in store
                if known and problem_with(self.variables[reference], value) is None:
                    store[reference] = value
                    self._refused.pop(reference, None)
                else:
                    self._refuse(call, reference, value, store)
            self._stale = self.phase is INITIALISING
        except BaseException as problem:
            self._tell(call, problem)

    def _refuse(self, call: str, reference: int, value: Any, store: dict[int, Any]) -> None:
        """Log why ``value`` is not taken; if a better value can still come, refuse steps until it does."""
        if reference not in store:
            self._tell(call, Refusal(f"no variable of this type has value reference {reference}"))
            return
        variable = self.variables[reference]
        if reference not in self._limits:
            reason = (
                "is an output" if variable.causality == "output" else "is fixed once initialisation has ended"
            )  # fmt: skip
            self._tell(call, Refusal(f"{variable.name} {reason}; {value!r} was not taken"))
            return
        problem = problem_with(variable, value) or f"{variable.name} = {value!r} was not taken"
        self._refused[reference] = problem
        self._tell(call, Refusal(problem))

    # State

    def _get_fmu_state(self) -> dict[str, Any]:
        try:
            if self._stale:
                self._prepare()
            return {
                "unit": self._signature(),
                "phase": self.phase,
                "start_time": self.start_time,
                "stores": {kind: list(store.items()) for kind, store in self._stores.items()},
                "refused": list(self._refused.items()),
                "hidden": self.freeze(),
            }
        except BaseException as problem:
            self._tell("getFMUstate", problem)
            return {}

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        try:
            if not state or state["unit"] != self._signature():
                raise Refusal("this is no complete state of this unit; nothing was changed")
            self._restore(state["stores"])
            self.start_time = state["start_time"]
            phases = (INSTANTIATED, INITIALISING, STEPPING, TERMINATED)
            self.phase = phases[phases.index(state["phase"])]  # the same objects again: phases are compared by identity
            self._refused = {reference: text for reference, text in state["refused"]}
            early = self.phase in (INSTANTIATED, INITIALISING)
            self._open_settings(("input", "parameter") if early else ("input",))
            self._stale = self.phase is INITIALISING
            if not early:
                if self._prepared_for != self._settings():
                    self._prepare()
                    self._restore(state["stores"])  # since ``initialise`` has shown the outputs of the start
                self.thaw(state["hidden"])
        except BaseException as problem:
            self._tell("setFMUstate", problem)

    def _restore(self, stores: dict[str, list[Any]]) -> None:
        for kind, store in self._stores.items():
            store.update((reference, value) for reference, value in stores[kind])

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

    def log(self, msg: str, status: Fmi2Status = Fmi2Status.ok, category: str | None = None, debug: Any = None) -> None:
        """Queue a message for the host, which reads it as a printf format and as UTF-8."""
        clean = msg.replace("%", "%%").encode("utf-8", "backslashreplace").decode("utf-8")
        super().log(clean, status, category)

    def to_xml(self, model_options: dict[str, str] | None = None) -> Element:
        """Model description of this unit."""
        from .packaging.model_description import model_description

        return model_description(type(self))
