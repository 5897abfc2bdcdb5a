"""The PID around the plant: loop gains, and their margins.

The loop is cut at one actuator, the voltages' difference (pitch) or their sum (elevation), while the other loop stays
closed. With P(z) the sampled plant from (v_f - v_r, v_f + v_r) to the angles, K(z) the controller, one period of
computing delay and the plant's own input delay d,

    L(z) = z^-1 exp(-j w d) K(z) P(z),    l_1 = L_11 + L_12 L_21 / (1 - L_22),

and -l_1 is the loop gain of negative feedback.
"""

import numpy as np
from numpy.typing import NDArray

from heli_identifier.workbench.linearise.controller import controller
from heli_identifier.workbench.linearise.linear_model import LinearModel
from heli_identifier.workbench.linearise.margins import Margins, Responses, loop_margins
from heli_plant.control import PidSettings

LOOPS = ("pitch", "elevation")
"""Loops, in the order of the channels: difference and sum of the voltages."""

TO_ROTORS = np.array([[0.5, 0.5], [-0.5, 0.5]])
"""(v_front, v_rear) from difference and sum."""


def frequencies(period: float, count: int = 400) -> NDArray[np.float64]:
    """Frequencies [rad/s] from slow drift to the Nyquist frequency, shape (count,)."""
    return np.geomspace(0.01, 0.999 * np.pi / period, count)


def plant_response(model: LinearModel, omega: NDArray[np.float64]) -> Responses:
    """Response (N, 3, 2) from (difference, sum) of the voltages, both delays included, to the angles."""
    z = np.exp(1j * omega * model.period)
    inputs = np.broadcast_to(model.G @ TO_ROTORS, (len(z), *model.G.shape))
    resolvent = np.linalg.solve(z[:, None, None] * np.eye(len(model.F)) - model.F, inputs)
    delays = np.exp(-1j * omega * model.input_delay) / z
    return model.C @ resolvent * delays[:, None, None]


def controller_response(settings: PidSettings, period: float, omega: NDArray[np.float64]) -> Responses:
    """Response (N, 2, 3) from the angles to (difference, sum) of the voltages."""
    system = controller(settings, period)
    z = np.exp(1j * omega * period)
    inputs = np.broadcast_to(system.B, (len(z), *system.B.shape))
    resolvent = np.linalg.solve(z[:, None, None] * np.eye(6) - system.A, inputs)
    return np.linalg.inv(TO_ROTORS) @ (system.C @ resolvent + system.D)


def loop_gain(plant: Responses, control: Responses, loop: int) -> Responses:
    """Gain (..., N) of one loop under negative feedback, the other one closed; leading axes of ``plant`` are kept."""
    L = control @ plant
    other = 1 - loop
    through = L[..., loop, other] * L[..., other, loop] / (1.0 - L[..., other, other])
    return -(L[..., loop, loop] + through)


def margins_over(
    plants: Responses, settings: PidSettings, period: float, omega: NDArray[np.float64]
) -> dict[str, list[Margins]]:
    """Margins of the pitch and the elevation loop of a PID around each of many plants.

    Parameters
    ----------
    plants : NDArray, shape (M, N, 3, 2), complex
        :func:`plant_response` of each.
    settings : PidSettings
    period : float
        Control period [s].
    omega : NDArray, shape (N,)
        Frequencies [rad/s].
    """
    pid = controller_response(settings, period, omega)
    return {
        name: [loop_margins(gain, omega) for gain in loop_gain(plants, pid, index)] for index, name in enumerate(LOOPS)
    }


def margins(model: LinearModel, settings: PidSettings) -> dict[str, Margins]:
    """Margins of the pitch and the elevation loop of a PID around a plant."""
    omega = frequencies(model.period)
    found = margins_over(plant_response(model, omega)[None], settings, model.period, omega)
    return {name: of_loop for name, (of_loop,) in found.items()}
