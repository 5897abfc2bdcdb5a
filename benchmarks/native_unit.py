"""The native AdaptiveIdentifier over whole records, driven by its FMI functions in machine code, and its memory.

The unit has the bits of the one in Python (tests/test_native_units.py) and takes a sample in 5 to 15 us, so that
figures over many rigs and over millions of steps are figures of the unit itself.
"""

import json
import struct
import types
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Union, get_args, get_origin, get_type_hints

import numba
import numpy as np
from numpy.typing import NDArray

from fmu_src.master import loop as machine
from fmu_src.master.instance import Instance
from fmu_src.native import build_native
from fmu_src.state import thawed_state
from fmu_src.variables import Value
from heli_identifier.online import IdentifierState, Sampled

INPUTS = ("v_front", "v_rear", "pitch", "elevation", "travel")

Array = NDArray[np.float64]


@numba.njit(cache=True, nogil=True)
def _drive(unit, rows, fed, shown, record, step, every):  # type: ignore[no-untyped-def]
    """Take samples; return the number of a refused one, or -1."""
    for k in range(len(rows)):
        for i in range(len(fed)):
            fed[i] = rows[k, i]
        status = machine.transfer(unit, machine.PUT)
        if status <= 1:
            status = machine.call(unit[machine.STEP], (unit[machine.COMPONENT], k * step, step, np.int32(1)))
        if status > 1:
            return k
        if (k + 1) % every == 0:
            machine.transfer(unit, machine.GET)
            record[(k + 1) // every - 1] = shown
    return -1


class Units:
    """Runs of one build of the unit."""

    def __init__(self, folder: Path) -> None:
        self._fmu, self._folder, self._numbers = build_native("AdaptiveIdentifier", folder), folder, count()

    def run(self, log: Any, outputs: tuple[str, ...], every: int, parameters: dict[str, Value]) -> Array:
        """Feed a log to a new instance; give ``outputs`` after every so many samples, (N // every, len(outputs))."""
        instance = Instance("identifier", self._fmu, self._folder / f"unit-{next(self._numbers)}")
        rows = np.ascontiguousarray(np.column_stack((log.voltages, log.angles)), dtype=float)
        record, fed, shown = np.empty((len(rows) // every, len(outputs))), np.zeros(len(INPUTS)), np.zeros(len(outputs))
        try:
            instance.initialise({"sample.time": log.step, **parameters}, 0.0, 1e9)
            instance.finish_initialisation(0.0)
            instance.connect(list(INPUTS), fed, list(outputs), shown)
            unit = np.array(instance.row(), dtype=np.int64)
            refused = _drive(unit, rows, fed, shown, record, log.step, every)
            if refused >= 0:
                raise RuntimeError(f"sample {refused}: {instance.messages}")
        finally:
            instance.close()
        return record


@contextmanager
def built_units() -> Iterator[Units]:
    """Build the native unit in a temporary folder."""
    with TemporaryDirectory(prefix="heli-identifier-") as folder:
        yield Units(Path(folder))


# --- memory ------------------------------------------------------------------------------------------------------


def identifier_state(unit: Instance) -> IdentifierState:
    """Return what an AdaptiveIdentifier remembers, out of its serialised state; it has taken at least one sample.

    A native unit writes its variables, then its memory: the fields of the identifier's NamedTuples in their order, a
    float as a C double, an int as eight bytes, a list behind its length, an optional value behind a flag. A unit in
    Python writes the same memory as JSON.
    """
    state = unit.slave.getFMUState()
    data = bytes(unit.slave.serializeFMUstate(state))
    unit.slave.freeFMUState(state)
    if not unit.is_native:
        return thawed_state(json.loads(data)["hidden"][0][0], IdentifierState)
    memory = _Bytes(data)
    # token, sum, whether it has Model Exchange, phase, failure, whether initialised, two times
    memory.at += data.index(b"\0") + 1 + 8 + 1 + 8 + 8 + 1 + 1 + 8 + 8
    for variable in unit.description.modelVariables:
        memory.at += 8 + 1 + 8
        if variable.type == "String":
            length = memory.take("q")
            memory.at += length
    memory.take("?")  # whether it has warned
    sampled: Sampled | None = memory.value(Sampled | None)
    if sampled is None or memory.at != len(data):
        raise ValueError(f"{len(data) - memory.at} bytes are left of the state")
    return sampled.state


class _Bytes:
    """Bytes and the place up to which they are read."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, 0

    def take(self, kind: str) -> Any:
        (value,) = struct.unpack_from(f"<{kind}", self.data, self.at)
        self.at += struct.calcsize(f"<{kind}")
        return value

    def value(self, kind: Any) -> Any:
        """Read one value of a type."""
        if kind in (float, int, bool):
            return self.take({float: "d", int: "q", bool: "?"}[kind])
        if get_origin(kind) in (Union, types.UnionType):
            (inner,) = [one for one in get_args(kind) if one is not type(None)]
            return self.value(inner) if self.take("?") else None
        if get_origin(kind) is tuple:
            kinds = get_args(kind)
            return tuple(self.value(one) for one in (kinds[:1] * self.take("q") if kinds[-1] is Ellipsis else kinds))
        return kind(*(self.value(inner) for inner in get_type_hints(kind).values()))
