"""The files of a unit in C.

They are the sources (written by hand, translated, or generated from the unit's definition), the description with which
an importer compiles them, and binaries for every platform with a compiler. Names, causalities and start values are
those of the pythonfmu unit.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from typing import Any

from heli_plant.state_feedback import FeedbackSettings, feedback_step, start_feedback

from ..description import TOOL, render, render_xml
from ..errors import BuildError
from ..slave_base import CLOCK_TOLERANCE, LONGEST_STEP, SlaveBase
from ..variables import Variable
from ..vendoring import content_guid
from .definitions import DEFINITIONS, MODEL_EXCHANGE, Definition
from .toolchain import compile_all
from .translator.program import Translation, functions, header, render_types, source
from .translator.types import Struct, annotation_type
from .translator.values import literal

NATIVE_UNITS = tuple(DEFINITIONS)
"""Units that exist in C; the others run in Python only."""

RUNTIME = ("arithmetic.h", "memory.h", "memory.c", "unit.h", "unit.c", "values.c", "state.c", "exchange.c", "fmi.h")
HEADERS = {2: ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"),
           3: ("fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h")}  # fmt: skip
"""Files in C of every unit, and headers of the standard, which are part of fmpy."""


def native_unit(
    kind: type[SlaveBase], variables: tuple[Variable, ...], fmi: int, all_platforms: bool, model_exchange: bool
) -> tuple[dict[str, bytes], dict[str, Any]]:
    """Return the files of a unit with these start values, and the arguments of :func:`.description.describe`.

    The arguments are those of :func:`fmu_src.build`.
    """
    unit = kind.__name__
    if unit not in DEFINITIONS:
        names = ", ".join(DEFINITIONS)
        raise BuildError(f"{unit} runs in Python only; there is C for {names}. Leave native away for it")
    if model_exchange and unit not in MODEL_EXCHANGE:
        names = ", ".join(MODEL_EXCHANGE)
        raise BuildError(f"{unit} has no model exchange, because it works at sampling instants; {names} has")
    definition = (MODEL_EXCHANGE if model_exchange else DEFINITIONS)[unit]
    variables += definition.state_variables
    sources = _sources(definition, kind, variables, fmi)
    token = content_guid(sources)  # the same one on every machine
    sources["token.c"] = f'#include "unit.h"\n\nconst char UNIT_TOKEN[] = {literal(token)};\n'
    compiled = sorted(name for name in sources if name.endswith(".c"))
    binaries = compile_all(sources, unit, fmi, all_platforms)
    entries = binaries | {f"sources/{name}": text.encode() for name, text in sources.items()}
    entries["sources/buildDescription.xml"] = render_xml("buildDescription.xml", identifier=unit, compiled=compiled)
    platforms = ", ".join(sorted(path.split("/")[1] for path in binaries)) or "no platform"
    return entries, {
        "variables": variables, "token": token, "fmi": fmi, "tool": TOOL, "platforms": platforms, "sources": compiled,
        "states": len(definition.states),
    }  # fmt: skip


@cache
def _model(definition: Definition) -> tuple[str, str]:
    """Return model.h and model.c: the translation of a unit's functions."""
    translation = Translation(definition.externals)
    for entry in definition.entries:
        translation.translate_entry(*(entry if isinstance(entry, tuple) else (entry,)))
    if definition.settings is not None:
        translation.define_type(Struct(definition.settings))
    return header(translation, annotation_type(definition.memory)), source(translation)


def _sources(definition: Definition, unit: type[SlaveBase], variables: Sequence[Variable], fmi: int) -> dict[str, str]:
    """Return every source of a unit by its file name, except that of its token."""
    names = [*RUNTIME, f"fmi{fmi}.c", *definition.files]
    sources = {name: files(__package__).joinpath("c", name).read_text(encoding="utf-8") for name in names}
    sources |= {name: files("fmpy").joinpath("c-code", name).read_text(encoding="utf-8") for name in HEADERS[fmi]}
    sources["model.h"], sources["model.c"] = _model(definition)
    settings = getattr(definition.settings, "__name__", None)
    sources["variables.h"] = render("variables.h.j2", variables=variables, settings=settings, reference=reference)
    sources["variables.c"] = render(
        "variables.c.j2", unit=unit, variables=variables, exchanged=bool(definition.states), longest_step=LONGEST_STEP,
        clock_tolerance=CLOCK_TOLERANCE, quoted=literal, number=lambda value: repr(float(value)),
    )  # fmt: skip
    return sources


def reference(name: str) -> str:
    """Return the C name of a variable's value reference: ``feedback.pitch`` is ``REF_feedback_pitch``."""
    return "REF_" + re.sub(r"\W+", "_", name).strip("_")


def controller_sources(settings: FeedbackSettings) -> dict[str, str]:
    """Return controller.h and controller.c: the step of the StateFeedback unit with these settings as constants.

    It is C99 for a microcontroller or a computer without FMI: no heap, no libraries.
    """
    translation = Translation()
    translation.translate_entry(start_feedback)
    translation.translate_entry(feedback_step)
    translation.define_type(Struct(FeedbackSettings))
    code = functions(translation, is_alone=True)
    return {
        "controller.h": render_types("controller.h.j2", translation, period=f"{settings.period:g}"),
        "controller.c": render("controller.c.j2", functions=code, settings=_constant(settings)),
    }


def _constant(value: Any) -> str:
    """Return a number, or nested tuples of numbers, as an initialiser in C."""
    if isinstance(value, tuple):
        separator = ",\n    " if any(isinstance(item, tuple) for item in value) else ", "
        return f"{{{separator.join(map(_constant, value))}}}"
    return literal(value)
