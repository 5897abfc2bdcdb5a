"""A controller, PID or state feedback, around the whole plant: friction, saturation, delay and sampling included.

:func:`check_closed_loop` simulates a measured flight from its references. Every :data:`AHEAD` s the plant starts from
the measured motion, and the controller from the state to which the measured angles have brought it. From there both run
by themselves, and the error is the root mean square of simulated less measured angles. Feedback does not make the error
smaller: the simulated voltages react to the simulated angles.
"""

from collections.abc import Callable, Sequence
from math import inf
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmu_src import TYPES, field_of, unit_class, with_fields
from heli_identifier import results
from heli_identifier.errors import refuse
from heli_identifier.online import Estimate
from heli_identifier.provenance import provenance
from heli_identifier.records import Log, LogSource, read_logs
from heli_identifier.results import Check, Outcome, ParameterSet, PlantSource, rms_figures
from heli_identifier.tools.linearisation import LinearModel, OperatingPoint
from heli_identifier.tracing import lag_voltages, record_start
from heli_plant.control import PidSettings, PidState, pid_step, start_pid
from heli_plant.effects import AXES
from heli_plant.parameters import PlantParameters
from heli_plant.plant import advance, measured_angles, rigid_start
from heli_plant.state import PlantState
from heli_plant.state_feedback import FeedbackSettings, FeedbackState, Rotors, feedback_step, repeat_row, start_feedback

Settings = PidSettings | FeedbackSettings  # of a controller
Memory = PidState | FeedbackState  # the state of a controller
Array = NDArray[np.float64]

CONTROLLER, FEEDBACK = "PidController", "StateFeedback"
KINDS: dict[str, type[Settings]] = {CONTROLLER: PidSettings, FEEDBACK: FeedbackSettings}
"""Settings of a controller by its unit."""

SETTLED = 0.05  # share of the step within which a response counts as settled
STEP = 0.1  # of a reference [rad]
AHEAD = 3.0  # length [s] of the parts of a flight that are simulated


def read_controller(file: str | PathLike[str], voltage_limit: float) -> Settings:
    """Read the controller of a controller.json; ConfigurationError if it holds none.

    The file may leave parameters out; of these ``voltage_limit`` is given [V], and the others have their defaults.
    """
    saved = results.read_parameters(file)
    wrong_unit = f"{file} holds parameters of the {saved.unit}; give those of a {CONTROLLER} or {FEEDBACK}."
    refuse(saved.unit not in KINDS, wrong_unit)
    default: Any = KINDS[saved.unit](voltage_limit=voltage_limit)
    values, variables = saved.start_values, unit_class(saved.unit).variables
    given = {v.field: TYPES[v.type](values[v.name]) for v in variables if v.field and v.name in values}
    return with_fields(default, given)


def controller_parameters(settings: Settings, point: OperatingPoint) -> ParameterSet:
    """Return the parameters with which a controller's unit holds an operating point.

    Zero parameters of a StateFeedback, of which it has many, are left out.
    """
    unit = next(unit for unit, kind in KINDS.items() if isinstance(settings, kind))
    values = {
        variable.name: Estimate(float(field_of(settings, variable.field)), None, variable.unit or "1")
        for variable in unit_class(unit).variables
        if variable.field
    }
    values["reference.pitch"] = Estimate(point.pitch, None, "rad")
    values["reference.elevation"] = Estimate(point.elevation, None, "rad")
    if unit == FEEDBACK:
        values = {name: estimate for name, estimate in values.items() if estimate.value}
    return ParameterSet(unit, values, provenance=provenance())


def start_controller(settings: Settings, pitch: float, elevation: float, travel: float) -> Memory:
    """Return the state of a controller without history, at measured angles [rad]."""
    if isinstance(settings, PidSettings):
        return start_pid(pitch, elevation, travel)
    return start_feedback(pitch, elevation, travel, settings)


def start_at_rest(settings: Settings, point: OperatingPoint) -> Memory:
    """Return the state of a controller that holds an operating point."""
    state: Any = start_controller(settings, point.pitch, point.elevation, 0.0)
    if isinstance(settings, FeedbackSettings):
        deviation = Rotors(point.v_front - settings.hover.front, point.v_rear - settings.hover.rear)
        return state._replace(now=deviation, before=repeat_row(deviation))
    integral_parts = {
        "pitch": point.v_rear - point.v_front,
        "elevation": settings.trim - point.lift,
        "travel": point.pitch if settings.travel_enabled else 0.0,
    }
    gains = {axis: getattr(settings, axis).integral for axis in AXES}
    return state._replace(**{f"integral_{axis}": integral_parts[axis] / gain for axis, gain in gains.items() if gain})


def step_controller(
    settings: Settings, memory: Any, angles: Sequence[float], references: Sequence[float], period: float
) -> tuple[Memory, tuple[float, float]]:
    """Return a controller's state after one step, and the voltages (v_front, v_rear) [V] of the next period."""
    pitch, elevation, travel = angles
    wanted = (references[0], references[1], references[2])
    if isinstance(settings, PidSettings):
        return pid_step(memory, pitch, elevation, travel, wanted, period, settings)
    state = feedback_step(memory, pitch, elevation, travel, wanted, Rotors(), settings)
    return state, (settings.hover.front + state.now.front, settings.hover.rear + state.now.rear)


