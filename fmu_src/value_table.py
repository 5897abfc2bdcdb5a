"""The values of a unit by reference: one flat list, what may be read of it, and what may be set to what.

A value that is not finite, out of range, or not open to be set is not taken; :meth:`ValueTable.take` returns the
reason. ``refused`` remembers the variables whose last value was bad.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from operator import itemgetter
from typing import Any

from .variables import Value, Variable, problem_with

TYPES = {"Real": float, "Integer": int, "Boolean": bool, "String": str}
"""Python type of each FMI type."""

EARLY, LATE = ("input", "parameter"), ("input",)
"""Causalities that may be set before initialisation has ended, and after; tunable parameters always."""

_PICKERS_KEPT = 256
"""A host asks for the same few sets of variables again and again; one that does not must not fill the memory."""


class ValueTable:
    """Values of all variables, value references being the positions in ``variables`` and in ``values``."""

    def __init__(self, variables: tuple[Variable, ...], start_values: Mapping[str, Value]) -> None:
        self.variables = variables
        self.values: list[Any] = []
        for variable in variables:
            start = start_values.get(variable.name, variable.start)
            kind = TYPES[variable.type]
            self.values.append(kind() if start is None else kind(start))
        self.of_type = {
            kind: frozenset(reference for reference, variable in enumerate(variables) if variable.type == kind)
            for kind in TYPES
        }
        self.pickers = {kind: Pickers(known) for kind, known in self.of_type.items()}
        self.refused: dict[int, str] = {}
        self.open_for(EARLY)

    def open_for(self, causalities: tuple[str, ...]) -> None:
        """Let variables of these causalities and tunable parameters be set from now on.

        ``limits`` are the bounds of every such variable by its reference, ``real_limits`` those of the Reals.
        """
        self.limits = {
            reference: variable.bounds
            for reference, variable in enumerate(self.variables)
            if variable.causality in causalities or variable.variability == "tunable"
        }
        reals = self.of_type["Real"]
        self.real_limits = {reference: bounds for reference, bounds in self.limits.items() if reference in reals}

    def take(self, kind: str, references: Sequence[int], values: Sequence[Value]) -> list[str]:
        """Take values that are good; return why the others were not taken."""
        known, problems = self.of_type[kind], []
        for reference, value in zip(references, values, strict=True):
            is_open = reference in known and reference in self.limits
            if is_open and problem_with(self.variables[reference], value) is None:
                self.values[reference] = value
                self.refused.pop(reference, None)
            else:
                problems.append(self._problem(kind, reference, value))
        return problems

    def _problem(self, kind: str, reference: int, value: Value) -> str:
        """Say why ``value`` is not taken; remember it if a better value can still come."""
        if reference not in self.of_type[kind]:
            return f"no variable of this type has value reference {reference}"
        variable = self.variables[reference]
        if reference not in self.limits:
            reason = "is an output" if variable.causality == "output" else "is fixed once initialisation has ended"
            return f"{variable.name} {reason}; {value!r} was not taken"
        self.refused[reference] = problem_with(variable, value) or f"{variable.name} = {value!r} was not taken"
        return self.refused[reference]

    def parameters(self) -> list[Value]:
        """Return the value of every parameter, in order."""
        return [
            value
            for value, variable in zip(self.values, self.variables, strict=True)
            if variable.causality == "parameter"
        ]


class Pickers(dict[tuple[int, ...], Callable[[list[Any]], list[Any]]]):
    """What picks variables of one type out of the values as a new list, by their references; made when first asked for.

    ``pickers[references](values)``; neighbours, or a single one, are picked by a slice.

    Raises
    ------
    KeyError
        A reference is not among those ``known``.
    """

    def __init__(self, known: frozenset[int]) -> None:
        super().__init__()
        self.known = known

    def __missing__(self, references: tuple[int, ...]) -> Callable[[list[Any]], list[Any]]:
        for reference in references:
            if reference not in self.known:
                raise KeyError(f"no variable of this type has value reference {reference}")
        if len(self) == _PICKERS_KEPT:
            self.clear()
        self[references] = picker = _picker(references)
        return picker


def _picker(references: tuple[int, ...]) -> Callable[[list[Any]], list[Any]]:
    first = references[0] if references else 0
    beyond = first + len(references)
    if references == (*range(first, beyond),):
        return itemgetter(slice(first, beyond))
    pick = itemgetter(*references)
    return lambda values: list(pick(values))
