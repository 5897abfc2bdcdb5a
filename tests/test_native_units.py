"""The native twins show the bits of the pythonfmu units; what they refuse, they refuse at the call."""

import json
import subprocess
import sys
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import pytest

from fmu_src.native import NATIVE_UNITS, build_native
from fmu_src.native.toolchain import PLATFORMS, compiler
from tests.fmi_rules import findings
from tests.native_builds import lockstep, needs_a_compiler

ANGLES = {"pitch": [-0.6, 0.6], "elevation": [-0.5, 0.5], "travel": [-1.0, 3.0]}
REFERENCES = {"pitch_reference": [-0.2, 0.2], "elevation_reference": [-0.1, 0.3], "travel_reference": [0.0, 0.0]}
VOLTAGES = {"v_front": [-5.0, 6.0], "v_rear": [-5.0, 6.0]}
WATCHED = {
    "watch.pitch": "dry_friction, quadratic_drag,rotor_mismatch",
    "watch.elevation": "quadratic_thrust,ground_effect",
    "watch.travel": " rotor_drag_torque ",
}


@pytest.fixture(scope="module")
def twins(tmp_path_factory):
    needs_a_compiler()
    folder = tmp_path_factory.mktemp("native")
    return {unit: build_native(unit, folder) for unit in NATIVE_UNITS}


@pytest.mark.parametrize(
    "parameters, steps",
    [
        ({}, 4000),
        ({**WATCHED, "report.interval": 0.5, "adaptation.forgetting": 0.02, "filter.frequency": 3.0}, 6000),
        (
            {"pitch.rest_angle_known": True, "pitch.rest_angle": -0.1, "motor.time_constant": 0.0,
             "report.interval": 0.3, "adaptation.forgetting": 0.05, "filter.frequency": 3.0},
            4000,
        ),
        ({"sample.time": 0.004, "adaptation.gain_limit": 1e300, "adaptation.forgetting": 0.0}, 2000),
        ({"method": "prediction_error", "report.interval": 0.5}, 4000),
        (
            {**WATCHED, "method": "prediction_error", "motor.lag_known": True, "sample.time": 0.002,
             "report.interval": 0.5},
            2000,
        ),
    ],
    ids=[
        "default", "watching", "rest angle known, no lag", "samples between points", "prediction errors, lag",
        "prediction errors, averaged samples",
    ],
)  # fmt: skip
def test_the_identifier_has_the_bits_of_the_pythonfmu_unit(tmp_path, fmus, twins, parameters, steps):
    run = lockstep(
        tmp_path, fmus["AdaptiveIdentifier"], twins["AdaptiveIdentifier"], parameters=parameters,
        inputs={**VOLTAGES, **ANGLES, **REFERENCES}, steps=steps, seed=2, longest=0.01, shortest=0.001,
    )  # fmt: skip
    assert run["different"] == 0, run


def test_a_plant_that_follows_a_rig_has_the_bits_of_the_pythonfmu_unit(tmp_path, fmus, twins):
    """Observer, missing samples, corrections of parameters and of the rotors' thrust; random within these bounds."""
    inputs = {
        **VOLTAGES,
        "measured.pitch": [-0.3, 0.3],
        "measured.elevation": [-0.2, 0.2],
        "measured.travel": [-0.2, 0.2],
        "measured.fresh": [0.0, 1.0],
        "observer.bandwidth": [0.0, 8.0],
        "correction.pitch.gain": [-0.05, 0.05],
        "correction.elevation.offset": [-0.1, 0.1],
        "correction.effects.dry_friction.pitch": [0.0, 0.05],
        "correction.effects.cable_stiffness.travel": [0.0, 0.1],
        "correction.rotor.front": [-0.3, 0.0],
    }
    run = lockstep(
        tmp_path, fmus["HelicopterPlant"], twins["HelicopterPlant"], parameters={"effects.input_delay.rotors": 0.03},
        inputs=inputs, steps=3000, seed=6, longest=0.01, shortest=0.005,
    )  # fmt: skip
    assert run["different"] == 0, run


@pytest.mark.parametrize(
    "parameters",
    [{}, {"travel.enabled": True, "reference.step_pitch": 0.2, "reference.step_time": 2.0, "voltage_limit": 3.0}],
    ids=["default", "travel, a reference step"],
)
def test_the_controller_has_the_bits_of_the_pythonfmu_unit(tmp_path, fmus, twins, parameters):
    inputs = {**ANGLES, "excitation_front": [-1.0, 1.0], "reference.travel": [-0.3, 0.3]}
    run = lockstep(
        tmp_path, fmus["PidController"], twins["PidController"], parameters=parameters, inputs=inputs, steps=3000,
        seed=3, longest=0.01, shortest=0.001,
    )  # fmt: skip
    assert run["different"] == 0, run


