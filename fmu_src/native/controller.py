"""One state feedback as two files of C99 for a microcontroller or a computer without FMI: no heap, no libraries."""

from __future__ import annotations

from typing import Any

from heli_plant.state_feedback import FeedbackSettings, feedback_step, start_feedback

from ..description import rendered
from .translator.program import Translation, functions, rendered_types
from .translator.types import Struct


def controller_sources(settings: FeedbackSettings) -> dict[str, str]:
    """Return controller.h and controller.c: the step of the StateFeedback unit with these settings as constants."""
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
