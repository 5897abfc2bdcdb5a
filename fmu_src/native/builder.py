"""The files of a unit in C.

They are the sources (written by hand, translated, or generated from the unit's definition), the description with which
an importer compiles them, and binaries for every platform with a compiler. Names, causalities and start values are
those of the pythonfmu unit. The table of definitions says which functions are translated for each unit, and which files
are written by hand.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.resources import files
from typing import Any

from heli_identifier import online
from heli_identifier.online import excitation
from heli_plant import communication, control, laws, motor, plant, state, state_feedback
from heli_plant.parameters import PlantParameters
from heli_plant.state_feedback import FeedbackSettings, feedback_step, start_feedback

from .. import slave_base
from ..description import TOOL, render, render_xml
from ..errors import BuildError
from ..slave_base import SlaveBase
from ..units import adaptive_identifier, controllers
from ..variables import Variable
from ..vendoring import content_guid
from .toolchain import compile_all
from .translator.program import Translation, functions, header, render_types
from .translator.types import Struct, annotation_type
from .translator.values import literal


@dataclass(frozen=True, eq=False)
class Definition:
    """A unit in C."""

    files: tuple[str, ...]  # in C; the first connects the translated functions with the unit's variables
    entries: tuple[Any, ...] = ()  # functions that it calls; in a tuple with types that replace or add annotations
    settings: type | None = None  # struct that is filled from the variables that name a field of it
    memory: Any = type(None)  # annotation of the unit's memory between steps
    externals: Mapping[Callable[..., Any], str] = field(default_factory=dict)  # names in C of functions by hand
    states: tuple[tuple[str, str, float], ...] = ()  # of Model Exchange: name, unit and nominal value of each

    @property
    def state_variables(self) -> tuple[Variable, ...]:
        """The states, which follow the unit's variables, and then their derivatives."""
        states = tuple(
            Variable(f"state.{name}", "local", f"continuous state: {name.replace('_', ' ')}", unit=unit, nominal=size)
            for name, unit, size in self.states
        )
        return states + tuple(  # rad/s becomes rad/s^2
            Variable(f"der({x.name})", "local", f"derivative of {x.name}", unit=f"{x.unit}/s".replace("/s/s", "/s^2"))
            for x in states
        )


_PARAMETERS = {"p": PlantParameters}
_PLANT = Definition(
    ("plant.c", "plant.h"),
    (
        communication.start_memory, communication.communicate, communication.is_finite, communication.read_sensors,
        state.start_state, (laws.motor_time_constant, _PARAMETERS), (laws.input_delay, _PARAMETERS),
        slave_base.check_substeps,
    ),
    PlantParameters,
    communication.PlantMemory,
)  # fmt: skip

DEFINITIONS = {
    "HelicopterPlant": _PLANT,
    "AdaptiveIdentifier": Definition(
        ("identifier.c",),
        (
            online.prepare, online.begin_sampling, online.before_samples, online.default_settings, online.is_closed,
            adaptive_identifier.take_samples, adaptive_identifier.output_values,
            (online.IdentifierSettings.__post_init__, {"self": online.IdentifierSettings}),
        ),
        online.IdentifierSettings,
        online.Sampled | None,
    ),
    "PidController": Definition(
        ("pid.c",),
        (controllers.pid_voltages, motor.saturate),
        control.PidSettings,
        control.PidState | None,
    ),
    "StateFeedback": Definition(
        ("state_feedback.c",),
        (controllers.feedback_voltages, motor.saturate),
        state_feedback.FeedbackSettings,
        state_feedback.SampledFeedback | None,
    ),
    "Exciter": Definition(
        ("exciter.c", "mersenne.c"),
        (
            (excitation.SquareChirp.at, {"self": excitation.SquareChirp}), excitation.paper_channels,
            excitation.multisine_components, excitation.multisine_value, excitation.check_bounds, excitation.combine,
        ),
        externals={excitation.phases: "phases"},
    ),
    "LogPlayer": Definition(("player.c",), (slave_base.time_tolerance,)),  # its file is read in C
}  # fmt: skip
"""By the unit's name."""

MODEL_EXCHANGE = {
    "HelicopterPlant": replace(
        _PLANT,
        files=(*_PLANT.files, "plant_exchange.c"),
        entries=(*_PLANT.entries, plant.rates_of_change, (laws.next_step_time, {"time": float} | _PARAMETERS)),
        states=plant.STATES,
    ),
}
"""Units that have Model Exchange beside co-simulation; their last file connects states, rates and events."""

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
        (name,) = MODEL_EXCHANGE
        raise BuildError(f"{unit} has no model exchange, because it works at sampling instants; {name} has")
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
    for entry in (slave_base.check_step, *definition.entries):
        translation.translate_entry(*(entry if isinstance(entry, tuple) else (entry,)))
    if definition.settings is not None:
        translation.define_type(Struct(definition.settings))
    comment = "/* Translated from the Python sources of the unit; change those, not this file. */"
    code = f'{comment}\n#include "model.h"\n\n{functions(translation)}'
    return header(translation, annotation_type(definition.memory)), code


def _sources(definition: Definition, unit: type[SlaveBase], variables: Sequence[Variable], fmi: int) -> dict[str, str]:
    """Return every source of a unit by its file name, except that of its token."""
    names = [*RUNTIME, f"fmi{fmi}.c", *definition.files]
    sources = {name: files(__package__).joinpath("c", name).read_text(encoding="utf-8") for name in names}
    sources |= {name: files("fmpy").joinpath("c-code", name).read_text(encoding="utf-8") for name in HEADERS[fmi]}
    sources["model.h"], sources["model.c"] = _model(definition)
    settings = getattr(definition.settings, "__name__", None)
    sources["variables.h"] = render("variables.h.j2", variables=variables, settings=settings, reference=reference)
    sources["variables.c"] = render(
        "variables.c.j2", unit=unit, variables=variables, exchanged=bool(definition.states), quoted=literal,
        number=lambda value: repr(float(value)),
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
