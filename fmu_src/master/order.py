"""What a run is ordered with, checked against the wiring: parameters by unit, whole steps."""

from __future__ import annotations

from collections.abc import Mapping

from heli_plant.errors import did_you_mean

from ..errors import WiringError
from ..variables import Value
from ..wiring import Scenario


def whole_steps(duration: float, step: float) -> int:
    """Return how many steps of ``step`` [s] make up ``duration`` [s].

    Raises
    ------
    WiringError
        They do not make it up, or are not positive and finite.
    """
    if not (0.0 < step < float("inf") and step <= duration < float("inf")):
        raise WiringError(f"duration = {duration:g} s and step = {step:g} s: 0 < step <= duration is needed")
    steps = round(duration / step)
    if abs(steps * step - duration) > 1e-6 * step:
        raise WiringError(f"duration = {duration:g} s is no whole number of steps of {step:g} s")
    return steps


def parameters_by_unit(wiring: Scenario, parameters: Mapping[str, Value]) -> dict[str, dict[str, Value]]:
    """Sort ``unit.parameter`` by unit, over those that the scenario itself needs changed.

    Raises
    ------
    WiringError
        The scenario has no such unit.
    """
    names = tuple(name for name, _ in wiring.units)
    sorted_out: dict[str, dict[str, Value]] = {name: {} for name in names}
    for full, value in {**dict(wiring.parameters), **parameters}.items():
        unit, _, name = full.partition(".")
        if unit not in sorted_out:
            raise WiringError(
                f"parameter {full!r}: scenario {wiring.name} has no unit {unit!r}{did_you_mean(unit, names)}; "
                f"its units are {', '.join(names)}"
            )
        sorted_out[unit][name] = value
    return sorted_out
