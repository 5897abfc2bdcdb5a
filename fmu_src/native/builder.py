"""Build the native twin of a unit: ``build_native("HelicopterPlant", "build")``.

The zip holds the sources (C by hand, the translation, tables from the unit's definition), the description by which an
importer compiles them, binaries for every platform that a compiler is at hand for, the model description, the
documentation and an icon. Names, causalities and start values are those of the pythonfmu unit.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from heli_identifier.files import write_atomically
from heli_plant.state_feedback import FeedbackSettings, feedback_step, start_feedback

from ..builder import checked_start_values, content_guid, icon, unit_class, variables_of, zip_bytes
from ..description import TOOL, model_description, rendered, rendered_xml
from ..errors import BuildError
from ..slave_base import CLOCK_TOLERANCE, LONGEST_STEP, MOST_SUBSTEPS, SlaveBase
from ..variables import Value, Variable
from .definitions import DEFINITIONS, Exchange
from .toolchain import binaries
from .translator.program import Translation, functions, header, rendered_types, source
from .translator.types import Struct, annotated
from .translator.values import quoted

NATIVE_UNITS = tuple(DEFINITIONS)
"""Units that have a native twin; the others run in Python only."""

RUNTIME = ("arithmetic.h", "memory.h", "memory.c", "unit.h", "unit.c", "values.c", "state.c", "exchange.c", "fmi.h")
HEADERS = {2: ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"),
           3: ("fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h")}  # fmt: skip
"""Files in C that every unit has, and headers of the standard, which fmpy carries."""


def build_native(
    unit: str,
    directory: str | Path,
    parameters: Mapping[str, Value] | None = None,
    fmi: int = 2,
    all_platforms: bool = False,
    model_exchange: bool = False,
    remark: str = "",
) -> Path:
    """Build the native twin of a unit into ``directory/<unit>.fmu``; without any compiler it holds sources only.

    Parameters
    ----------
    unit : str
        One of :data:`NATIVE_UNITS`.
    directory, parameters, remark
        As for :func:`fmu_src.build`.
    fmi : int
        2 or 3.
    all_platforms : bool
        Compile for macOS and, in FMI 3.0, for ARM as well; ziglang does.
    model_exchange : bool
        The unit has Model Exchange beside co-simulation, with its states and their derivatives as further variables.

    Raises
    ------
    BuildError
        As :func:`fmu_src.build`; a unit without a native twin or without model exchange, or a compiler that fails.
    """
    kind = unit_class(unit)
    variables = variables_of(kind, checked_start_values(kind, parameters or {}))
    if unit not in DEFINITIONS:
        having = ", ".join(DEFINITIONS)
        raise BuildError(f"{unit} runs in Python only; there is C for {having}. Leave native away for it")
    exchange = DEFINITIONS[unit].exchange if model_exchange else None
    if model_exchange and exchange is None:
        having = ", ".join(name for name, definition in DEFINITIONS.items() if definition.exchange)
        raise BuildError(f"{unit} has no model exchange, because it works at sampling instants; {having} has")
    variables += exchange.variables if exchange else ()
    sources = _sources(kind, variables, fmi, exchange)
    token = content_guid(sources)  # the same one on every machine
    sources["token.c"] = f'#include "unit.h"\n\nconst char UNIT_TOKEN[] = {quoted(token)};\n'
    compiled = sorted(name for name in sources if name.endswith(".c"))
    built = binaries(sources, unit, fmi, all_platforms)
    entries = built | {f"sources/{name}": text.encode() for name, text in sources.items()}
    entries["sources/buildDescription.xml"] = rendered_xml("buildDescription.xml", identifier=unit, compiled=compiled)
    platforms = ", ".join(sorted(path.split("/")[1] for path in built)) or "no platform"
    about = {"host": "native.html", "platforms": platforms, "exchange": model_exchange}
    entries["documentation/index.html"] = rendered(f"{unit}.html", unit=kind, variables=variables, **about).encode()
    entries["model.png" if fmi == 2 else "terminalsAndIcons/icon.png"] = icon()
    states = len(exchange.states) if exchange else 0
    entries["modelDescription.xml"] = model_description(kind, variables, token, fmi, TOOL, compiled, states, remark)
    return write_atomically(Path(directory) / f"{unit}.fmu", zip_bytes(entries))


@cache
def _model(unit: str, exchanged: bool) -> tuple[str, str]:
    """Return model.h and model.c: the translation of a unit's functions."""
    definition = DEFINITIONS[unit]
    translation = Translation(definition.externals)
    exchange = definition.exchange if exchanged else None
    for entry in (*definition.entries, *(exchange.entries if exchange else ())):
        translation.entry(*(entry if isinstance(entry, tuple) else (entry,)))
    for function, by in exchange.differentiated.items() if exchange else ():
        translation.entry(function, slopes_by=by)
    if definition.settings is not None:
        translation.use(Struct(definition.settings))
    return header(translation, annotated(definition.memory)), source(translation)


def _sources(
    unit: type[SlaveBase], variables: Sequence[Variable], fmi: int, exchange: Exchange | None
) -> dict[str, str]:
    """Return every source of a unit by its file name, but for that of its token."""
    definition = DEFINITIONS[unit.__name__]
    own = [*RUNTIME, f"fmi{fmi}.c", definition.adapter, *definition.files, *([exchange.adapter] if exchange else [])]
    found = {name: files(__package__).joinpath("c", name).read_text(encoding="utf-8") for name in own}
    found |= {name: files("fmpy").joinpath("c-code", name).read_text(encoding="utf-8") for name in HEADERS[fmi]}
    found["model.h"], found["model.c"] = _model(unit.__name__, exchange is not None)
    settings = getattr(definition.settings, "__name__", None)
    found["variables.h"] = rendered("variables.h.j2", variables=variables, settings=settings, reference=reference)
    found["variables.c"] = rendered(
        "variables.c.j2", unit=unit, variables=variables, exchanged=exchange is not None, longest_step=LONGEST_STEP,
        clock_tolerance=CLOCK_TOLERANCE, most_substeps=MOST_SUBSTEPS, quoted=quoted,
        number=lambda value: repr(float(value)),
    )  # fmt: skip
    return found


def reference(name: str) -> str:
    """Return the C name of a variable's value reference: ``feedback.pitch`` is ``REF_feedback_pitch``."""
    return "REF_" + re.sub(r"\W+", "_", name).strip("_")


def controller_sources(settings: FeedbackSettings) -> dict[str, str]:
    """Return controller.h and controller.c: the step of the StateFeedback unit with these settings as constants.

    It is C99 for a microcontroller or a computer without FMI: no heap, no libraries.
    """
    translation = Translation()
    translation.entry(start_feedback)
    translation.entry(feedback_step)
    translation.use(Struct(FeedbackSettings))
    own = functions(translation, is_alone=True)
    return {
        "controller.h": rendered_types("controller.h.j2", translation, period=f"{settings.period:g}"),
        "controller.c": rendered("controller.c.j2", functions=own, settings=_constant(settings)),
    }


def _constant(value: Any) -> str:
    """Return a tuple of numbers as an initialiser."""
    if isinstance(value, tuple):
        deep = any(isinstance(part, tuple) for part in value)
        return f"{{{(',' + (chr(10) + '    ' if deep else ' ')).join(map(_constant, value))}}}"
    return str(value).lower() if isinstance(value, bool) else repr(value)
