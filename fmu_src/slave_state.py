"""The whole state of a unit, for fmi2GetFMUstate and its relatives.

pythonfmu saves registered variables only, so that a hidden integrator would roll back wrong; here what the unit's
``freeze`` returns goes along. The state is made of dictionaries, lists, numbers, texts and None: ``json.dumps`` writes
it and ``json.loads`` reads it back to the bit.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from .errors import Refusal

if TYPE_CHECKING:
    from .slave_base import SlaveBase


def saved(unit: SlaveBase) -> dict[str, Any]:
    """Return the state of a unit; it shares nothing that changes with it."""
    return {
        "unit": _signature(unit),
        "phase": unit.phase,
        "start_time": unit.start_time,
        "values": list(unit.values),
        "refused": list(unit.table.refused.items()),
        "hidden": unit.freeze(),
    }


def read(state: bytes) -> dict[str, Any]:
    """Read a serialised state; bytes that are none give an empty state, which :func:`restore` refuses."""
    try:
        return json.loads(state.decode("utf-8"))
    except (ValueError, RecursionError):
        return {}


def restore(unit: SlaveBase, state: dict[str, Any]) -> None:
    """Take back what :func:`saved` returned.

    Raises
    ------
    Refusal
        It is no complete state of this unit; nothing was changed.
    """
    if not state or state["unit"] != _signature(unit):
        raise Refusal("this is no complete state of this unit; nothing was changed")
    unit.values[:] = state["values"]
    unit.start_time = state["start_time"]
    unit.table.refused = dict(state["refused"])
    unit.enter(state["phase"])
    if unit.is_initialised():
        if unit.prepared_for != unit.initial_conditions():
            unit.prepare()
            unit.values[:] = state["values"]  # since ``initialise`` has shown the outputs of the start
        unit.thaw(state["hidden"])


def _signature(unit: SlaveBase) -> list[Any]:
    return [type(unit).__name__, len(unit.variables)]
