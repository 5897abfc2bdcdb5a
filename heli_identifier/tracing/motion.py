"""What the tracer computes of the bench helicopter along a record: signals, equations of motion, variables of torques.

The rig with its parameters and priors is in :mod:`.helicopter`. These two are the only modules of this subpackage that
import the plant.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from math import atan2, copysign, hypot

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter

from heli_identifier.chain import local_cubic, smooth_motion
from heli_plant.effects import CATALOGUE, THRUST, VOLTAGE
from heli_plant.laws import bending_acceleration, input_delay, motor_input, motor_time_constant, thrust_voltage
from heli_plant.motor import decay_factor
from heli_plant.parameters import PlantParameters
from heli_plant.simulation import run_accelerations
from heli_plant.state import PlantState, start_state
from heli_plant.tabulated_torque import KNOTS, VARIABLES, tabulated_torque

from .instruments import Term
from .rig import Array, Record, means
from .settings import MOTION_WINDOW, TIMED, WINDOW

DAMPING = (0.1, 0.1)
"""Prior mean and standard deviation of every damping for instruments [1/s]: sister rigs have .02 to .25."""


def record_start(angles: Array, inputs: Array, step: float) -> Array:
    """State at a record's start, shape (12,): straight lines through the first .3 s, motors settled, cable slack."""
    count = min(max(4, int(0.3 / step)), len(angles))
    slopes, intercepts = np.polyfit(np.arange(count) * step, angles[:count], 1)
    rates = (float(slopes[0]), float(slopes[1]), float(slopes[2]))
    pitch, elevation, travel = map(float, intercepts)
    state = start_state(pitch, elevation, travel, float(inputs[0, 0]), float(inputs[0, 1]), rates)
    return np.array(tuple(state), dtype=float)


def state_in_motion(carry: Array, motion: Array) -> Array:
    """State (21,) of a filter in a measured motion (6,), with motors and bending of ``carry`` and calm air.

    The state has the elevation of the rigid arm: that of the encoder minus the bending.
    """
    state = np.zeros(len(carry))
    state[:6], state[6 : len(PlantState._fields)] = motion, carry[6 : len(PlantState._fields)]
    state[1] -= carry[8]
    state[4] -= carry[9]
    return state


def lag_voltages(voltages: Array, h: float, p: PlantParameters) -> Array:
    """Return voltages (N, 2) [V], ``h`` [s] apart, behind the motors' lag of eq. (9), settled at the first sample."""
    share, first = decay_factor(h, motor_time_constant(p)), voltages[0]
    return np.asarray(lfilter([0.0, 1.0 - share], [1.0, -share], voltages - first, axis=0) + first)


