"""The plant near an operating point as a linear system, continuous and sampled.

The operating point is an equilibrium of pitch and elevation: v_front, v_rear and the rate at which the arm then travels
make the accelerations of all three axes zero. Around it

    x' = A x + B u,    y = C x

with x the deviations of pitch, elevation, travel [rad], their rates [rad/s], the lagged voltages nu_front, nu_rear [V]
and, where the arm bends, q [rad] and q' [rad/s]; u = (v_front, v_rear) [V]; y = the encoders' pitch, elevation, travel
[rad]. A and B are the slopes of :func:`heli_plant.plant.rates_of_change`, F and G with a period h those of the
plant's own step, x_{k+1} = F x_k + G u_k. Both are central differences.

Dry and breakaway friction are left out: at rest their slope is that of a smoothing, not of a rig.
"""

from dataclasses import dataclass

import numpy as np
from control import StateSpace, ss
from scipy.optimize import root

from heli_identifier.errors import ConfigurationError, refuse, require_range
from heli_identifier.results import PlantSource, to_plant
from heli_plant.effects import AXES, CATALOGUE
from heli_plant.laws import motor_input, motor_time_constant, switched_on, thrust_voltages
from heli_plant.parameters import PlantParameters
from heli_plant.plant import accelerations, measured_angles, rates_of_change, rigid_start, step
from heli_plant.state import PlantState, start_state

STATES = PlantState._fields[:8]  # of a rigid arm; the next two are those of one that bends
INPUTS = ("v_front", "v_rear")
PERIOD = 0.01  # control period [s]

NOT_LINEAR = tuple(e.field for e in CATALOGUE if e.name in ("dry_friction", "breakaway_friction"))
"""Coefficients that a linear model leaves out: their slope at rest is that of the smoothing."""

WIDTH = 1e-6
"""Half the width of the differences [rad, rad/s, V]: they err by 1e-10 by rounding, and by 1e-12 by curvature."""

BALANCED = 1e-9  # largest acceleration [rad/s^2] at which a point counts as an equilibrium
STARTS = 5  # equal voltages near balance from which an equilibrium is searched: a curved thrust may have several
FURTHEST = 1.5  # largest pitch and elevation [rad]: beyond a quarter of a turn the rig lies on its back
LARGEST_LEAN = 0.7  # largest pitch [rad] of an equilibrium in which the travel rests


@dataclass(frozen=True)
class OperatingPoint:
    """An equilibrium of pitch and elevation: the encoders' angles [rad], travel rate [rad/s], voltages [V]."""

    pitch: float
    elevation: float
    travel_rate: float
    v_front: float
    v_rear: float

    @property
    def lift(self) -> float:
        """Sum of the voltages [V]."""
        return self.v_front + self.v_rear

    def state(self, parameters: PlantParameters) -> PlantState:
        """Return the plant's state at this point, with settled motors."""
        front, rear = motor_input(self.v_front, parameters), motor_input(self.v_rear, parameters)
        return start_state(self.pitch, self.elevation, 0.0, front, rear, (0.0, 0.0, self.travel_rate))


@dataclass(frozen=True, eq=False)
class LinearModel:
    """A plant at one operating point, sampled with held voltages; the delay of the voltages is not in ``sampled``."""

    plant: PlantParameters
    point: OperatingPoint
    sampled: StateSpace


def linearise(
    parameters: PlantSource, elevation: float = 0.0, pitch: float = 0.0, *, period: float | None = None
) -> StateSpace:
    """Linearise the plant at the equilibrium of an elevation and a pitch.

    States are deviations of pitch, elevation, travel [rad], their rates [rad/s], the lagged voltages nu_front, nu_rear
    [V] and, where the arm bends, its bending [rad] and bending rate [rad/s]. Inputs are v_front and v_rear [V], outputs
    pitch, elevation and travel [rad]. Dry and breakaway friction and an input delay are not in the model.
    :mod:`heli_identifier.tools.linearisation` states the equations; `heli linearise` adds intervals, margins and a
    retuned PID.

    Parameters
    ----------
    parameters : ParameterSet, PlantParameters, Diagnosis, or path of a parameters.json
    elevation, pitch : float
        Operating point [rad].
    period : float, optional
        Sampling period [s] over which the voltages are held; without it the system is continuous.

    Returns
    -------
    control.StateSpace
        With 8 or 10 states, 2 inputs, 3 outputs, all named.

    Raises
    ------
    ConfigurationError
        The plant has no equilibrium there within the motors' voltages, the motors have no lag, or the parameters are
        not those of a plant.
    """
    plant = to_plant(parameters)
    return linear_system(plant, operating_point(plant, pitch, elevation), period)


