"""The notebooks of the documentation: executed in order, small, and their code still runs."""

import json
import os
import subprocess
import sys

import pytest

from tests.docs_pages import DOCS, unlike

NOTEBOOKS = {path.name: json.loads(path.read_text(encoding="utf-8")) for path in DOCS.glob("notebooks/*.ipynb")}
LARGEST = 1_000_000
"""Bytes of a notebook with its outputs."""


def code_cells(name):
    return [cell for cell in NOTEBOOKS[name]["cells"] if cell["cell_type"] == "code"]


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_was_executed_once_from_top_to_bottom(name):
    counts = [cell["execution_count"] for cell in code_cells(name)]
    assert counts == list(range(1, len(counts) + 1))
    for cell in code_cells(name):
        assert all(output["output_type"] != "error" for output in cell["outputs"])


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_is_small(name):
    assert (DOCS / "notebooks" / name).stat().st_size < LARGEST


@pytest.mark.slow
@pytest.mark.parametrize("name", NOTEBOOKS)
def test_the_code_of_a_notebook_runs_and_prints_what_it_shows(name, tmp_path):
    script = "\n".join("".join(cell["source"]) for cell in code_cells(name))
    environment = {**os.environ, "MPLBACKEND": "agg"}
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    outputs = [output for cell in code_cells(name) for output in cell["outputs"] if output["output_type"] == "stream"]
    assert unlike("".join("".join(output["text"]) for output in outputs), done.stdout) == []
