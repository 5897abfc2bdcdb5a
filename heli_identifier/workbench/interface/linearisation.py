"""The plant as a linear system, for python-control."""

from typing import TYPE_CHECKING

from heli_identifier.workbench.delivery.parameter_set import ParameterSet
from heli_plant.parameters import PlantParameters

if TYPE_CHECKING:
    import control


def linearise(
    parameters: ParameterSet | PlantParameters,
    elevation: float = 0.0,
    pitch: float = 0.0,
    *,
    period: float | None = None,
) -> "control.StateSpace":
    """Linearise the plant at the equilibrium of an elevation and a pitch.

    States are deviations of pitch, elevation, travel [rad], their rates [rad/s], the lagged voltages nu_front, nu_rear
    [V] and, where the arm bends, its bending [rad] and bending rate [rad/s]. Inputs are v_front and v_rear [V], outputs
    pitch, elevation and travel [rad]. Dry and breakaway friction and an input delay are not in the model.
    :mod:`heli_identifier.workbench.linearise.linear_model` states the equations; `heli linearise` adds intervals,
    margins and a retuned PID.

    Parameters
    ----------
    parameters : ParameterSet or PlantParameters
        As :func:`heli_identifier.read_parameters` gives them.
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
    from heli_identifier.workbench.linearise.linear_model import linearise as linear_system
    from heli_identifier.workbench.linearise.operating_point import operating_point

    plant = parameters.plant() if isinstance(parameters, ParameterSet) else parameters
    return linear_system(plant, operating_point(plant, pitch, elevation), period)
