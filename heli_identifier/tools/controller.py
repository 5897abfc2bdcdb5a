"""Controllers for an identified plant: PID, LQR, LQI with a Kalman filter, judged over all plants the data allow.

About the operating point, with F, G, C of :mod:`.linearisation`, z the integrals of elevation and of travel or pitch,

    [K K_z] minimises  sum x'Q x + z'Q_z z + u'R u      (LQI; without z LQR)
    L is the predictor of the Kalman filter for torques of the air on the axes and noise of the encoders
    N r puts the equilibrium at the reference: with x_r, u_r its state and input, z_r = -S_zz^-1 S_zx x_r the integral
    that leaves the least cost-to-go x'S x, N = u_r + K x_r + K_z z_r.

The air has a standard deviation a and dies out at :data:`AIR_RATE` c, so it drives a rate like white noise of intensity
2 a^2 / c. The period between reading and acting and the input delay are undone by prediction
(:mod:`heli_plant.state_feedback`), so gains and filter are those of the plant without them; the margins are those of
the loop with both.

Two designs are made. The nominal one is what the weights say. The robust one makes the voltages dearer, R times
:data:`DEARER` to some power, until 95 % of the drawn plants keep the disk margin that is asked for. What a design
promises is what 95 % of the plants keep, all of it at once. A PID is retuned (:mod:`.pid`), nominally for the plant
alone.

Sources: B. D. O. Anderson and J. B. Moore, Optimal Control: Linear Quadratic Methods, 1990, sections 2.4, 3.1, 8.1; the
course's Q and R are diagonal, those of the default by Bryson's rule.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, astuple, dataclass
from math import ceil
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import ConfigurationError
from heli_identifier.online import Estimate
from heli_identifier.records import ControllerConfiguration
from heli_identifier.results import ParameterSet, plain
from heli_identifier.tools.linearisation import (
    PERIOD,
    LinearModel,
    OperatingPoint,
    linear_system,
    operating_point,
)
from heli_identifier.tools.loop import (
    Margins,
    Settings,
    StepResponse,
    closed_loop,
    controller_response,
    disk_margins,
    frequencies,
    is_stable,
    margins_over,
    plant_response,
    settling_time,
    step_response,
    unit_step,
)
from heli_identifier.tools.pid import CONTROLLER, drawn_plants, pid_values, retuned
from heli_identifier.tracing import DiagnosisSettings, Use, helicopter
from heli_plant.control import PidSettings
from heli_plant.effects import AXES
from heli_plant.laws import motor_time_constant
from heli_plant.parameters import PlantParameters
from heli_plant.state_feedback import (
    MOST_DELAY,
    Angles,
    Drive,
    FeedbackSettings,
    Gain,
    Innovation,
    Motion,
    Pair,
    PairGain,
    Rotors,
    Transition,
    entry_unit,
)

Array = NDArray[np.float64]

SCHEMA = "heli-controller/1"
FEEDBACK = "StateFeedback"
KINDS = ("lqi", "lqr", "pid")
OTHERS = ("pitch", "travel")
"""Angles that are controlled beside the elevation."""

DRAWS, TRIED = 1000, 200
"""Drawn plants over which a design is judged, and those over which a robust one is searched."""

CONFIDENCE = 0.95
"""Share of the plants that keep what is promised."""

AIR_RATE = 2.5
"""Rate at which the torque of the air dies out [1/s], that of measured rooms."""

MOTOR_NOISE = 0.01
"""Intensity of the noise on the motors' states [V^2 s]: their lag is no better known, and the filter stays regular."""

DEARER, DEAREST = 1.5, 24
"""Factor by which the voltages become dearer, and how often at most."""

LONGEST = 40.0
"""Length [s] of the steps whose settling is judged."""

SHOWN = {"pitch": 12.0, "elevation": 12.0, "travel": 30.0}
"""Length [s] of the steps that are shown."""

