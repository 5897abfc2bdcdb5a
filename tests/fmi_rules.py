"""Rules of FMI 2.0.4 that ``fmpy validate`` leaves out, checked on a built FMU; numbers are the standard's sections."""

import re
from datetime import datetime
from math import isfinite
from xml.etree import ElementTree

from tests.units import entries

CATEGORIES = {"logStatusWarning", "logStatusDiscard", "logStatusError", "logAll"}


def findings(path):
    """Give one sentence for each broken rule."""
    files = entries(path)
    root = ElementTree.fromstring(files["modelDescription.xml"])
    variables = root.findall("ModelVariables/ScalarVariable")
    flags = root.find("CoSimulation").attrib
    found = []

    def check(good, said):
        if not good:
            found.append(said)

    identifier = flags["modelIdentifier"]
    for name in (f"linux64/{identifier}.so", f"win64/{identifier}.dll"):
        check(f"binaries/{name}" in files, f"2.3: there is no binary {name}")
    check("documentation/index.html" in files, "2.3: there is no documentation/index.html")
    check(files.get("model.png", b"").startswith(b"\x89PNG\r\n\x1a\n"), "2.3: there is no model.png")
    check(re.fullmatch(r"\{[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}\}", root.get("guid")), "2.2.1: no GUID")
    datetime.strptime(root.get("generationDateAndTime"), "%Y-%m-%dT%H:%M:%SZ")
    wanted = dict.fromkeys(("needsExecutionTool", "canBeInstantiatedOnlyOncePerProcess"), "false")
    saves = "false" if identifier == "RigLink" else "true"  # what a rig sent cannot be sent again
    wanted |= {"canHandleVariableCommunicationStepSize": "true", "canSerializeFMUstate": saves}
    for name, value in {**wanted, "canGetAndSetFMUstate": saves}.items():
        check(flags.get(name) == value, f"4.3.1: {name} is {flags.get(name)}, not {value}")
    listed = {one.get("name") for one in root.iterfind("LogCategories/Category") if one.get("description")}
    check(listed >= CATEGORIES, f"2.2.4: categories {listed}")
    experiment = root.find("DefaultExperiment")
    start, stop, step = (float(experiment.get(name)) for name in ("startTime", "stopTime", "stepSize"))
    check(start < stop and 0.0 < step <= stop - start, "2.2.5: the default experiment is impossible")

    defined = [unit.get("name") for unit in root.iterfind("UnitDefinitions/Unit")]
    used = {variable[0].get("unit") for variable in variables if variable[0].tag == "Real"}
    check(sorted(defined) == sorted(used), f"2.2.2: units are defined twice, or defined and used differ: {defined}")
    keys = [(variable[0].tag, int(variable.get("valueReference"))) for variable in variables]
    check(len(set(keys)) == len(keys), "2.2.7: two variables of a type share a value reference")
    for variable in variables:
        name, typed = variable.get("name"), variable[0]
        check(variable.get("description"), f"2.2.7: {name} has no description")
        if typed.tag in ("Real", "Integer"):
            number = {key: float(typed.get(key)) for key in ("min", "start", "max", "nominal") if typed.get(key)}
            check(all(map(isfinite, number.values())), f"2.2.7: {name} has a bound or start that is not finite")
            low, high = number.get("min", float("-inf")), number.get("max", float("inf"))
            check(low <= number.get("start", low) <= high, f"2.2.7: {name} starts outside of its range")
            check(number.get("nominal", 1.0) > 0.0, f"2.2.7: {name} has a nominal value that is not positive")
    for section, causalities in {"Outputs": {"input", "local"}, "InitialUnknowns": {"input", "parameter"}}.items():
        unknowns = root.findall(f"ModelStructure/{section}/Unknown")
        places = [int(unknown.get("index")) for unknown in unknowns]
        check(places == sorted(set(places)), f"2.2.8: the entries of {section} are not sorted or repeat")
        for place, unknown in zip(places, unknowns, strict=True):
            known = [int(text) for text in unknown.get("dependencies").split()]
            check(known == sorted(set(known)), f"2.2.8: the dependencies of entry {place} are not sorted or repeat")
            kinds = {variables[k - 1].get("causality") for k in known}
            check(kinds <= causalities, f"2.2.8: entry {place} of {section} depends on {kinds}")
    return found
