"""A scenario of the wiring table as one .ssp file: structure, units, parameter sets."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from heli_identifier.files import write_atomically

from ..builder import build, unit_class
from ..errors import WiringError
from ..master.order import parameters_by_unit
from ..packaging.archive import zip_bytes
from ..packaging.model_description import xml_text
from ..variables import Value
from ..wiring import Scenario, scenario
from .parameter_set import parameter_set
from .system import system_structure

PARAMETERS = "parameters"
"""Name of every unit's parameter set in an .ssp: Ecos applies, on demand, all sets of one name."""


def write_ssp(
    scenario_name: str | Scenario,
    path: str | Path,
    parameters: Mapping[str, Value] | None = None,
    fmus: Mapping[str, str | Path] | None = None,
    duration: float = 90.0,
) -> Path:
    """Write a scenario as a flat .ssp, all or nothing; the same arguments give the same bytes.

    Parameters
    ----------
    scenario_name : str or Scenario
        A key of :data:`fmu_src.wiring.SCENARIOS`, or a scenario of one's own.
    path : path
        The .ssp file.
    parameters : mapping, optional
        By unit and parameter, as for :func:`fmu_src.master.run`.
    fmus : mapping, optional
        FMU file by unit name; those that are not given are built afresh.
    duration : float
        Stop time of the default experiment [s].

    Raises
    ------
    WiringError, BuildError
        An unknown scenario, unit or parameter, a value out of range.
    """
    wiring = scenario(scenario_name) if isinstance(scenario_name, str) else scenario_name
    given = parameters_by_unit(wiring, parameters or {})
    files = dict(fmus or {})
    for name in files:
        if name not in given:
            raise WiringError(f"an FMU is given for {name!r}; scenario {wiring.name} has {', '.join(given)}")
    entries = {"SystemStructure.ssd": xml_text(system_structure(wiring, duration))}
    with TemporaryDirectory(prefix="heli-units-") as fresh:
        for name, kind in wiring.units:
            file = Path(files[name]) if name in files else build(kind, fresh)
            entries[f"resources/{name}.fmu"] = file.read_bytes()
            entries[f"resources/{name}.ssv"] = parameter_set(unit_class(kind), PARAMETERS, given[name])
    return write_atomically(Path(path), zip_bytes(entries))
