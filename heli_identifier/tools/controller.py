"""Controllers for an identified plant.

:func:`design_controller` makes two designs of a kind (:mod:`.synthesis`), judged over plants that the data allow
(:mod:`.judging`). The nominal design follows the weights. The robust design raises the weight R of the voltages by
factors of :data:`WEIGHT_FACTOR` until 95 % of the drawn plants keep the required disk margin. A PID is retuned for
:data:`ROBUST` of the plants and compared with the present one; it is refused if its sensitivity peaks too high.
"""

from math import isfinite
from typing import Literal

import numpy as np

from heli_identifier.errors import refuse
from heli_identifier.records import ControllerConfiguration
from heli_identifier.results import EXPERIMENTS, GAIN_OF, ParameterSet, Use
from heli_identifier.tools import margins
from heli_identifier.tools.judging import CONFIDENCE, LONGEST, Design, judge_controller
from heli_identifier.tools.linearisation import PERIOD
from heli_identifier.tools.loop import Settings
from heli_identifier.tools.margins import LOOPS
from heli_identifier.tools.plants import Plants, allowed_plants, wrong_signs
from heli_identifier.tools.synthesis import PEAK, design_feedback, retune_pid
from heli_identifier.tracing import Progress
from heli_plant.control import PidSettings
from heli_plant.state_feedback import FeedbackSettings

Kind = Literal["pid", "lqr", "lqi"]
SecondAngle = Literal["pitch", "travel"]  # that is controlled in addition to the elevation
DRAWS, SEARCHED = 1000, 200  # drawn plants with which a design is judged, and with which a robust one is searched
ROBUST = 30  # drawn plants for which a PID is retuned
WEIGHT_FACTOR, MOST_FACTORS = 1.5, 24  # factor by which the weight of the voltages is raised, and how often at most


def design_controller(
    parameters: ParameterSet,
    kind: Kind = "lqi",
    other: SecondAngle = "pitch",
    elevation: float = 0.0,
    pitch: float = 0.0,
    aim: ControllerConfiguration | None = None,
    draws: int = DRAWS,
    progress: Progress = lambda what, share: None,
) -> Design:
    """Design a nominal and a robust controller at an elevation [rad] and, if the pitch is controlled, a pitch [rad].

    ``other`` is the second controlled angle. ``aim`` has the period, the weights and the required disk margin. The
    designs are judged over ``draws`` plants.

    ConfigurationError if the diagnosis does not call an axis fit for control, there is no equilibrium within the
    motors' voltages, the design is unstable, or the period is too long.
    """
    aim, with_travel, axes = aim or ControllerConfiguration(), other == "travel", ("elevation", other)
    refuse(
        with_travel and pitch != 0.0,
        f"a pitch of {pitch:g} rad cannot be held while the travel is controlled; leave it out, or control the pitch "
        "in place of the travel.",
    )
    used = (*LOOPS, *(("travel",) if with_travel else ()))
    unfit = [axis for axis in used if axis in parameters.axes_for(Use.NOTHING, Use.PREDICTION)]
    flights = " ".join(f"For the {axis}: {EXPERIMENTS[GAIN_OF[axis]]}" for axis in unfit)
    what = f"the {' and the '.join(unfit)} of these parameters"
    refuse(bool(unfit), f"the diagnosis does not call {what} fit for control. {flights}")
    plants = allowed_plants(parameters, None if with_travel else pitch, elevation, aim.period, draws, progress)
    model, notes = plants.model, [*plants.notes]
    progress("designing", 0.6)
    if kind == "pid":
        remedy = ", ".join(wrong_signs(parameters)) or "take --kind lqi"
        present = (aim.pid or PidSettings(voltage_limit=model.plant.v_max))._replace(travel_enabled=with_travel)
        retuned = retune_pid(model, present, plants.drawn[:ROBUST])
        settings: dict[str, Settings] = {"present": present, "retuned": retuned}
        if aim.period != PERIOD:
            notes.append(f"the PID is designed for steps of {aim.period:g} s: fly it with --step {aim.period:g}")
        if aim.pid is None:
            notes.append("no [controller.pid] of heli.toml is known: the present PID has default gains of the units")
    else:
        remedy = "lower the weights of the angles, or sample faster"
        nominal = design_feedback(model, aim, other, kind == "lqi")
        robust, reached = _find_robust(plants, nominal, aim, other, kind == "lqi")
        settings = {"nominal": nominal, "robust": robust}
        if reached < aim.disk_margin:
            notes.append(
                f"no weight of the voltages reaches a disk margin of {aim.disk_margin:g}; the best has {reached:.2f}"
            )
    progress("judging", 0.8)
    judged = {own: judge_controller(plants, own, axes) for own in dict.fromkeys(settings.values())}
    controllers = {name: judged[own] for name, own in settings.items()}
    first, delivered = controllers.items()
    unstable = "the designed loop is unstable on the identified plant, with its delay and bending"
    refuse(not delivered[1].is_stable, f"{unstable}; {remedy}.")
    figures = delivered[1].figures
    for axis in LOOPS if kind == "pid" else ():  # the bound of the search is soft
        peak = figures[f"{axis}.sensitivity"].value
        most = f"at most {PEAK:g} was asked for"
        refuse(peak > 1.05 * PEAK, f"the sensitivity of the retuned {axis} loop peaks at {peak:.2f}, {most}; {remedy}.")
    if not first[1].is_stable:
        notes.append(f"the loop is not stable with the {first[0]} controller, so its margins and steps mean nothing")
    for axis in axes:
        if not isfinite(figures[f"{axis}.settling"].promised):
            advice = "--kind lqi takes away what an LQR leaves; a higher --elevation moves the travel more"
            notes.append(f"not all of the plants settle on the {axis} within {LONGEST:g} s: {advice}")
    return Design(kind, axes, plants, controllers, tuple(notes))


def _find_robust(
    plants: Plants, nominal: FeedbackSettings, aim: ControllerConfiguration, other: str, integral: bool
) -> tuple[FeedbackSettings, float]:
    """Return the first design with which 95 % of the plants keep the disk margin, or else the best, and this margin."""
    best, reached = nominal, 0.0
    for power in range(MOST_FACTORS):
        trial = design_feedback(plants.model, aim, other, integral, WEIGHT_FACTOR**power)
        # the design does not know the arm's bending and counts the delay in whole periods
        loops = (margins.close_loop(model, trial) for model in (plants.model, *plants.drawn[:SEARCHED]))
        is_stable, *drawn_stable = map(margins.is_stable, loops)
        response = margins.controller_response(trial, aim.period, plants.omega)
        # the response of an unstable loop looks as if it had a margin
        disks = np.where(drawn_stable, margins.disk_margins(plants.responses[1 : SEARCHED + 1], response), 0.0)
        margin = float(np.quantile(disks, 1.0 - CONFIDENCE))
        if is_stable and margin > reached:
            best, reached = trial, margin
        if reached >= aim.disk_margin:
            break
    return best, reached
