"""Scenarios as SSP 1.0 files, for tools other than the master.

An .ssp contains structure, units and their parameter sets. The system is flat and has no connectors itself, because
libcosimpy and Ecos import nothing else. A component lists its outputs and its connected inputs only, because fmpy.ssp
feeds an unconnected listed input from the connector before it. An .ssv contains the parameters of one unit; if its FMU
is given, only those that are set.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.etree.ElementTree import register_namespace

from heli_identifier.files import draft_folder, write_atomically

from .builder import check_start_values, unit_class, zip_bytes
from .description import base_units, render_xml
from .errors import BuildError, is_positive
from .slave_base import SlaveBase
from .variables import Value, with_start_values
from .wiring import Scenario, scenario

for _prefix, _part in {"ssc": "Common", "ssd": "Description", "ssv": "ParameterValues"}.items():
    register_namespace(_prefix, f"http://ssp-standard.org/SSP1/SystemStructure{_part}")


def parameter_set(unit: type[SlaveBase], parameters: Mapping[str, Value], is_complete: bool = True) -> bytes:
    """Return ``<ssv:ParameterSet>`` with these parameters of a unit, if complete also with others at start values."""
    variables = with_start_values(unit.variables, check_start_values(unit, parameters))
    held = [v for v in variables if v.causality == "parameter" and (is_complete or v.name in parameters)]
    return render_xml("ParameterSet.ssv", parameters=held, units=base_units(v.unit for v in held))


def write_ssp(
    scenario_name: str | Scenario,
    path: str | Path,
    parameters: Mapping[str, Value] | None = None,
    fmus: Mapping[str, str | Path] | None = None,
    duration: float = 90.0,
    native: bool = False,
) -> Path:
    """Write a scenario as a flat .ssp, complete or not at all; the same arguments give the same bytes.

    Scenario, parameters, FMUs and ``native`` are those of :func:`fmu_src.master.run`; ``duration`` is the stop time of
    the default experiment [s]. WiringError or BuildError names what is unknown, missing or out of range.
    """
    if not is_positive(duration):
        raise BuildError(f"duration = {duration!r} s must be positive and finite.")
    wiring = scenario(scenario_name)
    by_unit = wiring.parameters_by_unit(parameters or {})
    entries = {"SystemStructure.ssd": system_structure(wiring, duration)}
    for name, kind in wiring.units:
        is_complete = name not in (fmus or {})  # a given FMU keeps its own start values, as those of a corrected plant
        entries[f"resources/{name}.ssv"] = parameter_set(unit_class(kind), by_unit[name], is_complete)
    with draft_folder() as folder:
        for name, file in wiring.unit_files(fmus or {}, folder, native).items():
            entries[f"resources/{name}.fmu"] = file.read_bytes()
    return write_atomically(Path(path), zip_bytes(entries))


def system_structure(scenario: Scenario, duration: float) -> bytes:
    """Return ``<ssd:SystemStructureDescription>``; components take their FMU and .ssv from ``resources/``."""
    components = {
        name: [
            v
            for v in unit_class(kind).variables
            if v.causality == "output" or f"{name}.{v.name}" in scenario.connections
        ]
        for name, kind in scenario.units
    }
    return render_xml(
        "SystemStructure.ssd", scenario=scenario, components=components, duration=repr(duration),
        units=base_units(v.unit for connectors in components.values() for v in connectors),
    )  # fmt: skip
