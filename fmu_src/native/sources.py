"""All sources of a native unit: C by hand, the translation, and tables from the unit's definition."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from xml.etree.ElementTree import Element, SubElement

from ..description import value_text, xml_text
from ..errors import BuildError
from ..slave_base import CLOCK_TOLERANCE, LONGEST_STEP, MOST_SUBSTEPS, SlaveBase
from ..variables import LARGEST, Value, Variable
from .definitions import DEFINITIONS, Definition, Exchange, reference
from .translator import Struct, Translation, annotated, header, persistence, quoted, source

RUNTIME = ("arithmetic.h", "memory.h", "memory.c", "unit.h", "unit.c", "values.c", "state.c", "exchange.c", "fmi.h")
"""Files in C that every unit has."""

HEADERS = {2: ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"),
           3: ("fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h")}  # fmt: skip
"""Headers of the standard, which fmpy carries."""

_GENERATED = "/* Generated from the unit's definition. */\n"


def exchange_of(unit: str) -> Exchange:
    """Return what Model Exchange adds to a unit.

    Raises
    ------
    BuildError
        The unit has none: it is sampled.
    """
    exchange = DEFINITIONS[unit]().exchange
    if exchange is None:
        having = ", ".join(name for name, definition in DEFINITIONS.items() if definition().exchange)
        raise BuildError(f"{unit} has no model exchange, because it works at sampling instants; {having} has")
    return exchange


@cache
def _model(unit: str, exchanged: bool) -> tuple[Definition, str, str]:
    """Return the definition of a unit, model.h and model.c: the translation of its functions."""
    definition = DEFINITIONS[unit]()
    translation = Translation(dict(definition.externals))
    exchange = definition.exchange if exchanged else None
    for entry in (*definition.entries, *(exchange.entries if exchange else ())):
        translation.entry(*(entry if isinstance(entry, tuple) else (entry,)))
    for function, by in exchange.differentiated.items() if exchange else ():
        translation.entry(function, slopes_by=by)
    for kind in definition.settings:
        translation.use(Struct(kind))
    memory = persistence([annotated(hint) for hint in definition.memory], translation)
    return definition, header(translation, f"{memory}\n{definition.more}"), source(translation)


def native_sources(
    unit: type[SlaveBase], start_values: Mapping[str, Value], token: str, fmi: int, exchange: Exchange | None = None
) -> dict[str, str]:
    """Return every source of a unit by its file name; with ``exchange`` it has Model Exchange as well.

    Raises
    ------
    BuildError
        The unit has no native twin.
    Untranslatable
        A function that the unit needs uses a form of Python that has no translation: file, line, reason.
    """
    if unit.__name__ not in DEFINITIONS:
        raise BuildError(
            f"{unit.__name__} runs in Python only; there is C for {', '.join(DEFINITIONS)}. Leave native away for it"
        )
    definition, model_header, model_source = _model(unit.__name__, exchange is not None)
    own = [*RUNTIME, f"fmi{fmi}.c", definition.adapter, *definition.files]
    own += [exchange.adapter] if exchange is not None else []
    variables = (*unit.variables, *(exchange.variables if exchange else ()))
    found = {name: files(__package__).joinpath("c", name).read_text(encoding="utf-8") for name in own}
    found |= {name: files("fmpy").joinpath("c-code", name).read_text(encoding="utf-8") for name in HEADERS[fmi]}
    found["model.h"], found["model.c"] = model_header, model_source
    found["variables.h"] = variables_header(variables, definition)
    found["variables.c"] = variables_source(unit, variables, start_values, token, exchange is not None)
    return dict(sorted(found.items()))


def compiled_files(sources: Mapping[str, str]) -> list[str]:
    """Return the files that are compiled."""
    return [name for name in sources if name.endswith(".c")]


def build_description(identifier: str, sources: Mapping[str, str]) -> bytes:
    """Return sources/buildDescription.xml (FMI 3.0, section 2.5.5; tools read it in FMI 2.0 units as well)."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    listed = SubElement(configuration, "SourceFileSet", language="C11", compilerOptions="-ffp-contract=off")
    for name in compiled_files(sources):
        SubElement(listed, "SourceFile", name=name)
    SubElement(listed, "IncludeDirectory", name=".")
    SubElement(configuration, "Library", name="m", external="true")
    return xml_text(root)


def variables_header(variables: Sequence[Variable], definition: Definition) -> str:
    """Return variables.h: the value references, and the functions that fill the settings."""
    names = ",\n".join(f"    {reference(variable.name)}" for variable in variables)
    text = f'{_GENERATED}#ifndef VARIABLES_H\n#define VARIABLES_H\n\n#include "model.h"\n#include "unit.h"\n\n'
    text += f"enum {{\n{names}\n}};\n\n"
    for kind, paths in definition.settings.items():
        lines = "".join(f"    x->{path} = values[{reference(name)}].real;\n" for path, name in paths.items())
        text += f"static inline void set_{kind.__name__}({kind.__name__} *x, const Value *values)\n{{\n{lines}}}\n\n"
    return f"{text}#endif\n"


def variables_source(
    unit: type[SlaveBase], variables: Sequence[Variable], start_values: Mapping[str, Value], token: str, exchanged: bool
) -> str:
    """Return variables.c: all variables, the token of the model description, the unit's limits."""
    rows = "\n".join(_row(variable, start_values.get(variable.name, variable.start)) for variable in variables)
    return (
        f'{_GENERATED}#include "unit.h"\n\nconst char UNIT_TOKEN[] = {quoted(token)};\n'
        f"{'' if exchanged else 'const Exchange *const EXCHANGE = NULL;'}\n\n"
        f"const bool HAS_PAST = {str(unit.has_past).lower()};\n"
        f"const double LONGEST_STEP = {LONGEST_STEP!r}, CLOCK_TOLERANCE = {CLOCK_TOLERANCE!r};\n"
        f"const int64_t MOST_SUBSTEPS = {MOST_SUBSTEPS};\n\n"
        "/* name, kind, causality, tunable, unit, minimum, maximum, nominal, start, text */\n"
        f"const Variable VARIABLES[] = {{\n{rows}\n}};\n\n"
        "const size_t VARIABLE_COUNT = sizeof VARIABLES / sizeof VARIABLES[0];\n"
    )


def _row(variable: Variable, start: Value | None) -> str:
    low, high = (0.0, 1.0) if variable.type == "Boolean" else variable.bounds
    assert abs(low) <= LARGEST and abs(high) <= LARGEST
    is_text = variable.type == "String"
    number = "0.0" if start is None or is_text else value_text(float(start), "Real")
    unit = variable.unit if variable.unit and variable.unit != "1" else ""
    parts = (
        quoted(variable.name), variable.type.upper(), variable.causality.upper(),
        str(variable.variability == "tunable").lower(), quoted(unit), repr(float(low)),
        repr(float(high)), repr(float(variable.nominal or 1.0)), number, quoted(str(start or "")) if is_text else "0",
    )  # fmt: skip
    return f"    {{{', '.join(parts)}}},"
