"""The native AdaptiveIdentifier over whole records, and its memory out of its serialised state.

The unit has the bits of the one in Python (tests/test_native_units.py) and takes a sample in some 10 us.
"""

import struct
import types
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from fmu_src.master.instance import Instance
from fmu_src.native import build_native
from fmu_src.variables import Value
from heli_identifier.online import IdentifierState, Sampled
from heli_identifier.records import Log

INPUTS = ("v_front", "v_rear", "pitch", "elevation", "travel")


class Units:
    """Runs of one build of the unit."""

    def __init__(self, folder: Path) -> None:
        self._fmu, self._folder, self._numbers = build_native("AdaptiveIdentifier", folder), folder, count()

    def run(self, log: Log, outputs: tuple[str, ...], every: int, parameters: dict[str, Value]) -> NDArray[np.float64]:
        """Feed a log to a new instance; give ``outputs`` after every so many samples, (N // every, len(outputs))."""
        unit, record = Instance("identifier", self._fmu, self._folder / f"unit-{next(self._numbers)}"), []
        try:
            unit.initialise({"sample.time": log.step, **parameters}, 0.0, 1e9)
            unit.finish_initialisation(0.0)
            given, asked = ([unit.variable(name).valueReference for name in names] for names in (INPUTS, outputs))
            for k, row in enumerate(np.column_stack((log.voltages, log.angles)).tolist(), 1):
                unit.slave.setReal(given, row)
                unit.slave.doStep(currentCommunicationPoint=(k - 1) * log.step, communicationStepSize=log.step)
                if k % every == 0:
                    record.append(unit.slave.getReal(asked))
        finally:
            unit.close()
        return np.array(record)


@contextmanager
def built_units() -> Iterator[Units]:
    """Build the native unit in a temporary folder."""
    with TemporaryDirectory(prefix="heli-identifier-") as folder:
        yield Units(Path(folder))


def identifier_state(unit: Instance) -> IdentifierState:
    """Return what a native AdaptiveIdentifier remembers; it has taken at least one sample.

    Its serialised state holds its variables, then its memory: the fields of the identifier's NamedTuples in their
    order, a float as a C double, an int as eight bytes, a list behind its length, an optional value behind a flag.
    """
    state = unit.slave.getFMUState()
    data = bytes(unit.slave.serializeFMUstate(state))
    unit.slave.freeFMUState(state)
    # token, sum, whether it has Model Exchange, phase, failure, whether initialised, two times
    at = data.index(b"\0") + 1 + 8 + 1 + 8 + 8 + 1 + 1 + 8 + 8

    def take(kind: str) -> Any:
        nonlocal at
        at += struct.calcsize(f"<{kind}")
        return struct.unpack_from(f"<{kind}", data, at - struct.calcsize(f"<{kind}"))[0]

    def value(kind: Any) -> Any:
        if kind in (float, int, bool):
            return take({float: "d", int: "q", bool: "?"}[kind])
        if get_origin(kind) in (Union, types.UnionType):
            (inner,) = [one for one in get_args(kind) if one is not type(None)]
            return value(inner) if take("?") else None
        if get_origin(kind) is tuple:
            kinds = get_args(kind)
            return tuple(value(one) for one in (kinds[:1] * take("q") if kinds[-1] is Ellipsis else kinds))
        return kind(*(value(inner) for inner in get_type_hints(kind).values()))

    for variable in unit.description.modelVariables:
        at += 8 + 1 + 8
        if variable.type == "String":
            length = take("q")
            at += length
    take("?")  # whether it has warned
    sampled: Sampled | None = value(Sampled | None)
    if sampled is None or at != len(data):
        raise ValueError(f"{len(data) - at} bytes are left of the state")
    return sampled.state
