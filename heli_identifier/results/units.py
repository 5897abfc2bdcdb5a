"""Units of co-simulation from Python."""

from collections.abc import Mapping
from os import PathLike
from pathlib import Path

from heli_identifier.errors import ConfigurationError
from heli_identifier.results.parameters import ParameterSet


def build(
    unit: str,
    folder: str | PathLike[str],
    parameters: ParameterSet | Mapping[str, float | str] | None = None,
    *,
    native: bool = False,
    fmi: int = 2,
    all_platforms: bool = False,
    model_exchange: bool = False,
) -> Path:
    """Build a co-simulation unit.

    Parameters
    ----------
    unit : str
        HelicopterPlant, AdaptiveIdentifier, PidController, Exciter or LogPlayer.
    folder : path
        Made if it does not exist. The file appears complete or not at all.
    parameters : ParameterSet or mapping, optional
        Start values by structured name (``pitch.damping``), each in the unit of the model description.

    native : bool
        In C, which needs no Python on the host, in place of Python.
    fmi : int
        Version of FMI, 2 or 3; a unit in Python is of FMI 2.0.

    all_platforms : bool
        Compile a native unit for macOS and, in FMI 3.0, for ARM as well.
    model_exchange : bool
        A native plant has Model Exchange beside co-simulation.

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
    from fmu_src.native import build_native

    if isinstance(parameters, ParameterSet):
        if parameters.unit != unit:
            raise ConfigurationError(f"these are parameters of the {parameters.unit}, those of the {unit} are needed.")
        parameters.check_complete()
        parameters = parameters.start_values
    if native:
        return build_native(unit, Path(folder), parameters, fmi, all_platforms, model_exchange)
    return build_unit(unit, Path(folder), parameters)