LEAST_LIFT = 0.3
"""Sum of the thrust voltages [V] below which the travel cannot be controlled: a lean has no lateral force."""

_USED: Mapping[str, tuple[int, ...]] = {"pitch": (0, 1, 3, 4, 6, 7), "travel": tuple(range(8))}
"""States of a design: without the travel and its rate where the pitch is controlled."""

MATRICES = ("transition", "drive", "innovation", "gain", "integral", "reference")
"""Fields of the settings whose entries are parameters of the unit."""

_FLOWN_BY = {"pitch": "k_x", "elevation": "k_z", "travel": "k_y"}


@dataclass(frozen=True, eq=False)
class Judged:
    """A controller around the plant and around every plant that the data allow.

    Attributes
    ----------
    settings : PidSettings or FeedbackSettings
    margins : dict of str to Margins
        Of the estimated plant, by loop.
    promised : dict of str to Margins
        What 95 % of the plants keep of all figures at once (:func:`kept_together`).
    disk, promised_disk : float
        Disk margin at both actuators at once.
    settling, promised_settling, worst_settling : dict of str to float
        Time [s] of a linear reference step, by axis; ``promised`` is kept by 95 % of the plants.
    stable : float
        Share of the plants for which the loop is stable.
    poles : NDArray, shape (n,), complex
        Of the closed loop with the estimated plant [1/s].
    disks : NDArray, shape (M,)
        Disk margin of every plant.
    steps : tuple of StepResponse
        Of the whole plant.
    band : dict of str to NDArray, shape (2, N)
        Lowest and highest response to a unit step among 95 % of the plants, by axis, at the times of the steps after 0.
    effort : float
        Factor by which the voltages were made dearer.
    """

    settings: Settings
    margins: dict[str, Margins]
    promised: dict[str, Margins]
    disk: float
    promised_disk: float
    settling: dict[str, float]
    promised_settling: dict[str, float]
    worst_settling: dict[str, float]
    stable: float
    poles: NDArray[Any]
    disks: Array
    steps: tuple[StepResponse, ...]
    band: dict[str, Array]
    effort: float = 1.0

    @property
    def document(self) -> dict[str, Any]:
        """What a JSON file holds of it."""
        return {
            "effort": self.effort,
            "stable_share": self.stable,
            "disk_margin": {"value": self.disk, "promised": self.promised_disk},
            "margins": {
                name: {
                    key: {"value": value, "promised": getattr(self.promised[name], key)}
                    for key, value in asdict(own).items()
                }
                for name, own in self.margins.items()
            },
            "settling_time_s": {
                axis: {"value": value, "promised": self.promised_settling[axis], "worst": self.worst_settling[axis]}
                for axis, value in self.settling.items()
            },
            "steps": {
                step.axis: {"size_rad": step.size, "overshoot": step.overshoot, "settling_time_s": step.settling_time}
                for step in self.steps
            },
            "poles": [[pole.real, pole.imag] for pole in self.poles.tolist()],
        }


