"""Errors of the FMI layer, and checks of arguments of any type that raise them."""

from __future__ import annotations

from collections.abc import Mapping
from numbers import Real
from sys import float_info
from typing import Any, TypeVar

from heli_plant.errors import did_you_mean

_Entry = TypeVar("_Entry")


class FmuError(Exception):
    """Root of the errors of ``fmu_src``."""


class Refusal(FmuError):
    """A unit refuses a call because of a value, a time or a file; its log tells the host the reason."""


class BuildError(FmuError):
    """A unit cannot be built: an unknown name, a value out of range, a source that an FMU must not contain."""


class Untranslatable(BuildError):
    """A function uses a form of Python that has no translation to C: file, line, reason."""


class WiringError(FmuError):
    """A scenario, unit or variable is not in the wiring table, or a run does not fit it."""


class MasterError(FmuError):
    """A unit answered a call of the master with a status worse than a warning, or a run failed."""


def look_up(table: Mapping[str, _Entry], name: Any, kind: str, error: type[FmuError]) -> _Entry:
    """Return an entry of a table; an error of this type says that no ``kind`` has this name, and what there is."""
    if isinstance(name, str) and name in table:
        return table[name]
    raise error(f"no {kind} is called {name!r}{did_you_mean(str(name), table)}; there are {', '.join(table)}")


def check_mapping(argument: str, value: Any, of: type | tuple[type, ...] = object, word: str = "values") -> None:
    """Refuse an ``argument`` that is no mapping of names to ``word``, which are instances of ``of``."""
    if not isinstance(value, Mapping) or not all(isinstance(k, str) and isinstance(v, of) for k, v in value.items()):
        raise WiringError(f"{argument} = {value!r:.100} must be a mapping of names to {word}")


def is_positive(value: Any) -> bool:
    """Return whether a value is a positive finite number."""
    return isinstance(value, Real) and 0.0 < value <= float_info.max  # type: ignore[operator]
