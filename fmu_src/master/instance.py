"""One unit under the master: an instance of an FMU with its buffers laid out once.

fmpy's methods build ctypes arrays with every call; here the value references and the values lie in arrays that are
made once, and a step is three calls with ready pointers. Every status is checked: whatever is not fmi2OK becomes a
:class:`fmu_src.errors.MasterError` that names unit, call and time, with what the unit itself said in its log.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from ctypes import POINTER, PyDLL, byref, c_double, c_int, c_size_t, c_uint, c_void_p, cast
from itertools import count
from pathlib import Path
from typing import Any

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from fmpy.logging import addLoggerProxy

from ..errors import MasterError
from ..variables import Value, nearest

OK, WARNING, DISCARD = 0, 1, 2
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
    """

    def __init__(self, name: str, fmu: Path) -> None:
        self.name = name
        self.messages: list[str] = []
        self.worst = OK
        self._kept: list[Any] = []
        self.description = fmpy.read_model_description(fmu)
        self.variables = {variable.name: variable for variable in self.description.modelVariables}
        self.folder = fmpy.extract(fmu)
        self.slave = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self._key = next(_KEYS)
        _LISTENERS[self._key] = self
        self._callbacks = fmi2CallbackFunctions()
        self._callbacks.logger = _LOGGER
        self._callbacks.allocateMemory = _ALLOCATE
        self._callbacks.freeMemory = _FREE
        self._callbacks.componentEnvironment = self._key
        addLoggerProxy(byref(self._callbacks))
        self._call("instantiate", 0.0, self.slave.instantiate, callbacks=self._callbacks, loggingOn=True)
        variables = self.description.modelVariables
        self.outputs = [v.name for v in variables if v.causality == "output" and v.type == "Real"]

    def hear(self, status: int, message: str) -> None:
        """Keep what the unit says for the next check."""
        self.messages.append(message)
        self.worst = max(self.worst, status)

    def _call(self, call: str, time: float, function: Any, *arguments: Any, **options: Any) -> Any:
        """Run one of fmpy's methods, with its failure put into the master's words."""
        try:
            value = function(*arguments, **options)
        except FMICallException as problem:
            self.fail(call, time, problem.status)
        except Exception as problem:  # fmpy raises a bare Exception when a unit does not come to life
            said = "; ".join(self.messages)
            raise MasterError(f"{self.name}.{call} at t = {time:g} s: {problem}; {said}") from problem
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
            raise MasterError(f"unit {self.name} has no variable {name!r}{nearest(name, tuple(self.variables))}")
        return self.variables[name]

    def initialise(self, parameters: Mapping[str, Value], start: float, stop: float) -> None:
        """Set the parameters and enter initialisation mode at ``start`` [s]."""
        self._call("setupExperiment", start, self.slave.setupExperiment, startTime=start, stopTime=stop)
        for name, value in parameters.items():
            variable = self.variable(name)
            if variable.causality != "parameter":
                raise MasterError(f"{self.name}.{name} is no parameter but an {variable.causality}")
            setter, kind = {
                "Real": (self.slave.setReal, float),
                "Integer": (self.slave.setInteger, int),
                "Boolean": (self.slave.setBoolean, bool),
                "String": (self.slave.setString, str),
            }[variable.type]
            self._call(f"set {name}", start, setter, [variable.valueReference], [kind(value)])
        self._call("enterInitializationMode", start, self.slave.enterInitializationMode)

    def finish_initialisation(self, start: float) -> None:
        """Leave initialisation mode."""
        self._call("exitInitializationMode", start, self.slave.exitInitializationMode)

    def bind(self, inputs: list[str], outputs: list[str], input_address: int, output_address: int) -> None:
        """Lay out the buffers: inputs and outputs lie at these addresses in the master's arrays of doubles."""
        for name in inputs:
            if self.variable(name).causality != "input":
                raise MasterError(f"{self.name}.{name} is no input")
        fed, shown = (self._references(names) for names in (inputs, outputs))
        # PyDLL keeps the interpreter's lock over a call: the unit needs it at once, and there is nobody else to run.
        library = PyDLL(None, handle=self.slave.dll._handle)
        self._set = _raw(library, "fmi2SetReal", (c_void_p, c_void_p, c_size_t, c_void_p))
        self._get = _raw(library, "fmi2GetReal", (c_void_p, c_void_p, c_size_t, c_void_p))
        self._step = _raw(library, "fmi2DoStep", (c_void_p, c_double, c_double, c_int))
        self._component = c_void_p(self.slave.component)
        self._set_arguments = (self._component, fed, c_size_t(len(inputs)), c_void_p(input_address))
        self._get_arguments = (self._component, shown, c_size_t(len(outputs)), c_void_p(output_address))
        self._is_fed, self._is_shown = bool(inputs), bool(outputs)

    def _references(self, names: list[str]) -> c_void_p:
        """Pointer to an array of value references, which this instance keeps alive."""
        array = (c_uint * len(names))(*(self.variable(name).valueReference for name in names))
        self._kept.append(array)
        return cast(array, c_void_p)

    def put(self, time: float) -> None:
        """Hand the inputs over."""
        if self._is_fed and ((status := self._set(*self._set_arguments)) or self.worst):
            self._judge("setReal", time, status)

    def fetch(self, time: float) -> None:
        """Take the outputs."""
        if self._is_shown and ((status := self._get(*self._get_arguments)) or self.worst):
            self._judge("getReal", time, status)

    def step(self, time: float, step: float) -> None:
        """Step from ``time`` by ``step`` [s]."""
        if (status := self._step(self._component, time, step, 1)) or self.worst:
            self._judge("doStep", time, status)

    def _judge(self, call: str, time: float, status: int) -> None:
        """Raise for anything worse than a warning."""
        if status > WARNING:
            self.fail(call, time, status)
        self.check_messages(call, time)

    def close(self) -> None:
        """Free the instance and its folder."""
        try:
            if getattr(self.slave, "component", None):
                self.slave.terminate()
                self.slave.freeInstance()
        finally:
            del _LISTENERS[self._key]
            shutil.rmtree(self.folder, ignore_errors=True)


def _raw(library: Any, name: str, arguments: tuple[Any, ...]) -> Any:
    """Return a function of the library with its own argument types: fmpy's prototypes stay as they are."""
    function = library[name]
    function.argtypes = arguments
    function.restype = c_int
    return function


def address(array: Any) -> int:
    """Address of a NumPy array's first double."""
    return cast(array.ctypes.data_as(POINTER(c_double)), c_void_p).value or 0
