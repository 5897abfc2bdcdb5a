"""What the native twin of a unit is made of."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Definition:
    """The native twin of a unit.

    Attributes
    ----------
    adapter : str
        File in C that connects the translated functions with the unit's variables.
    entries : tuple
        Functions that the adapter calls; one with unannotated parameters stands in a tuple with the functions for them.
    settings : mapping
        Structs that are filled from variables: for each field, by its path, the variable's name.
    memory : tuple of types
        What the unit remembers between steps.
    externals : mapping
        Functions that the adapter defines in C itself: the name there.
    more : str
        Further C text of the header.
    files : tuple of str
        Further files in C that the adapter needs.
    """

    adapter: str
    entries: tuple[Any, ...] = ()
    settings: Mapping[type, Mapping[str, str]] = field(default_factory=dict)
    memory: tuple[type, ...] = ()
    externals: Mapping[Callable[..., Any], str] = field(default_factory=dict)
    more: str = ""
    files: tuple[str, ...] = ()
