"""Tables in C from a unit's definition: its variables, and the structs that are filled from them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from ..packaging import value_text
from ..slave_base import CLOCK_TOLERANCE, LONGEST_STEP, MOST_SUBSTEPS, SlaveBase
from ..variables import LARGEST, Value, Variable
from .definition import Definition
from .translator import BOOL, INT, CType, Struct, fields

_KINDS = {"Real": "REAL", "Integer": "INTEGER", "Boolean": "BOOLEAN", "String": "STRING"}


def reference(name: str) -> str:
    """Return the C name of a variable's value reference: ``score.pitch[1]`` is ``REF_score_pitch_1``."""
    return "REF_" + re.sub(r"\W+", "_", name).strip("_")


def quoted(text: str) -> str:
    """Return a C string."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def variables_header(variables: Sequence[Variable], definition: Definition) -> str:
    """Return variables.h: the value references, and the functions that fill the settings."""
    names = ",\n".join(f"    {reference(variable.name)}" for variable in variables)
    settings = "\n".join(_setter(kind, paths) for kind, paths in definition.settings.items())
    return (
        "/* Generated from the unit's definition. */\n#ifndef VARIABLES_H\n#define VARIABLES_H\n\n"
        f'#include "model.h"\n#include "unit.h"\n\nenum {{\n{names}\n}};\n\n{settings}\n#endif\n'
    )


def _setter(kind: type, paths: Mapping[str, str]) -> str:
    lines = "".join(
        f"    x->{path} = {_converted(_type_at(kind, path), f'values[{reference(name)}].real')};\n"
        for path, name in paths.items()
    )
    return f"static inline void set_{kind.__name__}({kind.__name__} *x, const Value *values)\n{{\n{lines}}}\n"


def _type_at(kind: type, path: str) -> CType:
    first, _, rest = path.partition(".")
    found = fields(kind)[first]
    if rest:
        assert isinstance(found, Struct)
        return _type_at(found.kind, rest)
    return found


def _converted(kind: CType, text: str) -> str:
    return f"{text} != 0.0" if kind == BOOL else f"(int64_t){text}" if kind == INT else text


def variables_source(
    unit: type[SlaveBase], variables: Sequence[Variable], start_values: Mapping[str, Value], token: str, exchanged: bool
) -> str:
    """Return variables.c: all variables, the token of its model description, its limits."""
    rows = "\n".join(_row(variable, start_values.get(variable.name, variable.start)) for variable in variables)
    return (
        '/* Generated from the unit\'s definition. */\n#include "unit.h"\n\n'
        f"const char UNIT_TOKEN[] = {quoted(token)};\n"
        f"{'' if exchanged else 'const Exchange *const EXCHANGE = NULL;'}\n\n"
        f"const bool HAS_PAST = {'true' if unit.has_past else 'false'};\n"
        f"const double LONGEST_STEP = {LONGEST_STEP!r}, CLOCK_TOLERANCE = {CLOCK_TOLERANCE!r};\n"
        f"const int64_t MOST_SUBSTEPS = {MOST_SUBSTEPS};\n\n"
        "/* name, kind, causality, tunable, unit, minimum, maximum, nominal, start, text */\n"
        f"const Variable VARIABLES[] = {{\n{rows}\n}};\n\n"
        "const size_t VARIABLE_COUNT = sizeof VARIABLES / sizeof VARIABLES[0];\n"
    )


def _row(variable: Variable, start: Value | None) -> str:
    low, high = (0.0, 1.0) if variable.type == "Boolean" else variable.bounds
    number = "0.0" if start is None or variable.type == "String" else value_text(float(start), "Real")
    text = quoted(str(start or "")) if variable.type == "String" else "0"
    bounds = ", ".join(repr(float(bound)) for bound in (low, high))
    assert abs(low) <= LARGEST and abs(high) <= LARGEST
    return (
        f"    {{{quoted(variable.name)}, {_KINDS[variable.type]}, {variable.causality.upper()}, "
        f"{'true' if variable.variability == 'tunable' else 'false'}, {quoted(variable.unit or '')}, {bounds}, "
        f"{float(variable.nominal or 1.0)!r}, {number}, {text}}},"
    )
