"""Building units: the rules of FMI, content, parameters, determinism; the wiring table, its delays, its SSP files."""

import ast
import math
import re
import sys
from datetime import datetime
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.ssp.ssd import find_components, get_connections, read_ssd, read_ssv
from fmpy.validation import validate_fmu

from fmu_src import SCENARIOS, UNITS, BuildError, Scenario, WiringError, build, problem_with, unit_class
from fmu_src.description import base_exponents
from fmu_src.ssp import parameter_set, write_ssp
from fmu_src.variables import parameter
from fmu_src.vendoring import needed_sources
from tests.units import read_archive


def findings(path):
    """Give one sentence for each broken rule of FMI 2.0.4 that ``fmpy validate`` leaves out; numbers are sections."""
    files = read_archive(path)
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
    check(listed >= {"logStatusWarning", "logStatusDiscard", "logStatusError", "logAll"}, f"2.2.4: categories {listed}")
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
            check(all(map(math.isfinite, number.values())), f"2.2.7: {name} has a bound or start that is not finite")
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


@pytest.mark.parametrize("unit", UNITS)
def test_a_unit_breaks_no_rule_is_built_to_the_same_bytes_and_imports_only_itself_and_the_standard_library(
    fmus, unit, tmp_path
):
    assert validate_fmu(str(fmus[unit])) == findings(fmus[unit]) == []
    assert build(unit, tmp_path).read_bytes() == fmus[unit].read_bytes()
    files = read_archive(fmus[unit])
    page = files["documentation/index.html"].decode()
    assert "runs on the interpreter of its host" in page
    assert all(variable.name in page for variable in unit_class(unit).variables)
    assert b"Permission is hereby granted" in files["documentation/licenses/pythonfmu.txt"]
    if b'unit="rad"' in files["modelDescription.xml"]:
        assert f'<DisplayUnit name="deg" factor="{math.degrees(1.0)!r}" />'.encode() in files["modelDescription.xml"]
    sources = {name: text.decode() for name, text in files.items() if name.endswith(".py")}
    own = {name.split("/")[1].removesuffix(".py") for name in sources}
    assert all(re.search(r"_[0-9a-f]{12}$", name) for name in own)
    for text in sources.values():
        assert "strict=True" not in text  # zip's strict is Python 3.10
        for node in ast.walk(ast.parse(text, feature_version=(3, 9))):
            modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            modules += [node.module] if isinstance(node, ast.ImportFrom) and node.level == 0 else []
            assert {module.split(".")[0] for module in modules} <= own | sys.stdlib_module_names


def test_parameters_become_start_values_of_their_type_and_change_hash_and_guid_and_the_default_step(fmus, tmp_path):
    given = {"effects.dry_friction.pitch": 0.025, "encoder.enabled": 1.0, "encoder.counts_pitch": 2048.0}
    corrected = build("HelicopterPlant", tmp_path, given)
    assert validate_fmu(str(corrected)) == []
    start = {variable.name: variable.start for variable in read_model_description(corrected).modelVariables}
    assert [start[name] for name in given] == ["0.025", "true", "2048"]
    fast = build("StateFeedback", tmp_path, {"sample.time": 0.002})  # takes no longer step
    assert float(read_model_description(fast).defaultExperiment.stepSize) == 0.002
    one, other = read_archive(fmus["HelicopterPlant"]), read_archive(corrected)
    assert one["resources/slavemodule.txt"] != other["resources/slavemodule.txt"]
    assert len({files["modelDescription.xml"].partition(b"guid=")[2][:40] for files in (one, other)}) == 2


DAMPING = parameter("pitch.damping", 0.06, "damping", "1/s", -10.0, 10.0)
COUNTS, ENABLED = parameter("counts", 1, "", None, 0, 9), parameter("enabled", True, "")


@pytest.mark.parametrize(("variable", "value", "said"), [
    *((DAMPING, bad, f"pitch.damping = {bad!r} 1/s must lie in [-10, 10] 1/s") for bad in (math.nan, math.inf, 11)),
    (DAMPING, "much", "pitch.damping = 'much' must be a number in [-10, 10] 1/s"),
    (DAMPING, -10.0, None),
    (COUNTS, 2.5, "counts = 2.5 must be a whole number in [0, 9]"),
    *((COUNTS, good, None) for good in (2.0, np.int64(2))),
    (ENABLED, 0.5, "enabled = 0.5 must be 0 or 1"),
    (ENABLED, 1.0, None),
])  # fmt: skip
def test_a_value_is_good_or_its_problem_names_variable_value_bounds_and_unit(variable, value, said):
    assert problem_with(variable, value) == said


