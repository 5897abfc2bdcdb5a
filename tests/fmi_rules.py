"""FMI 2.0.4 rules that ``fmpy validate`` leaves out, checked on a built FMU.

Sections are those of the FMI 2.0.4 specification. fmpy checks the XML schema, names, required start values, legal
combinations of causality, variability and initial, and the sets of the ModelStructure; here is the rest of what can
be read off the files.
"""

from __future__ import annotations

import re
import struct
import zipfile
from collections.abc import Callable, Iterator
from datetime import datetime
from math import isfinite
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

PLATFORMS = {"linux64": ".so", "win64": ".dll"}
_DATE = "%Y-%m-%dT%H:%M:%SZ"


class Fmu(NamedTuple):
    """What the rules look at."""

    root: ElementTree.Element
    variables: list[ElementTree.Element]
    files: dict[str, bytes]


def findings(path: str | Path) -> list[str]:
    """Return one sentence per broken rule; an empty list for an FMU without a finding."""
    with zipfile.ZipFile(path) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    root = ElementTree.fromstring(files["modelDescription.xml"])
    fmu = Fmu(root, root.findall("ModelVariables/ScalarVariable"), files)
    return [text for rule in RULES for text in rule(fmu)]


def _reals(fmu: Fmu) -> Iterator[tuple[str, ElementTree.Element]]:
    for variable in fmu.variables:
        real = variable.find("Real")
        if real is not None:
            yield variable.get("name", ""), real


def files_are_in_place(fmu: Fmu) -> Iterator[str]:
    """2.3: the zip's structure; names are relative and use slashes."""
    identifier = fmu.root.find("CoSimulation").get("modelIdentifier", "")  # type: ignore[union-attr]
    for platform, suffix in PLATFORMS.items():
        if f"binaries/{platform}/{identifier}{suffix}" not in fmu.files:
            yield f"2.3: there is no binary {identifier}{suffix} for {platform}"
    if "documentation/index.html" not in fmu.files:
        yield "2.3: there is no documentation/index.html"
    if not fmu.files.get("model.png", b"").startswith(b"\x89PNG\r\n\x1a\n"):
        yield "2.3: there is no model.png, or it is no PNG"
    elif min(struct.unpack(">II", fmu.files["model.png"][16:24])) < 32:
        yield "2.3: model.png is too small for an icon"
    for name in fmu.files:
        if name.startswith("/") or "\\" in name or ".." in name.split("/"):
            yield f"2.3: the entry {name!r} leaves the zip"


def identity_is_usable(fmu: Fmu) -> Iterator[str]:
    """2.2.1, 4.3.1: identifier, GUID and date."""
    identifier = fmu.root.find("CoSimulation").get("modelIdentifier", "")  # type: ignore[union-attr]
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", identifier):
        yield f"4.3.1: the modelIdentifier {identifier!r} is no C identifier"
    if not re.fullmatch(r"\{[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}\}", fmu.root.get("guid", "")):
        yield f"2.2.1: the guid {fmu.root.get('guid')!r} is no GUID"
    try:
        datetime.strptime(fmu.root.get("generationDateAndTime", ""), _DATE)
    except ValueError:
        yield f"2.2.1: generationDateAndTime {fmu.root.get('generationDateAndTime')!r} is no UTC time"


def units_are_defined_and_used(fmu: Fmu) -> Iterator[str]:
    """2.2.2: every unit is defined once, used, and its display units have a factor."""
    defined = [unit.get("name", "") for unit in fmu.root.iterfind("UnitDefinitions/Unit")]
    used = {real.get("unit") for _, real in _reals(fmu)} - {None}
    for name in sorted({name for name in defined if defined.count(name) > 1}):
        yield f"2.2.2: the unit {name!r} is defined twice"
    for name in defined:
        if name not in used:
            yield f"2.2.2: the unit {name!r} is defined but not used"
    for name, real in _reals(fmu):
        if real.get("unit") is None:
            yield f"2.2.2: {name} has no unit"
    for display in fmu.root.iterfind("UnitDefinitions/Unit/DisplayUnit"):
        if float(display.get("factor", "1")) == 0.0:
            yield f"2.2.2: the display unit {display.get('name')!r} has the factor 0"


def references_are_unique(fmu: Fmu) -> Iterator[str]:
    """2.2.7: no two variables of one type share a value reference (they would be aliases)."""
    seen: dict[tuple[str, int], str] = {}
    for variable in fmu.variables:
        reference = int(variable.get("valueReference", "-1"))
        key, name = (variable[0].tag, reference), variable.get("name", "")
        if not 0 <= reference < 2**32:
            yield f"2.2.7: {name} has the value reference {reference}"
        if key in seen:
            yield f"2.2.7: {name} and {seen[key]} share the value reference {reference}"
        seen[key] = name


