"""Gains of a PID, and of LQR and LQI with a Kalman filter, for a linear plant.

Per loop of the PID the gains (P, I, D) minimise the integrated time-weighted error of a reference step and of a load
step of 1 V of the linear closed loop,

    J = sum_k t_k abs(1 - y_k) h + sum_k t_k abs(y_k under the load) h,

subject to a peak of the sensitivity of at most :data:`PEAK` for all given plants (Astrom and Hagglund, Advanced PID
Control, 2006, chapters 4 and 7), and to no more gain on encoder noise, P + D/tau, than the present PID has.

For LQR and LQI, about the operating point, with F, G, C of :mod:`.linearisation` and the integrals z of elevation and
of travel or pitch,

    [K K_z] minimises  sum x'Q x + z'Q_z z + u'R u      (LQI; without z LQR)
    L is the predictor of the Kalman filter for torques of the air on the axes and noise of the encoders
    N r puts the equilibrium at the reference: with x_r, u_r its state and input, z_r = -S_zz^-1 S_zx x_r the integral
    that leaves the least cost-to-go x'S x, N = u_r + K x_r + K_z z_r.

The torque of the air has a standard deviation a and decays at the rate :data:`AIR_RATE` c, so it acts on a rate like
white noise of intensity 2 a^2 / c. A prediction (:mod:`heli_plant.state_feedback`) compensates the period between
reading and acting and the input delay, so gains and filter are those of the plant without them.

Sources: B. D. O. Anderson and J. B. Moore, Optimal Control: Linear Quadratic Methods, 1990, sections 2.4, 3.1, 8.1; the
course's Q and R are diagonal, those of the default by Bryson's rule.
"""

from collections.abc import Sequence
from typing import Any

import control
import numpy as np
from scipy.optimize import minimize

from heli_identifier.errors import ConfigurationError, refuse
from heli_identifier.records import ControllerConfiguration
from heli_identifier.tools import margins
from heli_identifier.tools.linearisation import LinearModel, linear_system
from heli_identifier.tools.margins import Array
from heli_plant.control import AxisGains, PidSettings
from heli_plant.effects import AXES
from heli_plant.laws import motor_time_constant
from heli_plant.state_feedback import MOST_DELAY, Angles, FeedbackSettings, Motion, Pair, Rotors

PEAK = 1.6  # largest peak of the sensitivity: a phase margin of 36 degrees and a gain margin of 2.7 at least
HORIZON = 10.0  # length [s] of the steps in J
UNSTABLE = 1e6  # error J [s^2] that an unstable loop has at least
PENALTY = 50.0  # on a violated bound: larger than any improvement of a step response
WEAKER = (1.0, 0.3, 0.1, 0.03)  # the search starts at the first stable one of these shares of the present gains
NO_GAIN = 1e-9  # gains up to this are set to zero
AIR_RATE = 2.5  # rate at which the torque of the air decays [1/s], as in measured rooms

MOTOR_NOISE = 0.01
"""Intensity of the noise on the motors' states [V^2 s], for errors of their lag; it also keeps the filter regular."""


def retune_pid(model: LinearModel, settings: PidSettings, others: Sequence[LinearModel] = ()) -> PidSettings:
    """Return the PID with new gains of pitch and elevation, of the travel if its loop is on, and a new trim.

    The margins hold for the identified plant, ``model``, and for ``others``, plants that the data allow.
    """
    omega = margins.frequencies(model.sampled.dt, 250)
    responses = np.array([margins.plant_response(linear, omega) for linear in (model, *others)])
    tuned = settings._replace(travel_enabled=False, trim=model.point.lift)
    for loop in range(len(margins.LOOPS)):
        tuned = _tune_loop(model, responses, omega, tuned, loop)
    if settings.travel_enabled:
        tuned = _tune_loop(model, responses, omega, tuned._replace(travel_enabled=True), AXES.index("travel"))
    return tuned


def _tune_loop(
    model: LinearModel, responses: margins.Responses, omega: Array, settings: PidSettings, loop: int
) -> PidSettings:
    """Return the PID with new gains of one loop; the loop of the travel acts through that of the pitch."""
    axis, tau, channel = AXES[loop], settings.rate_time_constant, loop % len(margins.LOOPS)
    present: AxisGains = getattr(settings, axis)
    if min(present.proportional, present.derivative) <= 0.0:  # it holds no axis: its noise is no bound
        present = getattr(PidSettings(), axis)
    present = present._replace(integral=max(present.integral, 1e-3))
    noise_gain = present.proportional + present.derivative / tau

    def with_gains(gains: list[float]) -> PidSettings:
        changed: dict[str, Any] = {axis: AxisGains(*gains)}
        return settings._replace(**changed)

    def cost(logarithms: Array) -> float:
        gains = AxisGains(*np.exp(logarithms).tolist())
        trial = with_gains([*gains])
        pid = margins.controller_response(trial, model.sampled.dt, omega)
        peak = float(np.max(1.0 / np.abs(1.0 + margins.loop_gain(responses, pid, channel))))
        noise = (gains.proportional + gains.derivative / tau) / noise_gain
        return weighted_error(model, trial, loop) + PENALTY * (max(peak / PEAK - 1.0, 0.0) + max(noise - 1.0, 0.0))

    starts = [np.array(present) * share for share in WEAKER]
    stable = (start for start in starts if margins.is_stable(margins.close_loop(model, with_gains(start.tolist()))))
    options = {"xatol": 1e-3, "fatol": 1e-4, "maxiter": 250}
    start = np.log(next(stable, starts[0]))
    best = np.exp(minimize(cost, start, method="Nelder-Mead", options=options).x)
    return with_gains([float(f"{gain:.4g}") if gain > NO_GAIN else 0.0 for gain in best])