def test_a_build_that_fails_leaves_what_was_there_and_no_part_and_says_why(tmp_path, monkeypatch):
    in_the_way = tmp_path / "Exciter.fmu" / "old"
    in_the_way.mkdir(parents=True)
    with pytest.raises(OSError, match="Exciter.fmu"):
        build("Exciter", tmp_path)
    assert list(tmp_path.rglob("*")) == [tmp_path / "Exciter.fmu", in_the_way]
    with pytest.raises(BuildError, match="imports numpy, which is not in the standard library"):
        needed_sources("fmu_src.master.result")
    with pytest.raises(BuildError, match="has no parameter 'excitation.bas'; did you mean 'excitation.base'"):
        build("Exciter", tmp_path, {"excitation.bas": 1.0})
    with pytest.raises(BuildError, match=r"excitation.base = 99 V must lie in \["):
        build("Exciter", tmp_path, {"excitation.base": 99})
    monkeypatch.setattr("fmu_src.builder.distribution", lambda name: SimpleNamespace(files=()))
    with pytest.raises(BuildError, match="pythonfmu has no binaries"):  # as from its sources
        build("Exciter", tmp_path)


def test_names_of_units_resolve_to_base_units_and_a_text_reads_back_from_xml_as_it_was():
    """V = kg m^2 s^-3 A^-1."""
    assert base_exponents("rad/s^2/V") == {"rad": 1, "s": 1, "kg": -1, "m": -2, "A": 1}
    assert base_exponents("1/(V s)") == {"s": 2, "kg": -1, "m": -2, "A": 1}
    assert base_exponents("N.m.s") == {"kg": 1, "m": 2, "s": -1}
    with pytest.raises(BuildError, match="furlong"):
        base_exponents("furlong/s")
    text = "a<&\"' "
    root = ElementTree.fromstring(parameter_set(unit_class("LogPlayer"), {"log.path": text}))
    assert text in [node.get("value") for node in root.iter()]


@pytest.mark.parametrize("name", SCENARIOS)
def test_connections_join_an_output_to_an_input_of_its_unit_of_measure_and_what_is_not_fed_rests(name):
    """Not fed are the moving mass and those inputs by which a plant follows a rig."""
    wiring = SCENARIOS[name]
    variables = {unit: {v.name: v for v in unit_class(kind).variables} for unit, kind in wiring.units}
    for names in wiring.connections.items():
        target, source = (variables[unit][name] for unit, name in (full.split(".", 1) for full in names))
        assert (source.causality, target.causality, source.unit) == ("output", "input", target.unit)
    for unit, own in variables.items():
        for variable in own.values():
            if variable.causality == "input" and f"{unit}.{variable.name}" not in wiring.connections:
                rests = variable.name == "mass_position" or variable.name.startswith(("measured.", "correction."))
                rests = rests or variable.name.endswith("_reference")  # a second opinion, for those who have them
                assert rests or variable.name in ("observer.bandwidth", "fresh")
                assert variable.start == (1.0 if variable.name in ("fresh", "measured.fresh") else 0.0)
            # no output at the start depends on an input, so that one pass initialises all
            assert {own[name].causality for name in variable.initial_dependencies} <= {"parameter"}


def test_a_wire_to_a_unit_that_is_not_there_is_refused():
    with pytest.raises(WiringError, match="no unit of scenario lost is called 'z'"):
        Scenario("lost", "", (("a", "A"),), {"z.u": "a.x"})


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_file_is_valid_flat_the_same_again_and_holds_wiring_and_parameters(name, fmus, tmp_path):
    wiring, given = SCENARIOS[name], {"plant.pitch.gain": 1.0 / 3.0, "plant.encoder.enabled": True}
    files = {name: fmus[kind] for name, kind in wiring.units if name != "plant"}
    path, by_unit = write_ssp(wiring, tmp_path / "once.ssp", given, files), wiring.parameters_by_unit(given)
    assert write_ssp(wiring, tmp_path / "again.ssp", given, files).read_bytes() == path.read_bytes()
    system = read_ssd(str(path), validate=True).system
    assert [component.name for component in find_components(system)] == [name for name, _ in wiring.units]
    wires = {f"{b.parent.name}.{b.name}": f"{a.parent.name}.{a.name}" for a, b in get_connections(system)}
    assert wires == wiring.connections
    held = {}
    for name, kind in wiring.units:
        parameters = read_ssv(str(path), f"resources/{name}.ssv", validate=True).parameters
        expected = [v.name for v in unit_class(kind).variables if v.causality == "parameter"]
        if name in files:  # an FMU that is given keeps its own start values
            expected = [parameter for parameter in expected if parameter in by_unit[name]]
        assert [parameter.name for parameter in parameters] == expected
        held |= {f"{name}.{parameter.name}": parameter.value for parameter in parameters}
    for name, value in {**dict(wiring.parameters), **given}.items():
        assert held[name] == (repr(value).lower() if isinstance(value, bool) else str(value))
    assert system.connectors == [] and not any(hasattr(element, "elements") for element in system.elements)
    for component in find_components(system):
        for connector in component.connectors:  # every listed input is fed
            assert connector.kind == "output" or f"{component.name}.{connector.name}" in wires
