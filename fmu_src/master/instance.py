"""One unit under the master: an instance of an FMU, and its three calls of a step made ready (:mod:`.tape`).

Every status is checked: whatever is worse than a warning becomes a :class:`fmu_src.errors.MasterError` that names
unit, call and time, with what the unit itself said in its log.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from ctypes import PyDLL, byref, c_double, c_int, c_size_t, c_uint, c_void_p
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from fmpy.logging import addLoggerProxy
from numpy.typing import NDArray

from heli_plant.errors import did_you_mean

from ..errors import MasterError
from ..variables import Value
from .tape import DISCARD, OK, Call, Clock

_NO_EARLIER_STATE = c_int.from_param(1)
"""fmi2DoStep: the master will not go back to a state before the step."""

_KEYS = count(1)
_LISTENERS: dict[int, Instance] = {}
"""Instances by their component environment: fmpy's logger proxy serves one callback function in a process."""


def _hear(environment: int | None, _name: bytes, status: int, _category: bytes, message: bytes) -> None:
    """Logger callback of every instance."""
    listener = _LISTENERS.get(environment or 0)
    if listener is not None:
        listener.hear(status, message.decode("utf-8", "replace"))


_LOGGER = fmi2CallbackLoggerTYPE(_hear)
_ALLOCATE = fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
_FREE = fmi2CallbackFreeMemoryTYPE(fmpy.free)
_STATUS = ("ok", "warning", "discard", "error", "fatal", "pending")


