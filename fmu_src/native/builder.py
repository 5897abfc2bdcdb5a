"""Build the native twin of a unit: ``build_native("HelicopterPlant", "build")``.

The zip holds the sources, the description by which an importer compiles them, binaries for every platform that a
compiler is at hand for, the model description, the documentation and an icon. Names, causalities and start values are
those of the pythonfmu unit.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from heli_identifier.files import write_atomically

from ..builder import checked_start_values, content_guid, icon, index_html, unit_class, zip_bytes
from ..description import TOOL, model_description, xml_text
from ..variables import Value
from .definitions import DEFINITIONS
from .sources import build_description, compiled_files, exchange_of, native_sources
from .toolchain import binaries

NATIVE_UNITS = tuple(DEFINITIONS)
"""Units that have a native twin; the others run in Python only."""


def build_native(
    unit: str,
    directory: str | Path,
    parameters: Mapping[str, Value] | None = None,
    fmi: int = 2,
    all_platforms: bool = False,
    model_exchange: bool = False,
) -> Path:
    """Build the native twin of a unit into ``directory/<unit>.fmu``.

    Parameters
    ----------
    unit : str
        One of :data:`NATIVE_UNITS`.
    directory : path
        Created if it does not exist; the file appears complete or not at all.
    parameters : mapping, optional
        Start values of the unit's parameters by structured name.
    fmi : int
        2 or 3.
    all_platforms : bool
        Compile for macOS and, in FMI 3.0, for ARM as well; ziglang does.
    model_exchange : bool
        The unit has Model Exchange beside co-simulation, with its states and their derivatives as further variables.

    Returns
    -------
    Path
        The FMU; without any compiler it holds sources only.

    Raises
    ------
    BuildError
        A unit without a native twin or without model exchange, an unknown unit or parameter, a value out of range, or
        a compiler that fails.
    """
    kind = unit_class(unit)
    start_values = checked_start_values(kind, parameters or {})
    exchange = exchange_of(unit) if model_exchange else None
    extra = exchange.variables if exchange else ()
    untold = native_sources(kind, start_values, "", fmi, exchange)
    token = content_guid({name: text.encode() for name, text in untold.items()})  # the same one on every machine
    sources = native_sources(kind, start_values, token, fmi, exchange)
    files = compiled_files(sources)
    built = binaries(sources, unit, fmi, all_platforms)
    entries = {f"sources/{name}": text.encode() for name, text in sources.items()}
    entries["sources/buildDescription.xml"] = build_description(unit, sources)
    entries |= built
    platforms = ", ".join(sorted(path.split("/")[1] for path in built)) or "no platform"
    page = index_html(kind, start_values, "native.html", platforms=platforms, exchange=bool(exchange))
    entries["documentation/index.html"] = page.encode()
    entries["model.png" if fmi == 2 else "terminalsAndIcons/icon.png"] = icon()
    entries["modelDescription.xml"] = xml_text(model_description(kind, start_values, token, fmi, TOOL, files, extra))
    return write_atomically(Path(directory) / f"{unit}.fmu", zip_bytes(entries))
