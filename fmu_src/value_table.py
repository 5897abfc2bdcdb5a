"""The values of a unit by reference: one flat dictionary per type, and which of them may be set to what.

A get or set is a look-up per value. A value that is not finite, out of range, or not open to be set is not taken;
:meth:`ValueTable.take` returns the reason. ``refused`` remembers the variables whose last value was bad.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from .variables import Value, Variable, problem_with

TYPES = {"Real": float, "Integer": int, "Boolean": bool, "String": str}
"""Python type of each FMI type."""

EARLY, LATE = ("input", "parameter"), ("input",)
"""Causalities that may be set before initialisation has ended, and after; tunable parameters always."""


class ValueTable:
    """Values of all variables, value references being the positions in ``variables``."""

    def __init__(self, variables: tuple[Variable, ...], start_values: Mapping[str, Value]) -> None:
        self.variables = variables
        self.reals: dict[int, float] = {}
        self.integers: dict[int, int] = {}
        self.booleans: dict[int, bool] = {}
        self.strings: dict[int, str] = {}
        self.stores: dict[str, dict[int, Any]] = {
            "Real": self.reals, "Integer": self.integers, "Boolean": self.booleans, "String": self.strings,
        }  # fmt: skip
        for reference, variable in enumerate(variables):
            start = start_values.get(variable.name, variable.start)
            kind = TYPES[variable.type]
            self.stores[variable.type][reference] = kind() if start is None else kind(start)
        self.refused: dict[int, str] = {}
        self.open_for(EARLY)

    def open_for(self, causalities: tuple[str, ...]) -> None:
        """Let variables of these causalities and tunable parameters be set from now on."""
        self.limits = {
            reference: variable.bounds
            for reference, variable in enumerate(self.variables)
            if variable.causality in causalities or variable.variability == "tunable"
        }

    def take_reals(self, references: Sequence[int], values: Sequence[float]) -> list[str]:
        """Take Real values that are in range; return why the others were not taken."""
        limits, reals, problems = self.limits, self.reals, []
        for reference, value in zip(references, values, strict=True):
            if reference in limits and reference in reals:
                low, high = limits[reference]
                if low <= value <= high:  # false for a NaN
                    reals[reference] = value
                    if self.refused:
                        self.refused.pop(reference, None)
                    continue
            problems.append(self._problem("Real", reference, value))
        return problems

    def take(self, kind: str, references: Sequence[int], values: Sequence[Value]) -> list[str]:
        """Take values of any type that are good; return why the others were not taken."""
        store, problems = self.stores[kind], []
        for reference, value in zip(references, values, strict=True):
            known = reference in self.limits and reference in store
            if known and problem_with(self.variables[reference], value) is None:
                store[reference] = value
                self.refused.pop(reference, None)
            else:
                problems.append(self._problem(kind, reference, value))
        return problems

    def _problem(self, kind: str, reference: int, value: Value) -> str:
        """Say why ``value`` is not taken; remember it if a better value can still come."""
        if reference not in self.stores[kind]:
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
            self.stores[variable.type][reference]
            for reference, variable in enumerate(self.variables)
            if variable.causality == "parameter"
        ]

    def dump(self) -> dict[str, list[tuple[int, Any]]]:
        """Return all values, by type."""
        return {kind: list(store.items()) for kind, store in self.stores.items()}

    def restore(self, dumped: Mapping[str, Sequence[Sequence[Any]]]) -> None:
        """Take back what :meth:`dump` returned."""
        for kind, store in self.stores.items():
            store.update((reference, value) for reference, value in dumped[kind])
