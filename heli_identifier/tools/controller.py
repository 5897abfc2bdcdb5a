"""Controllers for an identified plant, judged over all plants that the data allow.

:func:`design_controller` makes two designs of a kind (:mod:`.synthesis`). The nominal one is what the weights say. The
robust one makes the voltages dearer, R times :data:`DEARER` to some power, until 95 % of the drawn plants keep the disk
margin that is asked for. What a design promises is what 95 % of the plants keep, all of it at once. A PID is retuned,
nominally for the plant alone, robustly for :data:`ROBUST` plants. The margins are those of the loop with the period
between reading and acting and with the input delay.

:func:`design_pid` sets the retuned PID beside the present one, with 95 % intervals of margins and linear model.
"""

import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, astuple, dataclass
from math import ceil
from typing import Any

import numpy as np
from control import StateSpace
from numpy.typing import NDArray
from scipy.io import savemat

from heli_identifier.errors import ConfigurationError
from heli_identifier.online import Estimate
from heli_identifier.records import ControllerConfiguration
from heli_identifier.results import PLANT, ParameterSet, plain
from heli_identifier.tools.linearisation import (
    NOT_LINEAR,
    PERIOD,
    LinearModel,
    OperatingPoint,
    drawn_models,
    hover,
    linear_model,
    linear_system,
    operating_point,
)
from heli_identifier.tools.loop import (
    CONTROLLER,
    LOOPS,
    Margins,
    Settings,
    StepResponse,
    closed_loop,
    controller_parameters,
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
from heli_identifier.tools.synthesis import PEAK, gains, retuned, synthesised
from heli_identifier.tracing import DiagnosisSettings, Use, helicopter
from heli_plant.control import PidSettings
from heli_plant.effects import AXES
from heli_plant.parameter_table import BY_FIELD, PARAMETERS
from heli_plant.parameters import PlantParameters

Array = NDArray[np.float64]

SCHEMA, LINEAR_SCHEMA = "heli-controller/1", "heli-linear-model/1"
KINDS = ("lqi", "lqr", "pid")
OTHERS = ("pitch", "travel")
"""Angles that are controlled beside the elevation."""

DRAWS, TRIED = 1000, 200
"""Drawn plants over which a design is judged, and those over which a robust one is searched."""

FEW = 60
"""Drawn plants of the retuned PID: the ends of a 95 % interval are then known to a tenth of its width."""

ROBUST = 30
"""Drawn plants for which a retuned PID has to keep its margins."""

CONFIDENCE = 0.95
"""Share of the plants that keep what is promised."""

DEARER, DEAREST = 1.5, 24
"""Factor by which the voltages become dearer, and how often at most."""

LONGEST = 40.0
"""Length [s] of the steps whose settling is judged."""

SHOWN = {"pitch": 12.0, "elevation": 12.0, "travel": 30.0}
"""Length [s] of the steps that are shown."""

LEAST_LIFT = 0.3
"""Sum of the thrust voltages [V] below which the travel cannot be controlled: a lean has no lateral force."""

_FLOWN_BY = {"pitch": "k_x", "elevation": "k_z", "travel": "k_y"}


@dataclass(frozen=True, eq=False)
class Judged:
    """A controller around the plant and around every plant that the data allow.

    Attributes
    ----------
    settings : PidSettings or FeedbackSettings
    margins, low, high, promised : dict of str to Margins
        By loop: of the estimated plant, the ends of the 95 % interval of each figure, and what 95 % of the plants keep
        of all figures at once (:func:`kept_together`).
    disk, promised_disk : float
        Disk margin at both actuators at once.
    settling, promised_settling, worst_settling : dict of str to float
        Time [s] of a linear reference step, by axis; ``promised`` is kept by 95 % of the plants.
    is_stable : bool
        Whether the loop with the estimated plant is.
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
    low: dict[str, Margins]
    high: dict[str, Margins]
    promised: dict[str, Margins]
    disk: float
    promised_disk: float
    settling: dict[str, float]
    promised_settling: dict[str, float]
    worst_settling: dict[str, float]
    is_stable: bool
    stable: float
    poles: NDArray[Any]
    disks: Array
    steps: tuple[StepResponse, ...]
    band: dict[str, Array]
    effort: float = 1.0

    @property
    def document(self) -> dict[str, Any]:
        """What a JSON file holds of it."""
        own, gains = self.settings, {}
        if isinstance(own, PidSettings):
            gains = {"gains": {axis: getattr(own, axis)._asdict() for axis in LOOPS}, "trim_V": own.trim}
        return {
            **gains,
            "effort": self.effort,
            "stable_share": self.stable,
            "disk_margin": {"value": self.disk, "promised": self.promised_disk},
            "margins": {
                name: {
                    key: {
                        "value": value,
                        "interval": [getattr(self.low[name], key), getattr(self.high[name], key)],
                        "promised": getattr(self.promised[name], key),
                    }
                    for key, value in asdict(found).items()
                }
                for name, found in self.margins.items()
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
        return controller_parameters(judged.settings, self.model.point, provenance)


@dataclass(frozen=True, eq=False)
class PidDesign:
    """A linear model and two PIDs around it.

    Attributes
    ----------
    model : LinearModel
    continuous : StateSpace
    intervals : dict of (low, high), shapes (n, n), (n, 2)
        95 % intervals of the continuous matrices A and B, entry by entry.
    before, after : Judged
        With the present PID and with the retuned one.
    notes : tuple of str
        What the linear model leaves out.
    """

    model: LinearModel
    continuous: StateSpace
    intervals: dict[str, Array]
    before: Judged
    after: Judged
    notes: tuple[str, ...]

    def document(self, provenance: Mapping[str, Any]) -> dict[str, Any]:
        """Return the content of linear_model.json; null stands for an infinite value."""
        continuous, sampled = self.continuous, self.model.sampled
        return plain(
            {
                "schema": LINEAR_SCHEMA,
                "operating_point": asdict(self.model.point),
                "states": continuous.state_labels,
                "inputs": continuous.input_labels,
                "outputs": continuous.output_labels,
                "input_delay_s": self.model.input_delay,
                "continuous": {key: getattr(continuous, key) for key in "ABCD"},
                "intervals": {name: {"low": low, "high": high} for name, (low, high) in self.intervals.items()},
                "sampled": {"F": sampled.A, "G": sampled.B, "C": sampled.C, "D": sampled.D, "period_s": sampled.dt},
                "loops": {"before": self.before.document, "after": self.after.document},
                "notes": self.notes,
                "provenance": provenance,
            }
        )

    def matlab_bytes(self) -> bytes:
        """Return a MATLAB file: A, B, C, D continuous, F, G sampled every ``period``, intervals of A and B."""
        continuous, sampled, out = self.continuous, self.model.sampled, io.BytesIO()
        savemat(
            out,
            {
                **{key: getattr(continuous, key) for key in "ABCD"},
                "F": sampled.A, "G": sampled.B, "period": sampled.dt,
                **{f"{name}_low": low for name, (low, _) in self.intervals.items()},
                **{f"{name}_high": high for name, (_, high) in self.intervals.items()},
                "states": continuous.state_labels, "inputs": continuous.input_labels,
                "outputs": continuous.output_labels,
                "operating_point": asdict(self.model.point), "input_delay": self.model.input_delay,
            },
        )  # fmt: skip
        return out.getvalue()

    def controller_parameters(self, provenance: Mapping[str, Any]) -> ParameterSet:
        """Return the retuned PID as a parameter set that ``heli build PidController --parameters`` takes."""
        return controller_parameters(self.after.settings, self.model.point, provenance)


def check_usable(parameters: ParameterSet, axes: Sequence[str], *unfit_for: Use) -> None:
    """Refuse a plant of whose axes the diagnosis says one of these uses, and say what to fly."""
    unfit = [axis for axis in axes if axis in parameters.axes_for(*unfit_for)]
    if unfit:
        fly = helicopter(DiagnosisSettings(), [np.zeros((1, 3))], [np.zeros((1, 2))]).fly
        flights = " ".join(f"For the {axis}: {fly[_FLOWN_BY[axis]]}" for axis in unfit)
        raise ConfigurationError(
            f"the diagnosis does not call the {' and the '.join(unfit)} of these parameters fit for control. {flights}"
        )


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
    check_usable(parameters, axes, Use.NOTHING, Use.PREDICTION)
    plant = parameters.plant()

    def find(one: PlantParameters) -> OperatingPoint:
        return hover(one, elevation) if other == "travel" else operating_point(one, pitch, elevation)

    point = find(plant)
    if other == "travel" and abs(point.v_front + point.v_rear) < LEAST_LIFT:
        raise ConfigurationError(
            f"at elevation {elevation:g} rad the rotors hardly lift ({point.v_front + point.v_rear:.2g} V together), "
            "so a lean does not move the travel; choose a higher --elevation."
        )
    model = linear_model(plant, point, aim.period)
    drawn = drawn_models(parameters, point, find, aim.period, draws, progress)
    plants = Plants(plant, model, [one for _, one in drawn])
    progress("designing", 0.6)
    notes = _fallen(draws, len(drawn))
    continuous: dict[str, Array] = {}
    nominal: Settings
    robust: Settings
    if kind == "pid":
        present = PidSettings(voltage_limit=plant.v_max, travel_enabled=other == "travel")
        trim = point.v_front + point.v_rear
        nominal, effort = retuned(model, present, (), trim), 1.0
        robust = retuned(model, present, plants.drawn[:ROBUST], trim)
    else:
        nominal = synthesised(plant, point, aim, other, kind == "lqi")
        robust, effort, reached = nominal, 1.0, 0.0
        for power in range(DEAREST):
            trial = synthesised(plant, point, aim, other, kind == "lqi", DEARER**power)
            found = disk_margins(plants.responses[1 : TRIED + 1], controller_response(trial, aim.period, plants.omega))
            stable = [is_stable(closed_loop(one, trial)) for one in plants.drawn[:20]]
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
    chosen = ("elevation", other)
    first = judge(plants, nominal, chosen)
    if not first.is_stable:
        raise ConfigurationError(
            "the designed loop is unstable on the identified plant, with its delay and bending; lower the weights of "
            "the angles, or sample faster."
        )
    second = first
    if robust != nominal:
        progress("judging the robust design", 0.85)
        second = judge(plants, robust, chosen, effort)
    return ControllerDesign(kind, chosen, model, first, second, len(drawn), continuous, tuple(notes))


def _fallen(draws: int, left: int) -> list[str]:
    return [f"{draws - left} of {draws} plants that the data allow have no equilibrium there"] if left < draws else []


class Plants:
    """The estimated plant, drawn ones as linear models, and the responses of all, the estimated one's first."""

    def __init__(self, plant: PlantParameters, model: LinearModel, drawn: Sequence[LinearModel]) -> None:
        self.plant, self.model, self.drawn = plant, model, drawn
        self.omega = frequencies(model.sampled.dt)
        self.responses = np.array([plant_response(one, self.omega) for one in (model, *drawn)])


def judge(plants: Plants, settings: Settings, axes: Sequence[str], effort: float = 1.0) -> Judged:
    """Judge a controller of ``axes`` around the estimated plant and around every drawn one."""
    model, period = plants.model, plants.model.sampled.dt
    closed = closed_loop(model, settings)
    found = margins_over(plants.responses, settings, period, plants.omega)
    disks = disk_margins(plants.responses, controller_response(settings, period, plants.omega))
    loops = [closed, *(closed_loop(one, settings) for one in plants.drawn)]
    stable = np.array([is_stable(loop) for loop in loops])
    disks[1:][~stable[1:]] = 0.0
    count = round(LONGEST / period)
    times, band = [], {}
    with np.errstate(over="ignore", invalid="ignore"):
        for axis in axes:
            index = AXES.index(axis)
            paths = [unit_step(loop, index, count)[:, index] for loop in loops]
            times.append([settling_time(path, period) for path in paths])
            band[axis] = np.quantile(np.array(paths)[1:, : round(SHOWN[axis] / period)], (0.025, 0.975), axis=0)
    rows = np.array([[x for loop in found for x in astuple(found[loop][k])] for k in range(1, len(loops))])
    # as they may be infinite, quantiles without interpolation
    low, high = np.quantile(rows, (0.025, 0.975), axis=0, method="nearest")
    # larger is better in every column: margins of both loops, the disk margin, settling of both axes
    better = np.tile((1.0, -1.0, 1.0, -1.0, 1.0), len(found))
    kept = kept_together(np.column_stack((rows * better, disks[1:], *(-np.array(own[1:]) for own in times))))

    def by_loop(figures: Array) -> dict[str, Margins]:
        return {loop: Margins(*own.tolist()) for loop, own in zip(found, np.split(figures, len(found)), strict=True)}

    return Judged(
        settings, {loop: own[0] for loop, own in found.items()}, by_loop(low), by_loop(high),
        by_loop(kept[: len(better)] * better), float(disks[0]), float(kept[len(better)]),
        {axis: own[0] for axis, own in zip(axes, times, strict=True)},
        dict(zip(axes, (-kept[len(better) + 1 :]).tolist(), strict=True)),
        {axis: max(own) for axis, own in zip(axes, times, strict=True)},
        bool(stable[0]), float(np.mean(stable[1:])), _poles(closed, period), disks[1:],
        tuple(step_response(plants.plant, model.point, settings, axis, 0.1, SHOWN[axis], period) for axis in axes),
        band, effort,
    )  # fmt: skip


def kept_together(figures: Array) -> Array:
    """Return what :data:`CONFIDENCE` of M plants keep of all figures (M, J) at once, shape (J,); larger is better.

    Plants are ranked in every figure; those whose worst rank is lowest are left out, and the least that the others have
    is kept by all of them.

    Source: J. Besag et al., Statistical Science 10 (1995) 3, section 6.3 (simultaneous credible regions from ranks).
    """
    known = np.where(np.isnan(figures), -np.inf, figures)
    ranks = np.array([np.searchsorted(np.sort(column), column, side="right") for column in known.T]).min(0)
    few = len(known) - ceil(CONFIDENCE * len(known))
    return np.asarray(known[np.argsort(ranks, kind="stable")[few:]].min(0))


def _poles(closed: StateSpace, period: float) -> NDArray[Any]:
    """Poles [1/s] of a sampled loop, without those of shift registers and of what nothing moves."""
    z = np.linalg.eigvals(closed.A).astype(complex)
    z = z[np.abs(z) > 1e-3]
    s = np.log(z) / period
    return s[np.abs(s) > 1e-6]


def design_pid(
    parameters: ParameterSet,
    pitch: float = 0.0,
    elevation: float = 0.0,
    settings: PidSettings | None = None,
    draws: int = FEW,
    progress: Callable[[str, float], None] = lambda what, share: None,
) -> PidDesign:
    """Linearise a plant at a pitch and elevation [rad], find the margins of the present PID there, and retune it.

    Raises
    ------
    ConfigurationError
        There is no equilibrium, of the plant or of any plant that the data allow; the motors have no lag; the diagnosis
        calls an axis of a loop not usable; or the parameters are those of another unit than the plant.
    """
    check_usable(parameters, LOOPS, Use.NOTHING)
    plant = parameters.plant()
    present = (settings or PidSettings(voltage_limit=plant.v_max))._replace(travel_enabled=False)

    def find(one: PlantParameters) -> OperatingPoint:
        return operating_point(one, pitch, elevation)

    point = find(plant)
    model = linear_model(plant, point)
    drawn = drawn_models(parameters, point, find, PERIOD, draws, progress)
    plants = Plants(plant, model, [one for _, one in drawn])
    progress("retuning", 0.6)
    new = retuned(model, present, plants.drawn[:ROBUST], point.v_front + point.v_rear)
    progress("margins", 0.8)
    before, after = (judge(plants, pid, LOOPS) for pid in (present, new))
    systems = [linear_system(one, own.point) for one, own in drawn]
    ends = {name: np.quantile([getattr(one, name) for one in systems], (0.025, 0.975), axis=0) for name in "AB"}
    notes = (*_left_out(plant), *_fallen(draws, len(drawn)))
    return PidDesign(model, linear_system(plant, point), ends, before, after, notes)


def _left_out(plant: PlantParameters) -> list[str]:
    notes = [
        f"the linear model leaves out {BY_FIELD[field].name}: friction that sticks has no slope at rest"
        for field in NOT_LINEAR
        if getattr(plant, field) != 0.0
    ]
    if plant.input_delay_rotors:
        notes.append(f"an input delay of {plant.input_delay_rotors:.3g} s is in the margins, not in the matrices")
    return notes


@dataclass(frozen=True)
class Advice:
    """What is to be said about the controller of a changed plant.

    The ``sentence`` is empty and there are no ``gains``, parameters of the PidController, where the margins are kept.
    ``document`` holds the same for JSON, and the peak of each loop's sensitivity with the present gains.
    """

    sentence: str
    document: dict[str, Any]
    gains: ParameterSet | None


def control_advice(
    parameters: PlantParameters,
    standard_errors: Mapping[str, float],
    pitch: float = 0.0,
    elevation: float = 0.0,
    settings: PidSettings | None = None,
) -> Advice:
    """Judge the PID after a change was adopted in flight, and offer gains that would keep its margins.

    They are kept where the upper end of the sensitivity's 95 % interval is at most :data:`PEAK`. Takes some seconds.

    ``standard_errors`` are by structured name; parameters that are not in it keep their value. The operating point is
    in [rad], the present PID by default that of the units. ConfigurationError if there is no equilibrium there.
    """
    values = {
        row.name: Estimate(getattr(parameters, row.field), standard_errors.get(row.name) or None, row.unit)
        for row in PARAMETERS
    }
    made = design_pid(ParameterSet(PLANT, values), pitch, elevation, settings)
    now, beyond, peaks = made.before, [], {}
    for axis in LOOPS:
        value, low, high = (one[axis].sensitivity for one in (now.margins, now.low, now.high))
        peaks[axis] = {"value": value, "interval": [low, high]}
        if high > PEAK:
            beyond.append(f"{axis} {value:.2f} ({low:.2f} to {high:.2f})")
    sentence, gains = "", None
    if beyond:
        gains = made.controller_parameters({})
        sentence = (
            "The PID does not keep its margins with the changed plant: peak of the sensitivity on "
            f"{', '.join(beyond)}, stated are at most {PEAK:g}. Gains that would keep them are offered, not applied."
        )
    document = {
        "sentence": sentence,
        "unit": CONTROLLER,
        "gains": gains.start_values if gains else {},
        "largest_sensitivity": PEAK,
        "sensitivity": peaks,
    }
    return Advice(sentence, document, gains)
