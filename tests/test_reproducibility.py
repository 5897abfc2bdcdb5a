"""The same logs and settings give the same diagnosis, in whatever order a process hashes, with one thread or two."""

import json
import os
import subprocess
import sys

import pytest

from heli_identifier.records import demo_logs
from tests.faults.case import ROOT


def diagnosed(folder, seed, threads):
    """Diagnose two demonstration logs in a process of its own; gives diagnosis.json without its times."""
    (first, second, _), (held,) = demo_logs("rig-a")
    words = ["diagnose", first, second, "--validate", held, "--to", "40", "--output", "out"]
    limits = {f"{library}_NUM_THREADS": str(threads) for library in ("OPENBLAS", "OMP", "MKL", "NUMBA")}
    subprocess.run(
        [sys.executable, "-c", "from heli_command import main; main()", *map(str, words)],
        cwd=folder,
        env={**os.environ, **limits, "PYTHONHASHSEED": str(seed), "PYTHONPATH": str(ROOT)},
        capture_output=True,
        check=True,
    )
    document = json.loads((folder / "out" / "diagnosis.json").read_text())
    del document["seconds"], document["provenance"]["date"]
    del document["provenance"]["command"]  # of a process that is started with -c it holds no more than that
    return document, (folder / "out" / "HelicopterPlant.fmu").read_bytes()


@pytest.mark.slow
def test_a_diagnosis_repeats_to_the_bit_with_another_hash_seed_and_two_threads(tmp_path):
    (tmp_path / "one").mkdir()
    (tmp_path / "two").mkdir()
    assert diagnosed(tmp_path / "one", 1, 1) == diagnosed(tmp_path / "two", 2, 2)
