"""Native units of FMI 3.0: the bits of their twins of FMI 2.0, the same names, statuses at the call."""

import subprocess
import sys
import zipfile
from xml.etree import ElementTree

import pytest

from fmu_src.native import NATIVE_UNITS, build_native
from tests.native_builds import lockstep, needs_a_compiler

ANGLES = {"pitch": [-0.6, 0.6], "elevation": [-0.5, 0.5], "travel": [-1.0, 3.0]}
VOLTAGES = {"v_front": [-5.0, 6.0], "v_rear": [-5.0, 6.0]}
ORDERS = {
    "HelicopterPlant": ({"effects.input_delay.rotors": 0.03, "encoder.enabled": True}, VOLTAGES),
    "AdaptiveIdentifier": ({"watch.pitch": "dry_friction", "report.interval": 0.5}, {**VOLTAGES, **ANGLES}),
    "PidController": ({"travel.enabled": True}, ANGLES),
    "Exciter": ({"excitation.experiment": 3}, {}),
    "LogPlayer": ({}, {}),
}


@pytest.fixture(scope="module")
def twins(tmp_path_factory):
    needs_a_compiler()
    folder = tmp_path_factory.mktemp("native")
    return {(unit, fmi): build_native(unit, folder / str(fmi), fmi=fmi) for unit in NATIVE_UNITS for fmi in (2, 3)}


@pytest.mark.parametrize("unit", NATIVE_UNITS)
def test_both_versions_of_fmi_show_the_same_bits(tmp_path, twins, unit):
    parameters, inputs = ORDERS[unit]
    if unit == "LogPlayer":
        log = tmp_path / "log.csv"
        rows = "".join(f"{0.01 * k:.2f},{k},{-k},.1,.2,.3\n" for k in range(100))
        log.write_text("time [s],v_front [V],v_rear [V],pitch [rad],elevation [rad],travel [rad]\n" + rows)
        parameters = {"log.path": str(log)}
    run = lockstep(
        tmp_path, twins[unit, 2], twins[unit, 3], program="fmi3_lockstep.py", parameters=parameters, inputs=inputs,
        steps=1000, seed=6,
    )  # fmt: skip
    assert run["different"] == 0
    assert run["time"] == 0.0
    assert run["statuses"] == [2] * len(inputs)
    assert [status for status, _ in run["log"]] == run["statuses"]


@pytest.mark.parametrize("unit", NATIVE_UNITS)
def test_fmpy_finds_no_problem_in_a_unit_of_fmi_3(twins, unit):
    done = subprocess.run(
        [sys.executable, "-m", "fmpy", "validate", str(twins[unit, 3])], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0 and "No problems found" in done.stdout, done.stdout


@pytest.mark.parametrize("unit", NATIVE_UNITS)
def test_names_references_causalities_and_start_values_are_those_of_fmi_2(twins, unit):
    def root(fmi):
        with zipfile.ZipFile(twins[unit, fmi]) as archive:
            return ElementTree.fromstring(archive.read("modelDescription.xml"))

    def start(node):
        inner = node.find("Start")
        return node.get("start") if inner is None else inner.get("value")

    keys = ("name", "valueReference", "causality", "variability", "description")
    old = [(*map(v.get, keys), v[0].get("unit"), v[0].get("start")) for v in root(2).iter("ScalarVariable")]
    new = [(*map(v.get, keys), v.get("unit"), start(v)) for v in root(3).find("ModelVariables")]
    assert new[:-1] == old
    assert new[-1][:3] == ("time", str(len(old)), "independent")


def test_binaries_lie_in_the_folders_of_fmi_3(twins):
    with zipfile.ZipFile(twins["PidController", 3]) as archive:
        names = archive.namelist()
    assert "binaries/x86_64-linux/PidController.so" in names
    assert not [name for name in names if "linux64" in name or "win64" in name]