def fly(
    parameters: PlantParameters,
    settings: Settings,
    references: Array,
    state: PlantState,
    held: tuple[float, float],
    period: float,
    memory: Memory,
    added: Array | None = None,
    air: Array | None = None,
    read: Callable[[ArrayLike], ArrayLike] = np.asarray,
) -> tuple[Array, Array]:
    """Simulate the whole plant under a controller along references (N, 3) [rad].

    Returns angles (N, 3) [rad] and voltages (N, 2) [V]. The start is given by ``state``, the voltages ``held`` [V] and
    the controller's state ``memory``. Voltages ``added`` (N, 2) [V] are added to the controller's within its limit;
    ``air`` (N, 3) [rad/s^2] acts on the axes; ``read`` turns angles into those that the encoders measure.
    """
    count, limit = len(references), settings.voltage_limit
    time = np.arange(count, dtype=np.float64) * period
    angles, voltages = np.empty((count, 3)), np.empty((count, 2))
    rows: Sequence[list[float]] = references.tolist()
    for k in range(count):
        angles[k], voltages[k] = read(measured_angles(state)), held
        if added is not None:
            voltages[k] = np.clip(voltages[k] + added[k], -limit, limit)
        memory, held = step_controller(settings, memory, angles[k].tolist(), rows[k], period)
        state = advance(state, time, voltages, k, 0.0, period, parameters)
        if air is not None:
            w1, w2, w3 = (np.array(state[3:6]) + period * air[k]).tolist()
            state = state._replace(pitch_rate=w1, elevation_rate=w2, travel_rate=w3)
    return angles, voltages


def settling_time(share: Array, period: float) -> float:
    """Return the time [s] after which a unit step response (N,) stays within :data:`SETTLED`; infinite if never."""
    outside = np.flatnonzero(~(np.abs(share - 1.0) <= SETTLED))
    last = outside.max(initial=-1)
    return inf if last == len(share) - 1 else float((last + 1) * period)


def step_response(
    model: LinearModel, settings: Settings, axis: str, size: float = STEP, duration: float = 12.0
) -> Array:
    """Return how an axis of the whole plant leaves its operating point (N,) [rad] after a step of its reference.

    The step of ``size`` [rad] comes at once, and lasts for ``duration`` [s]. The controller starts at the operating
    point of ``model`` and is called with its period. A mass that moved once during a log does not move here.
    """
    plant, point, period, index = model.plant, model.point, model.sampled.dt, AXES.index(axis)
    plant = plant._replace(moving_mass_elevation=0.0)
    hold = np.array([point.pitch, point.elevation, 0.0])
    references = np.tile(hold + size * np.eye(3)[index], (round(duration / period), 1))
    state, held = rigid_start(point.state(plant), plant), (point.v_front, point.v_rear)
    angles, _ = fly(plant, settings, references, state, held, period, start_at_rest(settings, point))
    return np.asarray(angles[:, index] - hold[index])


def check_closed_loop(
    logs: LogSource | Sequence[LogSource], parameters: PlantSource, settings: Settings, limit: float = inf
) -> Check:
    """Simulate logs from their references, under the controller that flew.

    Errors of the followed axes up to ``limit`` [rad] pass. ConfigurationError if a log has no reference of an axis that
    the controller follows, or the sampling of a log does not fit a state feedback.
    """
    plant = results.to_plant(parameters)
    followed = ("elevation", "travel" if settings.travel_enabled else "pitch")
    outcomes, voltages = list[Outcome](), {}
    for log in read_logs(logs):
        missing = " and the ".join(axis for axis in followed if axis not in log.references)
        refuse(
            bool(missing),
            f"log {log.name} has no reference of the {missing}, which this controller follows; name the column in "
            "[log.references] of heli.toml.",
        )
        errors, voltages[log.name], period = _simulate_log(log, plant, settings)
        figures = dict(zip(AXES, rms_figures(errors, period), strict=True))
        outcomes += [Outcome(log.name, axis, figures[axis], limit) for axis in followed]
    return Check(tuple(outcomes), (), "closed_loop_3s", voltages=voltages)


def _simulate_log(log: Log, plant: PlantParameters, settings: Settings) -> tuple[list[Array], float, float]:
    """Return errors (n, 3) [rad] of the parts of a log, rms error of the voltages [V], and period [s]."""
    period = settings.period if isinstance(settings, FeedbackSettings) else log.step
    every = round(period / log.step)
    refuse(
        every < 1 or abs(every * log.step - period) > 0.01 * log.step,
        f"log {log.name} is sampled every {log.step:g} s and this controller every {period:g} s; the controller's "
        "period must be a multiple of the log's.",
    )
    # a state feedback's period may be a multiple of the log's; the voltages are averaged over it
    count, period = log.samples // every, every * log.step
    voltages = log.voltages[: count * every].reshape(count, every, 2).mean(axis=1)
    zero = np.zeros(log.samples)
    log_references = np.column_stack([log.references.get(axis, zero) for axis in AXES])
    measured, references = (signals[::every][:count] for signals in (log.angles, log_references))
    lagged = lag_voltages(voltages, period, plant)
    length, commanded, errors = round(AHEAD / period), np.empty_like(voltages), list[Array]()
    memory = start_controller(settings, *measured[0].tolist())
    for k in range(count):
        if k in range(length, count - length, length):
            part, (front, rear), (nu_front, nu_rear) = slice(k, k + length), voltages[k].tolist(), lagged[k].tolist()
            state = PlantState(*map(float, record_start(measured[part], voltages[part], period)))
            state = state._replace(nu_front=nu_front, nu_rear=nu_rear)
            angles, _ = fly(plant, settings, references[part], state, (front, rear), period, memory)
            errors.append(angles - measured[part])
        memory, commanded[k] = step_controller(settings, memory, measured[k].tolist(), references[k].tolist(), period)
    refuse(not errors, f"log {log.name} lasts {log.duration:.3g} s; to be flown again it needs {3 * AHEAD:g} s.")
    return errors, float(np.sqrt(np.mean((commanded[:-1] - voltages[1:]) ** 2))), period
