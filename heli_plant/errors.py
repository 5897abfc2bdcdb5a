"""Errors of the physics package, and proposals of similar names, which every package adds to its errors."""

from __future__ import annotations

from collections.abc import Iterable


class PlantError(Exception):
    """Root of every error that ``heli_plant`` raises on purpose."""


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return ``; did you mean 'x'?`` with the closest of the known names, or nothing if none is close."""
    from difflib import get_close_matches  # only errors need it

    near = get_close_matches(name, list(known), n=1)
    return f"; did you mean {near[0]!r}?" if near else ""
