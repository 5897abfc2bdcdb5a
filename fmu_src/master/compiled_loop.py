"""The master's loop in machine code, for units that need no Python: C calls C, 3 calls a unit and step.

A call through ctypes takes about 2 us, a step of a native unit less than one. numba compiles the loop and calls the
units' functions by their addresses; it allocates nothing, keeps no lock, and stops at the first status that is worse
than a warning.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from ctypes import addressof, c_uint
from functools import cache
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

from .instance import Instance
from .layout import Layout

COLUMNS = ("component", "set", "step", "get", "inputs", "inputs_count", "fed", "outputs", "outputs_count", "shown")
"""What the loop knows of a unit: addresses, and lengths."""

_CALLS = ("setReal", "doStep", "getReal")


def _call(builder: Any, address: Any, arguments: Sequence[Any]) -> Any:
    """Call the C function at an address; it returns a status."""
    kind = ir.FunctionType(ir.IntType(32), [argument.type for argument in arguments])
    return builder.call(builder.inttoptr(address, kind.as_pointer()), arguments)


def _transfer_call(typing: Any, function: Any, component: Any, references: Any, count: Any, values: Any) -> Any:
    """fmi2SetReal or fmi2GetReal at the address ``function``."""

    def emit(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        to = cgutils.voidptr_t
        pointers = [builder.inttoptr(given[i], to) for i in (1, 2)]
        return _call(builder, given[0], [*pointers, given[3], builder.inttoptr(given[4], to)])

    return types.int32(*(types.int64,) * 5), emit


def _do_step_call(typing: Any, function: Any, component: Any, time: Any, step: Any) -> Any:
    """fmi2DoStep at the address ``function``."""

    def emit(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        component = builder.inttoptr(given[1], cgutils.voidptr_t)
        return _call(builder, given[0], [component, given[2], given[3], ir.Constant(ir.IntType(32), 1)])

    return types.int32(types.int64, types.int64, types.float64, types.float64), emit


_transfer: Any = intrinsic(_transfer_call)
_do_step: Any = intrinsic(_do_step_call)


@numba.njit(nogil=True)
def _loop(units, sources, fed, shown, record, step, first):
    """Take len(record) steps from ``first`` on; return (step, unit, call, status) of the first refusal, or -1, zeros.

    ``units`` has a row of :data:`COLUMNS` per unit.
    """
    for k in range(len(record)):
        for i in range(len(sources)):
            fed[i] = shown[sources[i]]
        for u in range(len(units)):
            if units[u, 5] > 0:
                status = _transfer(units[u, 1], units[u, 0], units[u, 4], units[u, 5], units[u, 6])
                if status > 1:
                    return first + k, u, 0, status
            status = _do_step(units[u, 2], units[u, 0], (first + k) * step, step)
            if status > 1:
                return first + k, u, 1, status
            if units[u, 8] > 0:
                status = _transfer(units[u, 3], units[u, 0], units[u, 7], units[u, 8], units[u, 9])
                if status > 1:
                    return first + k, u, 2, status
        record[k] = shown
    return -1, 0, 0, 0


@cache
def _kept_loop() -> Any:
    """Give the loop, whose machine code is kept sealed on the disk."""
    return kept_on_disk(_loop, sha256(Path(__file__).read_bytes()).hexdigest()[:16])


def compiled_loop(
    units: dict[str, Instance], layout: Layout, fed: NDArray[np.float64], shown: NDArray[np.float64]
) -> Callable[[NDArray[np.float64], float, int], None]:
    """Prepare the loop; return a function of a record, a step and the number of its first step.

    It takes as many communication steps as ``record`` has rows, from t = ``first`` ``step`` on, and raises MasterError
    where a unit answers worse than a warning: unit, call, time and reason. Row k receives the outputs at
    (first + k + 1) ``step`` [s].

    Parameters
    ----------
    units : dict
        Native units by name, in the order of the arrays.
    layout : Layout
    fed, shown : ndarray
        Inputs and outputs of all units; ``shown`` holds the outputs at t = 0.
    """
    everyone = list(units.values())
    kept: list[Any] = []  # what the addresses point at
    rows = []
    first_in = first_out = 0
    for name, unit in units.items():
        row = [unit.component(), *(unit.address(call) for call in _CALLS)]
        for names, values, first in (
            (layout.inputs[name], fed, first_in),
            (layout.outputs[name], shown, first_out),
        ):
            references = (c_uint * max(len(names), 1))(*(unit.variable(name).valueReference for name in names))
            kept.append(references)
            row += [addressof(references), len(names), values.ctypes.data + first * values.itemsize]
        rows.append(row)
        first_in, first_out = first_in + len(layout.inputs[name]), first_out + len(layout.outputs[name])
    table = np.array(rows, dtype=np.int64)
    loop = _kept_loop()
    loop(table[:0], layout.sources, fed, shown, np.empty((0, len(shown))), 1.0, 0)  # compiled, or loaded, here

    def run(record: NDArray[np.float64], step: float, first: int) -> None:
        k, u, call, status = loop(table, layout.sources, fed, shown, record, step, first)
        if k >= 0:
            everyone[u].log.check(_CALLS[call], k * step, status)

    run.kept = kept  # type: ignore[attr-defined]
    return run
