"""Build a unit into an FMU: ``build("HelicopterPlant", "build")``.

The zip contains the unit's sources under hashed names (:mod:`fmu_src.vendoring`) and pythonfmu's binaries, or a unit in
C (:mod:`fmu_src.native`), the model description with a GUID that depends on the content, the documentation and an icon.
Two builds of the same sources and parameters are the same bytes.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from importlib import import_module
from importlib.metadata import distribution
from pathlib import Path

from heli_identifier.files import write_atomically
from heli_plant.errors import did_you_mean

from .description import describe
from .errors import BuildError, check_mapping, look_up
from .slave_base import SlaveBase
from .variables import TYPES, Value, Variable, problem_with, with_start_values
from .vendoring import content_guid, python_unit

UNITS: dict[str, str] = {
    "HelicopterPlant": "fmu_src.units.helicopter_plant",
    "FollowingPlant": "fmu_src.units.helicopter_plant",
    "AdaptiveIdentifier": "fmu_src.units.adaptive_identifier",
    "PidController": "fmu_src.units.controllers",
    "StateFeedback": "fmu_src.units.controllers",
    "Exciter": "fmu_src.units.exciter",
    "LogPlayer": "fmu_src.units.log_player",
    "RigLink": "fmu_src.units.rig_link",
    "Corrector": "fmu_src.units.corrector",
}
"""Module of each unit."""

EARLIEST = (1980, 1, 1, 0, 0, 0)  # the earliest time of a zip entry


def unit_class(name: str) -> type[SlaveBase]:
    """Return the class of a unit, or raise BuildError if none has this name."""
    return getattr(import_module(look_up(UNITS, name, "unit", BuildError)), name)


def parameters_of(unit: type[SlaveBase]) -> dict[str, Variable]:
    """Return the parameters of a unit by name."""
    return {variable.name: variable for variable in unit.variables if variable.causality == "parameter"}


def check_start_values(unit: type[SlaveBase], parameters: Mapping[str, Value], within: str = "") -> dict[str, Value]:
    """Return ``parameters`` as start values of ``unit``, converted to their types; a number may be given as text.

    BuildError names, with the prefix ``within``, what is no parameter of the unit or out of range.
    """
    check_mapping("parameters", parameters)
    known = parameters_of(unit)
    values: dict[str, Value] = {}
    for name, value in parameters.items():
        if name not in known:
            raise BuildError(f"{unit.__name__} has no parameter {name!r}{did_you_mean(name, tuple(known))}")
        variable = known[name]._replace(name=within + name)
        if variable.type != "String":
            value = number_or_text(value)
        if problem := problem_with(variable, value):
            raise BuildError(problem)
        if isinstance(value, str) and not value.isprintable():
            raise BuildError(f"{variable.name} = {value!r} holds a character that is no text in XML; take it out")
        values[name] = TYPES[variable.type](value)
    return values


def number_or_text(value: Value) -> Value:
    """Return the number that a text stands for, if any: 1_000 is 1000, as in heli.toml; true is 1, false is 0."""
    if not isinstance(value, str):
        return value
    if value.lower() in ("true", "false"):
        return float(value.lower() == "true")
    try:
        return float(value)
    except ValueError:
        return value


def build(
    unit: str,
    directory: str | Path,
    parameters: Mapping[str, Value] | None = None,
    remark: str = "",
    *,
    native: bool = False,
    fmi: int = 2,
    all_platforms: bool = False,
    model_exchange: bool = False,
) -> Path:
    """Build a unit into ``directory/<unit>.fmu``.

    Parameters
    ----------
    unit : str
        A key of :data:`UNITS`.
    directory : path
        Created if it does not exist; the file appears complete or not at all.
    parameters : mapping, optional
        Start values of the unit's parameters by structured name, in the units of the model description; a corrected
        plant is delivered in this way.
    remark : str
        Sentence that follows the unit's summary in the model description.
    native : bool
        Build the unit in C, if it is one of :data:`fmu_src.native.NATIVE_UNITS`; without a compiler the FMU contains
        sources only. The following arguments are for native units.
    fmi : int
        2 or 3.
    all_platforms : bool
        Also compile for macOS and, in FMI 3.0, for ARM; this needs ziglang.
    model_exchange : bool
        Add Model Exchange to co-simulation, with the states and their derivatives as further variables.

    Returns
    -------
    Path
        The FMU. BuildError names an argument that is unknown, out of range or not for this unit, a source that an FMU
        must not contain, or a compiler that fails.
    """
    options = {f"fmi={fmi}": fmi != 2, "all_platforms": all_platforms, "model_exchange": model_exchange}
    for name, given in options.items():
        if given and not native:
            raise BuildError(f"{name} belongs to native units; add native=True")
    if fmi not in (2, 3):
        raise BuildError(f"fmi is {fmi}; native units exist for FMI 2 and 3; give 2 or 3")
    kind = unit_class(unit)
    start_values = check_start_values(kind, parameters or {})
    variables = with_start_values(kind.variables, start_values)
    if native:
        from .native.builder import native_unit  # units in Python do not need the translator

        entries, details = native_unit(kind, variables, fmi, all_platforms, model_exchange)
    else:
        entries = python_unit(kind, start_values) | _pythonfmu_files(unit)
        details = {"variables": variables, "token": content_guid(entries)}
    entries |= describe(kind, remark=remark, **details)
    return write_atomically(Path(directory) / f"{unit}.fmu", zip_bytes(entries))


def build_all(directory: str | Path) -> dict[str, Path]:
    """Build every unit with its default parameters; return the FMUs by unit."""
    return {name: build(name, directory) for name in UNITS}


def _pythonfmu_files(identifier: str) -> dict[str, bytes]:
    """Return pythonfmu's binaries under the model identifier's name, and its licence."""
    entries = {}
    for file in distribution("pythonfmu").files or ():
        if file.match("resources/binaries/*/*") and file.suffix in (".so", ".dll", ".dylib"):
            entries[f"binaries/{file.parent.name}/{identifier}{file.suffix}"] = file.read_binary()
        elif file.name == "LICENSE":
            entries["documentation/licenses/pythonfmu.txt"] = file.read_binary()
    if len(entries) < 2:
        raise BuildError("the installed pythonfmu has no binaries; install its wheel (pip install pythonfmu)")
    return entries


def zip_bytes(entries: Mapping[str, bytes]) -> bytes:
    """Return a zip of ``entries`` in sorted order with one fixed time and mode: equal content, equal bytes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name in sorted(entries):
            info = zipfile.ZipInfo(name, EARLIEST)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = 0o644 << 16
            info.create_system = 3  # the same on every system
            archive.writestr(info, entries[name])  # the highest compression saves 1 % and takes twice as long
    return buffer.getvalue()
