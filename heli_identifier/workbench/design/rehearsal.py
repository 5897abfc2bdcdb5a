"""Experiments to choose from, and the log that each would give: simulated, with process noise and encoders.

The excitations are multisines of three bands, levels and strengths, and the paper's own. The process noise is a
first-order Gauss-Markov torque on each axis.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from heli_identifier.online.excitation import Excitation, Multisine, paper_excitation, voltages
from heli_plant.along import run_alone
from heli_plant.encoders import EncoderCounts
from heli_plant.parameters import PlantParameters
from heli_plant.state import rest_state

STEP = 0.01
"""Sampling period [s]."""

BANDS = {"slow": (0.03, 0.4), "middle": (0.1, 1.2), "fast": (0.5, 3.0)}
"""Bands [Hz] of the multisines."""

BASES = (0.0, 0.6, 1.25, 2.5)
"""Base voltages of each rotor [V]; near zero the rotors reverse."""

STRENGTHS = (0.25, 0.6, 1.2)
"""Root-mean-square values [V] of the signals on the difference and on the sum."""


@dataclass(frozen=True)
class ProcessNoise:
    """A random torque on each axis: standard ``deviation`` [rad/s^2] and ``correlation_time`` [s]."""

    deviation: float = 0.003
    correlation_time: float = 1.0


@dataclass(frozen=True)
class Proposal:
    """An excitation and its description in words."""

    name: str
    excitation: Excitation


def proposals(limit: float) -> Iterator[Proposal]:
    """Yield the excitations, their voltages clipped to plus or minus ``limit`` [V]."""
    for experiment in (1, 2):
        yield Proposal(
            f"the paper's experiment {experiment} on both channels, base 1.5 V",
            paper_excitation(experiment, "both", base=1.5),
        )
    for base in BASES:
        for pitch_band in BANDS:
            for sum_band in BANDS:
                for strength in STRENGTHS:
                    yield Proposal(
                        f"multisines of {strength:g} V rms, {pitch_band} on v_f - v_r and {sum_band} on v_f + v_r, "
                        f"base {base:g} V",
                        Excitation(
                            base,
                            Multisine(strength, *BANDS[pitch_band], period=30.0, seed=1),
                            Multisine(strength, *BANDS[sum_band], period=45.0, seed=2),
                            limit,
                        ),
                    )


def rehearsed_voltages(excitation: Excitation, duration: float) -> NDArray[np.float64]:
    """Return the voltages (N, 2) [V] of an excitation, sampled every :data:`STEP`."""
    count = round(duration / STEP)
    return np.array([voltages(k * STEP, excitation) for k in range(count)])


def rehearsed(
    parameters: PlantParameters, signal: NDArray[np.float64], noise: ProcessNoise | None = None
) -> NDArray[np.float64]:
    """Angles (N, 3) [rad] of a rig under ``signal`` (N, 2) [V], from its equilibrium under the first voltages."""
    noise = noise or ProcessNoise()
    start = rest_state(parameters, float(signal[0].sum()))
    random = np.random.default_rng(0)
    kept = float(np.exp(-STEP / noise.correlation_time))
    white = random.standard_normal((len(signal), 3)) * noise.deviation * np.sqrt(1.0 - kept * kept)
    torque = lfilter([1.0], [1.0, -kept], white, axis=0)
    angles = run_alone(signal, STEP, np.array(start, dtype=float), parameters, torque)
    widths = 2.0 * np.pi / np.array(EncoderCounts())
    return np.round(angles / widths) * widths
