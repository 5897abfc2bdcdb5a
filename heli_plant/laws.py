"""The laws of the catalogue put together: for each place one function of what enters there.

    added_pitch(time, pitch, ..., p)        sum of the laws at the place ACCELERATION of an axis [rad/s^2]
    motor_input(voltage, p)                 saturation, then the laws at VOLTAGE, one after the other [V]
    thrust_voltage(nu, time, p)             the laws at THRUST, one after the other [V]
    motor_time_constant(p)                  T_m, then the laws at LAG [s]
    input_delay(p)                          the laws at DELAY [s]
    bending_acceleration(...)               sum of the laws at BENDING [rad/s^2]
    next_step_time(time, p)                 when a law steps next [s], infinity if none does
    law_alone(entry)                        one law with c = 1, as a function of the motion alone

No law is written again here. In the text of each function the call of a law stands behind the question whether its
coefficient is other than zero; arguments that are parameters are read from ``p``. ``switched_on`` answers once for a
step whether an axis has any effect at all. To the sum on an axis belongs its tabulated torque
(:mod:`heli_plant.tabulated_torque`) where it has one.
"""

import linecache
import re
from collections.abc import Iterable
from functools import cache
from math import inf
from types import FunctionType
from typing import Any

from .effects import ACCELERATION, AXES, BENDING, CATALOGUE, DELAY, LAG, STEP_TIMES, THRUST, VOLTAGE, Effect, at
from .motor import saturate
from .tabulated_torque import KNOTS, VARIABLES, table_variable, tabulated_torque

_MOTION = (
    "time", "pitch", "elevation", "travel", "pitch_rate", "elevation_rate", "travel_rate", "mu_sum", "mu_diff",
    "travel_rest",
)  # fmt: skip
"""Arguments of the sums on the axes, from the laws' vocabulary (:mod:`heli_plant.effects.definition`)."""

_TABLED = ("time", *(name for name in VARIABLES if name != "time"))
"""Arguments of :func:`heli_plant.tabulated_torque.table_variable` behind number and first value."""

_CALLED: dict[str, Any] = {
    "inf": inf, "saturate": saturate, "table_variable": table_variable, "tabulated_torque": tabulated_torque,
    **{f"law_{entry.function.__name__}": entry.function for entry in CATALOGUE},
}  # fmt: skip
"""What the functions below call."""


def _call(entry: Effect, given: tuple[str, ...]) -> str:
    """Give the call of a law; its arguments are ``given``, or parameters, or follow from others."""
    known = {name: name for name in given} | {shape.name: f"p.{shape.field}" for shape in entry.shapes}
    known |= {"c": f"p.{entry.field}", "rate": f"{entry.axis}_rate"}
    known |= {"horizontal_elevation": "elevation + p.horizontal_offset"}
    return f"law_{entry.function.__name__}({', '.join(known.get(name, f'p.{name}') for name in entry.arguments)})"


def _function(name: str, arguments: Iterable[str], lines: Iterable[str], doc: str) -> FunctionType:
    """Make a function from its lines, whose source can be looked up as any other's."""
    text = "\n    ".join((f"def {name}({', '.join(arguments)}):", *lines)) + "\n"
    file = f"<{name} of {__name__}>"
    linecache.cache[file] = len(text), None, text.splitlines(keepends=True), file
    scope = {**_CALLED, "__name__": __name__}
    exec(compile(text, file, "exec"), scope)
    scope[name].__doc__ = doc
    return scope[name]


def _sum(name: str, entries: tuple[Effect, ...], arguments: tuple[str, ...], doc: str, *further: str) -> FunctionType:
    """Make a function that adds the laws of ``entries`` that are on, and what ``further`` lines add."""
    lines = ["total = 0.0"]
    for entry in entries:
        lines.append(f"if p.{entry.field} != 0.0: total = total + {_call(entry, arguments)}")
    lines.extend(further)
    return _function(name, (*arguments, "p"), (*lines, "return total"), doc)


def _chain(name: str, first: str, entries: tuple[Effect, ...], arguments: tuple[str, ...], doc: str) -> FunctionType:
    """Make a function that passes a value, at first ``first``, through the laws that are on."""
    value = first.partition(" ")[0]
    lines = [first] if first != value else []
    for entry in entries:
        lines.append(f"if p.{entry.field} != 0.0: {value} = {_call(entry, (*arguments, value))}")
    return _function(name, (*arguments, "p"), (*lines, f"return {value}"), doc)


