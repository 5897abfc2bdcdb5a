"""One state feedback as two files of C99 for a microcontroller or a computer without FMI: no heap, no libraries."""

from __future__ import annotations

from typing import Any

from heli_plant.state_feedback import FeedbackSettings, feedback_step, start_feedback

from .translator import Struct, Translation, header, source

_HEAD = """/* State feedback with a Kalman filter, as heli design-controller made it: C99, no heap, no libraries.

   controller_start(&state, pitch, elevation, travel);                    once, at rest
   controller_step(&state, angles, references, voltages);                 every {period:g} s

   Angles and references are pitch, elevation, travel [rad]; voltages are front and rear [V], to be put out one period
   after their angles were read. */
#ifndef CONTROLLER_H
#define CONTROLLER_H

#include <stdbool.h>
#include <stdint.h>

/* every product and sum is rounded by itself, as in the unit */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC optimize("fp-contract=off")
#elif defined(_MSC_VER)
#pragma fp_contract(off)
#endif

{types}
void controller_start(FeedbackState *state, double pitch, double elevation, double travel);
void controller_step(FeedbackState *state, const double angles[3], const double references[3], double voltages[2]);

#endif
"""

_ENDS = """
static const FeedbackSettings SETTINGS = {settings};

void controller_start(FeedbackState *state, double pitch, double elevation, double travel)
{{
    *state = state_feedback_start_feedback(pitch, elevation, travel, &SETTINGS);
}}

void controller_step(FeedbackState *state, const double angles[3], const double references[3], double voltages[2])
{{
    const Row3 wanted = {{references[0], references[1], references[2]}};
    const Rotors nothing = {{0.0, 0.0}};
    *state = state_feedback_feedback_step(state, angles[0], angles[1], angles[2], wanted, &nothing, &SETTINGS);
    voltages[0] = SETTINGS.hover.front + state->now.front;
    voltages[1] = SETTINGS.hover.rear + state->now.rear;
}}
"""


def controller_sources(settings: FeedbackSettings) -> dict[str, str]:
    """Return controller.h and controller.c: the step of the StateFeedback unit with these settings as constants."""
    translation = Translation()
    translation.entry(start_feedback)
    translation.entry(feedback_step)
    translation.use(Struct(FeedbackSettings))
    heads = [f"\n{entry.head.partition('(')[0]}(" for entry in translation.entries]
    text = header(translation)
    types = text[text.index("typedef") : min(text.index(head) for head in heads)].rstrip() + "\n"
    functions = source(translation).partition('#include "model.h"\n')[2]
    for head in heads:
        functions = functions.replace(head, f"\nstatic {head[1:]}")
    ends = _ENDS.format(settings=_constant(settings))
    return {
        "controller.h": _HEAD.format(period=settings.period, types=types),
        "controller.c": f'#include "controller.h"\n{functions}{ends}',
    }


def _constant(value: Any) -> str:
    """Return a tuple of numbers as an initialiser."""
    if isinstance(value, tuple):
        deep = any(isinstance(part, tuple) for part in value)
        return f"{{{(',' + (chr(10) + '    ' if deep else ' ')).join(map(_constant, value))}}}"
    return str(value).lower() if isinstance(value, bool) else repr(value)
