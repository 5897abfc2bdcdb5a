"""Check the arguments of functions against their type annotations."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import wraps
from inspect import signature
from numbers import Integral, Real
from os import PathLike
from types import NoneType, UnionType
from typing import Any, ParamSpec, TypeVar, Union, get_args, get_origin, get_type_hints

from heli_identifier.errors import ConfigurationError

P = ParamSpec("P")
R = TypeVar("R")

_NAMES = {NoneType: "None", str: "text", float: "number", int: "whole number", bool: "True or False", PathLike: "path"}


def check_types(function: Callable[P, R]) -> Callable[P, R]:
    """Raise a ConfigurationError for an argument that is not of its annotated type; it says which type is needed."""
    parameters = signature(function)

    @wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        hints = get_type_hints(function)
        for name, value in parameters.bind(*args, **kwargs).arguments.items():
            if wrong := _find_wrong_type(value, hints[name]):
                *others, last = _name_types(hints[name])
                needed = f"{', '.join(others)} or {last}" if others else last
                raise ConfigurationError(f"{name} is of type {', '.join(wrong)}; needed: {needed}.")
        return function(*args, **kwargs)

    return checked


def _find_wrong_type(value: Any, hint: Any) -> list[str]:
    """Name the type of a value that a hint does not accept, and of its first wrong item; empty if it accepts it."""
    origin, parts = get_origin(hint) or hint, get_args(hint)
    if origin in (Union, UnionType):
        return min((_find_wrong_type(value, part) for part in parts), key=lambda wrong: (bool(wrong), -len(wrong)))
    if origin is Sequence and isinstance(value, Iterable) and not isinstance(value, str | Mapping):
        for item in value if isinstance(value, Sequence) else ():  # an iterator must not be used up here
            if wrong := _find_wrong_type(item, parts[0]):
                return [type(value).__name__, f"with {wrong[0]} in it"]
        return []
    accepted = {float: Real, int: Integral}.get(origin, origin)
    fits = not isinstance(accepted, type) or (isinstance(value, accepted) and origin is not Sequence)
    return [] if fits else [type(value).__name__]


def _name_types(hint: Any) -> list[str]:
    """Name the types that a hint accepts."""
    origin, parts = get_origin(hint) or hint, get_args(hint)
    if origin in (Union, UnionType):
        names = list(dict.fromkeys(name for part in parts for name in _name_types(part)))
        return [name for name in names if name != "text"] if "path" in names else names
    if origin is Sequence:
        return [f"sequence of {'/'.join(_name_types(parts[0]))}"]
    return [_NAMES.get(origin, getattr(origin, "__name__", str(origin)))]