@dataclass(frozen=True, eq=False)
class ControllerDesign:
    """A nominal and a robust controller of one kind.

    Attributes
    ----------
    kind : str
        pid, lqr or lqi.
    axes : tuple of str
        Controlled angles: the elevation and travel or pitch.
    model : LinearModel
    nominal, robust : Judged
    plants : int
        Over which they were judged.
    continuous : dict of str to NDArray
        K, K_z, L and N of the same weights in continuous time; empty of a PID.
    notes : tuple of str
    """

    kind: str
    axes: tuple[str, str]
    model: LinearModel
    nominal: Judged
    robust: Judged
    plants: int
    continuous: dict[str, Array]
    notes: tuple[str, ...]

    def document(self, provenance: Mapping[str, Any]) -> dict[str, Any]:
        """Return the content of design.json; null stands for an infinite value."""
        return plain(
            {
                "schema": SCHEMA,
                "kind": self.kind,
                "axes": list(self.axes),
                "operating_point": asdict(self.model.point),
                "period_s": self.model.sampled.dt,
                "input_delay_s": self.model.input_delay,
                "plants": self.plants,
                "confidence": CONFIDENCE,
                "nominal": self.nominal.document,
                "robust": self.robust.document,
                "continuous": self.continuous,
                "notes": list(self.notes),
                "provenance": provenance,
            }
        )

    def parameters(self, judged: Judged, provenance: Mapping[str, Any]) -> ParameterSet:
        """Return one of the controllers as parameters of its unit."""
        settings, point = judged.settings, self.model.point
        if isinstance(settings, PidSettings):
            values = pid_values(settings, point)
            if settings.travel_enabled:
                gains = zip(("proportional", "integral", "derivative"), ("1", "1/s", "s"), strict=True)
                values |= {f"travel.{n}": Estimate(getattr(settings.travel, n), None, unit) for n, unit in gains}
                values["travel.enabled"] = Estimate(1.0, None, "1")
            values["voltage_limit"] = Estimate(settings.voltage_limit, None, "V")
            return ParameterSet(CONTROLLER, values, provenance=provenance)
        return ParameterSet(FEEDBACK, feedback_values(settings), provenance=provenance)


def feedback_values(settings: FeedbackSettings) -> dict[str, Estimate]:
    """Return the parameters of the StateFeedback unit that make it this controller, but for entries of zero."""
    values: dict[str, tuple[float, str]] = {
        "sample.time": (settings.period, "s"),
        "sample.delay": (float(settings.delay), "1"),
        "travel.enabled": (float(settings.travel_enabled), "1"),
        "voltage_limit": (settings.voltage_limit, "V"),
    }
    values |= {f"point.{axis}": (value, "rad") for axis, value in settings.point._asdict().items()}
    values |= {f"reference.{axis}": (value, "rad") for axis, value in settings.point._asdict().items()}
    values |= {f"hover.{rotor}": (value, "V") for rotor, value in settings.hover._asdict().items()}
    for matrix in MATRICES:
        for row, own in getattr(settings, matrix)._asdict().items():
            values |= {
                f"{matrix}.{row}.{column}": (value, entry_unit(matrix, row, column))
                for column, value in own._asdict().items()
            }
    return {name: Estimate(value, None, unit) for name, (value, unit) in values.items() if value != 0.0}


def feedback_settings(values: Mapping[str, float]) -> FeedbackSettings:
    """Return the controller of the StateFeedback unit's parameters; what is missing is zero, or the unit's default."""
    default = FeedbackSettings()

    def filled(name: str, own: Any) -> Any:
        if not hasattr(own, "_fields"):
            return float(values.get(name, own))
        return type(own)(*(filled(f"{name}.{field}", part) for field, part in own._asdict().items()))

    made = {name: filled(name, own) for name, own in default._asdict().items() if hasattr(own, "_fields")}
    return default._replace(
        **made,
        period=float(values.get("sample.time", default.period)),
        delay=int(values.get("sample.delay", 0)),
        travel_enabled=bool(values.get("travel.enabled", 0.0)),
        voltage_limit=float(values.get("voltage_limit", default.voltage_limit)),
    )


def hover(plant: PlantParameters, elevation: float) -> OperatingPoint:
    """Find the equilibrium at an elevation [rad] at which the travel stands still as well.

    Raises
    ------
    ConfigurationError
        There is none within the motors' voltages.
    """
    low, high = -0.05, 0.05
    rate_low, rate_high = (operating_point(plant, pitch, elevation).travel_rate for pitch in (low, high))
    for _ in range(20):  # secants: the rate is nearly proportional to the lean
        if rate_high == rate_low:
            break
        low, rate_low, high = high, rate_high, high - rate_high * (high - low) / (rate_high - rate_low)
        if not abs(high) < 0.7:
            break
        point = operating_point(plant, high, elevation)
        rate_high = point.travel_rate
        if abs(rate_high) < 1e-9:
            return point
    raise ConfigurationError(
        f"the travel has no rest at elevation {elevation:g} rad with the pitch within 0.7 rad; choose a higher "
        "elevation, where the rotors lift, or control the pitch."
    )


