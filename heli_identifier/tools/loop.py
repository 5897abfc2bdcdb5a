"""A sampled controller around the linear plant: closed loop, margins, and a reference step on the whole plant.

The controller is a PID or a state feedback. It is a linear system within its limits, so differences of the unit's own
step give its matrices exactly. Its voltages appear one period after the angles they follow from and reach the motors
after the plant's input delay d.

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
(1982) 242, for mu as a bound over scalings, which for two numbers is exact and least where both off-diagonal entries
have one size.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple, TypeVar

import numpy as np
from control import StateSpace, append, ss
from numpy.typing import ArrayLike, NDArray

from fmu_src import TYPES, Variable, field_of, unit_class, with_fields
from heli_identifier.online import Estimate
from heli_identifier.results import ParameterSet
from heli_identifier.tools.linearisation import LinearModel, OperatingPoint
from heli_plant.control import PidSettings, PidState, pid_step, start_pid
from heli_plant.effects import AXES
from heli_plant.parameters import PlantParameters
from heli_plant.plant import advance, measured_angles, rigid_start
from heli_plant.state import PlantState
from heli_plant.state_feedback import (
    MOST_DELAY,
    Angles,
    FeedbackSettings,
    FeedbackState,
    Rotors,
    eight,
    feedback_step,
    start_feedback,
)

Controller = TypeVar("Controller", PidSettings, FeedbackSettings)

Settings = PidSettings | FeedbackSettings
"""A controller."""

Memory = PidState | FeedbackState
"""Its state."""

Responses = NDArray[Any]
"""Frequency responses, complex."""

CONTROLLER, FEEDBACK = "PidController", "StateFeedback"

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

def numbers_in(value: Any) -> list[Any]:
    """Return the numbers in tuples of tuples, in order."""
    return [number for part in value for number in numbers_in(part)] if isinstance(value, tuple) else [value]


def filled(like: Any, numbers: Iterator[float]) -> Any:
    """Return named tuples and matrices such as ``like`` with other numbers in them."""
    parts = [filled(part, numbers) if isinstance(part, tuple) else type(part)(next(numbers)) for part in like]
    return like._make(parts) if hasattr(like, "_make") else tuple(parts)


def controller_settings(default: Controller, values: Mapping[str, float]) -> Controller:
    """Return a controller from parameters of its unit; what is missing is as in ``default``."""
    fields = {own.field: TYPES[own.type](values[own.name]) for own in _declared(default) if own.name in values}
    found: Controller = with_fields(default, fields)
    return found


def controller_parameters(settings: Settings, point: OperatingPoint, provenance: Mapping[str, Any]) -> ParameterSet:
    """Return a controller that holds an operating point as parameters of its unit.

    Those of a StateFeedback that are zero, and of a PID those of loops that are off, are left out.
    """
    estimates = {
        own.name: Estimate(float(field_of(settings, own.field)), None, own.unit or "1") for own in _declared(settings)
    }
    held = {"reference.pitch": point.pitch, "reference.elevation": point.elevation}
    estimates |= {name: Estimate(angle, None, "rad") for name, angle in held.items()}
    if isinstance(settings, PidSettings):
        off = ("rate.", *(() if settings.travel_enabled else ("travel.",)), "travel.pitch_limit")
        kept = {name: own for name, own in estimates.items() if not name.startswith(off)}
        return ParameterSet(CONTROLLER, kept, provenance=provenance)
    return ParameterSet(FEEDBACK, {name: own for name, own in estimates.items() if own.value}, provenance=provenance)


def _declared(settings: Settings) -> list[Variable]:
    """Parameters of a controller's unit that set a field of its settings."""
    unit = unit_class(CONTROLLER if isinstance(settings, PidSettings) else FEEDBACK)
    return [own for own in unit.variables if own.field]


