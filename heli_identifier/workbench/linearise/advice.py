"""Whether the PID keeps its margins after a change was adopted in flight, and the gains that would.

The margins are those of `heli linearise`, over the plants that the standard errors allow. They are kept where the upper
end of the sensitivity's 95 % interval is at most :data:`.retuning.PEAK`. The gains are offered and never applied.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from heli_identifier.online import Estimate
from heli_identifier.workbench.delivery.parameter_set import PLANT, ParameterSet
from heli_identifier.workbench.linearise.design import design
from heli_identifier.workbench.linearise.documents import CONTROLLER, controller_parameters
from heli_identifier.workbench.linearise.margins import LOOPS
from heli_identifier.workbench.linearise.retuning import PEAK
from heli_plant.control import PidSettings
from heli_plant.parameter_table import PARAMETERS
from heli_plant.parameters import PlantParameters


@dataclass(frozen=True)
class Advice:
    """What is to be said about the controller of a changed plant.

    Attributes
    ----------
    sentence : str
        Empty where the margins are kept.
    gains : mapping of str to float
        Parameters of the PidController that would keep them; empty where they are kept.
    sensitivity : mapping of str to (value, low, high)
        Peak of the sensitivity of each loop with the present gains, with its 95 % interval.
    """

    sentence: str
    gains: Mapping[str, float]
    sensitivity: Mapping[str, tuple[float, float, float]]

    @property
    def document(self) -> dict[str, Any]:
        """The same for a JSON file."""
        return {
            "sentence": self.sentence,
            "unit": CONTROLLER,
            "gains": dict(self.gains),
            "largest_sensitivity": PEAK,
            "sensitivity": {
                axis: {"value": value, "interval": [low, high]} for axis, (value, low, high) in self.sensitivity.items()
            },
        }


def control_advice(
    parameters: PlantParameters,
    standard_errors: Mapping[str, float],
    pitch: float = 0.0,
    elevation: float = 0.0,
    settings: PidSettings | None = None,
) -> Advice:
    """Judge the PID around a plant; takes some seconds, most of them for the gains that are offered.

    Parameters
    ----------
    parameters : PlantParameters
    standard_errors : mapping
        By structured name, in the parameter's unit; parameters that are not in it keep their value.
    pitch, elevation : float
        Operating point [rad].
    settings : PidSettings, optional
        The present PID.

    Raises
    ------
    ConfigurationError
        There is no equilibrium at this point.
    """
    values = {
        row.name: Estimate(getattr(parameters, row.field), standard_errors.get(row.name) or None, row.unit)
        for row in PARAMETERS
    }
    made = design(ParameterSet(PLANT, values), pitch, elevation, settings)
    peaks = {
        axis: (
            made.before.margins[axis].sensitivity,
            made.before.low[axis].sensitivity,
            made.before.high[axis].sensitivity,
        )
        for axis in LOOPS
    }
    beyond = [axis for axis in LOOPS if peaks[axis][2] > PEAK]
    if not beyond:
        return Advice("", {}, peaks)
    offered = controller_parameters(made, {}).values
    parts = [f"{axis} {peaks[axis][0]:.2f} ({peaks[axis][1]:.2f} to {peaks[axis][2]:.2f})" for axis in beyond]
    sentence = (
        f"The PID does not keep its margins with the changed plant: peak of the sensitivity on {', '.join(parts)}, "
        f"stated are at most {PEAK:g}. Gains that would keep them are offered, not applied."
    )
    return Advice(sentence, {name: one.value for name, one in offered.items()}, peaks)