@pytest.mark.parametrize("channel", [0, 1, 2])
@pytest.mark.parametrize("experiment", [0, 1, 2, 3])
def test_the_exciter_has_the_bits_of_the_pythonfmu_unit(tmp_path, fmus, twins, experiment, channel):
    """Experiment 3 draws its phases from Python's random numbers, which the twin computes anew."""
    parameters = {"excitation.experiment": experiment, "excitation.channel": channel, "multisine.seed": 77}
    run = lockstep(
        tmp_path, fmus["Exciter"], twins["Exciter"], parameters=parameters, inputs={}, steps=3000, seed=4,
        longest=0.03, shortest=0.001,
    )  # fmt: skip
    assert run["different"] == 0, run


LOG = "time [s],v_front [V],v_rear [V],pitch [deg],elevation [rad],travel [rad]\n"
ROWS = "".join(f"{5.0 + 0.01 * k:.2f},{k / 7.0!r},{-k / 3.0!r},{k / 11.0!r},.2,-1e-3\n" for k in range(400))


@pytest.mark.parametrize(
    "text",
    [
        LOG + ROWS,
        "\ufeff" + (LOG + ROWS).replace("\n", "\r\n"),
        LOG.replace("pitch", '"pitch').replace("[deg]", '[deg]"') + ROWS.replace(",.2,", ',  ".2" ,') + "\n\n",
        "note," + LOG + "".join(f'"a, b ""c""",{row}\n' for row in ROWS.splitlines()),
    ],
    ids=["plain", "byte order mark, CRLF", "quotes and blanks", "a further column"],
)
def test_the_player_has_the_bits_of_the_pythonfmu_unit(tmp_path, fmus, twins, text):
    path = tmp_path / "log.csv"
    path.write_bytes(text.encode())
    run = lockstep(
        tmp_path, fmus["LogPlayer"], twins["LogPlayer"], parameters={"log.path": str(path), "log.start": 0.5},
        inputs={}, steps=500, seed=5, longest=0.01, shortest=0.001,
    )  # fmt: skip
    assert run["different"] == 0, run


REFUSED_LOGS = {
    "": "has no column 'time [s]'",
    LOG: "has no rows below its header",
    LOG.replace("v_rear", "rear") + ROWS: "has no column 'v_rear [V]'",
    LOG + "0,1,2,3,4,5\n0,1,2,3,4,5\n": "row 3: time = 0 s must be greater than 0 s",
    LOG + "0,1,2,three,4,5\n": "row 2, column 'pitch [deg]': 'three' is not a finite number",
    LOG + "0,1,2,nan,4,5\n": "row 2, column 'pitch [deg]': 'nan' is not a finite number",
    LOG + "0,1,2\n": "row 2, column 'pitch [deg]': '' is not a finite number",
}
INITIALISE = """
unit = Unit(sys.argv[1]).instantiate()
parameters = json.loads(sys.argv[2])
status = 0
try:
    unit.start(parameters)
except Exception as problem:
    status = getattr(problem, "status", -1)
answer([status, [text for _, _, text in unit.log]])
"""


@pytest.mark.parametrize("text", REFUSED_LOGS, ids=list(REFUSED_LOGS.values()))
def test_a_log_that_cannot_be_played_is_refused_when_the_initialisation_ends(tmp_path, twins, in_host, text):
    path = tmp_path / "log.csv"
    path.write_text(text)
    status, log = in_host("import json\n" + INITIALISE, twins["LogPlayer"], json.dumps({"log.path": str(path)}))
    assert status == 3
    assert REFUSED_LOGS[text] in log[0] and str(path) in log[0]


