"""What a perfect model would still get wrong: the figures of the model on data made by the model itself.

The innovations form of the fitted model, x_hat' = f(x_hat, v) + L e, y = y_hat + e, generates logs whose statistics are
those of the data if the model is right (Ljung, System Identification, section 4.3). e is drawn from an autoregression
of the innovations at the full rate.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import Log
from heli_identifier.tracing.prediction.innovations_form import generated
from heli_identifier.tracing.prediction.observer import innovations, observe, observer_start
from heli_identifier.tracing.prediction.recursive_filter import filtered
from heli_identifier.tracing.prediction.whitening import fit_axis
from heli_plant.parameters import PlantParameters
from heli_plant.plant import rigid_start
from heli_plant.state import PlantState

ORDER = 40
"""Order of the autoregression at the full rate: .4 s of memory beside what the observer's poles add."""

PIECE = 3.2
"""Length [s] of a piece: room for two seconds of prediction, short enough that an unstable axis stays near the rig."""


def synthetic_record(record: Log, parameters: PlantParameters, bandwidth: float, seed: int = 0) -> Log | None:
    """Record of the same voltages, made by the model in place of the rig; None where the model runs away for good."""
    noise = _noise(record, parameters, bandwidth, seed)
    angles = generated(record, rigid_start(observer_start(record), parameters), noise, parameters, bandwidth)
    return replace(record, angles=angles) if np.isfinite(angles).all() else None


def synthetic_pieces(record: Log, parameters: PlantParameters, bandwidth: float, seed: int = 0) -> tuple[Log, ...]:
    """Make records of an unstable model: pieces of :data:`PIECE` seconds, each begun at the rig's own motion.

    Pieces that still run away from the rig by half a turn are left out.
    """
    noise = _noise(record, parameters, bandwidth, seed)
    motion = observe(record, parameters, bandwidth, observer_start(record))[1]
    length = int(PIECE / record.step)
    pieces = []
    for first in range(0, record.samples - length + 1, length):
        rows = slice(first, first + length)
        piece = Log(f"{record.name}[{first}]", record.rate_hz, record.voltages[rows], record.angles[rows])
        start = _state(motion[first], float(record.angles[0, 2]))
        angles = generated(piece, start, noise[rows], parameters, bandwidth)
        if np.abs(angles - piece.angles).max() < np.pi:
            pieces.append(replace(piece, angles=angles))
    return tuple(pieces)


def _state(motion: NDArray[np.float64], cable_rest: float) -> PlantState:
    """State at one sample of an observer's motion (8,), the arm unbent."""
    pitch, elevation, travel, w1, w2, w3, nu_front, nu_rear = (float(value) for value in motion)
    return PlantState(pitch, elevation, travel, w1, w2, w3, nu_front, nu_rear, cable_rest=cable_rest)


def _noise(record: Log, parameters: PlantParameters, bandwidth: float, seed: int) -> NDArray[np.float64]:
    """Innovations (N, 3) [rad] drawn with the noise spectrum of the record's own."""
    e = innovations(record, parameters, bandwidth, observer_start(record)) / bandwidth**2
    settled = e[int(10.0 / bandwidth / record.step) :]
    random = np.random.default_rng(seed)
    return np.column_stack([_with_spectrum_of(settled[:, axis], len(e), random) for axis in range(3)])


def _with_spectrum_of(sample: NDArray[np.float64], count: int, random: np.random.Generator) -> NDArray[np.float64]:
    """``count`` samples of Gaussian noise with the spectrum of ``sample``."""
    taps, scale = fit_axis([sample], ORDER)
    lead = 10 * ORDER
    return filtered([scale], taps, random.standard_normal(count + lead))[lead:]