@lru_cache(maxsize=8)
def controller(settings: Settings, period: float) -> StateSpace:
    """Return the linear system of a controller that is called every ``period`` [s].

    States are those of its step, inputs the measured angles and their references [rad], outputs v_front and v_rear [V].
    """
    free: Settings
    if isinstance(settings, PidSettings):
        free = settings._replace(voltage_limit=UNLIMITED, pitch_limit=UNLIMITED)
    else:
        free = settings._replace(voltage_limit=UNLIMITED, point=Angles(), hover=Rotors(), period=period)
    empty = begun(free, 0.0, 0.0, 0.0)
    size = n = len(numbers_in(empty))
    if isinstance(free, FeedbackSettings):
        n -= 2 * (MOST_DELAY - free.delay)  # older voltages are kept, but never looked at

    def after(row: list[float]) -> NDArray[np.float64]:
        memory = filled(empty, iter([*row[:n], *[0.0] * (size - n)]))
        memory, voltages = answered(free, memory, row[n : n + 3], row[n + 3 :], period)
        return np.array([*numbers_in(memory)[:n], *voltages])

    base = after([0.0] * (n + 6))
    slope = np.column_stack([after(row) - base for row in np.eye(n + 6).tolist()])
    return ss(slope[:n, :n], slope[:n, n:], slope[n:, :n], slope[n:, n:], period)


def closed_loop(model: LinearModel, settings: Settings) -> StateSpace:
    """Close the loop of a controller around a plant; the input delay is rounded to whole periods.

    Inputs are the references of pitch, elevation, travel [rad] and loads on difference and sum of the voltages [V],
    outputs the angles [rad].
    """
    plant = model.sampled
    periods = 1 + round(model.input_delay / plant.dt)
    n, one, nothing = 2 * periods, np.eye(3), np.zeros((3, 3))
    delay = ss(np.eye(n, k=-2), np.eye(n, 2), np.eye(n)[-2:], np.zeros((2, 2)), plant.dt)
    loads, references = (ss([], [], [], np.eye(size), plant.dt) for size in (2, 3))
    # From references, loads and the controller's voltages to references and angles, then to angles and what it hears.
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


class Margins(NamedTuple):
    """Margins of one loop.

    ``gain`` and ``gain_down`` are the factors by which the loop gain may grow (infinite if any) and shrink (0 if any),
    ``phase`` [deg], ``sensitivity`` the peak of abs(1/(1 + l)), ``crossover`` the highest frequency [rad/s] of unit
    gain.
    """

    gain: float
    gain_down: float
    phase: float
    sensitivity: float
    crossover: float


