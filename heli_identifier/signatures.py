"""Check the arguments of functions against their type annotations."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import wraps
from inspect import formatannotation, signature
from numbers import Integral, Real
from types import UnionType
from typing import Any, ParamSpec, TypeVar, Union, get_args, get_origin, get_type_hints

from heli_identifier.errors import ConfigurationError

P = ParamSpec("P")
R = TypeVar("R")


def check_types(function: Callable[P, R]) -> Callable[P, R]:
    """Raise a ConfigurationError for an argument that is not of its annotated type; it says which type is needed."""
    parameters = signature(function)

    @wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        hints = get_type_hints(function)
        for name, value in parameters.bind(*args, **kwargs).arguments.items():
            if wrong := _find_wrong_type(value, hints[name]):
                needed = re.sub(r"\w+\.", "", formatannotation(hints[name]))  # without the names of modules
                raise ConfigurationError(f"{name} is of type {wrong}; needed: {needed}.")
        return function(*args, **kwargs)

    return checked


def _find_wrong_type(value: Any, hint: Any) -> str:
    """Name the type of a value that a hint does not accept, and of its first wrong item; empty if it accepts it."""
    origin, parts, kind = get_origin(hint) or hint, get_args(hint), type(value).__name__
    if origin in (Union, UnionType):
        wrong = [_find_wrong_type(value, part) for part in parts]
        return max(wrong, key=len) if all(wrong) else ""
    if origin is Sequence and isinstance(value, Iterable) and not isinstance(value, str | Mapping):
        items = value if isinstance(value, Sequence) else ()  # an iterator must not be used up here
        item = next(filter(None, (_find_wrong_type(item, parts[0]) for item in items)), "")
        return item and f"{kind}, with {item} in it"
    accepted = {float: Real, int: Integral}.get(origin, origin)
    fits = not isinstance(accepted, type) or (isinstance(value, accepted) and origin is not Sequence)
    return "" if fits else kind
