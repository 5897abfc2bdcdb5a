"""Controllers for an identified plant.

:func:`design_controller` makes two designs of a kind (:mod:`.synthesis`), judged over all plants that the data allow
(:mod:`.judging`). The nominal one is what the weights say. The robust one makes the voltages dearer, R times
:data:`DEARER` to some power, until 95 % of the drawn plants keep the disk margin that is asked for. A PID is retuned,
nominally for the plant alone, robustly for :data:`ROBUST` plants.

:func:`design_pid` sets the retuned PID beside the present one, with 95 % intervals of margins and linear model.
"""

import io
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import savemat

from heli_identifier.errors import ConfigurationError
from heli_identifier.online import Estimate
from heli_identifier.records import ControllerConfiguration
from heli_identifier.results import PLANT, ParameterSet, plain
from heli_identifier.tools.judging import CONFIDENCE, Figure, Judged, Plants, Progress, allowed_plants, judge
from heli_identifier.tools.linearisation import (
    NOT_LINEAR,
    PERIOD,
    OperatingPoint,
    hover,
    linear_system,
    operating_point,
)
from heli_identifier.tools.loop import (
    CONTROLLER,
    LOOPS,
    Settings,
    closed_loop,
    controller_response,
    disk_margins,
    is_stable,
)
from heli_identifier.tools.synthesis import PEAK, gains, retuned, synthesised
from heli_identifier.tracing import DiagnosisSettings, Use, helicopter
from heli_plant.control import PidSettings
from heli_plant.parameters import BY_FIELD, PARAMETERS, PlantParameters

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

DEARER, DEAREST = 1.5, 24
"""Factor by which the voltages become dearer, and how often at most."""

LEAST_LIFT = 0.3
"""Sum of the thrust voltages [V] below which the travel cannot be controlled: a lean has no lateral force."""

_FLOWN_BY = {"pitch": "k_x", "elevation": "k_z", "travel": "k_y"}


@dataclass(frozen=True, eq=False)
class ControllerDesign:
    """A nominal and a robust controller of one kind."""

    kind: str
    """pid, lqr or lqi."""
    axes: tuple[str, str]
    """Controlled angles: the elevation and travel or pitch."""
    plants: Plants
    """Over which they were judged."""
    nominal: Judged
    robust: Judged
    continuous: dict[str, NDArray[np.float64]]
    """K, K_z, L and N of the same weights in continuous time; empty of a PID."""
    notes: tuple[str, ...]

    def document(self, provenance: Mapping[str, Any]) -> dict[str, Any]:
        """Return the content of design.json; null stands for an infinite value."""
        model = self.plants.model
        return plain(
            {
                "schema": SCHEMA,
                "kind": self.kind,
                "axes": list(self.axes),
                "operating_point": asdict(model.point),
                "period_s": model.sampled.dt,
                "input_delay_s": model.input_delay,
                "plants": len(self.plants.drawn),
                "confidence": CONFIDENCE,
                "nominal": self.nominal.document,
                "robust": self.robust.document,
                "continuous": self.continuous,
                "notes": list(self.notes),
                "provenance": provenance,
            }
        )