def loop_margins(gain: Responses, omega: NDArray[np.float64]) -> Margins:
    """Return the margins of a loop gain (N,) of negative feedback at growing frequencies ``omega`` (N,) [rad/s].

    Between two frequencies, 2 % apart in :func:`frequencies`, the gain is interpolated: figures are good to 1e-3.
    """
    before, after, size = gain[:-1], gain[1:], np.log(np.abs(gain))
    over = np.flatnonzero((before.imag > 0.0) != (after.imag > 0.0))
    share = before.imag[over] / (before.imag[over] - after.imag[over])
    real = before.real[over] + share * (after.real[over] - before.real[over])
    factors = -1.0 / real[real < 0.0]
    unit = np.flatnonzero((size[:-1] > 0.0) != (size[1:] > 0.0))
    share = size[unit] / (size[unit] - size[unit + 1])
    phases = np.abs(np.angle(-before[unit] * np.exp(1j * share * np.angle(after[unit] / before[unit])), deg=True))
    return Margins(
        float(min(factors[factors > 1.0], default=np.inf)),
        float(max(factors[factors < 1.0], default=0.0)),
        float(min(phases, default=np.inf)),
        float(np.max(1.0 / np.abs(1.0 + gain))),
        float(max(omega[unit] * (omega[unit + 1] / omega[unit]) ** share, default=np.nan)),
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


def controller_response(settings: Settings, period: float, omega: NDArray[np.float64]) -> Responses:
    """Return the response (N, 2, 3) from the angles to (difference, sum) of the voltages."""
    pid = controller(settings, period)
    heard = _response(pid.A, pid.B[:, :3], pid.C, np.exp(1j * omega * period)) + pid.D[:, :3]
    return np.linalg.inv(TO_ROTORS) @ heard


def _response(A: NDArray[Any], B: NDArray[Any], C: NDArray[Any], z: Responses) -> Responses:
    """Return C (z - A)^-1 B at all frequencies at once."""
    return C @ np.linalg.solve(z[:, None, None] * np.eye(len(A)) - A, np.broadcast_to(B, (len(z), *B.shape)))


def loop_gain(plant: Responses, law: Responses, loop: int) -> Responses:
    """Return the gain (..., N) of one loop under negative feedback, the other one closed; (...) as in ``plant``."""
    L, other = law @ plant, 1 - loop
    through = L[..., loop, other] * L[..., other, loop] / (1.0 - L[..., other, other])
    return -(L[..., loop, loop] + through)


def margins_over(plants: Responses, law: Responses, omega: NDArray[np.float64]) -> dict[str, list[Margins]]:
    """Return the margins of the pitch and the elevation loop of a controller around each of many plants.

    Parameters
    ----------
    plants : NDArray, shape (M, N, 3, 2), complex
        :func:`plant_response` of each.
    law : NDArray, shape (N, 2, 3), complex
        :func:`controller_response`.
    omega : NDArray, shape (N,)
        Frequencies [rad/s].
    """
    return {
        name: [loop_margins(gain, omega) for gain in loop_gain(plants, law, index)] for index, name in enumerate(LOOPS)
    }


def disk_margins(plants: Responses, law: Responses) -> NDArray[np.float64]:
    """Return the disk margin (M,) at both actuators at once of a controller around each of many plants (M, N, 3, 2)."""
    S = np.linalg.inv(np.eye(2) - law @ plants)
    M = S - 0.5 * np.eye(2)
    total = np.abs(M[..., 0, 0]) ** 2 + np.abs(M[..., 1, 1]) ** 2 + 2.0 * np.abs(M[..., 0, 1] * M[..., 1, 0])
    mu = np.sqrt(0.5 * (total + np.sqrt(np.maximum(total**2 - 4.0 * np.abs(np.linalg.det(M)) ** 2, 0.0))))
    return np.asarray(1.0 / mu.max(axis=-1))


def settling_time(share: NDArray[np.float64], period: float) -> float:
    """Return the time [s] from which a response (N,) to a unit step stays within :data:`SETTLED`; infinite if never."""
    outside = np.flatnonzero(~(np.abs(share - 1.0) <= SETTLED))
    if not len(outside):
        return 0.0
    return float("inf") if outside[-1] == len(share) - 1 else float((outside[-1] + 1) * period)


class StepResponse(NamedTuple):
    """Response of an ``axis`` to a step of its reference of a ``size`` [rad] at ``time`` (N,) 0 [s].

    ``angle`` (N,) is the deviation from the operating point [rad].
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
        after = self.time >= -1e-9
        return settling_time(self.angle[after] / self.size, float(self.time[1] - self.time[0]))


def step_response(
    parameters: PlantParameters,
    point: OperatingPoint,
    settings: Settings,
    axis: str,
    size: float = 0.1,
    duration: float = 12.0,
    period: float = 0.01,
) -> StepResponse:
    """Simulate a reference step of ``size`` [rad] on one axis, for ``duration`` [s].

    The whole plant is simulated: friction, saturation, delay and sampling included. The controller holds the operating
    point from the start.
    """
    index = AXES.index(axis)
    lead, count = round(LEAD / period), round((LEAD + duration) / period)
    still = np.array([point.pitch, point.elevation, 0.0])
    references = np.where(np.arange(count)[:, None] < lead, still, still + size * np.eye(3)[index])
    state, held = rigid_start(point.state(parameters), parameters), (point.v_front, point.v_rear)
    angles, _ = fly(parameters, settings, references, state, held, period, at_rest(settings, point))
    time = np.arange(count, dtype=np.float64) * period - LEAD
    return StepResponse(axis, time, angles[:, index] - still[index], size)


def at_rest(settings: Settings, point: OperatingPoint) -> Memory:
    """Return the state of a controller that holds an operating point."""
    if isinstance(settings, FeedbackSettings):
        state = start_feedback(point.pitch, point.elevation, 0.0, settings)
        beside = Rotors(point.v_front - settings.hover.front, point.v_rear - settings.hover.rear)
        return state._replace(now=beside, before=eight(beside))
    integrals = {}
    if settings.pitch.integral:
        integrals["integral_pitch"] = (point.v_rear - point.v_front) / settings.pitch.integral
    if settings.elevation.integral:
        integrals["integral_elevation"] = (settings.trim - point.v_front - point.v_rear) / settings.elevation.integral
    if settings.travel_enabled and settings.travel.integral:
        integrals["integral_travel"] = point.pitch / settings.travel.integral
    return start_pid(point.pitch, point.elevation, 0.0)._replace(**integrals)


def begun(settings: Settings, pitch: float, elevation: float, travel: float) -> Memory:
    """Return the state of a controller without history, at measured angles [rad]."""
    if isinstance(settings, PidSettings):
        return start_pid(pitch, elevation, travel)
    return start_feedback(pitch, elevation, travel, settings)


def answered(
    settings: Settings, memory: Memory, angles: Sequence[float], wanted: Sequence[float], period: float
) -> tuple[Memory, tuple[float, float]]:
    """Return a controller's state after one step, and the voltages (v_front, v_rear) [V] of the next period."""
    (pitch, elevation, travel), (to_pitch, to_elevation, to_travel) = angles, wanted
    references = to_pitch, to_elevation, to_travel
    if isinstance(settings, PidSettings):
        assert isinstance(memory, PidState)
        return pid_step(memory, pitch, elevation, travel, references, period, settings)
    assert isinstance(memory, FeedbackState)
    state = feedback_step(memory, pitch, elevation, travel, references, Rotors(), settings)
    return state, (settings.hover.front + state.now.front, settings.hover.rear + state.now.rear)


def fly(
    parameters: PlantParameters,
    settings: Settings,
    references: NDArray[np.float64],
    state: PlantState,
    held: tuple[float, float],
    period: float,
    memory: Memory,
    added: NDArray[np.float64] | None = None,
    air: NDArray[np.float64] | None = None,
    measure: Callable[[PlantState], ArrayLike] = measured_angles,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Fly the whole plant under a controller along references (N, 3) [rad]; angles (N, 3) [rad], voltages (N, 2) [V].

    ``state``, the voltages ``held`` [V] and the controller's state ``memory`` begin. Voltages ``added`` (N, 2) [V] come
    on top within the controller's limit; ``air`` (N, 3) [rad/s^2] acts on the axes; ``measure`` gives the angles that
    are read.
    """
    count, limit = len(references), settings.voltage_limit
    time = np.arange(count, dtype=np.float64) * period
    angles, voltages = np.empty((count, 3)), np.empty((count, 2))
    rows: Sequence[list[float]] = references.tolist()
    for k in range(count):
        angles[k], voltages[k] = measure(state), held
        if added is not None:
            voltages[k] = np.clip(voltages[k] + added[k], -limit, limit)
        memory, held = answered(settings, memory, angles[k].tolist(), rows[k], period)
        state = advance(state, time, voltages, k, 0.0, period, parameters)
        if air is not None:
            w1, w2, w3 = (np.array(state[3:6]) + period * air[k]).tolist()
            state = state._replace(pitch_rate=w1, elevation_rate=w2, travel_rate=w3)
    return angles, voltages
