"""A sampled controller around the linear plant: closed loop, margins of each loop and of both at once.

The controller is a linear system within its limits, so differences of its step function give its matrices exactly. Its
voltages appear one period after the angles that they react to, and reach the motors after the plant's input delay d.

For the margins the loop is cut at one actuator, the voltages' difference (pitch) or their sum (elevation), while the
other loop stays closed. With P(z) the sampled plant from (v_f - v_r, v_f + v_r) to the angles and K(z) the controller,

    L(z) = z^-1 exp(-j w d) K(z) P(z),    l_1 = L_11 + L_12 L_21 / (1 - L_22),

and -l_1 is the loop gain of negative feedback. The disk margin allows a factor (1 + d/2)/(1 - d/2) at both actuators at
once, each d any complex number up to alpha in size,

    alpha = 1 / max over w of mu(S - I/2),    S = (I - L)^-1,

with mu the structured singular value, of two complex numbers sqrt((t + sqrt(t^2 - 4 abs(det M)^2)) / 2) with
t = abs(M_11)^2 + abs(M_22)^2 + 2 abs(M_12 M_21). It then allows any gain up to (2 + alpha)/(2 - alpha) and any phase up
to 2 atan(alpha / 2).

Sources: P. Seiler, A. Packard, P. Gahinet, IEEE Control Systems 40 (2020) 78 (disk margins); J. Doyle, IEE Proc. D 129
(1982) 242, for mu as a bound over scalings. For two numbers the bound is exact, and smallest where both off-diagonal
entries have the same size.
"""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from control import StateSpace, append, ss
from numpy.typing import NDArray

from heli_identifier.tools.linearisation import LinearModel
from heli_identifier.tools.loop import Array, Settings, start_controller, step_controller
from heli_plant.control import PidSettings
from heli_plant.state_feedback import MOST_DELAY, Angles, FeedbackSettings, Rotors

Responses = NDArray[Any]  # frequency responses, complex
LOOPS = ("pitch", "elevation")  # in the order of the channels: difference and sum of the voltages
TO_ROTORS = np.array([[0.5, 0.5], [-0.5, 0.5]])  # (v_front, v_rear) from difference and sum of the voltages
_UNLIMITED = 1e9  # limit [V] and [rad] that is never reached
_ROUNDING = 1e-12  # largest size of an entry of a sampled matrix that is due to rounding


@lru_cache(maxsize=8)
def controller_system(settings: Settings, period: float) -> StateSpace:
    """Return the linear system of a controller that is called every ``period`` [s].

    States are those of its step, inputs the measured angles and their references [rad], outputs v_front and v_rear [V].
    """
    linear: Settings
    if isinstance(settings, PidSettings):
        linear = settings._replace(voltage_limit=_UNLIMITED, pitch_limit=_UNLIMITED)
    else:
        linear = settings._replace(voltage_limit=_UNLIMITED, point=Angles(), hover=Rotors(), period=period)
    empty = start_controller(linear, 0.0, 0.0, 0.0)
    size = n = sum(np.ravel(part).size for part in empty)
    if isinstance(linear, FeedbackSettings):
        n -= 2 * (MOST_DELAY - linear.delay)  # older voltages are stored, but never used

    def step(row: list[float]) -> Array:
        memory = _fill_numbers(empty, [*row[:n], *[0.0] * (size - n)])
        memory, voltages = step_controller(linear, memory, row[n : n + 3], row[n + 3 :], period)
        numbers = np.hstack([np.ravel(part) for part in memory])
        return np.concatenate((numbers[:n], voltages))

    base = step([0.0] * (n + 6))
    slopes = np.column_stack([step(row) - base for row in np.eye(n + 6).tolist()])
    return ss(slopes[:n, :n], slopes[:n, n:], slopes[n:, :n], slopes[n:, n:], period)


def _fill_numbers(template: Any, numbers: list[float]) -> Any:
    """Return nested tuples like ``template`` with other numbers, which are removed from the list."""
    if not isinstance(template, tuple):
        return numbers.pop(0)
    parts = [_fill_numbers(part, numbers) for part in template]
    return template._make(parts) if hasattr(template, "_make") else tuple(parts)


def close_loop(model: LinearModel, settings: Settings) -> StateSpace:
    """Close the loop of a controller around a plant; the input delay is rounded to whole periods.

    Inputs are the references of pitch, elevation, travel [rad] and loads on difference and sum of the voltages [V],
    outputs the angles [rad].
    """
    plant = model.sampled
    periods = 1 + round(model.plant.input_delay_rotors / plant.dt)
    n, one, zero = 2 * periods, np.eye(3), np.zeros((3, 3))
    delay = ss(np.eye(n, k=-2), np.eye(n, 2), np.eye(n)[-2:], np.zeros((2, 2)), plant.dt)
    loads, references = (ss([], [], [], np.eye(size), plant.dt) for size in (2, 3))
    # From references, loads and the controller's voltages to references and angles, ...
    open_loop = append(references, plant * np.hstack((TO_ROTORS, np.eye(2))) * append(loads, delay))
    # ... and from these to the angles, and to the angles and references that the controller reads.
    with_controller_inputs = np.block([[zero, one], [zero, one], [one, zero]]) * open_loop
    return with_controller_inputs.lft(controller_system(settings, plant.dt), 2, 6)