@pytest.mark.parametrize(
    "unit, parameters, reason",
    [
        ("LogPlayer", {}, "log.path is empty"),
        ("LogPlayer", {"log.path": "/no/such/log.csv"}, "cannot be read: No such file"),
        ("Exciter", {"excitation.base": 6.0}, "excitation.base = 6.0 V must lie in [-5, 5] V"),
        ("Exciter", {"excitation.experiment": 3, "multisine.highest": 0.01}, "multisine.highest = 0.01 Hz must lie"),
        ("Exciter", {"excitation.experiment": 3, "multisine.period": 0.1}, "has no harmonic near 0.0333333 Hz"),
        ("AdaptiveIdentifier", {"watch.pitch": "dry_fricton"}, "effect 'dry_fricton' cannot be watched on pitch"),
        ("AdaptiveIdentifier", {"watch.travel": "a,b,c,d"}, "names 4 effects; at most 3 can be watched"),
        ("AdaptiveIdentifier", {"method": "guess"}, "method 'guess' must be one of adaptation, prediction_error"),
        (
            "AdaptiveIdentifier",
            {"filter.frequency": 100.0},
            "filter.frequency = 100.0 rad/s must lie in [0.001, 20] rad/s",
        ),
        ("HelicopterPlant", {"effects.motor_lag.rotors": -0.07, "motor.time_constant": 0.05}, "must not be negative"),
    ],
)
def test_what_the_initialisation_refuses_is_said_as_python_says_it(fmus, twins, in_host, unit, parameters, reason):
    order = json.dumps(parameters)
    status, log = in_host("import json\n" + INITIALISE, twins[unit], order)
    assert status == 3, log
    assert reason in log[0]
    _, said_by_python = in_host("import json\n" + INITIALISE, fmus[unit], order)
    if unit != "LogPlayer":  # the system's own words for a missing file differ
        assert log[0] == said_by_python[0]


@pytest.mark.parametrize("unit", NATIVE_UNITS)
def test_names_causalities_and_start_values_are_those_of_the_pythonfmu_unit(fmus, twins, unit):
    def listed(path):
        with zipfile.ZipFile(path) as archive:
            root = ElementTree.fromstring(archive.read("modelDescription.xml"))
        return [(v.attrib, v[0].tag, v[0].attrib) for v in root.iter("ScalarVariable")], root.find("ModelStructure")

    (ours, structure), (theirs, reference) = listed(twins[unit]), listed(fmus[unit])
    assert ours == theirs
    assert ElementTree.tostring(structure) == ElementTree.tostring(reference)


@pytest.mark.parametrize("unit", NATIVE_UNITS)
def test_fmpy_finds_no_problem_in_a_native_unit(twins, unit):
    done = subprocess.run(
        [sys.executable, "-m", "fmpy", "validate", str(twins[unit])], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0 and "No problems found" in done.stdout, done.stdout


@pytest.mark.parametrize("unit", NATIVE_UNITS)
def test_a_native_unit_keeps_the_rules_of_fmi(twins, unit):
    found = [text for text in findings(twins[unit]) if "no binary" not in text]
    assert found == []


@pytest.mark.parametrize("unit", NATIVE_UNITS)
def test_sources_and_their_description_are_always_there(twins, unit):
    with zipfile.ZipFile(twins[unit]) as archive:
        names = archive.namelist()
        build = ElementTree.fromstring(archive.read("sources/buildDescription.xml"))
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    compiled = [node.get("name") for node in build.iter("SourceFile")]
    assert compiled == [node.get("name") for node in root.iter("File")]
    assert {f"sources/{name}" for name in compiled} <= set(names)
    assert not [name for name in names if name.endswith(".py")]
    for target in PLATFORMS:
        own = f"binaries/{target.fmi2}/{unit}{target.suffix}"
        assert (own in names) is (compiler(target) is not None)


def test_two_builds_are_the_same_bytes(tmp_path, twins):
    again = build_native("PidController", tmp_path)
    assert again.read_bytes() == twins["PidController"].read_bytes()


def test_without_a_compiler_the_unit_holds_its_sources_and_the_user_is_told_what_to_install(tmp_path):
    """In a process that sees neither ziglang nor a system compiler."""
    program = (
        "import sys, zipfile; sys.modules['ziglang'] = None\n"
        "import importlib.util, shutil\n"
        "from fmu_src.native import build_native, without_compiler\n"
        f"path = build_native('PidController', {str(tmp_path)!r})\n"
        "print(without_compiler())\n"
        "print([n for n in zipfile.ZipFile(path).namelist() if n.startswith('binaries')])\n"
    )
    hidden = tmp_path / "hidden" / "ziglang_is_absent"
    hidden.mkdir(parents=True)
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False, cwd=Path(__file__).parent.parent,
        env={"PATH": str(hidden), "HOME": str(tmp_path)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    said, binaries = done.stdout.strip().splitlines()
    assert said.startswith("there is no C compiler for linux64 and win64, the units hold sources")
    assert "pip install 'heli-twin[native]'" in said
    assert binaries == "[]"
