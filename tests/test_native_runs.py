"""Native units by the commands; many runs of them: the same bits as one by one, bands that cover, counted refusals."""

import json
import zipfile

import numpy as np
import pytest

from fmu_src import CLOSED_LOOP, OPEN_LOOP, MasterError
from fmu_src.master import run_apart
from heli_identifier.online import Estimate
from heli_identifier.results.parameters import ParameterSet, plant_values
from heli_plant.parameters import BY_FIELD, TABLE_2
from tests.commands import heli
from tests.units import needs_a_compiler

RECORD = ["plant.pitch", "plant.elevation"]
DURATION = 5.0


@pytest.fixture(scope="module")
def files(twins):
    return {name: str(twins[kind]) for name, kind in OPEN_LOOP.units}


def many(files, variations, **more):
    return run_apart(OPEN_LOOP, DURATION, 0.01, {}, files, variations=variations, record=RECORD, **more)


def test_units_in_python_and_native_ones_give_the_same_bits_and_the_same_refusal(twins, fmus):
    """They are stepped by two loops, one in Python and one in machine code."""
    found, said = [], []
    for units in (fmus, twins):
        files = {name: str(units[kind]) for name, kind in CLOSED_LOOP.units}
        found.append(run_apart(CLOSED_LOOP, DURATION, 0.01, {"plant.encoder.enabled": True}, files))
        with pytest.raises(MasterError) as caught:
            run_apart(CLOSED_LOOP, 4.0, 2.0, {"plant.solver.step": 1e-5}, files)
        said.append(str(caught.value))
    assert found[0].names == found[1].names
    assert np.array_equal(found[0].values, found[1].values)
    assert said[0] == said[1] and said[0].startswith("plant.doStep at t = 0 s answered discard: ")


def test_every_run_begins_at_the_start_and_has_the_bits_of_a_run_alone(files):
    """With two equal variations both ends of the band are that run: nothing is left of the runs before."""
    variation = {"plant.pitch.gain": 0.25, "plant.effects.dry_friction.pitch": 0.02}
    result = many(files, [variation, variation])
    for values, given in ((result.values, {}), (result.bands.low, variation), (result.bands.high, variation)):
        alone = run_apart(OPEN_LOOP, DURATION, 0.01, given, files, record=RECORD)
        assert alone.names == result.names
        assert np.array_equal(values, alone.values)


def test_the_bands_lie_where_95_of_100_runs_do(files):
    """At one instant 5 of 100 runs lie outside; the ends are quantiles between neighbours, so at most one more does."""
    gains = np.linspace(0.2, 0.3, 100)
    result = many(files, [{"plant.pitch.gain": gain} for gain in gains])
    column = result.names.index("plant.pitch")
    last = [
        run_apart(OPEN_LOOP, DURATION, 0.01, {"plant.pitch.gain": gain}, files, record=RECORD).values[-1, column]
        for gain in (gains[1], gains[5], gains[94], gains[98])
    ]
    low, high = result.bands.low[-1, column], result.bands.high[-1, column]
    assert [low <= value <= high for value in last] == [False, True, True, False]


def test_a_run_that_a_unit_refuses_is_counted_with_its_reason_and_units_in_python_are_refused(files, fmus):
    bands = many(files, [{"plant.pitch.gain": 0.25}, {"plant.pitch.gain": 1e9}]).bands
    assert bands.runs == 1 and len(bands.refused) == 1
    assert "pitch.gain = 1000000000.0" in bands.refused[0]
    with pytest.raises(MasterError, match="every one of 1 varied runs was refused; the first: plant"):
        many(files, [{"plant.pitch.gain": 1e9}])
    with pytest.raises(MasterError, match="many runs need native units; plant is none"):
        many({**files, "plant": str(fmus["HelicopterPlant"])}, [{}])


@pytest.mark.slow
def test_the_command_repeats_with_its_seed_and_draws_figure_and_table(tmp_path, files):
    known = {field: getattr(TABLE_2, field) for field in ("a_wx", "k_x", "a_th")}
    estimates = {field: Estimate(value, 0.05 * abs(value), BY_FIELD[field].unit) for field, value in known.items()}
    file = ParameterSet("HelicopterPlant", plant_values(TABLE_2, estimates)).write(tmp_path / "parameters.json")
    given = [f"--fmu={name}={path}" for name, path in files.items()]
    words = ("simulate", "open_loop", "--native", "--runs", 20, "--duration", 2, "--parameters", file, "--json", *given)
    figure, table = tmp_path / "runs.svg", tmp_path / "runs.csv"
    first = heli(*words, "--plot", figure, "--output", table)
    assert first.exit_code == 0, first.output
    answer = json.loads(first.stdout)
    assert (answer["runs"], answer["refused"]) == (20, 0)
    pitch = next(row for row in answer["outputs"] if row["name"] == "plant.pitch")
    assert pitch["last_low"] < pitch["last_high"]
    assert json.loads(heli(*words).stdout) == answer
    assert json.loads(heli(*words, "--seed", 1).stdout) != answer
    assert "95 % of the runs" in figure.read_text()
    header = table.read_text().splitlines()[0]
    assert "plant.pitch low [rad]" in header and "plant.pitch high [rad]" in header
    assert "3 parameters are drawn" in first.stderr and "independently by their standard errors" in first.stderr


def test_build_and_ssp_write_native_units_of_either_version(tmp_path):
    needs_a_compiler()
    for fmi, folder in (("2", "linux64"), ("3", "x86_64-linux")):
        words = ("build", "PidController", "--native", "--fmi", fmi, "--output", tmp_path, "--set", "trim=-1.25")
        assert heli(*words).exit_code == 0
        with zipfile.ZipFile(tmp_path / "PidController.fmu") as archive:
            assert f"binaries/{folder}/PidController.so" in archive.namelist()
            assert "-1.25" in archive.read("sources/variables.c").decode()
    assert heli("ssp", "open_loop", "--native", "--output", tmp_path / "open.ssp").exit_code == 0
    with zipfile.ZipFile(tmp_path / "open.ssp") as archive:
        (tmp_path / "plant.fmu").write_bytes(archive.read("resources/plant.fmu"))
    with zipfile.ZipFile(tmp_path / "plant.fmu") as unit:
        assert "sources/model.c" in unit.namelist()
