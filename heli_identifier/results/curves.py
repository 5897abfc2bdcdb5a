"""Torques as curves: effects of the corrected plant over their variable, and unknown torques, drawn and in words."""

from collections.abc import Sequence

import numpy as np

from heli_identifier.chain import local_cubic, smooth_motion
from heli_identifier.results.statements import (
    CurveShape,
    EffectCurve,
    FoundEffect,
    PeriodicShape,
    Verdict,
    variable_name,
)
from heli_identifier.tracing.fit import Fit, covariance
from heli_identifier.tracing.helicopter import Rig
from heli_identifier.tracing.motion import lag_voltages
from heli_identifier.tracing.rig import Array, Parameters, Record
from heli_identifier.tracing.settings import PER_LOG, WINDOW
from heli_identifier.tracing.unknown import TIME, Unknown, curve_basis, table_variables, visited_values
from heli_plant.effects import AXES, Effect, effect

POINTS = 121
"""Points of a drawn curve."""


def draw_curves(fitted: Fit, effects: Sequence[FoundEffect]) -> tuple[EffectCurve, ...]:
    """Draw the effects of the plant over their variable: partial residuals, the law and its band.

    The partial residual is the smoothed acceleration less what the plant gives without the effect, averaged over bins
    of the variable; the law's curve is the plant with the effect less the plant without, at the same motion.
    """
    rig, drawn = fitted.likelihood.rig, []
    for found in effects:
        if isinstance(shape := found.shape, CurveShape):
            curve = np.column_stack((shape.curve, shape.band[:, 1:]))
            drawn.append(EffectCurve(found.name, found.axis, shape.variable, shape.unit, np.empty((0, 2)), curve))
        if found.coefficient is None or not found.in_plant or not (law := effect(found.name, found.axis)).drawn_against:
            continue
        bare = rig.assign(fitted.parameters, {law.field: 0.0})
        parts = [partial_residual(rig, record, fitted.parameters, bare, law) for record in fitted.likelihood.records]
        axis, variable, unit = parts[0][:3]
        x, y, torque = (np.concatenate([part[k] for part in parts]) for k in (3, 4, 5))
        bins = np.array_split(np.argsort(x), 32)
        X, Y, g = (np.array([v[b].mean() for b in bins]) for v in (x, y, torque))
        value, error = found.coefficient.value, found.coefficient.standard_error or 0.0
        spread = 1.96 * abs(error / value) * abs(g) if value else 0.0
        band = np.column_stack((X, g, g - spread, g + spread))
        drawn.append(EffectCurve(found.name, axis, variable, unit, np.column_stack((X, Y)), band))
    return tuple(drawn)


def partial_residual(
    rig: Rig, record: Record, parameters: Parameters, bare: Parameters, law: Effect
) -> tuple[str, str, str, Array, Array, Array]:
    """Return the points of an effect's curve; an effect of the rotors is drawn on the elevation.

    Returned are axis, variable, its unit and its values, the measured acceleration minus that of ``bare``, the
    plant without the effect, and the acceleration by the effect, both smoothed.
    """
    axis, h = AXES.index("elevation" if law.axis not in AXES else law.axis), record.step
    both = rig.plant_accelerations(record, parameters, bare, window=WINDOW)
    whole, without = (smooth_acceleration(of_plant[:, axis], h) for of_plant in both)
    inner = slice(round(1.0 / h), -round(1.0 / h))
    y = local_cubic(record.angles[:, axis], h, WINDOW, 2) - without
    motion = smooth_motion(record.angles, h, WINDOW)
    variable, unit, x = _drawn_variable(record, law.drawn_against or "", axis, motion, parameters)
    return AXES[axis], variable, unit, x[inner], y[inner], (whole - without)[inner]


def _drawn_variable(
    record: Record, kind: str, axis: int, motion: Array, parameters: Parameters
) -> tuple[str, str, Array]:
    """Name, unit and values of a variable that effects are drawn over."""
    if kind.startswith("mu_"):
        nu = lag_voltages(record.inputs, record.step, parameters)
        total = nu[:, 0] - nu[:, 1] if kind == "mu_diff" else nu.sum(1)
        return (kind, "V/s", np.gradient(total, record.step)) if kind == "mu_rate" else (kind, "V", total)
    if kind == "time":
        return "time", "s", record.time
    this, other = (f"{AXES[i]}_rate" for i in (axis, (1, 0, 1)[axis]))
    name, _, rate = {"rate": this, "other_rate": other}.get(kind, kind).partition("_")
    column = motion[:, AXES.index(name) + (3 if rate else 0)]
    return (f"{name} rate", "rad/s", column) if rate else (name, "rad", column)


