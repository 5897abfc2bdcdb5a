"""Controllers for an identified plant.

:func:`design_controller` makes two designs of a kind (:mod:`.synthesis`), judged over all plants that the data allow
(:mod:`.judging`). The nominal one is what the weights say. The robust one makes the voltages dearer, R times
:data:`DEARER` to some power, until 95 % of the drawn plants keep the disk margin that is asked for. A PID is retuned
for :data:`ROBUST` of the plants and stands beside the present one, in :func:`design_pid` with what is to be said of it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isfinite
from typing import Any

import numpy as np

from heli_identifier.errors import ConfigurationError, refuse
from heli_identifier.online import Estimate
from heli_identifier.records import ControllerConfiguration
from heli_identifier.results import GAIN_OF, PLANT, ParameterSet, Use, plant_values, to_plain
from heli_identifier.tools import margins
from heli_identifier.tools.judging import CONFIDENCE, LONGEST, Design, judge_controller
from heli_identifier.tools.linearisation import NOT_LINEAR
from heli_identifier.tools.loop import CONTROLLER, controller_parameters
from heli_identifier.tools.margins import LOOPS, Plants, allowed_plants
from heli_identifier.tools.synthesis import PEAK, design_feedback, retune_pid
from heli_identifier.tracing import Progress, Rig, sign_notes
from heli_plant.control import PidSettings
from heli_plant.parameters import BY_FIELD, BY_NAME, PlantParameters
from heli_plant.state_feedback import FeedbackSettings

KINDS = ("lqi", "lqr", "pid")
OTHERS = ("pitch", "travel")  # angles that are controlled beside the elevation
DRAWS, TRIED = 1000, 200  # drawn plants over which a design is judged, and those over which a robust one is searched
FEW, ROBUST = 60, 30  # the same of a retuned PID: the ends of a 95 % interval are then known to a tenth of its width
DEARER, DEAREST = 1.5, 24  # factor by which the voltages become dearer, and how often at most

LEAST_LIFT = 0.3
"""Sum of the thrust voltages [V] below which the travel cannot be controlled: a lean has no lateral force."""


def _check_usable(parameters: ParameterSet, axes: Sequence[str], *unfit_for: Use) -> None:
    """Refuse a plant of whose axes the diagnosis says one of these uses, and say what to fly."""
    if unfit := [axis for axis in axes if axis in parameters.axes_for(*unfit_for)]:
        flights = " ".join(f"For the {axis}: {Rig.experiments[GAIN_OF[axis]]}" for axis in unfit)
        raise ConfigurationError(
            f"the diagnosis does not call the {' and the '.join(unfit)} of these parameters fit for control. {flights}"
        )


def _wrong_signs(parameters: ParameterSet) -> tuple[str, ...]:
    """Say which gains have a sign that no rig has."""
    return sign_notes({gain: parameters.values[f"{axis}.gain"] for axis, gain in GAIN_OF.items()})


def design_controller(
    parameters: ParameterSet,
    kind: str = "lqi",
    other: str = "pitch",
    elevation: float = 0.0,
    pitch: float = 0.0,
    aim: ControllerConfiguration | None = None,
    draws: int = DRAWS,
    progress: Progress = lambda what, share: None,
) -> Design:
    """Design a nominal and a robust controller at an elevation [rad] and, if that is controlled, a pitch [rad].

    ``kind`` is one of :data:`KINDS`, ``other`` the angle that is controlled beside the elevation: travel or pitch.
    ``aim`` has period, weights, and the margin that is asked for. The designs are judged over ``draws`` plants.

    ConfigurationError if the diagnosis does not call an axis fit for control, there is no equilibrium within the
    motors' voltages, the design is unstable, or the period too long.
    """
    aim, travels, axes = aim or ControllerConfiguration(), other == "travel", ("elevation", other)
    known = kind in KINDS and other in OTHERS
    refuse(not known, f"{kind} of {other} is not designed; choose of {', '.join(KINDS)}, of pitch or travel.")
    refuse(
        travels and pitch != 0.0,
        f"a pitch of {pitch:g} rad cannot be held while the travel is controlled; leave it out, or control the pitch "
        "in place of the travel.",
    )
    _check_usable(parameters, (*LOOPS, *(("travel",) if travels else ())), Use.NOTHING, Use.PREDICTION)
    plants = allowed_plants(parameters, None if travels else pitch, elevation, aim.period, draws, progress)
    model, notes = plants.model, [*_wrong_signs(parameters), *plants.notes]
    refuse(
        travels and abs(model.point.lift) < LEAST_LIFT,
        f"at elevation {elevation:g} rad the rotors hardly lift ({model.point.lift:.2g} V together), so a lean does "
        "not move the travel; choose a higher --elevation.",
    )
    progress("designing", 0.6)
    if kind == "pid":
        made = _retune_pid(plants, aim.pid, travels, axes, progress)
    else:
        nominal, continuous = (design_feedback(model, aim, other, kind == "lqi", 1.0, held) for held in (True, False))
        robust, reached = _find_robust(plants, nominal, aim, other, kind == "lqi")
        if reached < aim.disk_margin:
            missed = f"no weight of the voltages reaches a disk margin of {aim.disk_margin:g}"
            notes.append(f"{missed}; the best has {reached:.2f}")
        progress("judging", 0.8)
        first = judge_controller(plants, nominal, axes)
        second = first if robust == nominal else judge_controller(plants, robust, axes)
        made = Design(kind, axes, plants, first, second, robust, (), continuous)
    checked, remedy = made.baseline, "lower the weights of the angles, or sample faster"
    if kind == "pid":
        checked, remedy = made.robust, ", ".join(_wrong_signs(parameters)) or "take --kind lqi"
    said = "the designed loop is unstable on the identified plant, with its delay and bending"
    refuse(not checked.is_stable, f"{said}; {remedy}.")
    for axis in axes:
        if not isfinite(made.robust.figures[f"{axis}.settling"].promised):
            why = "; a higher --elevation gives the rotors more lift, so that a lean moves it more"
            why = why if axis == "travel" else "; --kind lqi takes away what an LQR leaves" if kind == "lqr" else ""
            notes.append(f"not all of the plants settle on the {axis} within {LONGEST:g} s{why}")
    return replace(made, notes=(*notes, *made.notes))


def _retune_pid(
    plants: Plants, given: PidSettings | None, travels: bool, axes: tuple[str, ...], progress: Progress
) -> Design:
    """Retune a PID for the estimated plant and some of the drawn ones, and judge it beside the present one.

    That is by default the one of the units. The notes say what of it is not to be flown.
    """
    present = (given or PidSettings(voltage_limit=plants.model.plant.v_max))._replace(travel_enabled=travels)
    new = retune_pid(plants.model, present, plants.drawn[:ROBUST])
    progress("judging", 0.8)
    before, after = (judge_controller(plants, pid, axes) for pid in (present, new))
    peaks = {axis: after.figures[f"{axis}.sensitivity"].value for axis in LOOPS}
    refused = {axis: peak for axis, peak in peaks.items() if peak > 1.05 * PEAK}  # the bound of the search is soft
    kept = "controller.json keeps the present gains"
    others = "`heli design-controller` has other kinds of controllers"
    notes = [
        f"do not fly the retuned {axis} loop: its sensitivity peaks at {peak:.2f}, and at most {PEAK:g} was asked for. "
        f"{kept} of the {axis}; {others}"
        for axis, peak in refused.items()
    ]
    if not after.is_stable:
        notes = [f"do not fly the retuned PID: the loop is not stable with it. {kept}; {others}"]
    if given is None:
        notes.append("no [controller.pid] of heli.toml is known: the present PID has the default gains of the units")
    if not before.is_stable:
        notes.append("the loop is not stable with the present PID, so its margins and steps mean nothing")
    present_gains: dict[str, Any] = {axis: getattr(present, axis) for axis in refused}
    return Design("pid", axes, plants, before, after, new._replace(**present_gains), tuple(notes))


def _find_robust(
    plants: Plants, nominal: FeedbackSettings, aim: ControllerConfiguration, other: str, integral: bool
) -> tuple[FeedbackSettings, float]:
    """Return the design with the cheapest voltages of which 95 % of the plants keep the disk margin, or the best.

    With it the disk margin that is kept. Designs that are unstable on the identified plant are passed over.
    """
    best, reached = nominal, 0.0
    for power in range(DEAREST):
        trial = design_feedback(plants.model, aim, other, integral, DEARER**power)
        # the design knows neither the arm's bending nor what of the delay is no whole period
        loops = (margins.close_loop(one, trial) for one in (plants.model, *plants.drawn[:TRIED]))
        identified, *drawn = map(margins.is_stable, loops)
        law = margins.controller_response(trial, aim.period, plants.omega)
        # the response of a loop that is not stable looks as if it had a margin
        disks = np.where(drawn, margins.disk_margins(plants.responses[1 : TRIED + 1], law), 0.0)
        kept = float(np.quantile(disks, 1.0 - CONFIDENCE))
        if identified and kept > reached:
            best, reached = trial, kept
        if reached >= aim.disk_margin:
            break
    return best, reached


def design_pid(
    parameters: ParameterSet,
    pitch: float = 0.0,
    elevation: float = 0.0,
    aim: ControllerConfiguration | None = None,
    draws: int = FEW,
    progress: Progress = lambda what, share: None,
) -> Design:
    """Linearise a plant at a pitch and elevation [rad], find the margins of the present PID there, and retune it.

    ``aim`` has the PID, by default that of the units, and the period at which it is called.

    ConfigurationError if there is no equilibrium, of the plant or of any plant that the data allow; the motors have no
    lag; the diagnosis calls an axis of a loop not usable; or the parameters are those of another unit than the plant.
    """
    _check_usable(parameters, LOOPS, Use.NOTHING)
    aim = aim or ControllerConfiguration()
    plants = allowed_plants(parameters, pitch, elevation, aim.period, draws, progress)
    plant = plants.model.plant
    progress("retuning", 0.6)
    made = _retune_pid(plants, aim.pid, False, LOOPS, progress)
    notes = [
        f"the linear model leaves out {BY_FIELD[field].name}: friction that sticks has no slope at rest"
        for field in NOT_LINEAR
        if getattr(plant, field) != 0.0
    ]
    if plant.input_delay_rotors:
        notes.append(f"an input delay of {plant.input_delay_rotors:.3g} s is in the margins, not in the matrices")
    return replace(made, notes=(*_wrong_signs(parameters), *notes, *plants.notes, *made.notes))


def control_advice(
    parameters: PlantParameters,
    standard_errors: Mapping[str, float],
    elevation: float = 0.0,
    aim: ControllerConfiguration | None = None,
) -> tuple[dict[str, Any], ParameterSet | None]:
    """Judge the PID after a change was adopted in flight, and offer retuned gains if it does not keep its margins.

    They are kept where the upper end of the sensitivity's 95 % interval is at most :data:`PEAK`; the ``sentence`` of
    the document is then empty, and there are no gains. What the retuned gains reach is in the sentence: no gains may
    keep the margins. Takes some seconds.

    ``standard_errors`` are by structured name; parameters that are not in it keep their value. The elevation of the
    operating point is in [rad], ``aim`` as in :func:`design_pid`. ConfigurationError if there is no equilibrium.
    """
    errors = {BY_NAME[name].field: Estimate(0.0, error or None, "1") for name, error in standard_errors.items()}
    made = design_pid(ParameterSet(PLANT, plant_values(parameters, errors)), 0.0, elevation, aim)
    peaks, new = ({axis: own.figures[f"{axis}.sensitivity"] for axis in LOOPS} for own in (made.baseline, made.robust))
    beyond = {axis: peak for axis, peak in peaks.items() if peak.interval[1] > PEAK}
    sentence, offered = "", None
    if beyond:
        offered = controller_parameters(made.robust.settings, made.plants.model.point)
        before, after = (
            ", ".join("{} {:.2f} ({:.2f} to {:.2f})".format(axis, own.value, *own.interval) for axis, own in of.items())
            for of in (beyond, new)
        )
        sentence = (
            f"The PID does not keep its margins with the changed plant: peak of the sensitivity on {before}, stated "
            f"are at most {PEAK:g}. Retuned gains are offered, not applied; with them it is {after}."
        )
    document = {
        "sentence": sentence,
        "unit": CONTROLLER,
        "gains": offered.start_values if offered else {},
        "largest_sensitivity": PEAK,
        "sensitivity": peaks,
    }
    return to_plain(document), offered
