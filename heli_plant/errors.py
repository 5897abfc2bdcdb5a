"""Errors of the physics package, and the one way to propose a name."""

from collections.abc import Iterable
from difflib import get_close_matches


class PlantError(Exception):
    """Root of every error that ``heli_plant`` raises on purpose."""


class ParameterError(PlantError):
    """A parameter has an impossible value or a name that does not exist."""


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return "; did you mean 'x'?" with the known name that is closest, or nothing if none is close."""
    near = get_close_matches(name, list(known), n=1)
    return f"; did you mean {near[0]!r}?" if near else ""
