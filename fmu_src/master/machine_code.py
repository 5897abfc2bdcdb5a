"""The master's loop over native units as machine code, which calls the functions of the units by their addresses.

A call through ctypes takes about 2 us, a step of a native unit less than one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from heli_plant.compiled import kept_on_disk

from .instance import Array, Instance


class Loop:
    """Steps of some units, whose outputs ``shown`` feed their inputs ``fed`` by way of the indices ``sources``."""

    def __init__(self, units: Sequence[Instance], sources: NDArray[np.intp], fed: Array, shown: Array) -> None:
        self.units, worst = units, np.zeros(len(units), dtype=np.int64)
        for k, unit in enumerate(units):
            worst[k], unit.worst = unit.worst[0], worst[k : k + 1]
        self._arrays = np.array([unit.row() for unit in units], dtype=np.int64), sources, fed, shown, worst
        self._steps = kept_on_disk(step_all)
        self(np.empty((0, len(shown))), 1.0, 0)  # compiled, or loaded, here

    def __call__(self, record: Array, step: float, first: int) -> None:
        """Take a step [s] for each row of ``record``, from t = ``first`` steps on; row k gets ``shown`` behind it."""
        k, u, call, status = self._steps(*self._arrays, record, step, first)
        if k >= 0:
            self.units[u].check(("setReal", "doStep", "getReal")[call], k * step, status)


def _call(typing: Any, function: Any, arguments: Any) -> Any:
    """Call the C function at the address ``function``; pointers are integers, as they are to the machine."""

    def emit(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        values = cgutils.unpack_tuple(builder, given[1])
        kind = ir.FunctionType(ir.IntType(32), [value.type for value in values])
        return builder.call(builder.inttoptr(given[0], kind.as_pointer()), values)

    return types.int32(function, arguments), emit


call: Any = intrinsic(_call)

COMPONENT, STEP, PUT, GET = 0, 1, 2, 6
"""Places in a unit's row; behind the function at PUT or GET stand references, their number, and values."""


@numba.njit
def transfer(unit: Any, at: int) -> Any:
    """Set (PUT) or get (GET) the values of a unit; return the status."""
    if unit[at + 2] == 0:
        return np.int32(0)
    return call(unit[at], (unit[COMPONENT], unit[at + 1], unit[at + 2], unit[at + 3]))


@numba.njit
def step_all(
    units: Any, sources: Any, fed: Any, shown: Any, worst: Any, record: Any, step: float, first: int
) -> tuple[int, int, int, int]:
    """Take len(record) steps from ``first`` on; return (step, unit, call, status) of the first refusal, or -1, zeros.

    ``units`` has the row of each unit, ``worst`` the worst status that each has logged.
    """
    for k in range(len(record)):
        for i in range(len(sources)):
            fed[i] = shown[sources[i]]
        for u in range(len(units)):
            unit = units[u]
            status = transfer(unit, PUT)
            if status > 1 or worst[u] > 1:
                return first + k, u, 0, status
            status = call(unit[STEP], (unit[COMPONENT], (first + k) * step, step, np.int32(1)))
            if status > 1 or worst[u] > 1:
                return first + k, u, 1, status
            status = transfer(unit, GET)
            if status > 1 or worst[u] > 1:
                return first + k, u, 2, status
        record[k] = shown
    return -1, 0, 0, 0
