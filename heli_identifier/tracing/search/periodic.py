"""Periodic torques: one frequency with a free amplitude and phase in each record."""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.prediction.fit import Fit
from heli_identifier.tracing.prediction.problem import REDUCED_RATE, Problem
from heli_identifier.tracing.prediction.torque import torque_responses
from heli_identifier.tracing.search.settings import HIGHEST_FREQUENCY, LOWEST_FREQUENCY
from heli_plant.parameters import PlantParameters


def periodic_columns(
    problem: Problem, parameters: PlantParameters, axis: int, frequency: float
) -> list[NDArray[np.float64]]:
    """Responses to a cosine and a sine of ``frequency`` [Hz] in each record apart, (n_i, 1, 2 records)."""
    count = len(problem.records)
    accelerations = []
    for index, record in enumerate(problem.records):
        phase = 2.0 * np.pi * frequency * np.arange(record.samples) * record.step
        waves = np.zeros((record.samples, 2 * count))
        waves[:, 2 * index], waves[:, 2 * index + 1] = np.cos(phase), np.sin(phase)
        accelerations.append(waves)
    return [-r[:, None, :] for r in torque_responses(problem, axis, parameters, accelerations)]


def strongest_frequencies(fit: Fit, axis: int, count: int = 2) -> list[float]:
    """Frequencies [Hz] at which the innovations' periodogram, summed over records, stands out most.

    The periodogram is that of the innovations before whitening: an autoregression would hide a strong periodic torque.
    """
    size = 2 ** int(np.ceil(np.log2(max(fit.problem.lengths)) + 2))
    frequencies = np.fft.rfftfreq(size, 1.0 / REDUCED_RATE)
    power = np.zeros(len(frequencies))
    for residuals in fit.residuals:
        window = np.hanning(len(residuals))
        power += np.abs(np.fft.rfft(residuals[:, axis] * window, size)) ** 2 / (window @ window)
    background = _background(frequencies, power, 12.0 * REDUCED_RATE / max(fit.problem.lengths))
    inside = (frequencies > LOWEST_FREQUENCY) & (frequencies < HIGHEST_FREQUENCY)
    standing = np.where(inside, power / background, 0.0)
    found: list[float] = []
    width = 3.0 * REDUCED_RATE / max(fit.problem.lengths)
    for index in np.argsort(standing)[::-1]:
        if all(abs(frequencies[index] - f) > width for f in found):
            found.append(float(frequencies[index]))
        if len(found) == count:
            break
    return found


def _background(frequencies: NDArray[np.floating], power: NDArray[np.float64], least: float) -> NDArray[np.float64]:
    """Smooth level of a periodogram: its median over bands of a third of an octave, no narrower than ``least`` [Hz]."""
    edges = [LOWEST_FREQUENCY / 2.0]
    while edges[-1] < frequencies[-1]:
        edges.append(max(edges[-1] * 2.0 ** (1.0 / 3.0), edges[-1] + least))
    band = np.clip(np.searchsorted(edges, frequencies, side="right") - 1, 0, len(edges) - 2)
    used = np.unique(band)
    centres = [frequencies[band == i].mean() for i in used]
    levels = [np.median(power[band == i]) for i in used]
    return np.exp(np.interp(frequencies, centres, np.log(levels)))
