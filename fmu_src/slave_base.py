"""The common base of all units: it keeps a pythonfmu unit from crashing its host and from wrong results.

* No exception leaves a callback: pythonfmu returns fmi2Fatal for it, and after the second one the next call is a
  segmentation fault. Every exception is caught and logged with its text, and a step is refused with fmi2Discard.
* NaN, infinities and values out of range are refused. ``fmi2SetReal`` of a pythonfmu unit can only return fmi2OK or
  fmi2Fatal; therefore a bad value is logged and ignored, and steps are refused until the variable has a good value.
* Parameters are read when the initialisation ends. A fixed parameter that is set later is logged and ignored. Outputs
  are right from the start time on, also while the unit is initialising.
* A step that does not begin at the end of the last one is refused, because the state belongs to that time. Units whose
  outputs depend on the time alone accept it.
* The complete state is saved and restored. pythonfmu itself saves only the registered variables, so that a hidden
  integrator would roll back wrong.

A unit class defines its ``variables``, the methods ``initialise`` and ``advance``, and the types of its ``hidden``
state. Its ``values`` are one flat list; a value reference is the position in ``variables`` and in ``values``. Inputs
are read by position, because that is fast, parameters by name; the outputs are next to each other.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from math import isfinite
from traceback import format_exc
from typing import Any, ClassVar

from pythonfmu.enums import Fmi2Status
from pythonfmu.fmi2slave import Fmi2Slave

from heli_identifier.errors import IdentifierError
from heli_plant.errors import PlantError

from .access import getter, setter, thaw_state, unknown_reference
from .errors import Refusal
from .variables import TYPES, Value, Variable, problem_with, with_fields

INSTANTIATED, INITIALISING, STEPPING, TERMINATED = "instantiated", "initialising", "stepping", "terminated"

LONGEST_STEP = 1e9  # communication steps must be shorter [s], which also excludes infinity
MOST_SUBSTEPS = 10_000  # within one communication step: some seconds of computation
CLOCK_TOLERANCE = 1e-3  # share of a step by which a host may round its times
ROUNDING = 2.0**-53  # largest relative error of a sum of two numbers
_SETTABLE: dict[str, set[str]] = {STEPPING: {"input", "tunable"}, TERMINATED: set()}
"""Causality or variability of variables that may be set in a phase; before these, inputs and parameters."""


def time_tolerance(time: float, elapsed: float, step: float) -> float:
    """Return how long [s] before its instant something is due at ``time``, ``elapsed`` since the start of the run.

    Hosts round their times. If one adds up its steps, each of elapsed/step sums may be off by a rounding of the time.
    """
    return min(0.5 * step, CLOCK_TOLERANCE * step + ROUNDING * abs(time * elapsed) / step)


def check_substeps(span: float, length: float, name: str, time: float) -> None:
    """Refuse a step at ``time`` [s] if too many of ``length`` [s], the parameter ``name``, fit into ``span`` [s]."""
    if span > MOST_SUBSTEPS * length:
        raise Refusal(
            f"{span / length:.3g} steps of {name} = {length:g} s are due at t = {time:g} s; at most {MOST_SUBSTEPS} "
            "are taken in one communication step, take shorter ones"
        )


def check_step(phase: str, refused: str, has_past: bool, reached: float, time: float, step: float) -> None:
    """Refuse a ``step`` from ``time`` [s] that the unit cannot take after the one that ended at ``reached`` [s].

    ``refused`` says which variables have no good value; it is empty if all have one.
    """
    if phase != STEPPING:
        raise Refusal(f"the unit is {phase} and cannot step from t = {time:g} s: finish its initialisation first")
    if refused != "":
        raise Refusal(f"the step from t = {time:g} s is refused until this is corrected: {refused}")
    if not 0.0 < step < LONGEST_STEP:
        raise Refusal(
            f"communication step = {step!r} s at t = {time:g} s must be positive and below {LONGEST_STEP:g} s"
        )
    is_continuous = abs(time - reached) <= CLOCK_TOLERANCE * step
    if not is_continuous and (has_past or not isfinite(time)):
        raise Refusal(
            f"the step begins at t = {time!r} s, the one before ended at {reached!r} s: time must neither repeat nor "
            "jump; to go back, restore a state from then"
        )


class SlaveBase(Fmi2Slave):
    """A co-simulation unit that never raises through the C boundary."""

    variables: ClassVar[tuple[Variable, ...]] = ()
    references: ClassVar[dict[str, int]] = {}
    of_type: ClassVar[dict[str, frozenset[int]]] = {}
    """Value references of the variables of each type."""
    _first_output: ClassVar[int] = 0
    real_inputs: ClassVar[dict[int, tuple[float, float]]] = {}  # bounds by reference; all inputs are Real
    _build: ClassVar[str] = ""  # in an FMU with a hash of its sources and start values
    hidden: ClassVar[Mapping[str, Any]] = {}
    """Type of each attribute that a step sets and a later one reads; it may also be None (:mod:`fmu_src.access`)."""
    summary: ClassVar[str] = ""
    has_past: ClassVar[bool] = True
    """Whether outputs depend on earlier steps; if not, a step may begin at any time."""
    saves_state: ClassVar[bool] = True
    """Whether the state can be saved and restored."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.references = {variable.name: reference for reference, variable in enumerate(cls.variables)}
        cls.of_type = {kind: frozenset(k for k, v in enumerate(cls.variables) if v.type == kind) for kind in TYPES}
        cls._first_output = next((k for k, v in enumerate(cls.variables) if v.causality == "output"), 0)
        cls.real_inputs = {k: (v.minimum, v.maximum) for k, v in enumerate(cls.variables) if v.causality == "input"}
        cls._build = f"{cls.__module__}.{cls.__qualname__}"

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.start_time = 0.0
        self.reached = 0.0  # end of the last step [s]
        self.values: list[Any] = [0.0 if variable.start is None else variable.start for variable in self.variables]
        self.has_complained = False  # whether the reason of a refused step was written to the error stream
        self.refused: dict[int, str] = {}  # reason by reference, until the variable has a good value
        self._initialised_with: list[Any] | None = None
        self._enter_phase(INSTANTIATED)
        sys.path[:] = dict.fromkeys(sys.path)  # the binary adds the unit's folder with every instance

    # A unit class overrides these

    def initialise(self, time: float) -> None:
        """Read the parameters, set the state and all outputs at the start ``time`` [s]; may be called several times."""

    def advance(self, time: float, step: float) -> None:
        """Go from ``time`` to ``time + step`` [s] and set all outputs, or raise Refusal and change nothing."""

    # It may use these

    def value(self, name: str) -> Any:
        """Return the value of a variable."""
        return self.values[self.references[name]]

    def settings(self, defaults: Any, **more: Any) -> Any:
        """Return the settings ``defaults`` with the parameters that set a field of them, and with ``more`` fields."""
        fields = {v.field: value for v, value in zip(self.variables, self.values, strict=True) if v.field}
        return with_fields(defaults, {**fields, **more})

    def show(self, outputs: Iterable[float]) -> None:
        """Set the outputs, or only the first ones."""
        values = tuple(outputs)
        self.values[self._first_output : self._first_output + len(values)] = values

    # From instantiation to the first step, and the end

    def setup_experiment(self, start_time: float, *_: Any) -> None:
        """Store the start time [s]; it is fixed once the initialisation has begun."""
        if self.phase == INSTANTIATED and isfinite(start_time):
            self.start_time = start_time
            return
        reason = "it must be finite, and set before the initialisation begins"
        self.report("setupExperiment", Refusal(f"the start time {start_time!r} s was ignored: {reason}"))

    def enter_initialization_mode(self) -> None:
        """Start the initialisation; outputs may be read from now on."""
        if self._require_phase(INSTANTIATED, "enterInitializationMode"):
            self._enter_phase(INITIALISING)

    def exit_initialization_mode(self) -> None:
        """Fix the parameters and compute the outputs at the start time."""
        if not self._require_phase(INITIALISING, "exitInitializationMode"):
            return
        try:
            self.prepare()
        except BaseException as problem:
            self.report("exitInitializationMode", problem)
            self.refused[-1] = f"{problem} (the initialisation failed; reset the unit)"  # of no single variable
        self._enter_phase(STEPPING)

    def terminate(self) -> None:
        """Refuse all further steps."""
        self._enter_phase(TERMINATED)

    def _require_phase(self, phase: str, call: str) -> bool:
        """Return whether the unit is in the phase that a call needs; if not, log the call as ignored."""
        if self.phase != phase:
            self.report(call, Refusal(f"it is not allowed while the unit is {self.phase}, and was ignored"))
        return self.phase == phase

    def _enter_phase(self, phase: str) -> None:
        """Enter a phase; after a failed initialisation outputs stay outdated, so that reading them logs the reason."""
        self.phase = phase
        self.stepping_inputs = self.real_inputs if phase == STEPPING else {}
        if phase != TERMINATED:
            self.outdated = phase == INITIALISING or (phase == STEPPING and self._initialised_with is None)

    def prepare(self) -> None:
        """Compute state and outputs at the start time from the values; if that fails they stay outdated."""
        self._initialised_with = None
        self.initialise(self.start_time)
        self.reached = self.start_time
        self._initialised_with = self._initial_conditions()
        self.outdated = False

    def _initial_conditions(self) -> list[Any]:
        """Return start time and fixed parameters: ``initialise`` reads them, ``advance`` does not read them again."""
        fixed = (value for value, v in zip(self.values, self.variables, strict=True) if v.variability == "fixed")
        return [self.start_time, *fixed]

    # Every step

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Advance from ``current_time`` by ``step_size`` [s]; a refused step changes nothing."""
        try:
            refused = "; ".join(text for _, text in sorted(self.refused.items())) if self.refused else ""
            check_step(self.phase, refused, self.has_past, self.reached, current_time, step_size)
            self.advance(current_time, step_size)
            self.reached = current_time + step_size
            return True
        except BaseException as problem:  # KeyboardInterrupt as well: through the C boundary it would kill the host
            self.report("doStep", problem)
            return False

    # Values

    get_real, get_integer, get_boolean, get_string = map(getter, TYPES)
    set_real, set_integer, set_boolean, set_string = map(setter, TYPES)

    def set_value(self, kind: str, reference: int, value: Value) -> None:
        """Set a variable of this type, or refuse it; after a bad value steps are refused until a good one is set."""
        if reference not in self.of_type[kind]:
            raise unknown_reference(kind, reference)
        variable = self.variables[reference]
        if not {variable.causality, variable.variability} & _SETTABLE.get(self.phase, {"input", "parameter"}):
            reason = "is fixed once initialisation has ended"
            if variable.causality == "output":
                reason = "is an output"
            elif self.phase == TERMINATED:
                reason = "cannot be set, the unit is terminated"
            raise Refusal(f"{variable.name} {reason}; the value {value!r} was ignored")
        if problem := problem_with(variable, value):
            self.refused[reference] = problem
            raise Refusal(problem)
        self.values[reference] = value
        self.refused.pop(reference, None)
        self.outdated = self.outdated or self.phase == INITIALISING

    # The state

    def _get_fmu_state(self) -> dict[str, Any]:
        try:
            if not self.saves_state:
                raise Refusal("the state of this unit cannot be saved: what it hears cannot be sent again")
            if self.outdated:
                self.prepare()
            return {
                "unit": self._build,
                "base": [self.phase, self.start_time, self.reached, list(self.values), list(self.refused.items())],
                "hidden": [getattr(self, name, None) for name in self.hidden],  # steps replace it
            }
        except BaseException as problem:
            self.report("getFMUstate", problem)
            return {}

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        """Restore a state of this or another instance of the same unit, completely or not at all."""
        before = dict(self.__dict__)
        try:
            if not state or state["unit"] != self._build:
                raise Refusal(f"this is no complete state of a {type(self).__name__}; nothing was changed")
            phase, self.start_time, reached, values, refused = state["base"]
            self.values, self.refused = list(values), dict(refused)
            self._enter_phase(phase)
            if phase in (STEPPING, TERMINATED):
                if self._initialised_with != self._initial_conditions():
                    self.prepare()
                    self.values[:] = values  # ``initialise`` has set the outputs of the start time
                self.reached = reached
                hidden = map(thaw_state, state["hidden"], self.hidden.values())
                self.__dict__.update(zip(self.hidden, hidden, strict=True))
                self.outdated = False
        except BaseException as problem:
            self.__dict__ = before  # with the old list of values, which was replaced and not changed
            self.report("setFMUstate", problem)

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        """Read a serialised state; other bytes give an empty state, which is refused."""
        try:
            return json.loads(state.decode("utf-8"))
        except (ValueError, RecursionError):
            return {}

    # Messages to the host

    def report(self, call: str, problem: BaseException) -> None:
        """Log a problem in ``call``: a refusal of the project by its text, any other exception with its traceback.

        Some hosts show no log, so the reason of the first refused step also goes to the error stream.
        """
        text, status = f"{call}: {problem}", Fmi2Status.discard
        if not isinstance(problem, (Refusal, IdentifierError, PlantError)):
            text, status = f"{call}: {type(problem).__name__}: {problem}\n{format_exc()}", Fmi2Status.error
        self.log(text, status)
        if call == "doStep" and not self.has_complained:
            self.has_complained = True
            with suppress(Exception):  # a host may have no error stream
                sys.stderr.write(f"{type(self).__name__}.{text}\n")

    def log(self, msg: str, status: Fmi2Status = Fmi2Status.ok, category: str | None = None, debug: Any = None) -> None:
        """Queue a message for the host, which reads it as a printf format and as UTF-8."""
        text = msg.replace("%", "%%").encode("utf-8", "backslashreplace").decode("utf-8")
        super().log(text, status, category)
