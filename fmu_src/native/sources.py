"""All sources of a native unit, and the description by which an importer compiles them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from xml.etree.ElementTree import Element, SubElement

from ..errors import BuildError
from ..packaging import xml_text
from ..slave_base import SlaveBase
from ..variables import Value
from .definition import Definition, Exchange
from .definitions import DEFINITIONS
from .tables import variables_header, variables_source
from .translator import Struct, Translation, header, persistence, source

RUNTIME = ("arithmetic.h", "memory.h", "memory.c", "unit.h", "unit.c", "values.c", "state.c", "exchange.c", "fmi.h")
"""Files in C that every unit has."""

HEADERS = {2: ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"),
           3: ("fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h")}  # fmt: skip
"""Headers of the standard, which fmpy carries."""


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
    for kind in (*definition.settings, *definition.memory):
        translation.use(Struct(kind))
    memory = persistence([Struct(kind) for kind in definition.memory], translation)
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
    own += ["dual.h", exchange.adapter] if exchange is not None else []
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


def build_description(identifier: str, sources: Mapping[str, str], fmi: int) -> bytes:
    """Return sources/buildDescription.xml (FMI 3.0, section 2.5.5; tools read it in FMI 2.0 units as well)."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    listed = SubElement(configuration, "SourceFileSet", language="C11", compilerOptions="-ffp-contract=off")
    for name in compiled_files(sources):
        SubElement(listed, "SourceFile", name=name)
    SubElement(listed, "IncludeDirectory", name=".")
    SubElement(configuration, "Library", name="m", external="true")
    return xml_text(root)