def check_usable(parameters: ParameterSet, axes: Sequence[str]) -> None:
    """Refuse a plant whose diagnosis calls one of the axes unfit for control, and say what to fly.

    Raises
    ------
    ConfigurationError
        With the flight that would make it fit.
    """
    unfit = [axis for axis in axes if axis in parameters.axes_for(Use.NOTHING, Use.PREDICTION)]
    if unfit:
        fly = helicopter(DiagnosisSettings(), [np.zeros((1, 3))], [np.zeros((1, 2))]).fly
        flights = " ".join(f"For the {axis}: {fly[_FLOWN_BY[axis]]}" for axis in unfit)
        raise ConfigurationError(
            f"the diagnosis does not call the {' and the '.join(unfit)} of these parameters fit for control. {flights}"
        )


def model_of(plant: PlantParameters, point: OperatingPoint, period: float) -> LinearModel:
    """Linearise at a point, sampled; the continuous system stands in its place where it is not needed."""
    sampled = linear_system(plant, point, period)
    return LinearModel(point, sampled, sampled, plant.input_delay_rotors)


def synthesised(
    plant: PlantParameters,
    point: OperatingPoint,
    aim: ControllerConfiguration,
    other: str,
    integral: bool,
    effort: float = 1.0,
) -> FeedbackSettings:
    """Return the sampled LQR or LQI of a plant at a point, with its Kalman filter.

    Raises
    ------
    ConfigurationError
        The weights leave a mode that nothing stabilises, the period is too long or the delay too many periods.
    """
    h = aim.period
    lag, delay = motor_time_constant(plant), round(plant.input_delay_rotors / h)
    if h > lag:
        raise ConfigurationError(
            f"controller.period = {h:g} s is longer than the motors' lag of {lag:.3g} s, so the voltages between two "
            "samples are not resolved; take 0.01 s."
        )
    if delay > MOST_DELAY:
        raise ConfigurationError(
            f"the input delay of {plant.input_delay_rotors:.3g} s is {delay} periods of {h:g} s, the unit keeps at "
            f"most {MOST_DELAY}; take a longer controller.period."
        )
    rigid = plant._replace(arm_bending_elevation=0.0)
    K, K_z, L, N, system = gains(linear_system(rigid, point, h), aim, other, integral, effort)
    return FeedbackSettings(
        Transition(*(Motion(*row) for row in system.A.tolist())),
        Drive(*(Rotors(*row) for row in system.B.tolist())),
        Innovation(*(Angles(*row) for row in L.tolist())),
        Gain(*(Motion(*row) for row in K.tolist())),
        PairGain(*(Pair(*row) for row in K_z.tolist())),
        PairGain(*(Pair(*row) for row in N.tolist())),
        Angles(point.pitch, point.elevation, 0.0),
        Rotors(point.v_front, point.v_rear),
        h,
        delay,
        other == "travel",
        plant.v_max,
    )