def weighted_error(model: LinearModel, settings: PidSettings, loop: int) -> float:
    """Return the time-weighted error J [s^2] of a linear loop under a unit reference step and a load step of 1 V."""
    period, channel = model.sampled.dt, loop % len(margins.LOOPS)
    horizon = HORIZON if loop == channel else 4.0 * HORIZON  # the travel is that much slower
    closed, steps = margins.close_loop(model, settings), round(horizon / period)
    weights = np.arange(steps) * period**2
    with np.errstate(over="ignore", invalid="ignore"):
        reference, load = (margins.unit_step(closed, drive, steps)[:, loop] for drive in (loop, 3 + channel))
        error = float(weights @ (np.abs(1.0 - reference) + np.abs(load)))
    error = min(error, UNSTABLE) if np.isfinite(error) else UNSTABLE
    return error if margins.is_stable(closed) else UNSTABLE + error


def design_feedback(
    model: LinearModel, aim: ControllerConfiguration, other: str, integral: bool, effort: float = 1.0
) -> FeedbackSettings:
    """Return the LQR or LQI of a plant at a point with its Kalman filter.

    Rows and columns of the travel are zero if the ``other`` controlled angle is the pitch.

    ConfigurationError if no feedback stabilises the plant with these weights, or the period or the delay is too long.
    """
    plant, point, w, period = model.plant, model.point, aim.weights, aim.period
    lag, delay = motor_time_constant(plant), round(plant.input_delay_rotors / period)
    long_period = f"controller.period = {period:g} s is longer than the motors' lag of {lag:.3g} s"
    refuse(period > lag, f"{long_period}, so the voltages between two samples are not resolved; take 0.01 s.")
    long_delay = f"the input delay of {plant.input_delay_rotors:.3g} s is {delay} periods of {period:g} s"
    refuse(delay > MOST_DELAY, f"{long_delay}, the unit keeps at most {MOST_DELAY}; take a longer controller.period.")
    system = linear_system(plant._replace(arm_bending_elevation=0.0), point, period)
    # without the travel and its rate if the pitch is controlled
    states, angles, controlled = [0, 1, 3, 4, 6, 7], [0, 1], [1, 0]
    if other == "travel":
        states, angles, controlled = [*range(8)], [0, 1, 2], [1, 2]
    A, B, C = system.A[np.ix_(states, states)], system.B[states], system.C[np.ix_(angles, states)]
    S, n = system.C[np.ix_(controlled, states)], len(states)
    weights = [w.pitch, w.elevation, w.travel, w.pitch_rate, w.elevation_rate, w.travel_rate, 0.0, 0.0]
    Q = np.diag([*np.array(weights)[states], *([w.elevation_integral, w.other_integral] if integral else [])]) * period
    R = np.eye(2) * w.voltage * effort * period
    intensity = [2.0 * aim.air[axis] ** 2 / AIR_RATE for axis in angles] + [MOTOR_NOISE] * 2
    noise = np.eye(n)[:, [*(states.index(3 + axis) for axis in angles), n - 2, n - 1]]
    W = np.diag(intensity) * period
    V, counts = np.eye(len(angles)), C / aim.encoder_noise  # angles in units of their noise: well conditioned
    try:
        gains, cost, poles = control.dlqr(A, B, Q, R, integral_action=period * S if integral else None)
        kalman_gain, _, filter_poles = control.dlqe(A, noise, counts, W, V)
        steady = np.linalg.solve(
            np.block([[A - np.eye(n), B], [S, np.zeros((2, 2))]]), np.vstack((np.zeros((n, 2)), np.eye(2)))
        )
    except (ValueError, np.linalg.LinAlgError, control.ControlArgument) as error:
        raise ConfigurationError(
            "the weights and the plant have no stabilising feedback at this point: a mode is not weighted or cannot be "
            f"controlled ({error}); give its angle a weight, or choose a point with more lift."
        ) from error
    refuse(
        not np.abs([*poles, *filter_poles]).max() < 1.0 or not np.isfinite(gains).all(),
        "the design is unstable on its own model: a mode is hardly weighted or hardly controlled; raise the weights of "
        "the angles and of their integrals, or choose a point with more lift.",
    )
    feedback, K_z = np.asarray(gains)[:, :n], np.zeros((2, 2))
    N = steady[n:] + feedback @ steady[:n]
    if integral:
        K_z = np.asarray(gains)[:, n:]
        N = N - K_z @ np.linalg.solve(cost[n:, n:], cost[n:, :n] @ steady[:n])
    K, L, F, G = (np.zeros(shape) for shape in ((2, 8), (8, 3), (8, 8), (8, 2)))
    K[:, states], L[np.ix_(states, angles)] = feedback, kalman_gain / aim.encoder_noise
    F[np.ix_(states, states)], G[states] = A, B

    def rows(kind: Any, matrix: Array) -> Any:
        return tuple(kind(*row) for row in matrix.tolist())

    return FeedbackSettings(
        transition=rows(Motion, F),
        drive=rows(Rotors, G),
        innovation=rows(Angles, L),
        gain=rows(Motion, K),
        integral=rows(Pair, K_z),
        reference=rows(Pair, N),
        point=Angles(point.pitch, point.elevation, 0.0),
        hover=Rotors(point.v_front, point.v_rear),
        period=period,
        delay=delay,
        travel_enabled=other == "travel",
        voltage_limit=plant.v_max,
    )
