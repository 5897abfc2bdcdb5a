"""The state of a unit as lists that ``json.dumps`` writes and ``json.loads`` reads back bit for bit.

A state is nested NamedTuples, sets of parameters, tuples and lists of numbers and texts; the annotations are the schema
by which it comes back.
"""

from functools import cache
from typing import Any, Union, get_args, get_origin, get_type_hints

_hints = cache(get_type_hints)


def freeze_state(state: Any) -> Any:
    """Return a copy of a state as lists."""
    nested = isinstance(state, (tuple, list)) or hasattr(state, "_fields")
    return [freeze_state(one) for one in state] if nested else state


def thaw_state(saved: Any, kind: Any) -> Any:
    """Return the state of type ``kind``, a NamedTuple, tuple or list, or one of these or None, saved as lists."""
    if get_origin(kind) is Union:  # with None
        (kind,) = (one for one in get_args(kind) if one is not type(None))
    if not isinstance(saved, (tuple, list)):
        return saved
    if hasattr(kind, "_fields"):
        hints, pairs = _hints(kind), zip(kind._fields, saved, strict=True)
        return kind(**{name: thaw_state(one, hints.get(name, float)) for name, one in pairs})
    kinds = get_args(kind)
    if len(kinds) < 2 or kinds[1] is Ellipsis:
        kinds = kinds[:1] * len(saved)
    return get_origin(kind)(thaw_state(one, own) for one, own in zip(saved, kinds, strict=True))
