"""The place of every output and input in the master's two arrays, and the output that feeds each input."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heli_plant.errors import did_you_mean

from ..errors import WiringError
from ..wiring import Scenario


@dataclass(frozen=True, eq=False)
class Layout:
    """The wiring table as places in arrays.

    Attributes
    ----------
    names : tuple of str
        ``unit.variable`` of every output that is read, in the order of the array of outputs.
    outputs, inputs : mapping
        For each unit the variables that are read and set, in the order of the arrays.
    sources : ndarray, shape (number of inputs,)
        For each input, the place of the output that feeds it.
    """

    names: tuple[str, ...]
    outputs: Mapping[str, list[str]]
    inputs: Mapping[str, list[str]]
    sources: NDArray[np.intp]


def laid_out(wiring: Scenario, shown: Mapping[str, Collection[str]], record: Collection[str] | None) -> Layout:
    """Lay out a scenario.

    Parameters
    ----------
    wiring : Scenario
    shown : mapping
        The Real outputs of each unit.
    record : collection of str, optional
        ``unit.variable`` of the outputs to record; outputs that feed an input are read as well. All by default.

    Raises
    ------
    WiringError
        A name in ``record`` or in the wiring is no output of its unit.
    """
    every = [f"{unit}.{name}" for unit, names in shown.items() for name in names]
    feeding = {f"{wire.source_unit}.{wire.source}" for wire in wiring.connections}
    for name in (*sorted(feeding), *(record or ())):
        if name not in every:
            raise WiringError(f"scenario {wiring.name} has no output {name!r}{did_you_mean(name, every)}")
    wanted = set(every) if record is None else {*record, *feeding}
    names = tuple(name for name in every if name in wanted)
    place = {name: index for index, name in enumerate(names)}
    outputs = {unit: [name for name in own if f"{unit}.{name}" in place] for unit, own in shown.items()}
    wires = {unit: [wire for wire in wiring.connections if wire.target_unit == unit] for unit in shown}
    inputs = {unit: [wire.target for wire in own] for unit, own in wires.items()}
    sources = [place[f"{wire.source_unit}.{wire.source}"] for own in wires.values() for wire in own]
    return Layout(names, outputs, inputs, np.array(sources, dtype=np.intp))
