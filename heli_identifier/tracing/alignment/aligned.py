"""Logs with one zero of the elevation, the model before that was fitted to them, and what was shifted."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from heli_identifier.records import Log
from heli_identifier.tracing.alignment.elevation_zero import ROUNDS, SETTLED, outlying, shifted, zero_note, zeros
from heli_identifier.tracing.search.model import Model
from heli_identifier.tracing.validation.held_out import HeldOut, hold_out


@dataclass(frozen=True, eq=False)
class Aligned:
    """Logs of one rig with one zero of the elevation.

    Attributes
    ----------
    null : Model
        The model before, fitted to the training logs.
    held_out : HeldOut
    notes : tuple of str
        What was shifted, one sentence a log.
    """

    null: Model
    held_out: HeldOut
    notes: tuple[str, ...]


def aligned(training: Sequence[Log], held_out: Sequence[Log], fitted: Callable[[Sequence[Log]], Model]) -> Aligned:
    """Shift the logs whose elevation was zeroed in another position, and fit the model before.

    Parameters
    ----------
    training, held_out : sequence of Log
    fitted : callable
        Fits the model before to training logs.
    """
    logs, zero = (*training, *held_out), np.zeros(len(training) + len(held_out))

    def fitted_to(own: Sequence[Log]) -> tuple[Model, HeldOut]:
        null = fitted(own[: len(training)])
        return null, hold_out(own[len(training) :], null.fit.problem.bandwidth)

    null, held = fitted_to(logs)
    for _ in range(ROUNDS):
        parameters = null.fit.parameters
        innovations = [*null.fit.model_residuals, *held.errors(parameters).residuals]
        left = zeros(innovations, parameters.a_e, held.problem.bandwidth)
        moved = np.where(outlying(zero + left), zero + left, 0.0)
        if np.allclose(moved, zero, rtol=0.0, atol=SETTLED):
            break
        zero = moved
        null, held = fitted_to(shifted(logs, zero))
    notes = tuple(zero_note(log.name, shift) for log, shift in zip(logs, zero, strict=True) if shift)
    return Aligned(null, held, notes)
