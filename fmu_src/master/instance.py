"""One unit under the master: an instance of an FMU and its three calls of a communication step (:mod:`.tape`).

Every status is checked. Anything worse than a warning becomes a :class:`fmu_src.errors.MasterError` that names unit,
call and time and quotes the unit's log (:mod:`.unit_log`).
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from ctypes import PyDLL, byref, c_double, c_int, c_size_t, c_uint, c_void_p, cast
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
from .tape import Call, Clock
from .unit_log import UnitLog
from .unpacking import unpacked

_NO_EARLIER_STATE = c_int.from_param(1)
"""Argument of fmi2DoStep: the master will not restore a state from before the step."""

_KEYS = count(1)
_LOGS: dict[int, UnitLog] = {}
"""Logs by component environment, because fmpy's logger proxy serves one callback function per process."""


def _hear(environment: int | None, _name: bytes, status: int, _category: bytes, message: bytes) -> None:
    """Logger callback of every instance."""
    log = _LOGS.get(environment or 0)
    if log is not None:
        log.hear(status, message.decode("utf-8", "replace"))


_LOGGER = fmi2CallbackLoggerTYPE(_hear)
_ALLOCATE = fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
_FREE = fmi2CallbackFreeMemoryTYPE(fmpy.free)


class Instance:
    """An instantiated unit.

    Parameters
    ----------
    name : str
        Its name in the scenario.
    fmu : Path
        The FMU file.
    folder : Path
        Where the FMU is unpacked; it does not exist yet.
    alarm : list of UnitLog
        Shared by the instances of a run (:class:`.unit_log.UnitLog`).
    """

    def __init__(self, name: str, fmu: Path, folder: Path, alarm: list[UnitLog]) -> None:
        self.name = name
        self.log = UnitLog(name, alarm)
        self.folder = str(folder)
        self.description = unpacked(name, fmu, folder)
        self.variables = {variable.name: variable for variable in self.description.modelVariables}
        self.outputs = [name for name, v in self.variables.items() if v.causality == "output" and v.type == "Real"]
        self._key = next(_KEYS)
        _LOGS[self._key] = self.log
        try:
            self._instantiate()
        except BaseException:
            self.close()
            raise

    def _instantiate(self) -> None:
        """Load the unit's library and instantiate the unit."""
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

    def _call(self, call: str, time: float, function: Any, *arguments: Any, **options: Any) -> Any:
        """Run one of fmpy's methods; its failure becomes a MasterError."""
        try:
            value = function(*arguments, **options)
        except FMICallException as problem:
            self.log.check(call, time, problem.status)
            raise
        except Exception as problem:  # fmpy raises a bare Exception when a unit cannot be loaded or instantiated
            said = "; ".join([str(problem), *self.log.messages])
            raise MasterError(f"{self.name}.{call} at t = {time:g} s: {said}") from problem
        self.log.check(call, time)
        return value

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
                raise MasterError(f"{self.name}.{name} is not a parameter; its causality is {variable.causality}")
            setter, kind, wanted = {
                "Real": (self.slave.setReal, float, "a number"),
                "Integer": (self.slave.setInteger, int, "a whole number"),
                "Boolean": (self.slave.setBoolean, bool, "true or false"),
                "String": (self.slave.setString, str, "text"),
            }[variable.type]
            # the unit checks the range; here only what cannot be converted to the variable's type
            if isinstance(value, str) != (kind is str) or (kind is int and not float(value).is_integer()):
                raise MasterError(f"{self.name}.{name} = {value!r} must be {wanted}")
            self._call(f"set {name}", start, setter, [variable.valueReference], [kind(value)])
        self._call("enterInitializationMode", start, self.slave.enterInitializationMode)

    def finish_initialisation(self, start: float) -> None:
        """Leave initialisation mode."""
        self._call("exitInitializationMode", start, self.slave.exitInitializationMode)

    def reset(self) -> None:
        """Set the unit back to where it was when it was instantiated."""
        self.log.clear()
        self._call("reset", 0.0, self.slave.reset)

    def bind(
        self, inputs: list[str], outputs: list[str], fed: NDArray[np.float64], shown: NDArray[np.float64], clock: Clock
    ) -> None:
        """Prepare the calls of a step: ``puts``, ``steps`` and ``fetches``, each a list of at most one call.

        Parameters
        ----------
        inputs, outputs : list of str
            Variables that are set and read in every step.
        fed, shown : ndarray, shapes (len(inputs),) and (len(outputs),)
            Contiguous; the calls read ``fed`` and write ``shown`` in place.
        clock : Clock

        Raises
        ------
        MasterError
            A name is no input, or no variable of the unit.
        """
        for name in inputs:
            causality = self.variable(name).causality
            if causality != "input":
                raise MasterError(f"{self.name}.{name} is not an input; its causality is {causality}")
        component = c_void_p.from_param(self.slave.component)
        self.puts = self._transfer("setReal", component, inputs, fed)
        self.steps = [self._prepared("doStep", component, clock.time, clock.step, _NO_EARLIER_STATE)]
        self.fetches = self._transfer("getReal", component, outputs, shown)

    def _transfer(self, call: str, component: Any, names: list[str], values: NDArray[np.float64]) -> list[Call]:
        """Return the call that moves these variables to or from ``values``; no call if there are no variables."""
        if not names:
            return []
        references = (c_uint * len(names))(*(self.variable(name).valueReference for name in names))
        buffer = (c_double * len(names)).from_buffer(values.data)
        return [self._prepared(call, component, byref(references), c_size_t.from_param(len(names)), byref(buffer))]

    def _prepared(self, call: str, *arguments: Any) -> Call:
        """Return a call of the FMU (``doStep``: fmi2DoStep) with its C arguments, which the call keeps alive."""
        # PyDLL keeps the interpreter's lock over a call: the unit needs it at once, and no other thread has to run.
        library = PyDLL(None, handle=self.slave.dll._handle)
        return Call(self.log, call, partial(library[f"fmi2{call[0].upper()}{call[1:]}"], *arguments))

    @property
    def is_native(self) -> bool:
        """Whether the unit is C code of this project: it refuses by its status, and needs no interpreter."""
        return str(self.description.generationTool).startswith("heli-twin")

    def component(self) -> int:
        """Return the address of the instance."""
        return int(self.slave.component)

    def address(self, call: str) -> int:
        """Return the address of a function of the FMU (``doStep``: fmi2DoStep)."""
        function = PyDLL(None, handle=self.slave.dll._handle)[f"fmi2{call[0].upper()}{call[1:]}"]
        return int(cast(function, c_void_p).value or 0)

    def close(self) -> None:
        """Free the instance and its folder."""
        try:
            slave: Any = getattr(self, "slave", None)
            if getattr(slave, "component", None):
                slave.terminate()
                slave.freeInstance()
        finally:
            del _LOGS[self._key]
            shutil.rmtree(self.folder, ignore_errors=True)