@dataclass(frozen=True, eq=False)
class PidDesign:
    """The present PID and the retuned one around a linear model, and what that model leaves out."""

    plants: Plants
    before: Judged
    after: Judged
    notes: tuple[str, ...]

    def matrices(self) -> dict[str, Any]:
        """Return A, B, C, D continuous, F, G sampled every ``period`` [s], names, and 95 % intervals of A and B."""
        model = self.plants.model
        continuous, sampled = linear_system(self.plants.plant, model.point), model.sampled
        drawn = [
            linear_system(plant, own.point)
            for plant, own in zip(self.plants.drawn, self.plants.drawn_models, strict=True)
        ]
        ends: dict[str, Any] = {}
        for name in "AB":
            of_plants = [getattr(one, name) for one in drawn]
            ends[f"{name}_low"], ends[f"{name}_high"] = np.quantile(of_plants, (0.025, 0.975), axis=0)
        return {
            **{key: getattr(continuous, key) for key in "ABCD"},
            "F": sampled.A,
            "G": sampled.B,
            "period": sampled.dt,
            **ends,
            "states": continuous.state_labels,
            "inputs": continuous.input_labels,
            "outputs": continuous.output_labels,
            "operating_point": asdict(model.point),
            "input_delay": model.input_delay,
        }

    def document(self, provenance: Mapping[str, Any]) -> dict[str, Any]:
        """Return the content of linear_model.json; null stands for an infinite value."""
        own = self.matrices()
        return plain(
            {
                "schema": LINEAR_SCHEMA,
                **{key: own[key] for key in ("operating_point", "states", "inputs", "outputs")},
                "input_delay_s": own["input_delay"],
                "continuous": {key: own[key] for key in "ABCD"},
                "intervals": {name: {end: own[f"{name}_{end}"] for end in ("low", "high")} for name in "AB"},
                "sampled": {**{key: own[key] for key in "FGCD"}, "period_s": own["period"]},
                "loops": {"before": self.before.document, "after": self.after.document},
                "notes": self.notes,
                "provenance": provenance,
            }
        )

    def matlab_bytes(self) -> bytes:
        """Return :meth:`matrices` as a MATLAB file."""
        out = io.BytesIO()
        savemat(out, self.matrices())
        return out.getvalue()

    def controller_parameters(self, provenance: Mapping[str, Any]) -> ParameterSet:
        """Return the retuned PID as a parameter set that ``heli build PidController --parameters`` takes."""
        return self.after.parameters(self.plants.model.point, provenance)


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
    progress: Progress = lambda what, share: None,
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
    check_usable(parameters, (*LOOPS, *(("travel",) if other == "travel" else ())), Use.NOTHING, Use.PREDICTION)

    def find(one: PlantParameters) -> OperatingPoint:
        return hover(one, elevation) if other == "travel" else operating_point(one, pitch, elevation)

    plant = parameters.plant()
    point = find(plant)
    lift = point.v_front + point.v_rear
    if other == "travel" and abs(lift) < LEAST_LIFT:
        raise ConfigurationError(
            f"at elevation {elevation:g} rad the rotors hardly lift ({lift:.2g} V together), so a lean does not move "
            "the travel; choose a higher --elevation."
        )
    plants = allowed_plants(parameters, find, aim.period, draws, progress)
    progress("designing", 0.6)
    effort, continuous, notes = 1.0, {}, plants.notes
    nominal: Settings
    robust: Settings
    if kind == "pid":
        present = PidSettings(voltage_limit=plant.v_max, travel_enabled=other == "travel")
        nominal, robust = (retuned(plants.model, present, own, lift) for own in ((), plants.drawn_models[:ROBUST]))
    else:
        integral = kind == "lqi"
        nominal = synthesised(plant, point, aim, other, integral)
        robust, effort, reached = _robust(plants, nominal, aim, other, integral)
        if reached < aim.disk_margin:
            missed = f"no weight of the voltages reaches a disk margin of {aim.disk_margin:g}"
            notes = (*notes, f"{missed}; the best has {reached:.2f}")
        rigid = linear_system(plant._replace(arm_bending_elevation=0.0), point)
        continuous = dict(zip(("K", "K_z", "L", "N"), gains(rigid, aim, other, integral), strict=False))
    axes = ("elevation", other)
    progress("judging the nominal design", 0.7)
    first = judge(plants, nominal, axes)
    if not first.is_stable:
        raise ConfigurationError(
            "the designed loop is unstable on the identified plant, with its delay and bending; lower the weights of "
            "the angles, or sample faster."
        )
    progress("judging the robust design", 0.85)
    second = first if robust == nominal else judge(plants, robust, axes, effort)
    return ControllerDesign(kind, axes, plants, first, second, continuous, notes)


def _robust(
    plants: Plants, nominal: Settings, aim: ControllerConfiguration, other: str, integral: bool
) -> tuple[Settings, float, float]:
    """Return the design with the cheapest voltages of which 95 % of the plants keep the disk margin, or the best.

    With it the factor by which the voltages are dearer, and the disk margin that is kept.
    """
    best, effort, reached = nominal, 1.0, 0.0
    for power in range(DEAREST):
        trial = synthesised(plants.plant, plants.model.point, aim, other, integral, DEARER**power)
        law = controller_response(trial, aim.period, plants.omega)
        stable = all(is_stable(closed_loop(one, trial)) for one in plants.drawn_models[:20])
        found = disk_margins(plants.responses[1 : TRIED + 1], law)
        kept = float(np.quantile(found, 1.0 - CONFIDENCE)) if stable else 0.0
        if kept > reached:
            best, effort, reached = trial, DEARER**power, kept
        if reached >= aim.disk_margin:
            break
    return best, effort, reached


