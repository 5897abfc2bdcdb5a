"""An unknown torque in numbers and words: a curve with a band and its kind, or a period with an amplitude."""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.search.found_effect import CurveShape, PeriodicShape
from heli_identifier.tracing.search.model import Model
from heli_identifier.tracing.search.splines import DEGREE, UNITS
from heli_identifier.tracing.search.unknown import Unknown

POINTS = 121
"""Points of a drawn curve."""


def described(model: Model, index: int) -> CurveShape | PeriodicShape:
    """Shape of the unknown torque number ``index`` of a model."""
    unknown = model.unknowns[index]
    if unknown.frequency is not None:
        return _periodic(unknown.frequency, model.weights(index), model.weights_covariance(index))
    x = np.linspace(unknown.knots[DEGREE], unknown.knots[-DEGREE - 1], POINTS)
    y, error = curve_at(model, index, x)
    half = 1.96 * error
    visited = np.isfinite(half)
    return CurveShape(
        unknown.variable,
        UNITS[unknown.variable],
        _words(unknown, x[visited], y[visited], half[visited]),
        np.column_stack((x, y))[visited],
        np.column_stack((x, y - half, y + half))[visited],
    )


def curve_at(model: Model, index: int, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Give unknown curve number ``index`` at values ``x`` (n,) of its variable.

    Returns
    -------
    torque, standard_error : NDArray, shape (n,)
        Per inertia [rad/s^2]; the error is infinite where no record has values.
    """
    basis, covariance = model.unknowns[index].curve(x), model.weights_covariance(index)
    silent = np.isinf(np.diag(covariance))  # splines where no record has values
    known = np.where(silent[:, None] | silent, 0.0, covariance)
    error = np.sqrt(np.einsum("ij,jk,ik->i", basis, known, basis))
    error[(basis[:, silent] != 0.0).any(axis=1)] = np.inf
    return basis @ model.weights(index), error


def _periodic(frequency: float, weights: NDArray[np.float64], covariance: NDArray[np.float64]) -> PeriodicShape:
    """Shape of a periodic torque of ``frequency`` [Hz] with its mean amplitude over the records."""
    amplitudes = np.hypot(weights[0::2], weights[1::2])
    error = float(np.sqrt(np.trace(covariance) / 2.0) / len(amplitudes))
    amplitude = float(amplitudes.mean())
    description = f"periodic in time at {frequency:.3f} Hz, amplitude {amplitude:.2g} rad/s^2"
    return PeriodicShape(float(frequency), amplitude, error, description)


def _determined(y: NDArray[np.float64], half: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Where the half width ``half`` of a curve's band is less than a quarter of the curve's range.

    The range is that of the part that is determined itself, found by iteration. Otherwise the ends, where a spline
    rests on a few samples, would decide the size of the curve. Where hardly any part is determined, all of it counts.
    """
    known = np.ones(len(y), dtype=bool)
    while True:
        narrower = known & (half < 0.25 * np.ptp(y[known]))
        if narrower.sum() < 0.1 * len(y) or (narrower == known).all():
            return known
        known = narrower


def _words(unknown: Unknown, x: NDArray[np.float64], y: NDArray[np.float64], half: NDArray[np.float64]) -> str:
    """Describe the curve where records have been; its size is that of the part that they determine."""
    known = _determined(y, half)
    words = [f"a torque of {unknown.variable}, {np.ptp(y[known]):.2g} rad/s^2 from lowest to highest"]
    if len(y) < POINTS:
        return words[0]  # a curve with gaps has a size, but its shape is not known
    if unknown.variable == "travel":
        spectrum = np.abs(np.fft.rfft(y[:-1] - y[:-1].mean()))
        waves = int(np.argmax(spectrum[1:9])) + 1
        if spectrum[waves] ** 2 > 0.5 * float((spectrum[1:] ** 2).sum()):
            return f"{words[0]}, periodic with {waves} wave{'s' if waves > 1 else ''} per turn"
        return words[0]
    if known.sum() > 10:
        level = float(np.median(y[known]))
        peak = int(np.argmax(np.where(known, np.abs(y - level), 0.0)))
        wide = np.abs(y - level) > 0.5 * abs(y[peak] - level)
        # a curve that is large at the end of the range may go on there: a parabola is not local
        inside = not (wide[known][0] or wide[known][-1])
        if inside and wide[known].mean() < 0.25:
            width = float(x[1] - x[0]) * int((wide & known).sum())
            unit = UNITS[unknown.variable]
            words.append(f"localised near {x[peak]:.3g} {unit}, about {width:.2g} {unit} wide")
            return ", ".join(words)
    inner = (x >= max(x[0], -x[-1])) & (x <= min(x[-1], -x[0]))
    if inner.sum() > 20:
        centred = y[inner] - y[inner].mean()
        odd = 0.5 * (centred - centred[::-1])
        share = float((odd**2).sum() / max((centred**2).sum(), 1e-30))
        if share > 0.8:
            words.append("odd")
        elif share < 0.2:
            words.append("even")
    slope = np.abs(np.gradient(y, x))
    ends = np.concatenate((slope[:12], slope[-12:])).mean()
    if ends < 0.3 * slope[len(slope) // 3 : -len(slope) // 3].mean():
        words.append("saturating")
    return ", ".join(words)
