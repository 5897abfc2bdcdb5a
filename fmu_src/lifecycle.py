"""The life of a unit, without FMI: its values, its phases, and its whole state to save and to restore.

A unit is instantiated, initialising, stepping, terminated. Parameters may be set up to the end of the initialisation;
outputs are right from the start time on, also while the unit is initialising.

A unit class gives its ``variables``, the methods ``initialise`` and ``advance``, and, if it has a hidden state,
``freeze`` and ``thaw``. Its ``values`` lie in one flat list by value reference (:mod:`fmu_src.value_table`).
"""

from __future__ import annotations

from typing import Any, ClassVar

from .errors import Refusal
from .value_table import EARLY, LATE, NEVER, ValueTable
from .variables import Value, Variable

INSTANTIATED, INITIALISING, STEPPING, TERMINATED = "instantiated", "initialising", "stepping", "terminated"


class Lifecycle:
    """Values, phase and state of a unit; methods raise :class:`fmu_src.errors.Refusal`."""

    variables: ClassVar[tuple[Variable, ...]] = ()
    start_values: ClassVar[dict[str, Value]] = {}
    references: ClassVar[dict[str, int]] = {}

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.references = {variable.name: reference for reference, variable in enumerate(cls.variables)}

    def __init__(self) -> None:
        self.start_time = 0.0
        self.table = ValueTable(self.variables, self.start_values)
        self.values = self.table.values
        self.reached = 0.0  # end of the last step [s]
        self._initialised_with: list[Any] | None = None
        self.enter(INSTANTIATED)

    # What a unit class gives

    def initialise(self, time: float) -> None:
        """Read the parameters, set the state and all outputs at the start ``time`` [s]; may be called repeatedly."""

    def advance(self, time: float, step: float) -> None:
        """Go from ``time`` to ``time + step`` [s] and set all outputs; raise Refusal and leave all as it was."""

    def freeze(self) -> Any:
        """Return the hidden state as a copy made of lists, numbers, texts and None."""
        return None

    def thaw(self, frozen: Any) -> None:
        """Restore what :meth:`freeze` returned; parameters and outputs are restored by :meth:`restore`."""

    # Phases

    def enter(self, phase: str) -> None:
        """Enter a phase; it decides which variables may be set, and whether outputs are computed before they are read.

        A unit whose initialisation failed has none: whoever reads them is told why, at every time.
        """
        self.phase = phase
        if phase != TERMINATED:
            self._outdated = phase == INITIALISING or (phase == STEPPING and self._initialised_with is None)
        self.table.open_for({STEPPING: LATE, TERMINATED: NEVER}.get(phase, EARLY))
        self._steady = phase == STEPPING and not self.table.refused

    def is_initialised(self) -> bool:
        """Whether the initialisation has ended."""
        return self.phase in (STEPPING, TERMINATED)

    def take(self, kind: str, references: list[int], values: list[Any]) -> list[str]:
        """Set variables of one FMI type; return a sentence for each value that was refused."""
        problems = self.table.take(kind, references, values)
        self._outdated = self._outdated or self.phase == INITIALISING
        self._steady = self.phase == STEPPING and not self.table.refused
        return problems

    def prepare(self) -> None:
        """Compute state and outputs at the start time from the values; they stay outdated if that fails."""
        self._initialised_with = None
        self.initialise(self.start_time)
        self.reached = self.start_time
        self._initialised_with = self._initial_conditions()
        self._outdated = False

    def _initial_conditions(self) -> list[Any]:
        """Start time and fixed parameters: all that ``initialise`` reads and ``advance`` does not read again.

        Tunable parameters and inputs are read in every step. A state may hold some that do not fit together: it is
        restored all the same, and the next step is refused until they do.
        """
        return [self.start_time, *self.table.fixed_parameters()]

    # State

    def saved(self) -> dict[str, Any]:
        """Return the whole state as a copy that ``json.dumps`` writes and ``json.loads`` reads back bit for bit."""
        if self._outdated:
            self.prepare()
        return {
            "unit": self._signature(),
            "phase": self.phase,
            "start_time": self.start_time,
            "reached": self.reached,
            "values": list(self.values),
            "refused": list(self.table.refused.items()),
            "hidden": self.freeze(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Restore what :meth:`saved` returned, here or in another instance of the same unit.

        Raises
        ------
        Refusal
            ``state`` is no complete state of this unit; nothing was changed.
        """
        if not state or state["unit"] != self._signature():
            raise Refusal(f"this is no complete state of a {type(self).__name__}; nothing was changed")
        self.values[:] = state["values"]
        self.start_time = state["start_time"]
        self.table.refused = dict(state["refused"])
        self.enter(state["phase"])
        if self.is_initialised():
            if self._initialised_with != self._initial_conditions():
                self.prepare()
                self.values[:] = state["values"]  # ``initialise`` has set the outputs of the start time
            self.reached = state["reached"]
            self.thaw(state["hidden"])
            self._outdated = False

    def _signature(self) -> list[Any]:
        return [type(self).__name__, len(self.variables)]
