"""The PID around the plant: loop gains and margins.

The loop is cut at one actuator, the voltages' difference (pitch) or their sum (elevation), while the other loop stays
closed. With P(z) the sampled plant from (v_f - v_r, v_f + v_r) to the angles, K(z) the controller, one period of
computing delay and the plant's own input delay d,

    L(z) = z^-1 exp(-j w d) K(z) P(z),    l_1 = L_11 + L_12 L_21 / (1 - L_22),

and -l_1 is the loop gain of negative feedback.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.linearise.controller import controller
from heli_identifier.linearise.linear_model import LinearModel
from heli_plant.control import PidSettings

LOOPS = ("pitch", "elevation")
"""Loops, in the order of the channels: difference and sum of the voltages."""

TO_ROTORS = np.array([[0.5, 0.5], [-0.5, 0.5]])
"""(v_front, v_rear) from difference and sum."""

Responses = NDArray[Any]
"""Frequency responses, complex."""


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


def margins(model: LinearModel, settings: PidSettings) -> dict[str, Margins]:
    """Margins of the pitch and the elevation loop of a PID around a plant."""
    import control

    omega = frequencies(model.period)
    plant, pid = plant_response(model, omega), controller_response(settings, model.period, omega)
    found = {}
    for index, name in enumerate(LOOPS):
        gain = loop_gain(plant, pid, index)
        turned = np.degrees(np.unwrap(np.angle(gain)))
        ups, phases, _, _, crossings, _ = control.stability_margins((np.abs(gain), turned, omega), returnall=True)
        ups, phases = np.asarray(ups, float), np.asarray(phases, float)
        found[name] = Margins(
            float(min(ups[ups > 1.0], default=np.inf)),
            float(max(ups[ups < 1.0], default=0.0)),
            float(min(np.abs(phases), default=np.inf)),
            float(np.max(1.0 / np.abs(1.0 + gain))),
            float(max(crossings, default=np.nan)),
        )
    return found
