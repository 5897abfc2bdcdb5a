"""The pitch experiment off line: simulated and identified by the compiled twins of plant and identifier.

What the units do in seconds takes milliseconds here, so that a fit can run the experiment hundreds of times. Three
parameters are estimated as in the paper's Table 1, theta0 being taken as known.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import IdentifierSettings
from heli_identifier.online.excitation import paper_excitation, voltages
from heli_identifier.workbench.identify.replay import replay
from heli_identifier.workbench.paper.published import TRUTH
from heli_identifier.workbench.paper.random_torque import simulate_under_torque
from heli_plant.parameters import PlantParameters
from heli_plant.simulation import simulate
from heli_plant.state import rest_state

STEP = 0.01
"""Sampling period [s]."""

DURATION = 200.0
"""Of one experiment [s], as the runs of the units."""

_SETTINGS = IdentifierSettings(rest_angle=TRUTH.theta0, initial_gain=1e6, gain_limit=1e6)
"""Gamma(0) so large that Omega(0) leaves no trace: what remains is the effect's."""


class PitchEstimate(NamedTuple):
    """a_wx [1/s], a_th [1/s^2], k_x [rad/s^2/V]."""

    a_wx: float
    a_th: float
    k_x: float


@cache
def pitch_voltages(experiment: int, base: float, duration: float = DURATION) -> NDArray[np.float64]:
    """Front and rear voltage [V] of the pitch experiment, shape (N, 2), on a ``base`` voltage [V] of each rotor."""
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
    """Run the pitch experiment on a plant and return what the paper's estimator makes of it.

    Parameters
    ----------
    parameters : PlantParameters
        Effects included.
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
