"""The master's loop in machine code, for units that need no Python: C calls C, 3 calls a unit and step.

A call through ctypes takes about 2 us, a step of a native unit less than one. numba compiles the loop and calls the
units' functions by their addresses; it allocates nothing, keeps no lock, and stops at the first status that is worse
than a warning.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from ctypes import addressof
from hashlib import sha256
from pathlib import Path
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from heli_plant.compiled import kept_on_disk

from .instance import Place

COMPONENT, SET, STEP, GET, INPUTS, INPUTS_COUNT, FED, OUTPUTS, OUTPUTS_COUNT, SHOWN = range(10)
"""Columns of what the loop knows of a unit: addresses, and lengths."""

_CALLS = ("setReal", "doStep", "getReal")
Array = NDArray[np.float64]


def _call(typing: Any, function: Any, arguments: Any) -> Any:
    """Call the C function at the address ``function``; pointers are integers, as they are to the machine."""

    def emit(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        values = cgutils.unpack_tuple(builder, given[1])
        kind = ir.FunctionType(ir.IntType(32), [value.type for value in values])
        return builder.call(builder.inttoptr(given[0], kind.as_pointer()), values)

    return types.int32(function, arguments), emit


call: Any = intrinsic(_call)


@numba.njit(nogil=True)
def _loop(units, sources, fed, shown, record, step, first):
    """Take len(record) steps from ``first`` on; return (step, unit, call, status) of the first refusal, or -1, zeros.

    ``units`` has a row of addresses and lengths per unit.
    """
    for k in range(len(record)):
        for i in range(len(sources)):
            fed[i] = shown[sources[i]]
        for u in range(len(units)):
            unit = units[u]
            if unit[INPUTS_COUNT] > 0:
                status = call(unit[SET], (unit[COMPONENT], unit[INPUTS], unit[INPUTS_COUNT], unit[FED]))
                if status > 1:
                    return first + k, u, 0, status
            status = call(unit[STEP], (unit[COMPONENT], (first + k) * step, step, np.int32(1)))
            if status > 1:
                return first + k, u, 1, status
            if unit[OUTPUTS_COUNT] > 0:
                status = call(unit[GET], (unit[COMPONENT], unit[OUTPUTS], unit[OUTPUTS_COUNT], unit[SHOWN]))
                if status > 1:
                    return first + k, u, 2, status
        record[k] = shown
    return -1, 0, 0, 0


def unit_row(place: Place) -> list[int]:
    """Return the loop's row of a unit; its arrays have to outlive it."""
    unit, inputs, fed, outputs, shown = place
    return [
        int(unit.slave.component), *map(unit.address, _CALLS),
        addressof(inputs), len(inputs), addressof(fed), addressof(outputs), len(outputs), addressof(shown),
    ]  # fmt: skip


def compiled_loop(
    places: Sequence[Place], sources: NDArray[np.intp], fed: Array, shown: Array, step: float
) -> Callable[[Array, int], None]:
    """Prepare the loop for arrays as those of :class:`.loop.Wired`; return a function of a record and a step's number.

    It takes as many communication steps as ``record`` has rows, from t = ``first`` ``step`` on, and raises MasterError
    where a unit answers worse than a warning. Row k receives the outputs at (first + k + 1) ``step`` [s].
    """
    table = np.array([unit_row(place) for place in places], dtype=np.int64)
    loop = kept_on_disk(_loop, sha256(Path(__file__).read_bytes()).hexdigest()[:16])
    loop(table[:0], sources, fed, shown, np.empty((0, len(shown))), 1.0, 0)  # compiled, or loaded, here

    def run(record: Array, first: int) -> None:
        k, u, name, status = loop(table, sources, fed, shown, record, step, first)
        if k >= 0:
            places[u].unit.check(_CALLS[name], k * step, status)

    return run
