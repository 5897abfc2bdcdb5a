"""What functions are given is held to their annotations: another type is refused in a sentence."""

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

_WORDS = {NoneType: "None", str: "text", float: "number", int: "whole number", bool: "True or False", PathLike: "path"}


def check_types(function: Callable[P, R]) -> Callable[P, R]:
    """Refuse arguments of other types than those annotated, with a ConfigurationError that says what is needed."""
    parameters = signature(function)

    @wraps(function)
    def checked(*args: P.args, **given: P.kwargs) -> R:
        hints = get_type_hints(function)
        for name, value in parameters.bind(*args, **given).arguments.items():
            if wrong := _misfit(value, hints[name]):
                *others, last = _words(hints[name])
                needed = f"{', '.join(others)} or {last}" if others else last
                raise ConfigurationError(f"{name} is of type {', '.join(wrong)}; needed: {needed}.")
        return function(*args, **given)

    return checked


def _misfit(value: Any, hint: Any) -> list[str]:
    """Give the type of a value that a hint does not accept, with the type of the first item that is wrong."""
    origin, parts = get_origin(hint) or hint, get_args(hint)
    if origin in (Union, UnionType):
        return min((_misfit(value, part) for part in parts), key=lambda wrong: (bool(wrong), -len(wrong)))
    if origin is Sequence and isinstance(value, Iterable) and not isinstance(value, str | Mapping):
        items = value if isinstance(value, Sequence) else ()  # what can be gone through once is left alone
        return next(([type(value).__name__, f"with {w[0]} in it"] for i in items if (w := _misfit(i, parts[0]))), [])
    accepted = {float: Real, int: Integral}.get(origin, origin)
    fits = not isinstance(accepted, type) or (isinstance(value, accepted) and origin is not Sequence)
    return [] if fits else [type(value).__name__]


def _words(hint: Any) -> list[str]:
    """Name the types that a hint accepts."""
    origin, parts = get_origin(hint) or hint, get_args(hint)
    if origin in (Union, UnionType):
        found = list(dict.fromkeys(word for part in parts for word in _words(part)))
        return [word for word in found if word != "text"] if "path" in found else found
    if origin is Sequence:
        return [f"sequence of {'/'.join(_words(parts[0]))}"]
    return [_WORDS.get(origin, getattr(origin, "__name__", str(origin)))]
