"""What the native twin of a unit is made of."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ..variables import Variable


@dataclass(frozen=True)
class Exchange:
    """What Model Exchange adds to a unit.

    Attributes
    ----------
    adapter : str
        File in C that connects the translated functions with states, rates and slopes.
    entries : tuple
        Functions that it calls, as those of :class:`Definition`.
    differentiated : mapping
        Functions that are translated for dual numbers as well, and the parameters that are.
    states : tuple of Variable
        One per continuous state; they stand behind the unit's variables, their derivatives behind them.
    """

    adapter: str
    entries: tuple[Any, ...]
    differentiated: Mapping[Callable[..., Any], tuple[str, ...]]
    states: tuple[Variable, ...]

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The states and their derivatives."""
        rates = tuple(
            state._replace(
                name=f"der({state.name})",
                unit=per_second(state.unit),
                nominal=None,
                description=f"derivative of {state.name}",
            )
            for state in self.states
        )
        return (*self.states, *rates)


def per_second(unit: str | None) -> str:
    """Return the unit of a derivative: ``rad/s`` becomes ``rad/s^2``."""
    unit = unit or "1"
    return unit.removesuffix("/s") + ("/s^2" if unit.endswith("/s") else "/s")


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
    exchange : Exchange or None
        What Model Exchange adds, in units that have it.
    """

    adapter: str
    entries: tuple[Any, ...] = ()
    settings: Mapping[type, Mapping[str, str]] = field(default_factory=dict)
    memory: tuple[type, ...] = ()
    externals: Mapping[Callable[..., Any], str] = field(default_factory=dict)
    more: str = ""
    files: tuple[str, ...] = ()
    exchange: Exchange | None = None