def gains(
    system: control.StateSpace, aim: ControllerConfiguration, other: str, integral: bool, effort: float = 1.0
) -> tuple[Array, Array, Array, Array, control.StateSpace]:
    """Return K (2, 8), K_z (2, 2), L (8, 3), N (2, 2) and the system that the filter predicts with.

    Continuous or sampled as ``system`` is. Where the pitch is controlled, rows and columns of the travel are zero.

    Raises
    ------
    ConfigurationError
        The Riccati equations have no stabilising solution.
    """
    w, used, sampled = aim.weights, list(_USED[other]), bool(system.dt)
    angles = [0, 1, 2] if other == "travel" else [0, 1]
    chosen = [1, 2 if other == "travel" else 0]
    A, B, C = system.A[np.ix_(used, used)], system.B[used], system.C[np.ix_(angles, used)]
    S = system.C[np.ix_(chosen, used)]
    n, h = len(used), float(system.dt) if sampled else 1.0
    scale = h if sampled else 1.0
    rated = [w.pitch, w.elevation, w.travel, w.pitch_rate, w.elevation_rate, w.travel_rate, 0.0, 0.0]
    Q = np.diag([*np.array(rated)[used], *([w.elevation_integral, w.other_integral] if integral else [])]) * scale
    R = np.eye(2) * w.voltage * effort * scale
    whole, drive = A, B
    if integral:
        z = np.eye(2) if sampled else np.zeros((2, 2))
        whole = np.block([[A, np.zeros((n, 2))], [h * S, z]])
        drive = np.vstack((B, np.zeros((2, 2))))
    rates = [used.index(3 + axis) for axis in angles]
    intensity = [2.0 * aim.air[axis] ** 2 / AIR_RATE for axis in angles] + [MOTOR_NOISE] * 2
    noise = np.eye(n)[:, [*rates, n - 2, n - 1]]
    W = np.diag(intensity) * (h if sampled else 1.0 / PERIOD)
    V, counts = np.eye(len(angles)), C / aim.encoder_noise  # angles in units of their noise: well conditioned
    try:
        solve, estimate = (control.dlqr, control.dlqe) if sampled else (control.lqr, control.lqe)
        found, cost, poles = solve(whole, drive, Q, R)
        filtered, _, errors = estimate(A, noise, counts, W, V)
        steady = np.linalg.solve(
            np.block([[A - (np.eye(n) if sampled else 0.0), B], [S, np.zeros((2, 2))]]),
            np.vstack((np.zeros((n, 2)), np.eye(2))),
        )
    except (ValueError, np.linalg.LinAlgError, control.ControlArgument) as error:
        raise ConfigurationError(
            "the weights and the plant have no stabilising feedback at this point: a mode is not weighted or cannot be "
            f"controlled ({error}); give its angle a weight, or choose a point with more lift."
        ) from error
    stable = np.abs([*poles, *errors]).max() < 1.0 if sampled else np.real([*poles, *errors]).max() < 0.0
    if not stable or not np.isfinite(found).all():
        raise ConfigurationError(
            "the design is unstable on its own model: a mode is hardly weighted or hardly controlled; raise the "
            "weights of the angles, or choose a point with more lift."
        )
    feedback = np.asarray(found)[:, :n]
    N = steady[n:] + feedback @ steady[:n]
    K_z = np.zeros((2, 2))
    if integral:
        K_z = np.asarray(found)[:, n:]
        N = N - K_z @ np.linalg.solve(cost[n:, n:], cost[n:, :n] @ steady[:n])
    K, L = np.zeros((2, 8)), np.zeros((8, 3))
    K[:, used], L[np.ix_(used, angles)] = feedback, filtered / aim.encoder_noise
    kept = np.zeros((8, 8))
    kept[np.ix_(used, used)] = A
    driven = np.zeros((8, 2))
    driven[used] = B
    predicts = control.ss(kept, driven, system.C[:, :8], np.zeros((3, 2)), system.dt)
    return K, K_z, L, N, predicts


