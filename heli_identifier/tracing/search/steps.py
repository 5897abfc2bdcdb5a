"""Where in time a step of the elevation torque would explain most: starting points for the moving mass.

The innovations' response to a step is the same wherever the step lies: whitened once, it is moved along the record.
With c(t) the response to a step at t, B an orthonormal basis of what the fitted parameters explain and z the whitened
residual, the score is |z'c - (B'z)'B'c| / sqrt(c'c - |B'c|^2); the products for all t at once are cross-correlations.
"""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.prediction.fit import Fit
from heli_identifier.tracing.prediction.problem import REDUCED_RATE, SETTLING
from heli_identifier.tracing.prediction.torque import torque_responses
from heli_identifier.tracing.prediction.whitening import Whitener
from heli_identifier.tracing.search.candidates import STEP_SPACING, Candidate, stepping_at
from heli_identifier.tracing.search.scan import basis_of
from heli_plant.effects import AXES

ELEVATION = AXES.index("elevation")

APART = 2.0
"""Least distance [s] of two steps from each other and from a record's end."""


def best_steps(fit: Fit, of_noise: Whitener) -> list[Candidate]:
    """Find the moves that step at the best times under the whitener of the fit or that of the noise."""
    times = {t for whitener in (of_noise, fit.whitener) for t in step_times(fit, whitener)}
    return stepping_at(sorted(times), fit.parameters)


def step_times(fit: Fit, whitener: Whitener, count: int = 2) -> tuple[float, ...]:
    """Find the times [s] of the ``count`` best steps, the same in every record."""
    known = whitener.apply_axis(ELEVATION, [raw[:, ELEVATION] for raw in fit.raw_jacobian])
    basis = basis_of(known[:, np.linalg.norm(known, axis=0) > 0.0])
    white = whitener.apply_axis(ELEVATION, [r[:, ELEVATION] for r in fit.residuals])
    longest = max(record.duration for record in fit.problem.records)
    late = SETTLING / fit.problem.bandwidth + whitener.order / REDUCED_RATE
    times = np.arange(late, longest - APART, STEP_SPACING)
    lags = np.round((times - late) * REDUCED_RATE).astype(int)
    products, energy = np.zeros((len(times), 1 + basis.shape[1])), np.zeros(len(times))
    first = 0
    for response in _whitened_steps(fit, whitener, late):
        rows = slice(first, first + len(response))
        inside = lags < len(response)
        signals = np.column_stack((white[rows], basis[rows]))
        products[inside] += _moved_products(signals, response)[lags[inside]]
        energy[inside] += np.cumsum(response**2)[len(response) - 1 - lags[inside]]
        first += len(response)
    along, within = products[:, 0], products[:, 1:]
    left = np.maximum(energy - (within**2).sum(axis=1), 1e-12 * energy.max())
    scores = np.abs(along - within @ (basis.T @ white)) / np.sqrt(left)
    found: list[float] = []
    for index in np.argsort(-scores):
        if all(abs(times[index] - t) > APART + 0.5 * STEP_SPACING for t in found):
            found.append(float(round(times[index], 2)))
        if len(found) == count:
            break
    return tuple(found)


def _whitened_steps(fit: Fit, whitener: Whitener, late: float) -> list[NDArray[np.float64]]:
    """Per record the whitened response (n_i,) to a step at its first whitened sample, ``late`` [s]."""
    steps = [(np.arange(r.samples) * r.step >= late).astype(float)[:, None] for r in fit.problem.records]
    responses = torque_responses(fit.problem, ELEVATION, fit.parameters, steps)
    return [whitener.apply_axis(ELEVATION, [response[:, 0]]) for response in responses]


def _moved_products(signals: NDArray[np.float64], response: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inner products (n, m) of signals (n, m) with the response moved by 0, 1, ... n - 1 samples."""
    count = len(response)
    length = 1 << (2 * count - 1).bit_length()  # room for the products behind the record's end, and fast
    spectrum = np.fft.rfft(signals, length, axis=0) * np.fft.rfft(response[::-1], length)[:, None]
    return np.fft.irfft(spectrum, length, axis=0)[count - 1 : 2 * count - 1]