class Tables:
    """Torques over one variable of the motion, one table an axis, that the plant can take without knowing a law."""

    variables = {name: unit for name, unit in VARIABLES.items() if name != "time"}
    """Variables of tables with their units; not time, as such a torque repeats in no other log."""
    knots = KNOTS
    turning = frozenset(("travel",))
    """Variables that count within one turn."""
    held = frozenset((
        ("pitch", "pitch"), ("pitch", "pitch_rate"), ("pitch", "mu_diff"), ("elevation", "elevation"),
        ("elevation", "elevation_rate"), ("elevation", "mu_sum"), ("travel", "travel_rate"), ("travel", "pitch"),
    ))  # fmt: skip
    """Tables whose straight line is a term of the model before."""

    @staticmethod
    def values(record: Record, parameters: PlantParameters, motion: Array) -> Array:
        """Return the variables (n, V) along a motion (n, 6) at every :attr:`.rig.Record.held`-th sample."""
        nu = lag_voltages(record.inputs, record.step, parameters)[:: record.held]
        return np.column_stack((motion, nu.sum(1), nu[:, 0] - nu[:, 1]))

    @staticmethod
    @cache
    def basis() -> Array:
        """Weights (m, K) of a table's torques at points 1/50 of a spacing apart."""
        s = np.linspace(0.0, KNOTS - 1.0, 50 * (KNOTS - 1) + 1).tolist()
        return np.array([tabulated_torque(at, 0.0, 1.0, np.eye(KNOTS)) for at in s])

    @staticmethod
    def points(s: Array) -> NDArray[np.intp]:
        """Return the nearest of these points to ``s`` (n,) spacings behind the first one."""
        return np.clip(np.rint(50.0 * s), 0, 50 * (KNOTS - 1)).astype(np.intp)

    @staticmethod
    def fields(axis: str, variable: str) -> tuple[str, ...]:
        """Torques of a table as parameters of the plant; if the table closes, its last torque is tied to the first."""
        last = KNOTS if variable == "travel" else KNOTS + 1
        return tuple(f"table_torque_{k}_{axis}" for k in range(1, last))

    @staticmethod
    def first(axis: str) -> str:
        """Where the first value of a table lies, as a parameter of the plant."""
        return f"table_first_{axis}"

    @staticmethod
    def switch_on(axis: str, variable: str, first: float, spacing: float) -> dict[str, float]:
        """Parameters that switch a table on."""
        number = list(VARIABLES).index(variable) + 1.0
        return {f"table_variable_{axis}": number, Tables.first(axis): first, f"table_spacing_{axis}": spacing}


def thrust_slopes(parameters: PlantParameters, voltage: float) -> tuple[float, float]:
    """Slope of the thrust about ``voltage`` [V], and thrust over voltage there; both are 1 for a linear rotor."""
    if not any(getattr(parameters, field) for field in _thrust_fields()):
        return 1.0, 1.0
    near = (voltage - 0.25, voltage, voltage + 0.25)
    low, middle, high = (thrust_voltage(motor_input(v, parameters), 0.0, parameters) for v in near)
    slope = max((high - low) / 0.5, 0.05)
    return slope, max(middle / voltage, 0.05) if abs(voltage) > 0.25 else slope


@cache
def _thrust_fields() -> tuple[str, ...]:
    """Coefficients of the effects that bend the thrust over the voltage."""
    return tuple(entry.field for entry in CATALOGUE if entry.place in (VOLTAGE, THRUST))


def sum_thrust(record: Record, p: PlantParameters) -> Array:
    """Sum of the rotors' thrust voltages (N,) [V] along a record; a delay is taken in whole samples."""
    if not input_delay(p) and not any(getattr(p, field) for field in _thrust_fields()):
        return np.asarray(lag_voltages(record.inputs, record.step, p).sum(1))
    late = np.maximum(np.arange(record.samples) - round(input_delay(p) / record.step), 0)
    nu = lag_voltages(np.vectorize(lambda v: motor_input(v, p))(record.inputs[late]), record.step, p)
    return np.vectorize(lambda v, t: thrust_voltage(v, t, p))(nu, record.time[:, None]).sum(1)


def arm_readings(record: Record, plants: Sequence[PlantParameters]) -> Iterator[Array]:
    """Return reading minus angle [rad], (N, 3) each, of plants with the same rotors, whose arms bend."""
    mu = sum_thrust(record, plants[0])
    for p in plants:
        bending = np.zeros((record.samples, 3))
        q, rate, drive = (bending_acceleration(*unit, p) for unit in np.eye(3).tolist())  # the law is linear
        if drive:
            b, a, _ = cont2discrete(([drive], [1.0, -rate, -q]), record.step, "foh")
            bending[:, 1] = lfilter(b[0], a, mu - mu[0]) - drive / q * mu[0]
        yield bending