def _any_on(entries: tuple[Effect, ...]) -> str:
    return " or ".join(f"p.{entry.field} != 0.0" for entry in entries) or "False"


def _has_table(axis: str) -> str:
    return f"p.table_variable_{axis} > 0.5"


def _table(axis: str) -> str:
    """Give the call of an axis's tabulated torque."""
    first = f"p.table_first_{axis}"
    x = f"table_variable(p.table_variable_{axis}, {first}, {', '.join(_TABLED)})"
    y = ", ".join(f"p.table_torque_{k}_{axis}" for k in range(1, KNOTS + 1))
    return f"tabulated_torque({x}, {first}, p.table_spacing_{axis}, ({y}))"


added_pitch, added_elevation, added_travel = (
    _sum(
        f"added_{axis}",
        at(ACCELERATION, axis),
        _MOTION,
        f"Return the acceleration [rad/s^2] of the {axis} by the effects that are on and by its table.",
        f"if {_has_table(axis)}: total = total + {_table(axis)}",
    )
    for axis in AXES
)
switched_on = _function(
    "switched_on",
    ("p",),
    [f"return {', '.join(f'{_any_on(at(ACCELERATION, axis))} or {_has_table(axis)}' for axis in AXES)}"],
    "Return for pitch, elevation and travel whether any of the effects that accelerate it, or its table, is on.",
)
motor_input = _chain(
    "motor_input",
    "voltage = saturate(voltage, p.v_max)",
    at(VOLTAGE),
    ("voltage",),
    "Return the voltage [V] that drives the lag of eq. (9) under an applied ``voltage`` [V].",
)
thrust_voltage = _chain(
    "thrust_voltage",
    "nu",
    at(THRUST),
    ("nu", "time"),
    "Return the thrust-equivalent voltage [V] of a lagged voltage ``nu`` [V] at ``time`` [s].",
)
motor_time_constant = _chain(
    "motor_time_constant",
    "time_constant = p.T_m",
    at(LAG),
    (),
    "Return the time constant [s] of the motors with the effects that are on.",
)
input_delay = _chain(
    "input_delay", "delay = 0.0", at(DELAY), (), "Return the time [s] that a voltage takes to the motors."
)
bending_acceleration = _sum(
    "bending_acceleration",
    at(BENDING, "elevation"),
    ("bending", "bending_rate", "mu_sum"),
    "Return the acceleration q'' [rad/s^2] of the bending mode at q [rad], q' [rad/s] and mu_s [V].",
)
bends = _function(
    "bends", ("p",), [f"return {_any_on(at(BENDING, 'elevation'))}"], "Return whether the arm's bending mode is on."
)

next_step_time = _function(
    "next_step_time",
    ("time", "p"),
    [
        "found = inf",
        *(
            f"if p.{entry.field} != 0.0 and time < p.{shape.field} < found: found = p.{shape.field}"
            for entry in CATALOGUE
            for shape in entry.shapes
            if shape.start == STEP_TIMES
        ),
        "return found",
    ],
    "Return the first time [s] after ``time`` at which a law that is on steps.",
)


@cache
def law_alone(entry: Effect) -> FunctionType:
    """Return a law as a function of the motion, or of nu and time at THRUST: c and k_z are 1, shapes have defaults."""
    values = {shape.field: shape.default for shape in entry.shapes} | {entry.field: 1.0, "k_z": 1.0}
    given = ("nu", "time") if entry.place == THRUST else _MOTION
    line = re.sub(r"\bp\.(\w+)", lambda found: repr(values.get(found[1], 0.0)), _call(entry, given))
    return _function(f"{entry.field}_alone", given, [f"return 0.0 + ({line})"], f"Return {entry.law} with c = 1.")


def thrust_voltages(nu_front: float, nu_rear: float, time: float, p: Any) -> tuple[float, float]:
    """Return (mu_d, mu_s) [V], difference and sum of the rotors' thrust-equivalent voltages at ``time`` [s]."""
    front, rear = thrust_voltage(nu_front, time, p), thrust_voltage(nu_rear, time, p)
    return front - rear, front + rear
