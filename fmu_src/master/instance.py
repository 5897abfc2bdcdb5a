"""One unit under the master: its FMU unpacked and loaded, its calls from first to last, its inputs and outputs.

After every call except terminate both status and log are checked, because a pythonfmu unit cannot refuse a set call by
its status. Anything worse than a warning becomes a MasterError that names unit, call and time and quotes the messages.

Loading a unit runs its code with the rights of the user; nothing here can prevent that. But an archive cannot write
outside its folder or fill the disk, and its description cannot read other files.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from contextlib import suppress
from ctypes import addressof, byref, c_double, c_int64, c_size_t, c_void_p, cast
from pathlib import Path
from typing import Any
from urllib.parse import unquote_to_bytes

import fmpy
import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.logging import addLoggerProxy
from lxml import etree
from numpy.typing import NDArray

from heli_identifier import processes
from heli_identifier.files import check_zip
from heli_plant.errors import did_you_mean

from ..errors import MasterError
from ..variables import LARGEST, TYPES, Value, Variable, problem_with

Array = NDArray[np.float64]

WARNING = 1
_STATUSES = ("ok", "warning", "discard", "error", "fatal", "pending")

_INSTANCES: dict[int, Instance] = {}  # by component environment: fmpy's logger proxy serves one callback per process


def _receive_message(environment: int | None, _name: bytes, status: int, _category: bytes, message: bytes) -> None:
    """Logger callback of every instance."""
    unit = _INSTANCES.get(environment or 0)
    if unit is not None:
        unit.messages.append(message.decode("utf-8", "replace"))
        unit.worst.value = max(unit.worst.value, status)


_LOGGER = fmi2CallbackLoggerTYPE(_receive_message)


def unpack(name: str, fmu: Path, folder: Path) -> Any:
    """Unpack an FMU of any origin and return its model description, or raise MasterError if it cannot be run."""
    try:
        check_zip(fmu)
        fmpy.extract(str(fmu), str(folder))
        if not (folder / "modelDescription.xml").is_file():
            raise ValueError("it holds no modelDescription.xml")
        if etree.parse(folder / "modelDescription.xml", etree.XMLParser(resolve_entities=False)).docinfo.doctype:
            raise ValueError("its XML has a document type, which may define entities; take it out")
        description = fmpy.read_model_description(str(folder))
        if description.fmiVersion != "2.0" or description.coSimulation is None:
            kind = "model exchange" if description.coSimulation is None else "co-simulation"
            raise ValueError(f"it is for FMI {description.fmiVersion} {kind}, FMI 2.0 co-simulation is needed")
    except Exception as error:  # fmpy raises whatever its parsers raise on damaged archives and descriptions
        reason = " ".join(str(error).split()) or type(error).__name__
        raise MasterError(f"the FMU of {name}, {fmu}, cannot be used: {reason[:300]}") from error
    return description


class Instance:
    """An instantiated unit, with its name in the scenario; its FMU is unpacked into the new folder ``folder``."""

    def __init__(self, name: str, fmu: Path, folder: Path) -> None:
        processes.restart_watchdog()
        self.name, self.folder = name, str(folder)
        self.messages: list[str] = []  # its log
        self.worst = c_int64(0)  # the worst status of a message
        self.description = unpack(name, fmu, folder)
        self.variables = {variable.name: variable for variable in self.description.modelVariables}
        self.outputs = [v for v in self.variables.values() if v.causality == "output" and v.type == "Real"]
        _INSTANCES[id(self)] = self
        try:
            self.slave = self._call(
                "load", 0.0, FMU2Slave, instanceName=name, guid=self.description.guid, unzipDirectory=self.folder,
                modelIdentifier=self.description.coSimulation.modelIdentifier,
            )  # fmt: skip
            self.play = getattr(self.slave.dll, "heli_play", None)  # the loop in C, of native units of this project
            if (folder / "resources" / "slavemodule.txt").is_file():
                # a plain path for a pythonfmu unit: of a URI it would decode %20 alone, and crash on ü or #
                call = self.slave.fmi2Instantiate
                self.slave.fmi2Instantiate = lambda name, kind, guid, resources, *rest: call(
                    name, kind, guid, unquote_to_bytes(resources), *rest
                )
            memory = defaultCallbacks.allocateMemory, defaultCallbacks.freeMemory
            callbacks = fmi2CallbackFunctions(_LOGGER, *memory, componentEnvironment=id(self))
            addLoggerProxy(byref(callbacks))
            self._call("instantiate", 0.0, self.slave.instantiate, callbacks=callbacks, loggingOn=True)
        except BaseException:
            self.close()
            raise

    def check(self, call: str, time: float, status: int = 0) -> None:
        """Raise MasterError if the status of ``call`` at ``time`` [s], or one in the log, is worse than a warning."""
        worst = status if status > WARNING else self.worst.value
        if worst > WARNING:
            word = _STATUSES[worst] if worst < len(_STATUSES) else f"status {worst}"
            reason = "; ".join(self.messages) or "the unit gives no reason"
            raise MasterError(f"{self.name}.{call} at t = {time:g} s answered {word}: {reason}")

    def _call(self, call: str, time: float, function: Any, *arguments: Any, **options: Any) -> Any:
        """Run one of fmpy's methods; its failure becomes a MasterError."""
        try:
            value = function(*arguments, **options)
        except FMICallException as problem:
            self.check(call, time, problem.status)
            raise
        except Exception as problem:  # fmpy raises a bare Exception when a unit cannot be loaded or instantiated
            reason = "; ".join([str(problem), *self.messages])
            raise MasterError(f"{self.name}.{call} at t = {time:g} s: {reason}") from problem
        self.check(call, time)
        return value

    def variable(self, name: str, causality: str | None = None) -> Any:
        """Return a variable's description, or raise MasterError if there is none of this ``causality``."""
        if name not in self.variables:
            raise MasterError(f"unit {self.name} has no variable {name!r}{did_you_mean(name, tuple(self.variables))}")
        variable = self.variables[name]
        if causality not in (None, variable.causality):
            article = "an" if causality == "input" else "a"
            raise MasterError(f"{self.name}.{name} is not {article} {causality}; its causality is {variable.causality}")
        return variable

    def initialise(self, parameters: Mapping[str, Value], start: float, stop: float) -> None:
        """Set the parameters and enter initialisation mode at ``start`` [s]."""
        processes.restart_watchdog()
        self._call("setupExperiment", start, self.slave.setupExperiment, startTime=start, stopTime=stop)
        for name, value in parameters.items():
            variable = self.variable(name, "parameter")
            kind = variable.type.replace("Enumeration", "Integer")
            low, high = (-(2**31), 2**31 - 1) if kind == "Integer" else (-LARGEST, LARGEST)  # what FMI 2.0 can pass
            full = Variable(f"{self.name}.{name}", "parameter", "", kind, minimum=low, maximum=high)
            if problem := problem_with(full, value):
                raise MasterError(problem)
            setter = getattr(self.slave, f"set{kind}")
            self._call(f"set {name}", start, setter, [variable.valueReference], [TYPES[kind](value)])
        self._call("enterInitializationMode", start, self.slave.enterInitializationMode)

    def finish_initialisation(self, start: float) -> None:
        """Leave initialisation mode."""
        processes.restart_watchdog()
        self._call("exitInitializationMode", start, self.slave.exitInitializationMode)

    def reset(self) -> None:
        """Set the unit back to its state after instantiation."""
        self.messages.clear()
        self.worst.value = 0
        self._call("reset", 0.0, self.slave.reset)

    def connect(
        self, inputs: list[str], fed: Array, outputs: list[str], shown: Array, time: c_double, step: c_double
    ) -> None:
        """Connect inputs, by ``unit.variable``, to their values in ``fed``, and outputs to those in ``shown``.

        ``calls`` are those of a step of ``step`` [s] from ``time`` [s]: name, function in the library, arguments.
        """
        input_references, output_references = (
            np.array([self.variable(name.partition(".")[2], causality).valueReference for name in names], np.uint32)
            for names, causality in ((inputs, "input"), (outputs, "output"))
        )
        self._arrays = input_references, fed, output_references, shown  # keep what the addresses point to
        ins, fed_at, outs, shown_at = (array.ctypes.data for array in self._arrays)
        # fmpy's own methods copy every number twice
        put, go, get = (self.slave.dll[f"fmi2{call}"] for call in ("SetReal", "DoStep", "GetReal"))
        component, n, m, unit = self.slave.component, len(inputs), len(outputs), c_void_p(self.slave.component)
        calls = (
            ("setReal", put, (unit, c_void_p(ins), c_size_t(n), c_void_p(fed_at))),
            ("doStep", go, (unit, time, step, 1)),
            ("getReal", get, (unit, c_void_p(outs), c_size_t(m), c_void_p(shown_at))),
        )
        self.calls = [call for call, count in zip(calls, (n, 1, m), strict=True) if count]
        put_at, go_at, get_at = (cast(call, c_void_p).value for call in (put, go, get))
        # a Linked of native/c/fmi2.c
        self.loop_row = component, go_at, put_at, ins, n, fed_at, get_at, outs, m, shown_at, addressof(self.worst)

    def close(self) -> None:
        """Free the instance and its folder; a refusal to terminate is ignored: it must not hide why a run failed."""
        try:
            slave: Any = getattr(self, "slave", None)
            if getattr(slave, "component", None):
                with suppress(FMICallException):
                    slave.terminate()
                slave.freeInstance()
        finally:
            del _INSTANCES[id(self)]
            shutil.rmtree(self.folder, ignore_errors=True)
