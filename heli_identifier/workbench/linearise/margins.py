"""Margins of the PID's loops around the plant, by python-control.

The loop is cut at one actuator, the voltages' difference (pitch) or their sum (elevation), while the other loop stays
closed. With P(z) the sampled plant from (v_f - v_r, v_f + v_r) to the angles, K(z) the controller, one period of
computing delay and the plant's own input delay d,

    L(z) = z^-1 exp(-j w d) K(z) P(z),    l_1 = L_11 + L_12 L_21 / (1 - L_22),

and -l_1 is the loop gain of negative feedback.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from control import stability_margins
from numpy.typing import NDArray

from heli_identifier.workbench.linearise.closed_loop import TO_ROTORS, controller
from heli_identifier.workbench.linearise.linear_model import LinearModel
from heli_plant.control import PidSettings

Responses = NDArray[Any]
"""Frequency responses, complex."""

LOOPS = ("pitch", "elevation")
"""Loops, in the order of the channels: difference and sum of the voltages."""


@dataclass(frozen=True)
class Margins:
    """Margins of one loop.

    Attributes
    ----------
    gain : float
        Factor by which the loop gain may grow; infinite if any.
    gain_down : float
        Factor by which it may shrink, below 1; 0 if any.
    phase : float
        [deg].
    sensitivity : float
        Peak of abs(1/(1 + l)).
    crossover : float
        Highest frequency [rad/s] of unit gain.
    """

    gain: float
    gain_down: float
    phase: float
    sensitivity: float
    crossover: float


def loop_margins(gain: Responses, omega: NDArray[np.float64]) -> Margins:
    """Return the margins of a loop.

    Parameters
    ----------
    gain : NDArray, shape (N,), complex
        Loop gain, of negative feedback.
    omega : NDArray, shape (N,)
        Frequencies [rad/s], growing.
    """
    turned = np.degrees(np.unwrap(np.angle(gain)))
    found = stability_margins((np.abs(gain), turned, omega), returnall=True)
    factors, phases, _, _, crossings, _ = map(np.asarray, found)
    return Margins(
        float(min(factors[factors > 1.0], default=np.inf)),
        float(max(factors[factors < 1.0], default=0.0)),
        float(min(np.abs(phases), default=np.inf)),
        float(np.max(1.0 / np.abs(1.0 + gain))),
        float(max(crossings, default=np.nan)),
    )


def frequencies(period: float, count: int = 400) -> NDArray[np.float64]:
    """Return frequencies [rad/s] from slow drift to the Nyquist frequency, shape (count,)."""
    return np.geomspace(0.01, 0.999 * np.pi / period, count)


def plant_response(model: LinearModel, omega: NDArray[np.float64]) -> Responses:
    """Return the response (N, 3, 2) from (difference, sum) of the voltages, both delays included, to the angles."""
    plant = model.sampled
    z = np.exp(1j * omega * plant.dt)
    inputs = np.broadcast_to(plant.B @ TO_ROTORS, (len(z), *plant.B.shape))
    resolvent = np.linalg.solve(z[:, None, None] * np.eye(plant.nstates) - plant.A, inputs)
    delays = np.exp(-1j * omega * model.input_delay) / z
    return plant.C @ resolvent * delays[:, None, None]


def controller_response(settings: PidSettings, period: float, omega: NDArray[np.float64]) -> Responses:
    """Return the response (N, 2, 3) from the angles to (difference, sum) of the voltages."""
    system = controller(settings, period)
    z = np.exp(1j * omega * period)
    inputs = np.broadcast_to(system.B, (len(z), *system.B.shape))
    resolvent = np.linalg.solve(z[:, None, None] * np.eye(6) - system.A, inputs)
    return np.linalg.inv(TO_ROTORS) @ (system.C @ resolvent + system.D)


def loop_gain(plant: Responses, control: Responses, loop: int) -> Responses:
    """Return the gain (..., N) of one loop under negative feedback, the other one closed; (...) as in ``plant``."""
    L = control @ plant
    other = 1 - loop
    through = L[..., loop, other] * L[..., other, loop] / (1.0 - L[..., other, other])
    return -(L[..., loop, loop] + through)


def margins_over(
    plants: Responses, settings: PidSettings, period: float, omega: NDArray[np.float64]
) -> dict[str, list[Margins]]:
    """Return the margins of the pitch and the elevation loop of a PID around each of many plants.

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
    """Return the margins of the pitch and the elevation loop of a PID around a plant."""
    omega = frequencies(model.sampled.dt)
    found = margins_over(plant_response(model, omega)[None], settings, model.sampled.dt, omega)
    return {name: of_loop for name, (of_loop,) in found.items()}
