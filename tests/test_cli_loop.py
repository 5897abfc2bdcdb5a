"""From logs to a corrected plant by the commands alone, and back: what one writes the next one takes."""

import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest

from fmu_src import UNITS, build
from fmu_src.native.toolchain import LINUX, find_compiler
from heli_identifier.errors import IdentifierError, LogError
from heli_identifier.records import demo_files, read_data_set, write_log
from heli_identifier.results import NATIVE_PLANT, plant_values
from heli_identifier.results.running import check_free_run, unit_run
from heli_identifier.tools import split_logs
from heli_plant.effects import CATALOGUE
from heli_plant.parameters import BY_NAME
from heli_plant.simulation import simulate
from heli_plant.state import PlantState
from tests.commands import HELI, heli, heli_json, run_python
from tests.diagnosis_example import AFTER, BEFORE, example_diagnosis, simulated_log

RESULTS = {"diagnosis.json", "report.html", "parameters.json", "HelicopterPlant.fmu"}
NATIVE = ["--native"] if find_compiler(LINUX) else []


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory):
    """The folder that ``heli diagnose`` leaves for a log of rig-a, and what it printed."""
    (training, *_), held_out = demo_files("rig-a")
    folder = tmp_path_factory.mktemp("rig-a") / "result"
    words = ["diagnose", training, "--validate", *held_out, "--output", folder, "--json", *NATIVE]
    return folder, run_python(HELI, *words).stdout


def test_a_diagnosis_leaves_its_four_files_and_prints_its_document_and_finds_the_friction_of_rig_a(diagnosed):
    folder, printed = diagnosed
    assert {path.name for path in folder.iterdir()} == RESULTS | ({NATIVE_PLANT} if NATIVE else set())
    assert [path.name for path in folder.parent.iterdir()] == ["result"]
    assert json.loads(printed) == json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))
    first = json.loads(printed)["effects"][0]
    assert (first["name"], first["axis"]) == ("dry_friction", "pitch")
    # the bar of the project: within 15 % of the truth, .025
    assert first["coefficient"]["value"] == pytest.approx(0.025, rel=0.15)


def test_the_parameters_of_a_diagnosis_build_the_unit_that_it_delivered_and_the_native_one_is_the_same(
    diagnosed, tmp_path
):
    folder, _ = diagnosed
    words = ("build", "HelicopterPlant", "--parameters", folder / "parameters.json", "--output", tmp_path)
    assert heli(*words).exit_code == 0
    assert (tmp_path / "HelicopterPlant.fmu").read_bytes() == (folder / "HelicopterPlant.fmu").read_bytes()
    delivered = ["HelicopterPlant.fmu", NATIVE_PLANT][: 1 + len(NATIVE)]
    variables = (fmpy.read_model_description(folder / file).modelVariables for file in delivered)
    one, *other = [{own.name: own.start for own in listed} for listed in variables]
    assert other in ([], [one]) and float(one["effects.dry_friction.pitch"]) > 0.0  # rig-a has it


def test_a_check_passes_on_a_log_of_the_same_rig_and_fails_on_one_of_another(diagnosed, tmp_path):
    parameters = diagnosed[0] / "parameters.json"
    (own,), (other,) = demo_files("rig-a")[1], demo_files("rig-c")[1]
    passed = heli("check", own, "--parameters", parameters, "--junit", tmp_path / "passed.xml")
    failed = heli("check", other, "--parameters", parameters, "--junit", tmp_path / "failed.xml", "--json")
    assert (passed.exit_code, failed.exit_code) == (0, 1)
    assert ElementTree.parse(tmp_path / "passed.xml").getroot().attrib["failures"] == "0"
    suite = ElementTree.parse(tmp_path / "failed.xml").getroot()
    outcome = json.loads(failed.stdout)
    assert not outcome["passed"]
    assert int(suite.attrib["failures"]) == sum(not axis["passed"] for axis in outcome["outcomes"]) > 0
    assert len(suite.findall("testcase/failure")) == int(suite.attrib["failures"])


@pytest.mark.parametrize("step", [0.004, 0.03])
def test_a_log_is_played_whole_in_steps_of_any_length(tmp_path, step):
    log = simulated_log(6.0)
    words = ("--log", write_log(log, tmp_path / "log.csv"), "--output", tmp_path / "run.csv")
    assert heli("simulate", "plant_beside_log", *words, "--step", step).exit_code == 0
    end = np.genfromtxt(tmp_path / "run.csv", delimiter=",", skip_header=1)[-1, 0]
    # the last sample is that of 5.99 s; the run ends there, or less than a step before
    assert log.samples == 600
    assert 5.99 - step < end <= 5.99 + 1e-9


