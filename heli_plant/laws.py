"""The laws of the catalogue, combined into one function for each place at which they enter the plant.

    added_pitch(time, pitch, ..., p)        sum of the laws at ACCELERATION of an axis, and of its table [rad/s^2]
    switched_on(p), has_tables(p)           whether pitch, elevation and travel have such laws; whether there are tables
    motor_input(voltage, p)                 saturation, then the laws at VOLTAGE, one after the other [V]
    thrust_voltage(nu, time, p)             the laws at THRUST, one after the other [V]
    motor_time_constant(p)                  T_m, then the laws at LAG [s]
    input_delay(p)                          the laws at DELAY [s]
    bending_acceleration(q, q', mu_s, p)    sum of the laws at BENDING, q'' [rad/s^2]; bends(p): whether there is one
    next_step_time(time, p)                 when a law steps next [s], infinity if none does

These functions are generated from the text of the laws. Each law is computed only if its coefficient is not zero;
arguments that are parameters are read from ``p``.
"""

import linecache
import re
from collections.abc import Iterable
from math import inf
from types import FunctionType
from typing import Any

from .effects import ACCELERATION, AXES, BENDING, CATALOGUE, DELAY, LAG, STEP_TIMES, THRUST, VOLTAGE, Effect, effects_at
from .motor import saturate
from .tabulated_torque import KNOTS, table_variable, tabulated_torque

_MOTION = (
    "time", "pitch", "elevation", "travel", "pitch_rate", "elevation_rate", "travel_rate", "mu_sum", "mu_diff",
    "travel_rest",
)  # fmt: skip
"""Arguments of the sums on the axes, from the laws' vocabulary; tables use all but the last."""

_CALLED: dict[str, Any] = {
    "inf": inf, "saturate": saturate, "table_variable": table_variable, "tabulated_torque": tabulated_torque,
}  # fmt: skip
for _law in (entry.function for entry in CATALOGUE):
    _CALLED |= {name: _law.__globals__[name] for name in _law.__code__.co_names if name in _law.__globals__}
"""Globals of the generated functions: those that they need themselves, and those of the laws."""


def _law_expression(entry: Effect, variables: tuple[str, ...]) -> str:
    """Return a law's expression in ``variables`` and in parameters; calls of the law would take half as long again."""
    replacements = {name: f"p.{name}" for name in entry.arguments} | {name: name for name in variables}
    replacements |= {shape.name: f"p.{shape.field}" for shape in entry.shapes}
    replacements |= {"c": f"p.{entry.field}", "rate": f"{entry.axis}_rate"}
    replacements |= {"horizontal_elevation": "(elevation + p.horizontal_offset)"}
    code = entry.function.__code__
    text = "".join(linecache.getlines(code.co_filename)[code.co_firstlineno - 1 :])  # inspect takes ten times as long
    expression = text.partition("\n    return ")[2].partition("\n\n")[0].strip()
    return re.sub(r"\b[a-z_]\w*", lambda word: replacements.get(word[0], word[0]), expression)


def _make_function(name: str, arguments: Iterable[str], lines: Iterable[str]) -> FunctionType:
    """Make a function from its lines; its source is in :mod:`linecache`, where :mod:`inspect` finds it."""
    text = "\n    ".join((f"def {name}({', '.join(arguments)}):", *lines)) + "\n"
    file = f"<{name} of {__name__}>"
    linecache.cache[file] = len(text), None, text.splitlines(keepends=True), file
    scope = {**_CALLED, "__name__": __name__}
    exec(compile(text, file, "exec"), scope)
    return scope[name]


def _compose(
    name: str, first_line: str, entries: tuple[Effect, ...], arguments: tuple[str, ...], *last_lines: str
) -> FunctionType:
    """Make a function that starts with the value of ``first_line`` and adds the active laws to it, or applies them."""
    value = first_line.partition(" ")[0]
    lines = [first_line] if first_line != value else []
    for entry in entries:
        law = _law_expression(entry, (*arguments, value))
        law = f"{value} + ({law})" if entry.place in (ACCELERATION, BENDING) else law
        lines.append(f"if p.{entry.field} != 0.0: {value} = {law}")
    return _make_function(name, (*arguments, "p"), (*lines, *last_lines, f"return {value}"))


def _any_on(entries: tuple[Effect, ...]) -> str:
    return " or ".join(f"p.{entry.field} != 0.0" for entry in entries) or "False"


def _has_table(axis: str) -> str:
    return f"p.table_variable_{axis} > 0.5"


def _table_call(axis: str) -> str:
    """Return the call of an axis's tabulated torque."""
    first = f"p.table_first_{axis}"
    x = f"table_variable(p.table_variable_{axis}, {first}, {', '.join(_MOTION[:-1])})"
    y = ", ".join(f"p.table_torque_{k}_{axis}" for k in range(1, KNOTS + 1))
    return f"tabulated_torque({x}, {first}, p.table_spacing_{axis}, ({y}))"


added_pitch, added_elevation, added_travel = (
    _compose(
        f"added_{axis}", "total = 0.0", effects_at(ACCELERATION, axis), _MOTION,
        f"if {_has_table(axis)}: total = total + {_table_call(axis)}",
    )
    for axis in AXES
)  # fmt: skip
has_tables = _make_function("has_tables", ("p",), [f"return {' or '.join(map(_has_table, AXES))}"])
_switches = (f"{_any_on(effects_at(ACCELERATION, axis))} or {_has_table(axis)}" for axis in AXES)
switched_on = _make_function("switched_on", ("p",), [f"return {', '.join(_switches)}"])
motor_input = _compose("motor_input", "voltage = saturate(voltage, p.v_max)", effects_at(VOLTAGE), ("voltage",))
thrust_voltage = _compose("thrust_voltage", "nu", effects_at(THRUST), ("nu", "time"))
motor_time_constant = _compose("motor_time_constant", "time_constant = p.T_m", effects_at(LAG), ())
input_delay = _compose("input_delay", "delay = 0.0", effects_at(DELAY), ())
_BENDING = effects_at(BENDING, "elevation")
bending_acceleration = _compose("bending_acceleration", "total = 0.0", _BENDING, ("bending", "bending_rate", "mu_sum"))
bends = _make_function("bends", ("p",), [f"return {_any_on(_BENDING)}"])
_steps = [(entry.field, shape.field) for entry in CATALOGUE for shape in entry.shapes if shape.start == STEP_TIMES]
_lines = [f"if p.{field} != 0.0 and time < p.{at} < next_time: next_time = p.{at}" for field, at in _steps]
next_step_time = _make_function("next_step_time", ("time", "p"), ["next_time = inf", *_lines, "return next_time"])


def thrust_voltages(nu_front: float, nu_rear: float, time: float, p: Any) -> tuple[float, float]:
    """Return (mu_d, mu_s) [V], difference and sum of the rotors' thrust-equivalent voltages at ``time`` [s]."""
    front = p.share_front * thrust_voltage(nu_front, time, p)
    rear = p.share_rear * thrust_voltage(nu_rear, time, p)
    return front - rear, front + rear
