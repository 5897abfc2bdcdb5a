"""The values of a unit in one flat list by value reference, with the checks of reading and setting them.

:meth:`ValueTable.take` ignores a value that is not finite, out of range, or of a variable that may not be set, and
returns the reason. ``refused`` keeps the variables whose last value was bad, until they are set to a good one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from operator import itemgetter
from typing import Any

from .variables import Value, Variable, problem_with

TYPES = {"Real": float, "Integer": int, "Boolean": bool, "String": str}
"""Python type of each FMI type."""

EARLY, LATE, NEVER = ("input", "parameter"), ("input", "tunable"), ()
"""Causality or variability of what may be set before and after the end of the initialisation, and after the end."""

_PICKERS_KEPT = 256
"""A host reads the same few sets of variables again and again; the bound is for one that does not."""


class ValueTable:
    """Values of all variables; a value reference is the position in ``variables`` and in ``values``."""

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
        self.pickers = {kind: Pickers(kind, known) for kind, known in self.of_type.items()}
        self.refused: dict[int, str] = {}
        self.open_for(EARLY)

    def open_for(self, kinds: tuple[str, ...]) -> None:
        """Allow setting variables of these kinds from now on.

        ``limits`` holds the bounds of every such variable by its reference, ``real_limits`` those of the Reals.
        """
        self.limits = {
            reference: variable.bounds
            for reference, variable in enumerate(self.variables)
            if variable.causality in kinds or variable.variability in kinds
        }
        self.kinds, reals = kinds, self.of_type["Real"]
        self.real_limits = {reference: bounds for reference, bounds in self.limits.items() if reference in reals}

    def take(self, kind: str, references: Sequence[int], values: Sequence[Value]) -> list[str]:
        """Set the good values; return a sentence for each of the others."""
        problems = []
        for reference, value in zip(references, values, strict=True):
            problem = self._problem(kind, reference, value)
            if problem is None:
                self.values[reference] = value
                self.refused.pop(reference, None)
            else:
                problems.append(problem)
        return problems

    def _problem(self, kind: str, reference: int, value: Value) -> str | None:
        """Return why ``value`` is refused, or None; keep a refusal that a better value can end."""
        if reference not in self.of_type[kind]:
            return _unknown(kind, reference)
        variable = self.variables[reference]
        if reference not in self.limits:
            reason = "is fixed once initialisation has ended" if self.kinds else "cannot be set, the unit is terminated"
            reason = "is an output" if variable.causality == "output" else reason
            return f"{variable.name} {reason}; the value {value!r} was ignored"
        problem = problem_with(variable, value)
        if problem is not None:
            self.refused[reference] = problem
        return problem

    def fixed_parameters(self) -> list[Value]:
        """Return the value of every parameter that is fixed once the initialisation has ended, in order."""
        return [
            value
            for value, variable in zip(self.values, self.variables, strict=True)
            if variable.causality == "parameter" and variable.variability == "fixed"
        ]


def _unknown(kind: str, reference: int) -> str:
    return f"no {kind} variable has value reference {reference}"


class Pickers(dict[tuple[int, ...], Callable[[list[Any]], list[Any]]]):
    """Functions that read variables of one type: ``pickers[references](values)`` is a new list of their values.

    Each is made when its references are read for the first time; neighbours are read by a slice.

    Raises
    ------
    KeyError
        A reference is not among those ``known``.
    """

    def __init__(self, kind: str, known: frozenset[int]) -> None:
        super().__init__()
        self.kind, self.known = kind, known

    def __missing__(self, references: tuple[int, ...]) -> Callable[[list[Any]], list[Any]]:
        for reference in references:
            if reference not in self.known:
                raise KeyError(_unknown(self.kind, reference))
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
