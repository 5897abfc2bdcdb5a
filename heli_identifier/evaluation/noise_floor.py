"""What a perfect model would still get wrong: the figures of the model on data made by the model itself.

The innovations form of the fitted model, x_hat' = f(x_hat, v) + L e, y = y_hat + e, generates logs whose statistics are
those of the data if the model is right (Ljung, System Identification, section 4.3). e is drawn from an autoregression
of the innovations at the full rate.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from heli_identifier.prediction.observer import DAMPING, corrected, observe, observer_start
from heli_identifier.prediction.record import Record
from heli_identifier.prediction.whitening import fit_axis
from heli_plant.compiled import compiled, parameter_record
from heli_plant.delay import delayed, whole_and_fraction
from heli_plant.parameters import PlantParameters
from heli_plant.plant import measured_angles, rigid_start, step
from heli_plant.state import PlantState

ORDER = 40
"""Order of the autoregression at the full rate: .4 s of memory beside what the observer's poles add."""

PIECE = 3.2
"""Length [s] of a piece: room for two seconds of prediction, short enough that an unstable axis stays near the rig."""


def _generate(voltages, noise, start, h, p, l1, l2, angles):
    """Fill ``angles`` (N, 3) [rad] of the innovations form driven by ``noise`` (N, 3) [rad]."""
    whole, fraction = whole_and_fraction(p.input_delay_rotors, h)
    state = start
    for k in range(len(angles)):
        pitch, elevation, travel = measured_angles(state)
        e1, e2, e3 = noise[k, 0], noise[k, 1], noise[k, 2]
        angles[k, 0], angles[k, 1], angles[k, 2] = pitch + e1, elevation + e2, travel + e3
        recent, older = max(k - whole, 0), max(k - whole - 1, 0)
        v_front = delayed(voltages[recent, 0], voltages[older, 0], fraction)
        v_rear = delayed(voltages[recent, 1], voltages[older, 1], fraction)
        state = step(corrected(state, e1, e2, e3, l1, l2), v_front, v_rear, 0.0, k * h, h, p)


def synthetic_record(record: Record, parameters: PlantParameters, bandwidth: float, seed: int = 0) -> Record:
    """Return a record of the same voltages, made by the model in place of the rig; unstable models run away from it."""
    noise = _noise(record, parameters, bandwidth, seed)
    return _generated(record, rigid_start(observer_start(record), parameters), noise, parameters, bandwidth)


def synthetic_pieces(
    record: Record, parameters: PlantParameters, bandwidth: float, seed: int = 0
) -> tuple[Record, ...]:
    """Return the same in pieces of :data:`PIECE` seconds, each begun at the rig's own motion: for unstable models.

    Pieces that run away from the rig by half a turn all the same are left out.
    """
    noise = _noise(record, parameters, bandwidth, seed)
    motion = observe(record, parameters, bandwidth, observer_start(record))[1]
    length = int(PIECE / record.step)
    pieces = []
    for first in range(0, record.samples - length + 1, length):
        rows = slice(first, first + length)
        piece = Record(f"{record.name}[{first}]", record.step, record.voltages[rows], record.angles[rows])
        start = _state(motion[first], float(record.angles[0, 2]))
        made = _generated(piece, start, noise[rows], parameters, bandwidth)
        if np.abs(made.angles - piece.angles).max() < np.pi:
            pieces.append(made)
    return tuple(pieces)


def _state(motion: NDArray[np.float64], cable_rest: float) -> PlantState:
    """State at one sample of an observer's motion (8,), the arm unbent."""
    pitch, elevation, travel, w1, w2, w3, nu_front, nu_rear = (float(value) for value in motion)
    return PlantState(pitch, elevation, travel, w1, w2, w3, nu_front, nu_rear, cable_rest=cable_rest)


def _noise(record: Record, parameters: PlantParameters, bandwidth: float, seed: int) -> NDArray[np.float64]:
    """Innovations (N, 3) [rad] drawn with the colour of the record's own."""
    e = observe(record, parameters, bandwidth, observer_start(record))[0] / bandwidth**2
    settled = e[int(10.0 / bandwidth / record.step) :]
    random = np.random.default_rng(seed)
    return np.column_stack([_coloured(settled[:, axis], len(e), random) for axis in range(3)])


def _generated(
    record: Record, start: PlantState, noise: NDArray[np.float64], parameters: PlantParameters, bandwidth: float
) -> Record:
    angles = np.empty_like(record.angles)
    h = record.step
    gains = (2.0 * DAMPING * bandwidth * h, bandwidth * bandwidth * h)
    compiled(_generate)(record.voltages, noise, start, h, parameter_record(parameters), *gains, angles)
    return Record(record.name, h, record.voltages, angles)


def _coloured(sample: NDArray[np.float64], count: int, random: np.random.Generator) -> NDArray[np.float64]:
    """``count`` samples of Gaussian noise with the colour of ``sample``."""
    taps, scale = fit_axis([sample], ORDER)
    lead = 10 * ORDER
    return lfilter([scale], taps, random.standard_normal(count + lead))[lead:]
