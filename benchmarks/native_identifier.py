"""The compiled identifier unit over whole records: the AdaptiveIdentifier's native twin, driven by its FMI functions.

The twin has the bits of the unit in Python (:mod:`tests.test_native_units`) and takes a sample in 5 to 15 us, so that
figures over many rigs and over ten million steps are figures of the unit itself.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import addressof, c_uint
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from fmu_src.master.compiled_loop import _do_step, _transfer
from fmu_src.master.instance import Instance
from fmu_src.native import build_native
from fmu_src.variables import Value
from heli_identifier.online import Estimate, ModelParameters
from heli_plant.parameter_table import BY_FIELD

INPUTS = ("v_front", "v_rear", "pitch", "elevation", "travel")
NAMES = ModelParameters._fields


@numba.njit(cache=True, nogil=True)
def _drive(unit, rows, fed, shown, record, step, first, every):
    """Take the samples ``rows`` from number ``first`` on; return the number of a refused one, or -1."""
    for k in range(len(rows)):
        for i in range(len(fed)):
            fed[i] = rows[k, i]
        status = _transfer(unit[1], unit[0], unit[4], len(fed), unit[5])
        if status <= 1:
            status = _do_step(unit[2], unit[0], (first + k) * step, step)
        if status > 1:
            return first + k
        if (k + 1) % every == 0:
            _transfer(unit[3], unit[0], unit[6], len(shown), unit[7])
            record[(k + 1) // every - 1] = shown
    return -1


class Unit:
    """An instance of the native AdaptiveIdentifier that has left its initialisation.

    Parameters
    ----------
    instance : Instance
    step : float
        Between two samples [s].
    outputs : sequence of str
        What :meth:`take` records.
    """

    def __init__(self, instance: Instance, step: float, outputs: tuple[str, ...]) -> None:
        self.instance, self.step, self.outputs, self.taken = instance, step, outputs, 0
        self._fed, self._shown = np.zeros(len(INPUTS)), np.zeros(len(outputs))
        given, asked = (
            (c_uint * len(names))(*(instance.variable(name).valueReference for name in names))
            for names in (INPUTS, outputs)
        )
        self._references = given, asked
        functions = [instance.address(call) for call in ("setReal", "doStep", "getReal")]
        places = [addressof(given), self._fed.ctypes.data, addressof(asked), self._shown.ctypes.data]
        self._unit = np.array([instance.component(), *functions, *places], dtype=np.int64)

    def take(self, rows: NDArray[np.float64], every: int) -> NDArray[np.float64]:
        """Take samples (N, 5); return the outputs after every so many of them, (N // every, len(outputs))."""
        record = np.empty((len(rows) // every, len(self.outputs)))
        rows = np.ascontiguousarray(rows, dtype=float)
        refused = _drive(self._unit, rows, self._fed, self._shown, record, self.step, self.taken, every)
        if refused >= 0:
            raise RuntimeError(f"sample {refused}: {self.instance.log.messages}")
        self.taken += len(rows)
        return record


class Units:
    """Instances of one build of the unit."""

    def __init__(self, folder: Path) -> None:
        self._fmu, self._folder, self._numbers = build_native("AdaptiveIdentifier", folder), folder, count()

    @contextmanager
    def unit(self, step: float, outputs: tuple[str, ...], **parameters: Value) -> Iterator[Unit]:
        """Give an instance with these parameters (dots written as two underscores); it is freed afterwards."""
        given = {"sample.time": step, **{name.replace("__", "."): value for name, value in parameters.items()}}
        alarm: list[Any] = []
        instance = Instance("identifier", self._fmu, self._folder / f"unit-{next(self._numbers)}", alarm)
        try:
            instance.initialise(given, 0.0, 1e9)
            instance.finish_initialisation(0.0)
            yield Unit(instance, step, outputs)
        finally:
            instance.close()

    def last(self, log: Any, **parameters: Value) -> dict[str, Estimate]:
        """Return the estimates after a log, by symbol, and the motors' lag as T_m."""
        lag = "motor_lag"
        outputs = (*NAMES, lag, *(f"standard_error.{name}" for name in (*NAMES, lag)))
        with self.unit(log.step, outputs, **parameters) as unit:
            found = unit.take(np.column_stack((log.voltages, log.angles)), len(log.angles))[-1]
        names = (*NAMES, "T_m")
        values, errors = found[: len(names)].tolist(), found[len(names) :].tolist()
        return {
            name: Estimate(value, error, BY_FIELD[name].unit)
            for name, value, error in zip(names, values, errors, strict=True)
        }


@contextmanager
def built_units() -> Iterator[Units]:
    """Build the native unit in a temporary folder."""
    with TemporaryDirectory(prefix="heli-identifier-") as folder:
        yield Units(Path(folder))
