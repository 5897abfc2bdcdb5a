"""The pitch experiment off line, by the compiled plant and identifier, with or without a random torque on the pitch.

The runs of the units take seconds, these take milliseconds, so that a fit can repeat the experiment hundreds of times.
As in the paper's Table 1, three parameters are estimated and theta0 is known.

The random torque is a first-order Gauss-Markov acceleration d [rad/s^2], as moving air in the room exerts it:

    d_(k+1) = b d_k + s sqrt(1 - b^2) w_k,    b = exp(-h / tau),    w white of unit variance

with the standard deviation s and the correlation time tau. It is held over each step of the plant,
:func:`heli_plant.plant.step`, which has no input for it: half of its push d h goes into the pitch rate before the step
and half after it (Strang's splitting), with an error of the order d h^3 per step.
"""

from functools import cache
from math import exp, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from heli_identifier.online import IdentifierSettings
from heli_identifier.online.excitation import paper_excitation, voltages
from heli_identifier.workbench.paper.published import TRUTH
from heli_identifier.workbench.paper.replay import replay
from heli_plant.compiled import compiled_for, parameter_record, read_only
from heli_plant.parameters import PlantParameters
from heli_plant.plant import measured_angles, step
from heli_plant.simulation import simulate
from heli_plant.state import PlantState, rest_state

STEP = 0.01
"""Sampling period [s]."""

DURATION = 200.0
"""Of one experiment [s], as in the runs of the units."""

_SETTINGS = IdentifierSettings(rest_angle=TRUTH.theta0, initial_gain=1e6, gain_limit=1e6)
"""Gamma(0) is so large that Omega(0) is forgotten: what deviates from Table 2 is due to the effect."""


class PitchEstimate(NamedTuple):
    """a_wx [1/s], a_th [1/s^2], k_x [rad/s^2/V]."""

    a_wx: float
    a_th: float
    k_x: float


@cache
def pitch_voltages(experiment: int, base: float, duration: float = DURATION) -> NDArray[np.float64]:
    """Return front and rear voltage [V], shape (N, 2), of the pitch experiment; ``base`` is that of each rotor [V]."""
    excitation = paper_excitation(experiment, "difference", base)
    held = np.array([voltages(k * STEP, excitation) for k in range(round(duration / STEP))])
    held.flags.writeable = False
    return held


def identify_pitch(
    parameters: PlantParameters,
    experiment: int,
    base: float = 0.5,
    duration: float = DURATION,
    torque: NDArray[np.float64] | None = None,
) -> PitchEstimate:
    """Run the pitch experiment on a plant and estimate its parameters as the paper does.

    Parameters
    ----------
    parameters : PlantParameters
        Of the plant, with its effects.
    experiment : int
        1 or 2.
    base : float
        Voltage of each rotor beneath the signal [V].
    duration : float
        [s].
    torque : ndarray, shape (N,), optional
        Disturbing pitch acceleration held over each step [rad/s^2].

    Returns
    -------
    PitchEstimate
        From exact angles; NaN where the plant left the finite range.
    """
    held = pitch_voltages(experiment, base, duration)
    start = rest_state(parameters, 2.0 * base)
    if torque is None:
        _, angles = simulate(held, STEP, start, parameters)
    else:
        angles = simulate_under_torque(held, torque, STEP, start, parameters)
    if not np.isfinite(angles).all():
        return PitchEstimate(np.nan, np.nan, np.nan)
    final = replay(held, angles, _SETTINGS, every=len(held)).final
    return PitchEstimate(final.a_wx, final.a_th, final.k_x)


def random_torque(deviation: float, correlation_time: float, count: int, h: float, seed: int) -> NDArray[np.float64]:
    """Return ``count`` samples [rad/s^2] with standard deviation ``deviation`` and ``correlation_time`` [s]."""
    kept = exp(-h / correlation_time)
    white = np.random.default_rng(seed).standard_normal(count)
    white[1:] *= sqrt(1.0 - kept * kept)  # the first sample is drawn from the stationary distribution
    return deviation * lfilter([1.0], [1.0, -kept], white)


def _loop(voltages, torque, start, h, p, angles):
    """Fill ``angles`` (N, 3); row k is at t_k = k h."""
    state = start
    for k in range(len(voltages)):
        angles[k, 0], angles[k, 1], angles[k, 2] = measured_angles(state)
        half = 0.5 * h * torque[k]
        state = step(_pushed(state, half), voltages[k, 0], voltages[k, 1], 0.0, k * h, h, p)
        state = _pushed(state, half)


def _pushed(state, push):
    """Return ``state`` with the pitch rate raised by ``push`` [rad/s]; compiled code has no ``_replace``."""
    pitch, elevation, travel, pitch_rate, w_2, w_3, nu_f, nu_r, bending, bending_rate, mass, rest = state
    return PlantState(
        pitch, elevation, travel, pitch_rate + push, w_2, w_3, nu_f, nu_r, bending, bending_rate, mass, rest
    )


def simulate_under_torque(
    voltages: NDArray[np.float64],
    torque: NDArray[np.float64],
    h: float,
    start: PlantState,
    parameters: PlantParameters,
) -> NDArray[np.float64]:
    """Simulate the plant, without input delay, under a disturbing pitch acceleration.

    Parameters
    ----------
    voltages : ndarray, shape (N, 2)
        Front and rear voltage [V], held over each step.
    torque : ndarray, shape (N,)
        Disturbing pitch acceleration [rad/s^2], held over each step.
    h : float
        Step [s].
    start : PlantState
    parameters : PlantParameters

    Returns
    -------
    ndarray, shape (N, 3)
        Pitch, elevation, travel [rad].

    Raises
    ------
    ValueError
        The arrays differ in length.
    """
    # Compiled code would read past the end of the shorter array.
    if voltages.shape != (len(torque), 2):
        raise ValueError(f"voltages of shape {voltages.shape} and torque of shape {torque.shape} must have N rows each")
    angles = np.empty((len(torque), 3))
    first = PlantState(*(float(value) for value in start))
    run = compiled_for(_loop, parameters)
    run(read_only(voltages), torque, first, h, parameter_record(parameters), angles)
    return angles