def design_controller(
    parameters: ParameterSet,
    kind: str = "lqi",
    other: str = "pitch",
    elevation: float = 0.0,
    pitch: float = 0.0,
    aim: ControllerConfiguration | None = None,
    draws: int = DRAWS,
    progress: Callable[[str, float], None] = lambda what, share: None,
) -> ControllerDesign:
    """Design a nominal and a robust controller at an elevation [rad] and, if that is controlled, a pitch [rad].

    Parameters
    ----------
    parameters : ParameterSet
        Of the plant.
    kind : str
        One of :data:`KINDS`.
    other : str
        Angle that is controlled beside the elevation: travel or pitch.
    aim : ControllerConfiguration, optional
        Period, weights, margin that is asked for.
    draws : int
        Plants over which the designs are judged.

    Raises
    ------
    ConfigurationError
        The diagnosis does not call an axis fit for control, there is no equilibrium within the motors' voltages, the
        design is unstable, or the period too long.
    """
    aim = aim or ControllerConfiguration()
    if kind not in KINDS or other not in OTHERS:
        raise ConfigurationError(
            f"{kind} of {other} is not designed; choose of {', '.join(KINDS)}, of pitch or travel."
        )
    axes = ("pitch", "elevation", "travel") if other == "travel" else ("pitch", "elevation")
    check_usable(parameters, axes)
    plant = parameters.plant()
    point = _point(plant, other, elevation, pitch)
    if other == "travel" and abs(point.v_front + point.v_rear) < LEAST_LIFT:
        raise ConfigurationError(
            f"at elevation {elevation:g} rad the rotors hardly lift ({point.v_front + point.v_rear:.2g} V together), "
            "so a lean does not move the travel; choose a higher --elevation."
        )
    model, models, fallen = model_of(plant, point, aim.period), [], 0
    for number, one in enumerate(drawn_plants(parameters, draws)):
        progress("linearising the plants that the data allow", 0.5 * number / draws)
        try:
            models.append(model_of(one, _point(one, other, elevation, pitch), aim.period))
        except ConfigurationError:
            fallen += 1
    if not models:
        raise ConfigurationError(f"none of {draws} plants that the data allow has an equilibrium there.")
    omega = frequencies(aim.period)
    responses = np.array([plant_response(one, omega) for one in (model, *models)])
    progress("designing", 0.6)
    notes = [f"{fallen} of {draws} plants that the data allow have no equilibrium there"] if fallen else []
    continuous: dict[str, Array] = {}
    nominal: Settings
    robust: Settings
    if kind == "pid":
        present = PidSettings(voltage_limit=plant.v_max, travel_enabled=other == "travel")
        trim = point.v_front + point.v_rear
        nominal, effort = retuned(model, present, (), trim), 1.0
        robust = retuned(model, present, models[:30], trim)
    else:
        nominal = synthesised(plant, point, aim, other, kind == "lqi")
        robust, effort, reached = nominal, 1.0, 0.0
        for power in range(DEAREST):
            trial = synthesised(plant, point, aim, other, kind == "lqi", DEARER**power)
            found = disk_margins(responses[1 : TRIED + 1], controller_response(trial, aim.period, omega))
            stable = [is_stable(closed_loop(one, trial)) for one in models[:20]]
            kept = float(np.quantile(found, 1.0 - CONFIDENCE)) if all(stable) else 0.0
            if kept > reached:
                robust, effort, reached = trial, DEARER**power, kept
            if reached >= aim.disk_margin:
                break
        else:
            notes.append(
                f"no weight of the voltages reaches a disk margin of {aim.disk_margin:g}; the best has {reached:.2f}"
            )
        names = ("K", "K_z", "L", "N")
        rigid = linear_system(plant._replace(arm_bending_elevation=0.0), point)
        continuous = dict(zip(names, gains(rigid, aim, other, kind == "lqi"), strict=False))
    progress("judging the nominal design", 0.7)
    first = judge(plant, model, models, responses, nominal, other, aim.period)
    second = first
    if robust != nominal:
        progress("judging the robust design", 0.85)
        second = judge(plant, model, models, responses, robust, other, aim.period, effort)
    return ControllerDesign(kind, ("elevation", other), model, first, second, len(models), continuous, tuple(notes))


def _point(plant: PlantParameters, other: str, elevation: float, pitch: float) -> OperatingPoint:
    return hover(plant, elevation) if other == "travel" else operating_point(plant, pitch, elevation)


