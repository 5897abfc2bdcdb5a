"""The rule checks find nothing on any unit, and each of them finds what it is for."""

import re
import subprocess
import zipfile

import pytest

from fmu_src import UNITS
from tests.fmi_rules import RULES, findings

FUNCTIONS = """
GetTypesPlatform GetVersion SetDebugLogging Instantiate FreeInstance SetupExperiment EnterInitializationMode
ExitInitializationMode Terminate Reset GetReal GetInteger GetBoolean GetString SetReal SetInteger SetBoolean SetString
GetFMUstate SetFMUstate FreeFMUstate SerializedFMUstateSize SerializeFMUstate DeSerializeFMUstate
GetDirectionalDerivative SetRealInputDerivatives GetRealOutputDerivatives DoStep CancelStep GetStatus GetRealStatus
GetIntegerStatus GetBooleanStatus GetStringStatus
""".split()
"""Every function that FMI 2.0.4 asks a co-simulation FMU to export (sections 2.1 and 4.2)."""


@pytest.mark.parametrize("unit", UNITS)
def test_a_unit_breaks_no_rule(fmus, unit):
    assert findings(fmus[unit]) == []


def spoilt(path, out, pattern, replacement, drop=None, file="modelDescription.xml"):
    """Copy an FMU with one thing wrong in it."""
    with zipfile.ZipFile(path) as source, zipfile.ZipFile(out, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name == file and pattern:
                changed = re.sub(pattern, replacement, content.decode(), count=1, flags=re.DOTALL)
                assert changed.encode() != content
                content = changed.encode()
            if name != drop:
                target.writestr(name, content)
    return out


SPOILERS = [
    ("files_are_in_place", "", "", "binaries/linux64/HelicopterPlant.so", "no binary HelicopterPlant.so"),
    ("files_are_in_place", "", "", "documentation/index.html", "no documentation/index.html"),
    ("files_are_in_place", "", "", "model.png", "no model.png"),
    ("identity_is_usable", 'modelIdentifier="HelicopterPlant"', 'modelIdentifier="1Plant"', None, "no C identifier"),
    ("identity_is_usable", r'guid="\{', 'guid="', None, "no GUID"),
    ("identity_is_usable", r'generationDateAndTime="[^"]*"', 'generationDateAndTime="2025"', None, "no UTC time"),
    ("units_are_defined_and_used", '<Unit name="Hz">', '<Unit name="kHz">', None, "'kHz' is defined but not used"),
    ("units_are_defined_and_used", '<Unit name="Hz">', '<Unit name="V">', None, "'V' is defined twice"),
    ("units_are_defined_and_used", ' unit="V"', "", None, "v_front has no unit"),
    ("units_are_defined_and_used", r'factor="57[^"]*"', 'factor="0"', None, "has the factor 0"),
    ("references_are_unique", 'valueReference="1"', 'valueReference="0"', None, "share the value reference 0"),
    ("values_are_in_range", 'start="0.06"', 'start="60"', None, "pitch.damping starts at 60, outside"),
    ("values_are_in_range", 'min="-30.0"', 'min="40.0"', None, "min = 40 above max = 30"),
    ("values_are_in_range", 'nominal="5.0"', 'nominal="0"', None, "v_front has nominal = 0"),
    ("values_are_in_range", 'description="voltage of the front[^"]*"', "", None, "v_front has no description"),
    ("values_are_in_range", 'start="0.06"', 'start="INF"', None, "pitch.damping has start = inf"),
    ("inputs_have_no_initial", 'causality="input"', 'causality="input" initial="exact"', None, "v_front has initial"),
    ("inputs_have_no_initial", '(name="pitch".*?)<Real', r'\1<Real start="0"', None, "pitch is calculated and has"),
    ("dependencies_point_at_knowns", 'dependencies=""', 'dependencies="4"', None, "entry 4, which is output"),
    ("dependencies_point_at_knowns", 'dependencies=""', 'dependencies="2 1"', None, "not sorted or repeat"),
    ("dependencies_point_at_knowns", ' dependencies=""', "", None, "does not say what it depends on"),
    ("dependencies_point_at_knowns", 'index="4"', 'index="5"', None, "entries of Outputs are not sorted or repeat"),
    ("experiment_is_possible", 'stopTime="90.0"', 'stopTime="-1"', None, "DefaultExperiment 0 .. -1 s"),
    ("experiment_is_possible", r"<DefaultExperiment[^>]*/>", "", None, "no DefaultExperiment"),
    ("log_categories_are_known", 'name="logAll"', 'name="all"', None, "logAll is missing"),
    ("no_execution_tool_is_needed", 'needsExecutionTool="false"', "", None, "needsExecutionTool is None"),
]


@pytest.mark.parametrize(("rule", "pattern", "replacement", "drop", "said"), SPOILERS)
def test_a_rule_finds_what_it_is_for(fmus, tmp_path, rule, pattern, replacement, drop, said):
    path = spoilt(fmus["HelicopterPlant"], tmp_path / "spoilt.fmu", pattern, replacement, drop)
    assert any(said in text for text in findings(path)), findings(path)


def test_every_rule_has_a_spoiler():
    assert {rule.__name__ for rule in RULES} == {rule for rule, *_ in SPOILERS}


@pytest.mark.parametrize("unit", UNITS)
def test_the_binary_exports_every_function_of_the_standard(fmus, unit, tmp_path):
    with zipfile.ZipFile(fmus[unit]) as archive:
        binary = tmp_path / "unit.so"
        binary.write_bytes(archive.read(f"binaries/linux64/{unit}.so"))
    symbols = subprocess.run(["nm", "-D", "--defined-only", str(binary)], capture_output=True, text=True, check=True)
    exported = {line.split()[-1] for line in symbols.stdout.splitlines()}
    assert {f"fmi2{name}" for name in FUNCTIONS} <= exported
