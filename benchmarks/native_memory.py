"""What a unit remembers, read out of the bytes of its serialised state: the identifier's Gamma, its count of samples.

A native unit writes its variables, then its memory: the fields of the identifier's NamedTuples in their order, each
float as a C double, each int as eight bytes, a list behind its length, an optional value behind a flag. A unit in
Python writes the same memory as JSON.
"""

import json
import struct
import types
from collections.abc import Iterator
from typing import Any, Union, get_args, get_origin, get_type_hints

from fmu_src.master.instance import Instance
from heli_identifier.online import IdentifierState, Sampled, thawed_state

Missing = type(None)


def identifier_state(unit: Instance) -> IdentifierState:
    """Return what an AdaptiveIdentifier remembers; it has taken at least one sample."""
    data = _serialised(unit)
    if not unit.is_native:
        return thawed_state(json.loads(data)["hidden"][0][0], IdentifierState)
    memory = _Bytes(data)
    # token, sum, whether it has Model Exchange, phase, failure, whether initialised, two times
    memory.skip(data.index(b"\0") + 1 + 8 + 1 + 8 + 8 + 1 + 1 + 8 + 8)
    for variable in unit.description.modelVariables:
        memory.skip(8 + 1 + 8)
        if variable.type == "String":
            memory.skip(memory.take("q"))
    sampling, _ = memory.take("?"), memory.take("?")
    sampled: Sampled = _value(Sampled, memory)
    if not sampling or memory.at != len(data):
        raise ValueError(f"{len(data) - memory.at} bytes are left of the state")
    return sampled.state


def _serialised(unit: Instance) -> bytes:
    state = unit.slave.getFMUState()
    data = unit.slave.serializeFMUstate(state)
    unit.slave.freeFMUState(state)
    return bytes(data)


class _Bytes:
    """Bytes and the place up to which they are read."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, 0

    def skip(self, count: int) -> None:
        self.at += count

    def take(self, kind: str) -> Any:
        (value,) = struct.unpack_from(f"<{kind}", self.data, self.at)
        self.at += struct.calcsize(f"<{kind}")
        return value


def _value(kind: Any, memory: _Bytes) -> Any:
    """Read one value of a type."""
    if kind in (float, int, bool):
        return memory.take({float: "d", int: "q", bool: "?"}[kind])
    if get_origin(kind) in (Union, types.UnionType):
        (inner,) = [one for one in get_args(kind) if one is not Missing]
        return _value(inner, memory) if memory.take("?") else None
    if get_origin(kind) is tuple:
        return tuple(_value(inner, memory) for inner in _items(get_args(kind), memory))
    return kind(*(_value(inner, memory) for inner in get_type_hints(kind).values()))


def _items(inner: tuple[Any, ...], memory: _Bytes) -> Iterator[Any]:
    if inner[-1] is Ellipsis:
        yield from (inner[0] for _ in range(memory.take("q")))
    else:
        yield from inner