def smooth_acceleration(accelerations: Array, h: float) -> Array:
    """Smooth accelerations (N,) as the second derivative of a local cubic smooths those of the angle."""
    angle = h * h * np.cumsum(np.cumsum(accelerations))
    return local_cubic(np.concatenate(([0.0], angle[:-1])), h, WINDOW, 2)


def describe_unknown(fitted: Fit, u: Unknown) -> FoundEffect:
    """State an unknown torque; a periodic one by its mean amplitude over the logs."""
    family, periodic = f"unknown torque of the {u.axis}", u.variable == TIME
    if periodic:
        amplitudes = np.hypot(u.weights[0::2], u.weights[1::2])
        A, error = float(amplitudes.mean()), float(np.sqrt(np.trace(u.covariance) / 2.0) / len(amplitudes))
        words = f"periodic in time at {u.spacing:.3f} Hz, amplitude {A:.2g} rad/s^2"
        shape: CurveShape | PeriodicShape = PeriodicShape(u.spacing, A, error, words)
        do = "Log the rig at rest, motors off, and look for what turns or blows in that time."
    else:
        shape = _curve(fitted, u)
        do = f"Lead the {u.axis} through all of its angles, motors off, and feel where the curve bends."
        if u.variable != u.axis:
            do = f"Visit all values of the {variable_name(u.variable)} evenly in one more log, all axes moving."
    return FoundEffect("unknown", u.axis, None, Verdict.UNKNOWN, family, (), shape, u.score, do, not periodic)


def _curve(fitted: Fit, u: Unknown) -> CurveShape:
    """Draw a table's torque where the logs were, without the constant and the line that the simplified model has."""
    tables = fitted.likelihood.rig.tables
    turning, first = u.variable in tables.turning, fitted.estimate(tables.first(u.axis))
    x = first + u.spacing * np.linspace(0.0, tables.knots - 1.0, POINTS)
    visited = visited_values(fitted, fitted.likelihood.rig.axes.index(u.axis), table_variables(fitted))
    values = visited[:, list(tables.variables).index(u.variable)]
    values = first + np.mod(values - first, 2.0 * np.pi) if turning else np.clip(values, x[0], x[-1])
    visits = np.sqrt(np.histogram(values, np.append(x, x[-1]) - 0.5 * (x[1] - x[0]))[0])
    visits[[0, -1]] = visits[[0, -1]].max()  # half a bin each, and of a turn the same angle
    basis, (which,) = curve_basis(tables, u.variable, first, u.spacing, [x])
    B = basis[which]
    trend = np.column_stack((np.ones(POINTS), x - x.mean())[: 1 + ((u.axis, u.variable) in tables.held)])
    B = B - trend @ np.linalg.lstsq(trend * visits[:, None], B * visits[:, None], rcond=None)[0]
    at = [fitted.fields.index(name) for name in tables.fields(u.axis, u.variable)]
    y = PER_LOG[0] * (B @ fitted.x[at])
    half = 1.96 * PER_LOG[0] * np.sqrt(np.einsum("ij,jk,ik->i", B, covariance(fitted)[np.ix_(at, at)], B))
    there = visits > 0.0
    x, y, half, unit = x[there], y[there], half[there], tables.variables[u.variable]
    said = _words(turning and bool(there.all()), unit, x, y, half)
    words = f"a torque by the {variable_name(u.variable)}, {said}"
    return CurveShape(u.variable, unit, words, np.column_stack((x, y)), np.column_stack((x, y - half, y + half)))


def _words(closed: bool, unit: str, x: Array, y: Array, half: Array) -> str:
    """Describe the determined part of a curve, where its band is narrow beside its range."""
    known = np.ones(len(y), dtype=bool)
    while (less := known & (half < 0.25 * np.ptp(y[known]))).sum() > max(10, 0.1 * len(y)) and (less != known).any():
        known = less
    X, Y = x[known], y[known]
    words = f"{np.ptp(Y):.2g} rad/s^2 from lowest to highest"
    if not known.all():
        words += f" between {X[0]:.2g} and {X[-1]:.2g} {unit}, where its band is narrow"
    if closed:
        power = np.abs(np.fft.rfft(y[:-1] - y[:-1].mean())) ** 2
        n = int(power.argmax())
        return f"{words}, periodic with {n} wave{'s'[: n > 1]} per turn" if power[n] > 0.5 * power.sum() else words
    if len(X) < 10:
        return words
    away = np.abs(Y - np.median(Y))
    wide = X[away > 0.5 * away.max()]
    if wide[0] > X[0] and wide[-1] < X[-1] and len(wide) < 0.35 * len(X):  # at an end it may be no notch
        return f"{words}, a notch near {0.5 * (wide[0] + wide[-1]):.3g} {unit}, {np.ptp(wide):.2g} {unit} wide"
    return words