def signals_of(record: Record, p: PlantParameters) -> Array:
    """Signals (N, 7) of the equations of motion: nu_f + nu_r, nu_f - nu_r, theta, eps, lambda'.

    The last two are -d/dT of the first two, T the motors' lag: -dnu/dT = p nu/(1 + T p).
    """
    nu, rate = lag_voltages(record.inputs, record.step, p), np.gradient(record.angles[:, 2], record.step)
    slope = (nu - lag_voltages(nu, record.step, p)) / max(motor_time_constant(p), TIMED)
    of_thrust, of_lag = ((own.sum(1), own[:, 0] - own[:, 1]) for own in (nu, slope))
    return np.column_stack((*of_thrust, record.angles[:, :2], rate, *of_lag))


def equation_terms(theta0: float) -> tuple[tuple[Term, ...], ...]:
    """Equations of motion of the axes in these signals, without constants and without the slopes of the lag."""
    return (
        (Term("a_wx", lambda s: -s[:, 2], 1, DAMPING), Term("a_th", lambda s: -np.sin(s[:, 2] - theta0)),
         Term("k_x", lambda s: s[:, 1])),
        (Term("a_wz", lambda s: -s[:, 3], 1, DAMPING), Term("a_e", lambda s: -s[:, 3]),
         Term("k_z", lambda s: s[:, 0] * np.cos(s[:, 2]))),
        (Term("a_wy", lambda s: -s[:, 4], 0, DAMPING), Term("k_y", lambda s: s[:, 0] * np.sin(s[:, 2]))),
    )  # fmt: skip


LATE = (
    Term("k_x late", lambda s: s[:, 6]), Term("k_z late", lambda s: s[:, 5] * np.cos(s[:, 2])),
    Term("k_y late", lambda s: s[:, 5] * np.sin(s[:, 2])),
)  # fmt: skip
"""Term of each axis for a longer lag; its parameter is minus the gain times the additional lag."""

CONSTANTS = ((Term("theta0", lambda s: np.cos(s[:, 2])),), (Term("a_1", lambda s: -np.ones(len(s))),), ())
"""Further terms of the first estimate: a_th sin theta_0 cos theta, and a_1."""


def estimate_equations(records: Sequence[Record], p: PlantParameters) -> dict[str, float]:
    """Estimate the equations of motion by least squares on smoothed derivatives, which the air biases."""
    values: dict[str, float] = {}
    slow = [replace(record.slower, angles=means(record.angles, record.held)) for record in records]
    every = [signals_of(record, p) for record in slow]
    for i, (moving, constant) in enumerate(zip(equation_terms(0.0), CONSTANTS, strict=True)):
        terms, X, y = (*moving, *constant), list[Array](), list[Array]()
        for record, signals in zip(slow, every, strict=True):
            window = round(WINDOW / record.step)
            long = record.samples > 4 * window
            inner, ends = (slice(window, -window), "nearest") if long else (slice(None), "interp")
            smooth = (local_cubic(term.of(signals), record.step, WINDOW, term.order, ends) for term in terms)
            X.append(np.column_stack([column[inner] for column in smooth]))
            y.append(local_cubic(record.angles[:, i], record.step, WINDOW, 2, ends)[inner])
        theta = np.linalg.lstsq(np.concatenate(X), np.concatenate(y), rcond=None)[0]
        values |= {term.name: float(value) for term, value in zip(terms, theta, strict=True)}
    sine, cosine = values["a_th"], values["theta0"]
    values["a_th"] = copysign(hypot(sine, cosine), sine)
    values["theta0"] = atan2(copysign(1.0, sine) * cosine, abs(sine))
    return values


def plant_accelerations(record: Record, *plants: PlantParameters, window: float = MOTION_WINDOW) -> Array:
    """Accelerations (m, N, 3) [rad/s^2] of plants along the measured motion, smoothed over ``window`` [s]."""
    motion = smooth_motion(record.angles, record.step, window)
    out = np.moveaxis(run_accelerations(record, plants, motion)[0], 0, 2).copy()
    out[:, 1:] = 0.5 * (out[:, 1:] + out[:, :-1])  # from the middles of the steps to their ends
    return out