def design_pid(
    parameters: ParameterSet,
    pitch: float = 0.0,
    elevation: float = 0.0,
    settings: PidSettings | None = None,
    draws: int = FEW,
    progress: Progress = lambda what, share: None,
) -> PidDesign:
    """Linearise a plant at a pitch and elevation [rad], find the margins of the present PID there, and retune it.

    Raises
    ------
    ConfigurationError
        There is no equilibrium, of the plant or of any plant that the data allow; the motors have no lag; the diagnosis
        calls an axis of a loop not usable; or the parameters are those of another unit than the plant.
    """
    check_usable(parameters, LOOPS, Use.NOTHING)
    plants = allowed_plants(
        parameters, lambda one: operating_point(one, pitch, elevation), PERIOD, draws, progress
    )
    plant, point = plants.plant, plants.model.point
    present = (settings or PidSettings(voltage_limit=plant.v_max))._replace(travel_enabled=False)
    progress("retuning", 0.6)
    new = retuned(plants.model, present, plants.drawn_models[:ROBUST], point.v_front + point.v_rear)
    progress("margins", 0.8)
    before, after = (judge(plants, pid, LOOPS) for pid in (present, new))
    notes = [
        f"the linear model leaves out {BY_FIELD[field].name}: friction that sticks has no slope at rest"
        for field in NOT_LINEAR
        if getattr(plant, field) != 0.0
    ]
    if plant.input_delay_rotors:
        notes.append(f"an input delay of {plant.input_delay_rotors:.3g} s is in the margins, not in the matrices")
    for axis in LOOPS:
        peak = after.figures[f"{axis}.sensitivity"].value
        if peak > 1.05 * PEAK:  # the bound of the search is soft
            notes.append(
                f"do not fly the retuned {axis} loop: its sensitivity peaks at {peak:.2f}, and at most {PEAK:g} was "
                "asked for; `heli design-controller` has other kinds of controllers"
            )
    return PidDesign(plants, before, after, (*notes, *plants.notes))


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
    """Judge the PID after a change was adopted in flight, and offer retuned gains if it does not keep its margins.

    They are kept where the upper end of the sensitivity's 95 % interval is at most :data:`PEAK`. What the retuned gains
    reach is in the sentence: no gains may keep the margins. Takes some seconds.

    ``standard_errors`` are by structured name; parameters that are not in it keep their value. The operating point is
    in [rad], the present PID by default that of the units. ConfigurationError if there is no equilibrium there.
    """
    values = {
        row.name: Estimate(getattr(parameters, row.field), standard_errors.get(row.name) or None, row.unit)
        for row in PARAMETERS
    }
    made = design_pid(ParameterSet(PLANT, values), pitch, elevation, settings)
    peaks, retuned_peaks = (
        {axis: judged.figures[f"{axis}.sensitivity"] for axis in LOOPS} for judged in (made.before, made.after)
    )
    beyond = [axis for axis in LOOPS if peaks[axis].high > PEAK]
    offered = made.controller_parameters({}) if beyond else None
    sentence = (
        "The PID does not keep its margins with the changed plant: peak of the sensitivity on "
        f"{_stated(peaks, beyond)}, stated are at most {PEAK:g}. Retuned gains are offered, not applied; with them it "
        f"is {_stated(retuned_peaks, LOOPS)}."
        if beyond
        else ""
    )
    document = {
        "sentence": sentence,
        "unit": CONTROLLER,
        "gains": offered.start_values if offered else {},
        "largest_sensitivity": PEAK,
        "sensitivity": {axis: {"value": p.value, "interval": [p.low, p.high]} for axis, p in peaks.items()},
    }
    return Advice(sentence, document, offered)


def _stated(peaks: Mapping[str, Figure], axes: Sequence[str]) -> str:
    """Peaks of axes with their 95 % intervals, as text."""
    own = ((axis, peaks[axis]) for axis in axes)
    return ", ".join(f"{axis} {peak.value:.2f} ({peak.low:.2f} to {peak.high:.2f})" for axis, peak in own)