def judge(
    plant: PlantParameters,
    model: LinearModel,
    models: Sequence[LinearModel],
    responses: NDArray[Any],
    settings: Settings,
    other: str,
    period: float,
    effort: float = 1.0,
) -> Judged:
    """Judge a controller around the plant and around every drawn one; ``responses`` are theirs, the plant's first.

    Raises
    ------
    ConfigurationError
        The loop with the plant itself is unstable.
    """
    omega, closed = frequencies(period), closed_loop(model, settings)
    if not is_stable(closed):
        raise ConfigurationError(
            "the designed loop is unstable on the identified plant, with its delay and bending; lower the weights of "
            "the angles, or sample faster."
        )
    found = margins_over(responses, settings, period, omega)
    disks = disk_margins(responses, controller_response(settings, period, omega))
    loops = [closed, *(closed_loop(one, settings) for one in models)]
    stable = np.array([is_stable(loop) for loop in loops[1:]])
    disks[1:][~stable] = 0.0
    count, axes = round(LONGEST / period), ("elevation", other)
    times, band = [], {}
    for axis in axes:
        index = AXES.index(axis)
        with np.errstate(over="ignore", invalid="ignore"):
            paths = [unit_step(loop, index, count)[:, index] for loop in loops]
        times.append([settling_time(path, period) for path in paths])
        band[axis] = np.quantile(np.array(paths)[1:, : round(SHOWN[axis] / period)], (0.025, 0.975), axis=0)
    # larger is better in every column: margins of both loops, the disk margin, settling of both axes
    rows = np.array([[x for loop in found for x in astuple(found[loop][k])] for k in range(1, len(loops))])
    better = np.tile((1.0, -1.0, 1.0, -1.0, 1.0), len(found))
    kept = kept_together(np.column_stack((rows * better, disks[1:], *(-np.array(own[1:]) for own in times))))
    promised = [Margins(*own.tolist()) for own in np.split(kept[: len(better)] * better, len(found))]
    return Judged(
        settings, {loop: own[0] for loop, own in found.items()}, dict(zip(found, promised, strict=True)),
        float(disks[0]), float(kept[len(better)]), {axis: own[0] for axis, own in zip(axes, times, strict=True)},
        dict(zip(axes, (-kept[len(better) + 1 :]).tolist(), strict=True)),
        {axis: max(own) for axis, own in zip(axes, times, strict=True)},
        float(np.mean(stable)), _poles(closed, period), disks[1:],
        tuple(step_response(plant, model.point, settings, axis, 0.1, SHOWN[axis], period) for axis in axes), band,
        effort,
    )  # fmt: skip


def kept_together(figures: Array) -> Array:
    """Return what :data:`CONFIDENCE` of the plants keep of all figures at once.

    Plants are ranked in every figure; those whose worst rank is lowest are left out, and the least that the others have
    is kept by all of them.

    Parameters
    ----------
    figures : Array, shape (M, J)
        Of M plants; larger is better.

    Returns
    -------
    Array, shape (J,)

    Source: J. Besag et al., Statistical Science 10 (1995) 3, section 6.3 (simultaneous credible regions from ranks).
    """
    known = np.where(np.isnan(figures), -np.inf, figures)
    ranks = np.array([np.searchsorted(np.sort(column), column, side="right") for column in known.T]).min(0)
    few = len(known) - ceil(CONFIDENCE * len(known))
    return np.asarray(known[np.argsort(ranks, kind="stable")[few:]].min(0))


def _poles(closed: control.StateSpace, period: float) -> NDArray[Any]:
    """Poles [1/s] of a sampled loop, without those of shift registers and of what nothing moves."""
    z = np.linalg.eigvals(closed.A).astype(complex)
    z = z[np.abs(z) > 1e-3]
    s = np.log(z) / period
    return s[np.abs(s) > 1e-6]