def values_are_in_range(fmu: Fmu) -> Iterator[str]:
    """2.2.7: min <= start <= max, nominal > 0, all finite, every variable described."""
    for variable in fmu.variables:
        name, typed = variable.get("name", ""), variable[0]
        if not variable.get("description"):
            yield f"2.2.7: {name} has no description"
        if typed.tag not in ("Real", "Integer"):
            continue
        number = {key: float(typed.get(key, "nan")) for key in ("min", "start", "max", "nominal") if typed.get(key)}
        for key, value in number.items():
            if not isfinite(value):
                yield f"2.2.7: {name} has {key} = {value}"
        low, high = number.get("min", float("-inf")), number.get("max", float("inf"))
        if low > high:
            yield f"2.2.7: {name} has min = {low:g} above max = {high:g}"
        if not low <= number.get("start", low) <= high:
            yield f"2.2.7: {name} starts at {number['start']:g}, outside [{low:g}, {high:g}]"
        if number.get("nominal", 1.0) <= 0.0:
            yield f"2.2.7: {name} has nominal = {number['nominal']:g}"


def inputs_have_no_initial(fmu: Fmu) -> Iterator[str]:
    """2.2.7: ``initial`` must not be given for inputs; outputs that are calculated have no start value."""
    for variable in fmu.variables:
        name = variable.get("name", "")
        if variable.get("causality") == "input" and variable.get("initial"):
            yield f"2.2.7: the input {name} has initial = {variable.get('initial')}"
        if variable.get("initial") == "calculated" and variable[0].get("start") is not None:
            yield f"2.2.7: {name} is calculated and has a start value"


def dependencies_point_at_knowns(fmu: Fmu) -> Iterator[str]:
    """2.2.8: dependencies are sorted, without repetition, and name knowns only."""
    knowns = {"Outputs": {"input"}, "InitialUnknowns": {"input", "parameter"}}
    for section, causalities in knowns.items():
        indices = []
        for unknown in fmu.root.iterfind(f"ModelStructure/{section}/Unknown"):
            index = int(unknown.get("index", "0"))
            indices.append(index)
            if unknown.get("dependencies") is None:
                yield f"2.2.8: {section} entry {index} does not say what it depends on"
                continue
            listed = [int(text) for text in unknown.get("dependencies", "").split()]
            if listed != sorted(set(listed)):
                yield f"2.2.8: the dependencies of {section} entry {index} are not sorted or repeat"
            for known in listed:
                causality = fmu.variables[known - 1].get("causality") if 0 < known <= len(fmu.variables) else "nothing"
                if causality not in causalities:
                    yield f"2.2.8: {section} entry {index} depends on entry {known}, which is {causality}"
        if indices != sorted(set(indices)):
            yield f"2.2.8: the entries of {section} are not sorted or repeat"


def experiment_is_possible(fmu: Fmu) -> Iterator[str]:
    """2.2.5: startTime < stopTime and a step that fits between them."""
    experiment = fmu.root.find("DefaultExperiment")
    if experiment is None:
        yield "2.2.5: there is no DefaultExperiment"
        return
    start, stop, step = (float(experiment.get(name, "nan")) for name in ("startTime", "stopTime", "stepSize"))
    if not (start < stop and 0.0 < step <= stop - start):
        yield f"2.2.5: DefaultExperiment {start:g} .. {stop:g} s in steps of {step:g} s"


def log_categories_are_known(fmu: Fmu) -> Iterator[str]:
    """2.2.4: categories are unique and described, the standardised statuses among them."""
    listed = {c.get("name"): c.get("description") for c in fmu.root.iterfind("LogCategories/Category")}
    for name in ("logStatusWarning", "logStatusDiscard", "logStatusError", "logAll"):
        if not listed.get(name):
            yield f"2.2.4: the log category {name} is missing or has no description"


def no_execution_tool_is_needed(fmu: Fmu) -> Iterator[str]:
    """4.3.1: the capability flags that importers refuse or rely on."""
    flags = fmu.root.find("CoSimulation").attrib  # type: ignore[union-attr]
    saves = "false" if flags.get("modelIdentifier") == "RigLink" else "true"  # what a rig sent cannot be sent again
    wanted = {
        "needsExecutionTool": "false",
        "canBeInstantiatedOnlyOncePerProcess": "false",
        "canHandleVariableCommunicationStepSize": "true",
        "canGetAndSetFMUstate": saves,
        "canSerializeFMUstate": saves,
    }
    for name, value in wanted.items():
        if flags.get(name) != value:
            yield f"4.3.1: {name} is {flags.get(name)}, not {value}"


RULES: tuple[Callable[[Fmu], Iterator[str]], ...] = (
    files_are_in_place,
    identity_is_usable,
    units_are_defined_and_used,
    references_are_unique,
    values_are_in_range,
    inputs_have_no_initial,
    dependencies_point_at_knowns,
    experiment_is_possible,
    log_categories_are_known,
    no_execution_tool_is_needed,
)