def test_the_unit_repeats_the_free_run_at_any_rate_of_the_log_and_is_delivered_only_if_it_does(tmp_path):
    values = {name: estimate.value for name, estimate in plant_values(AFTER, {}).items()}
    corrected_unit, flown = build("HelicopterPlant", tmp_path / "unit", values), simulated_log(8.0)
    for rate in (50.0, 333.0):
        held = np.repeat(flown.voltages, 10, axis=0)[:: int(1000 / rate)]
        log = replace(flown, rate_hz=rate, voltages=held, angles=np.zeros((len(held), 3)) + 0.01)
        series = replace(example_diagnosis().series[0], log=log)
        _, angles = simulate(log.voltages, log.step, PlantState(**series.start), AFTER)
        # 400 to 2700 steps of the same arithmetic, compiled and interpreted
        assert np.abs(unit_run(corrected_unit, series) - angles).max() < 1e-12
    check_free_run(corrected_unit, example_diagnosis())
    other = build("HelicopterPlant", tmp_path, {"pitch.damping": BEFORE.a_wx})
    with pytest.raises(IdentifierError, match="free run on run is off"):
        check_free_run(other, example_diagnosis())


def test_without_a_held_out_log_the_last_one_is_held_out_and_of_a_single_one_the_last_third(tmp_path):
    """No sample is in both."""
    logs = [write_log(simulated_log(length), tmp_path / f"run{length:g}.csv") for length in (30.0, 20.0)]
    training, held, said = split_logs(*read_data_set(logs))
    assert ([log.name for log in training], [log.name for log in held]) == (["run30"], ["run20"])
    assert said.startswith("held out: ")
    with pytest.raises(LogError, match="too short"):
        split_logs(*read_data_set(logs[:1], start=0.0, end=24.0))
    for start, end, samples in ((None, None, 3000), (3.0, 28.5, 2551)):
        (training,), (held,), _ = split_logs(*read_data_set(logs[:1], start=start, end=end))
        assert training.samples + held.samples == samples and held.samples == pytest.approx(samples / 3, abs=1)
        assert held.start > training.start + training.duration - 1.5 * training.step
        # the last sample kept is that of ``end``, which holds for one step
        first, last = (0.0, 29.99) if start is None else (start, end)
        assert (training.start, held.start + held.duration) == pytest.approx((first, last + 0.01))


def test_identify_finds_the_parameters_of_a_rig_that_the_model_describes(tmp_path):
    (first, second, _), _ = demo_files("rig-c")
    values = heli_json("identify", first, second, "--to", 45, "--output", tmp_path / "out")["values"]
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"identification.json", "history.csv", "history.svg"}
    # rig-c holds nothing beyond the model; a diagnosis of all its logs finds .3515 +- .0032
    assert values["pitch.gain"]["value"] == pytest.approx(0.3515, rel=0.01)
    assert 0.0 < values["pitch.gain"]["standard_error"] < 0.05 * values["pitch.gain"]["value"]
    history = (tmp_path / "out" / "history.csv").read_text().splitlines()
    assert history[0].startswith("log,time [s],a_wx [1/s],")
    assert {line.split(",")[0] for line in history[1:]} == {"train1", "train2"}


def test_build_makes_every_unit_and_lists_them_and_effects_lists_those_of_the_plant(tmp_path):
    files = heli_json("build", "--output", tmp_path)
    assert {Path(file).stem for file in files} == set(UNITS)
    assert sorted(files) == sorted(str(path) for path in tmp_path.iterdir())
    listed = heli_json("effects")
    assert [(entry["name"], entry["axis"]) for entry in listed] == [(e.name, e.axis) for e in CATALOGUE]
    assert all(entry["parameter"] in BY_NAME for entry in listed)


def test_parameters_of_a_file_reach_the_plant_of_a_scenario_and_set_outranks_them(tmp_path):
    file = tmp_path / "parameters.json"
    replace(example_diagnosis(), effects=example_diagnosis().effects[:1]).write(tmp_path)
    last = {}
    for name, words in {"file": (), "set": ("--set", "plant.effects.dry_friction.pitch=0")}.items():
        rows = heli_json("simulate", "open_loop", "--duration", 2, "--parameters", file, *words)
        last[name] = {row["name"]: row["last"] for row in rows}["plant.pitch"]
    assert last["file"] != last["set"]
