"""The commands with --native: build, ssp, simulate and diagnose."""

import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import pytest

import heli_identifier
from tests.native_builds import needs_a_compiler


def heli(folder, *words):
    return subprocess.run(
        [sys.executable, "-c", "from heli_identifier.cli import main; main()", *words],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip


def test_build_writes_a_native_unit_of_either_version(tmp_path):
    needs_a_compiler()
    for fmi, folder in (("2", "linux64"), ("3", "x86_64-linux")):
        words = ("build", "PidController", "--native", "--fmi", fmi, "--output", "out", "--set", "trim=-1.25")
        done = heli(tmp_path, *words)
        assert done.returncode == 0, done.stderr
        with zipfile.ZipFile(tmp_path / "out/PidController.fmu") as archive:
            assert f"binaries/{folder}/PidController.so" in archive.namelist()
            assert "-1.25" in archive.read("sources/variables.c").decode()


@pytest.mark.slow
def test_ssp_holds_native_units(tmp_path):
    needs_a_compiler()
    done = heli(tmp_path, "ssp", "open_loop", "--native", "--output", "open.ssp")
    assert done.returncode == 0, done.stderr
    with zipfile.ZipFile(tmp_path / "open.ssp") as archive:
        (tmp_path / "plant.fmu").write_bytes(archive.read("resources/plant.fmu"))
    with zipfile.ZipFile(tmp_path / "plant.fmu") as unit:
        assert "sources/model.c" in unit.namelist()


@pytest.mark.slow
def test_simulate_gives_the_same_file_with_native_units(tmp_path):
    needs_a_compiler()
    for extra, name in (([], "python.csv"), (["--native"], "native.csv")):
        done = heli(tmp_path, "simulate", "closed_loop", "--duration", "5", "--output", name, *extra)
        assert done.returncode == 0, done.stderr
    assert (tmp_path / "native.csv").read_bytes() == (tmp_path / "python.csv").read_bytes()


@pytest.mark.slow
def test_diagnose_hands_back_both_units_with_the_same_start_values(tmp_path):
    needs_a_compiler()
    rig = Path(heli_identifier.__file__).parent / "demo_logs" / "rig-a"
    logs = [str(rig / f"{name}.csv") for name in ("train1", "train2", "held")]
    done = heli(tmp_path, "diagnose", *logs, "--native", "--output", "result")
    assert done.returncode == 0, done.stderr
    assert "HelicopterPlant-native.fmu" in done.stderr
    starts: list[dict] = []
    for name in ("HelicopterPlant.fmu", "HelicopterPlant-native.fmu"):
        description = fmpy.read_model_description(tmp_path / "result" / name)
        starts.append({v.name: v.start for v in description.modelVariables})
    assert starts[0] == starts[1]
    assert float(starts[1]["effects.dry_friction.pitch"]) > 0.0  # rig-a has it
