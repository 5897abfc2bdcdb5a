"""A found effect drawn: the partial residual against the effect's variable, and the fitted law with its band.

The partial residual is the smoothed acceleration less what the model gives without the effect, averaged over bins of
the variable; the law's curve is the model with the effect less the model without, smoothed and averaged the same way.
No law is written again here: both come from the plant.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import Log
from heli_identifier.tracing.diagnosis.result import EffectCurve
from heli_identifier.tracing.prediction.along import accelerations_at
from heli_identifier.tracing.prediction.smoothed_state import as_smoothed, smoothed_motion
from heli_identifier.tracing.search.found_effect import CurveShape, FoundEffect
from heli_identifier.tracing.search.model import Model
from heli_plant.effects import AXES, Effect
from heli_plant.parameters import PlantParameters

BINS = 32
"""Bins of the variable, of equal population."""

RATES = tuple(f"{axis}_rate" for axis in AXES)

SHOWN_ON = {"rotors": "elevation"}
"""Axis on which an effect of the rotors is drawn."""


def accelerations_along(record: Log, parameters: PlantParameters) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Accelerations (N, 3) [rad/s^2] of the model at a record's smoothed motion, and mu_d, mu_s (N, 2) [V]."""
    return accelerations_at(record, np.column_stack((smoothed_motion(record), smoothed_motion(record, 1))), parameters)


def effect_curve(model: Model, effect: Effect, records: Sequence[Log]) -> EffectCurve | None:
    """Draw one named effect of a model; None for the bending mode."""
    if effect.drawn_against is None:
        return None
    shown = SHOWN_ON.get(effect.axis, effect.axis)
    axis = AXES.index(shown)
    parameters = model.fit.parameters
    bare = parameters._replace(**{effect.field: 0.0})
    xs, points, laws = [], [], []
    for record in records:
        without, mu = accelerations_along(record, bare)
        with_effect, _ = accelerations_along(record, parameters)
        without, with_effect = as_smoothed(without, record), as_smoothed(with_effect, record)
        cut = slice(int(1.0 / record.step), -int(1.0 / record.step))
        xs.append(_variable(record, effect.drawn_against, axis, mu)[cut])
        points.append((smoothed_motion(record, 2)[:, axis] - without[:, axis])[cut])
        laws.append((with_effect[:, axis] - without[:, axis])[cut])
    x, point, law = (np.concatenate(parts) for parts in (xs, points, laws))
    order = np.argsort(x)
    bins = np.array_split(order, BINS)
    value, error = getattr(parameters, effect.field), model.fit.standard_error(effect.field)
    spread = 1.96 * abs(error / value)
    centres = np.array([x[b].mean() for b in bins])
    drawn = np.array([law[b].mean() for b in bins])
    name, unit = _label(effect.drawn_against, axis)
    return EffectCurve(
        effect.name,
        shown,
        name,
        unit,
        np.column_stack((centres, [point[b].mean() for b in bins])),
        np.column_stack((centres, drawn, drawn - spread * np.abs(drawn), drawn + spread * np.abs(drawn))),
    )


def drawn_curves(model: Model, effects: Sequence[FoundEffect]) -> tuple[EffectCurve, ...]:
    """Curves of the found effects that can be drawn: named effects first, then unknown torques of one variable."""
    curves = [effect_curve(model, effect, model.fit.problem.records) for effect in model.effects]
    for found in effects:
        shape = found.shape
        if isinstance(shape, CurveShape):
            drawn = np.column_stack((shape.curve, shape.band[:, 1:]))
            curves.append(EffectCurve("unknown", found.axis, shape.variable, shape.unit, np.empty((0, 2)), drawn))
    return tuple(curve for curve in curves if curve is not None)


def _variable(record: Log, kind: str, axis: int, mu: NDArray[np.float64]) -> NDArray[np.float64]:
    angles, rates = smoothed_motion(record), smoothed_motion(record, 1)
    if kind == "rate":
        return rates[:, axis]
    if kind == "other_rate":
        return rates[:, _other(axis)]
    if kind == "mu_sum":
        return mu[:, 1]
    if kind == "mu_rate":
        return np.gradient(mu[:, 1], record.step)
    if kind in RATES:
        return rates[:, RATES.index(kind)]
    if kind == "time":
        return np.arange(record.samples, dtype=np.float64) * record.step
    return angles[:, AXES.index(kind)]


def _other(axis: int) -> int:
    """Give the axis whose rate a coupling torque follows: elevation's for pitch and travel, pitch's for elevation."""
    return (1, 0, 1)[axis]


def _label(kind: str, axis: int) -> tuple[str, str]:
    """Name and unit of a variable."""
    return {
        "rate": (f"{AXES[axis]} rate", "rad/s"),
        "other_rate": (f"{AXES[_other(axis)]} rate", "rad/s"),
        "mu_sum": ("mu_s", "V"),
        "mu_rate": ("d mu_s / dt", "V/s"),
        "time": ("time", "s"),
        **{rate: (f"{of} rate", "rad/s") for rate, of in zip(RATES, AXES, strict=True)},
    }.get(kind, (kind, "rad"))