def operating_point(parameters: PlantParameters, pitch: float | None = 0.0, elevation: float = 0.0) -> OperatingPoint:
    """Find the equilibrium at a pitch and an elevation [rad]; without a pitch, the one at which the travel rests too.

    ConfigurationError if an angle is beyond `FURTHEST`, or there is no equilibrium within the motors' voltages.
    """
    require_range("pitch", pitch or 0.0, "rad", -FURTHEST, FURTHEST)
    require_range("elevation", elevation, "rad", -FURTHEST, FURTHEST)
    switches, unlimited = switched_on(parameters), parameters._replace(v_max=1e6)

    def point(unknown: np.ndarray) -> OperatingPoint:
        v_front, v_rear, last = unknown.tolist()
        lean, rate = (last, 0.0) if pitch is None else (pitch, last)
        return OperatingPoint(lean, elevation, rate, v_front, v_rear)

    def residual(unknown: np.ndarray) -> tuple[float, float, float]:
        trial = point(unknown)
        state = rigid_start(trial.state(unlimited), parameters)
        mu_diff, mu_sum = thrust_voltages(state.nu_front, state.nu_rear, 0.0, parameters)
        return accelerations(
            0.0, trial.pitch, state.elevation, 0.0, 0.0, 0.0, trial.travel_rate, mu_diff, mu_sum, 0.0, 0.0, switches,
            parameters,
        )  # fmt: skip

    equal = [np.array((v, v, 0.0)) for v in parameters.v_max * np.linspace(-1.0, 1.0, 40)]  # none at rest: a dead zone
    starts = sorted(equal, key=lambda start: np.linalg.norm(residual(start)))[:STARTS]
    solutions = (root(residual, start, tol=1e-12).x for start in starts)
    balanced = next((point(x) for x in solutions if np.abs(residual(x)).max() < BALANCED), None)
    if balanced is None or (pitch is None and abs(balanced.pitch) > LARGEST_LEAN):
        raise ConfigurationError(
            f"the travel has no rest at elevation {elevation:g} rad with the pitch within {LARGEST_LEAN:g} rad; choose "
            "a higher elevation, where the rotors lift, or control the pitch."
            if pitch is None
            else f"the plant has no equilibrium at pitch {pitch:g} rad, elevation {elevation:g} rad; choose another."
        )
    voltage = max(abs(balanced.v_front), abs(balanced.v_rear))
    need = f"pitch {balanced.pitch:.3g} rad and elevation {elevation:g} rad need {voltage:.3g} V"
    too_high = voltage >= parameters.v_max
    refuse(too_high, f"{need}, the motors take {parameters.v_max:g} V; choose a point nearer to rest.")
    return balanced


def linear_model(
    parameters: PlantParameters, pitch: float | None = 0.0, elevation: float = 0.0, period: float = PERIOD
) -> LinearModel:
    """Linearise the plant at its :func:`operating_point`, sampled every ``period`` [s]."""
    point = operating_point(parameters, pitch, elevation)
    return LinearModel(parameters, point, linear_system(parameters, point, period))


def linear_system(parameters: PlantParameters, point: OperatingPoint, period: float | None = None) -> StateSpace:
    """Linearise the plant at an operating point as :func:`linearise` does; ConfigurationError if motors have no lag."""
    no_lag = motor_time_constant(parameters) <= 0.0
    refuse(no_lag, "motor.time_constant with its effect motor_lag is 0 s; a linear model needs a positive lag.")
    frictionless = parameters._replace(**dict.fromkeys(NOT_LINEAR, 0.0))
    n = len(STATES) + (2 if frictionless.arm_bending_elevation != 0.0 else 0)
    centre = rigid_start(point.state(frictionless), frictionless)

    def later(numbers: np.ndarray) -> np.ndarray:
        """Return the states' rates, or the states a period later, and the angles for a row of states and inputs."""
        state, (v_front, v_rear) = PlantState(*numbers[:n].tolist(), *centre[n:]), numbers[n:].tolist()
        after: tuple[float, ...]
        if period is None:
            after = rates_of_change(0.0, *state[:-2], v_front, v_rear, 0.0, state.cable_rest, frictionless)
        else:
            after = step(state, v_front, v_rear, 0.0, 0.0, period, frictionless)
        return np.array([*after[:n], *measured_angles(state)])

    middle, changes = np.array([*centre[:n], point.v_front, point.v_rear]), WIDTH * np.eye(n + len(INPUTS))
    slopes = np.column_stack([(later(middle + change) - later(middle - change)) / (2.0 * WIDTH) for change in changes])
    names = {"states": list(PlantState._fields[:n]), "inputs": list(INPUTS), "outputs": list(AXES)}
    return ss(slopes[:n, :n], slopes[:n, n:], slopes[n:, :n], np.zeros((len(AXES), len(INPUTS))), period or 0, **names)