class Instance:
    """An instantiated unit.

    Parameters
    ----------
    name : str
        Its name in the scenario.
    fmu : Path
        The FMU file.
    alarm : list, optional
        The instance appends itself when the unit's log tells of a refusal; shared by the instances of a run.
    """

    def __init__(self, name: str, fmu: Path, alarm: list[Instance] | None = None) -> None:
        self.name = name
        self.messages: list[str] = []
        self.worst = OK
        self.alarm: list[Instance] = [] if alarm is None else alarm
        self.description = fmpy.read_model_description(fmu)
        self.variables = {variable.name: variable for variable in self.description.modelVariables}
        self.outputs = [name for name, v in self.variables.items() if v.causality == "output" and v.type == "Real"]
        self.folder = fmpy.extract(fmu)
        self._key = next(_KEYS)
        _LISTENERS[self._key] = self
        try:
            self._instantiate()
        except BaseException:
            self.close()
            raise

    def _instantiate(self) -> None:
        """Load the unit's library and bring the unit to life."""
        self.slave = self._call(
            "load",
            0.0,
            FMU2Slave,
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=self.name,
        )
        self._callbacks = fmi2CallbackFunctions()
        self._callbacks.logger = _LOGGER
        self._callbacks.allocateMemory = _ALLOCATE
        self._callbacks.freeMemory = _FREE
        self._callbacks.componentEnvironment = self._key
        addLoggerProxy(byref(self._callbacks))
        self._call("instantiate", 0.0, self.slave.instantiate, callbacks=self._callbacks, loggingOn=True)

    def hear(self, status: int, message: str) -> None:
        """Keep what the unit says for the next check."""
        self.messages.append(message)
        self.worst = max(self.worst, status)
        if status >= DISCARD:
            self.alarm.append(self)

    def _call(self, call: str, time: float, function: Any, *arguments: Any, **options: Any) -> Any:
        """Run one of fmpy's methods, with its failure put into the master's words."""
        try:
            value = function(*arguments, **options)
        except FMICallException as problem:
            self.fail(call, time, problem.status)
        except Exception as problem:  # fmpy raises a bare Exception when a unit does not come to life
            said = "; ".join([str(problem), *self.messages])
            raise MasterError(f"{self.name}.{call} at t = {time:g} s: {said}") from problem
        self.check_messages(call, time)
        return value

    def fail(self, call: str, time: float, status: int) -> None:
        """Raise for a status other than fmi2OK."""
        said = "; ".join(self.messages) or "the unit gives no reason"
        word = _STATUS[status] if 0 <= status < len(_STATUS) else f"status {status}"
        raise MasterError(f"{self.name}.{call} at t = {time:g} s answered {word}: {said}")

    def check_messages(self, call: str, time: float) -> None:
        """Raise if the unit has logged a refusal: a pythonfmu unit cannot refuse a set call by its status."""
        if self.worst >= DISCARD:
            self.fail(call, time, self.worst)

    def variable(self, name: str) -> Any:
        """Return a variable's description.

        Raises
        ------
        MasterError
            The unit has no such variable.
        """
        if name not in self.variables:
            raise MasterError(f"unit {self.name} has no variable {name!r}{did_you_mean(name, tuple(self.variables))}")
        return self.variables[name]

    def initialise(self, parameters: Mapping[str, Value], start: float, stop: float) -> None:
        """Set the parameters and enter initialisation mode at ``start`` [s]."""
        self._call("setupExperiment", start, self.slave.setupExperiment, startTime=start, stopTime=stop)
        for name, value in parameters.items():
            variable = self.variable(name)
            if variable.causality != "parameter":
                raise MasterError(f"{self.name}.{name} is no parameter but an {variable.causality}")
            setter, kind, wanted = {
                "Real": (self.slave.setReal, float, "a number"),
                "Integer": (self.slave.setInteger, int, "a whole number"),
                "Boolean": (self.slave.setBoolean, bool, "true or false"),
                "String": (self.slave.setString, str, "text"),
            }[variable.type]
            # Only a text can be told from what is wanted; what a value may be is the unit's to say.
            if isinstance(value, str) != (kind is str) or (kind is int and not float(value).is_integer()):
                raise MasterError(f"{self.name}.{name} = {value!r} must be {wanted}")
            self._call(f"set {name}", start, setter, [variable.valueReference], [kind(value)])
        self._call("enterInitializationMode", start, self.slave.enterInitializationMode)

    def finish_initialisation(self, start: float) -> None:
        """Leave initialisation mode."""
        self._call("exitInitializationMode", start, self.slave.exitInitializationMode)

    def bind(
        self, inputs: list[str], outputs: list[str], fed: NDArray[np.float64], shown: NDArray[np.float64], clock: Clock
    ) -> None:
        """Make the calls of a step ready: ``puts``, ``steps`` and ``fetches``, empty where there is nothing to do.

        ``inputs`` are read from ``fed`` and ``outputs`` written to ``shown``, both shape (number of names,) and
        contiguous: the calls work on these arrays in place.
        """
        for name in inputs:
            if self.variable(name).causality != "input":
                raise MasterError(f"{self.name}.{name} is no input")
        component = c_void_p.from_param(self.slave.component)
        self.puts = self._transfer("setReal", component, inputs, fed)
        self.steps = [self._ready("doStep", component, clock.time, clock.step, _NO_EARLIER_STATE)]
        self.fetches = self._transfer("getReal", component, outputs, shown)

    def _transfer(self, call: str, component: Any, names: list[str], values: NDArray[np.float64]) -> list[Call]:
        """Return the call that moves these variables to or from ``values``; none if there are no variables."""
        if not names:
            return []
        references = (c_uint * len(names))(*(self.variable(name).valueReference for name in names))
        buffer = (c_double * len(names)).from_buffer(values.data)
        return [self._ready(call, component, byref(references), c_size_t.from_param(len(names)), byref(buffer))]

    def _ready(self, call: str, *arguments: Any) -> Call:
        """Return a call of the FMU (``doStep``: fmi2DoStep) with C arguments, which it keeps alive."""
        # PyDLL keeps the interpreter's lock over a call: the unit needs it at once, and there is nobody else to run.
        library = PyDLL(None, handle=self.slave.dll._handle)
        return Call(self, call, partial(library[f"fmi2{call[0].upper()}{call[1:]}"], *arguments))

    def close(self) -> None:
        """Free the instance and its folder."""
        try:
            slave: Any = getattr(self, "slave", None)
            if getattr(slave, "component", None):
                slave.terminate()
                slave.freeInstance()
        finally:
            del _LISTENERS[self._key]
            shutil.rmtree(self.folder, ignore_errors=True)
