"""Units of co-simulation from Python."""

from collections.abc import Mapping
from os import PathLike
from pathlib import Path

from heli_identifier.errors import ConfigurationError
from heli_identifier.workbench.delivery.parameter_set import ParameterSet


def build(
    unit: str, folder: str | PathLike[str], parameters: ParameterSet | Mapping[str, float | str] | None = None
) -> Path:
    """Build an FMI 2.0 co-simulation unit.

    Parameters
    ----------
    unit : str
        HelicopterPlant, AdaptiveIdentifier, PidController, Exciter or LogPlayer.
    folder : path
        Made if it does not exist. The file appears complete or not at all.
    parameters : ParameterSet or mapping, optional
        Start values by structured name (``pitch.damping``), each in the unit of the model description.

    Returns
    -------
    Path
        ``folder/<unit>.fmu``.

    Raises
    ------
    ConfigurationError
        The parameters are another unit's, or lack some of the plant's.
    BuildError
        There is no such unit, or it does not take a parameter or its value.
    """
    from fmu_src import build as build_unit

    if isinstance(parameters, ParameterSet):
        if parameters.unit != unit:
            raise ConfigurationError(f"these are parameters of the {parameters.unit}, those of the {unit} are needed.")
        parameters.check_complete()
        parameters = parameters.start_values
    return build_unit(unit, Path(folder), parameters)