def is_stable(loop: StateSpace) -> bool:
    """Whether all modes decay; states on which no other state depends, such as the travel, are left out."""
    states = list(range(loop.nstates))
    while idle := [i for i in states if not any(abs(loop.A[j, i]) > _ROUNDING for j in states if j != i)]:
        states = [i for i in states if i not in idle]
    return bool(np.abs(np.linalg.eigvals(loop.A[np.ix_(states, states)])).max(initial=0.0) < 1.0)


def unit_step(loop: StateSpace, drive: int, steps: int) -> Array:
    """Return the outputs (steps, 3) of a loop from rest under a constant 1 on the input of index ``drive``.

    The output at step j m + i is C A^i times the state at step j m, with m about the root of ``steps``; only these
    states are computed. The exponent of A doubles with each product.
    """
    n = loop.nstates
    power = np.block([[loop.A, loop.B[:, [drive]]], [np.zeros((1, n)), np.ones((1, 1))]])
    outputs, states = np.hstack((loop.C, np.zeros((loop.noutputs, 1))))[None], np.eye(n + 1)[:, n:]
    while len(outputs) ** 2 < steps:
        outputs = np.concatenate((outputs, outputs @ power))
        power = power @ power
    while len(outputs) * states.shape[1] < steps:
        states = np.hstack((states, power @ states))
        power = power @ power
    return np.moveaxis(outputs @ states, 2, 0).reshape(-1, loop.noutputs)[:steps]


class Margins(NamedTuple):
    """Margins of one loop.

    ``gain`` is the factor by which the loop gain may grow, infinite without a limit; ``phase`` [deg]; ``sensitivity``
    the peak of abs(1/(1 + l)).
    """

    gain: float
    phase: float
    sensitivity: float


def loop_margins(gain: Responses) -> Margins:
    """Return the margins of a loop gain (N,) of negative feedback at growing frequencies.

    Between two frequencies, 2 % apart in :func:`frequencies`, the gain is interpolated: margins are accurate to 1e-3.
    """
    before, after, size = gain[:-1], gain[1:], np.log(np.abs(gain))
    real_crossing = np.flatnonzero((before.imag > 0.0) != (after.imag > 0.0))
    share = before.imag[real_crossing] / (before.imag[real_crossing] - after.imag[real_crossing])
    real = before.real[real_crossing] + share * (after.real[real_crossing] - before.real[real_crossing])
    factors = -1.0 / real[real < 0.0]
    unit_gain = np.flatnonzero((size[:-1] > 0.0) != (size[1:] > 0.0))
    share = size[unit_gain] / (size[unit_gain] - size[unit_gain + 1])
    turn = np.angle(after[unit_gain] / before[unit_gain])
    phases = np.abs(np.angle(-before[unit_gain] * np.exp(1j * share * turn), deg=True))
    return Margins(
        float(min(factors[factors > 1.0], default=np.inf)),
        float(min(phases, default=np.inf)),
        float(np.max(1.0 / np.abs(1.0 + gain))),
    )


def frequencies(period: float, count: int = 400) -> Array:
    """Return frequencies [rad/s] from slow drift to the Nyquist frequency, shape (count,)."""
    return np.geomspace(0.01, 0.999 * np.pi / period, count)


def plant_response(model: LinearModel, omega: Array) -> Responses:
    """Return the response (N, 3, 2) from (difference, sum) of the voltages, both delays included, to the angles."""
    plant = model.sampled
    z = np.exp(1j * omega * plant.dt)
    delays = np.exp(-1j * omega * model.plant.input_delay_rotors) / z
    return _response(plant.A, plant.B @ TO_ROTORS, plant.C, z) * delays[:, None, None]


def controller_response(settings: Settings, period: float, omega: Array) -> Responses:
    """Return the response (N, 2, 3) from the angles to (difference, sum) of the voltages."""
    system = controller_system(settings, period)
    response = _response(system.A, system.B[:, :3], system.C, np.exp(1j * omega * period)) + system.D[:, :3]
    return np.linalg.inv(TO_ROTORS) @ response


def _response(A: NDArray[Any], B: NDArray[Any], C: NDArray[Any], z: Responses) -> Responses:
    """Return C (z - A)^-1 B at all frequencies at once."""
    return C @ np.linalg.solve(z[:, None, None] * np.eye(len(A)) - A, np.broadcast_to(B, (len(z), *B.shape)))


def loop_gain(plant: Responses, controller: Responses, loop: int) -> Responses:
    """Return the gain (..., N) of one loop under negative feedback, with the other closed; (...) as in ``plant``."""
    L, other = controller @ plant, 1 - loop
    through_other = L[..., loop, other] * L[..., other, loop] / (1.0 - L[..., other, other])
    return -(L[..., loop, loop] + through_other)


def disk_margins(plants: Responses, controller: Responses) -> Array:
    """Return the disk margins (M,) at both actuators at once of a controller around each of M plants (M, N, 3, 2)."""
    S = np.linalg.inv(np.eye(2) - controller @ plants)
    M = S - 0.5 * np.eye(2)
    total = np.abs(M[..., 0, 0]) ** 2 + np.abs(M[..., 1, 1]) ** 2 + 2.0 * np.abs(M[..., 0, 1] * M[..., 1, 0])
    mu = np.sqrt(0.5 * (total + np.sqrt(np.maximum(total**2 - 4.0 * np.abs(np.linalg.det(M)) ** 2, 0.0))))
    return np.asarray(1.0 / mu.max(axis=-1))
