"""The sampled PID around the linear plant: closed loop, margins, and a reference step on the whole plant.

The PID is a linear system within its limits, so differences of the unit's own step give its matrices exactly. Its
voltages appear one period after the angles they follow from and reach the motors after the plant's input delay d.

For the margins the loop is cut at one actuator, the voltages' difference (pitch) or their sum (elevation), while the
other loop stays closed. With P(z) the sampled plant from (v_f - v_r, v_f + v_r) to the angles and K(z) the PID,

    L(z) = z^-1 exp(-j w d) K(z) P(z),    l_1 = L_11 + L_12 L_21 / (1 - L_22),

and -l_1 is the loop gain of negative feedback.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from control import StateSpace, append, ss, stability_margins
from numpy.typing import NDArray

from heli_identifier.tools.linearisation import LinearModel, OperatingPoint
from heli_plant.control import AxisGains, PidSettings, PidState, pid_step, start_pid
from heli_plant.effects import AXES
from heli_plant.parameters import PlantParameters
from heli_plant.plant import advance, measured_angles, rigid_start

Responses = NDArray[Any]
"""Frequency responses, complex."""

LOOPS = ("pitch", "elevation")
"""Loops, in the order of the channels: difference and sum of the voltages."""

TO_ROTORS = np.array([[0.5, 0.5], [-0.5, 0.5]])
"""(v_front, v_rear) from difference and sum of the voltages."""

UNLIMITED = 1e9
"""Limit [V] and [rad] that is never reached."""

SETTLED = 0.05
"""Share of the step within which a response counts as settled."""

LEAD = 1.0
"""Time [s] before the step."""

_NOTHING = 1e-12
"""Entry of a sampled matrix below which it is rounding."""


def pid_settings(values: Mapping[str, float], voltage_limit: float | None = None) -> PidSettings:
    """Return the PID from parameters of the PidController unit.

    Parameters
    ----------
    values : mapping
        By structured name, as ``pitch.proportional``; what is missing has its default.
    voltage_limit : float, optional
        Default of the limit [V] where it is that of a plant.
    """
    usual = PidSettings()
    if voltage_limit is not None:
        usual = usual._replace(voltage_limit=voltage_limit)
    gains: dict[str, Any] = {
        axis: AxisGains(*(float(values.get(f"{axis}.{name}", gain)) for name, gain in of_axis._asdict().items()))
        for axis, of_axis in zip(AXES, (usual.pitch, usual.elevation, usual.travel), strict=True)
    }
    return usual._replace(
        **gains,
        trim=float(values.get("trim", usual.trim)),
        rate_time_constant=float(values.get("rate.time_constant", usual.rate_time_constant)),
        voltage_limit=float(values.get("voltage_limit", usual.voltage_limit)),
    )


def controller(settings: PidSettings, period: float) -> StateSpace:
    """Return the linear system of a PID that is called every ``period`` [s].

    States are its integrals and filtered angles, inputs the measured angles and their references [rad], outputs v_front
    and v_rear [V].
    """
    free = settings._replace(voltage_limit=UNLIMITED, pitch_limit=UNLIMITED)

    def following(row: list[float]) -> NDArray[np.float64]:
        """Return state and voltages after a period, from state, angles and references in one row."""
        references = (row[9], row[10], row[11])
        state, voltages = pid_step(PidState(*row[:6]), row[6], row[7], row[8], references, period, free)
        return np.array([*state, *voltages])

    base = following([0.0] * 12)
    slope = np.column_stack([following(row) - base for row in np.eye(12).tolist()])
    return ss(slope[:6, :6], slope[:6, 6:], slope[6:, :6], slope[6:, 6:], period)


def closed_loop(model: LinearModel, settings: PidSettings) -> StateSpace:
    """Close the loop of a PID around a plant; the input delay is rounded to whole periods.

    Inputs are the references of pitch, elevation, travel [rad] and loads on difference and sum of the voltages [V],
    outputs the angles [rad].
    """
    plant = model.sampled
    periods = 1 + round(model.input_delay / plant.dt)
    n, one, nothing = 2 * periods, np.eye(3), np.zeros((3, 3))
    delay = ss(np.eye(n, k=-2), np.eye(n, 2), np.eye(n)[-2:], np.zeros((2, 2)), plant.dt)
    loads, references = (ss([], [], [], np.eye(size), plant.dt) for size in (2, 3))
    # From references, loads and the PID's voltages to references and angles, then to angles and what the PID hears.
    driven = append(references, plant * np.hstack((TO_ROTORS, np.eye(2))) * append(loads, delay))
    heard = np.block([[nothing, one], [nothing, one], [one, nothing]]) * driven
    return heard.lft(controller(settings, plant.dt), 2, 6)


def is_stable(loop: StateSpace) -> bool:
    """Whether all modes decay; states on which no other state depends, such as the travel, are left out."""
    acting = list(range(loop.nstates))
    while idle := [i for i in acting if not any(abs(loop.A[j, i]) > _NOTHING for j in acting if j != i)]:
        acting = [i for i in acting if i not in idle]
    return bool(np.abs(np.linalg.eigvals(loop.A[np.ix_(acting, acting)])).max() < 1.0)


def unit_step(loop: StateSpace, drive: int, steps: int) -> NDArray[np.float64]:
    """Return the outputs (steps, 3) of a loop from rest under a constant 1 on the input of index ``drive``.

    The exponent of A doubles with each product, so ten products give a thousand steps.
    """
    n = loop.nstates
    power = np.block([[loop.A, loop.B[:, [drive]]], [np.zeros((1, n)), np.ones((1, 1))]])
    path = np.eye(n + 1)[:, n:]
    while path.shape[1] < steps:
        path = np.hstack((path, power @ path))
        power = power @ power
    return (loop.C @ path[:n, :steps]).T


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
    """Return the margins of a loop gain (N,) of negative feedback at growing frequencies ``omega`` (N,) [rad/s]."""
    phase = np.degrees(np.unwrap(np.angle(gain)))
    found = stability_margins((np.abs(gain), phase, omega), returnall=True)
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
    delays = np.exp(-1j * omega * model.input_delay) / z
    return _response(plant.A, plant.B @ TO_ROTORS, plant.C, z) * delays[:, None, None]


def controller_response(settings: PidSettings, period: float, omega: NDArray[np.float64]) -> Responses:
    """Return the response (N, 2, 3) from the angles to (difference, sum) of the voltages."""
    pid = controller(settings, period)
    heard = _response(pid.A, pid.B[:, :3], pid.C, np.exp(1j * omega * period)) + pid.D[:, :3]
    return np.linalg.inv(TO_ROTORS) @ heard


def _response(A: NDArray[Any], B: NDArray[Any], C: NDArray[Any], z: Responses) -> Responses:
    """Return C (z - A)^-1 B at all frequencies at once."""
    return C @ np.linalg.solve(z[:, None, None] * np.eye(len(A)) - A, np.broadcast_to(B, (len(z), *B.shape)))


def loop_gain(plant: Responses, pid: Responses, loop: int) -> Responses:
    """Return the gain (..., N) of one loop under negative feedback, the other one closed; (...) as in ``plant``."""
    L, other = pid @ plant, 1 - loop
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


@dataclass(frozen=True, eq=False)
class StepResponse:
    """Response to a step of one reference.

    Attributes
    ----------
    axis : str
    time : NDArray, shape (N,)
        [s], the step at 0.
    angle : NDArray, shape (N,)
        Deviation from the operating point [rad].
    size : float
        Of the step [rad].
    """

    axis: str
    time: NDArray[np.float64]
    angle: NDArray[np.float64]
    size: float

    @property
    def overshoot(self) -> float:
        """Largest excess over the step, as a share of it."""
        return max(float(np.max(self.angle / self.size)) - 1.0, 0.0)

    @property
    def settling_time(self) -> float:
        """Time [s] after which the response stays within :data:`SETTLED` of the step; infinite if it does not."""
        outside = np.abs(self.angle / self.size - 1.0) > SETTLED
        if outside[-1]:
            return float("inf")
        return float(self.time[int(np.flatnonzero(outside)[-1]) + 1]) if outside.any() else 0.0


def step_response(
    parameters: PlantParameters,
    point: OperatingPoint,
    settings: PidSettings,
    axis: str,
    size: float = 0.1,
    duration: float = 12.0,
    period: float = 0.01,
) -> StepResponse:
    """Simulate a reference step of ``size`` [rad] on the pitch or the elevation, for ``duration`` [s].

    The whole plant is simulated: friction, saturation, delay and sampling included. The controller holds the operating
    point in its integrals from the start.
    """
    index, held = AXES.index(axis), (point.v_front, point.v_rear)
    integrals = {}
    if settings.pitch.integral:
        integrals["integral_pitch"] = (point.v_rear - point.v_front) / settings.pitch.integral
    if settings.elevation.integral:
        integrals["integral_elevation"] = (settings.trim - sum(held)) / settings.elevation.integral
    pid = start_pid(point.pitch, point.elevation, 0.0)._replace(**integrals)
    state = rigid_start(point.state(parameters), parameters)
    lead, count = round(LEAD / period), round((LEAD + duration) / period)
    time = np.arange(count, dtype=np.float64) * period
    angles, voltages = np.empty(count), np.empty((count, 2))
    still = np.array([point.pitch, point.elevation, 0.0])
    references = [tuple(still.tolist()), tuple((still + size * np.eye(3)[index]).tolist())]
    for k in range(count):
        measured = measured_angles(state)
        angles[k], voltages[k] = measured[index], held
        following, wanted = pid_step(pid, *measured, references[k >= lead], period, settings)
        state = advance(state, time, voltages, k, 0.0, period, parameters)
        pid, held = following, wanted
    return StepResponse(axis, time - LEAD, angles - still[index], size)
