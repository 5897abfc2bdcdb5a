"""Commands and notebooks of the documentation do what they show: in order, in a fresh copy of a clone."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs_pages import DOCS, ROOT, SHELL, blocks, clone, predecessor, session, typed, unlike

PAGES = {
    str(page.relative_to(ROOT)): page.read_text(encoding="utf-8") for page in (ROOT / "README.md", *DOCS.rglob("*.md"))
}
TYPED = sorted(name for name, text in PAGES.items() if any(typed(block) for block in blocks(text)))


@pytest.fixture(scope="module")
def typed_page(tmp_path_factory):
    """Type a page once, behind the page that it continues; gives what each block printed, and its folder."""
    done = {}

    def typed_once(name):
        if name not in done:
            before = predecessor(PAGES[name])
            folder = typed_once(f"docs/{before}")[1] if before else clone(tmp_path_factory.mktemp("docs") / "heli-twin")
            done[name] = session(PAGES[name], folder), folder
        return done[name]

    return typed_once


@pytest.mark.slow
@pytest.mark.parametrize("name", TYPED)
def test_a_reader_who_types_the_page_gets_what_it_shows(name, typed_page):
    outputs = typed_page(name)[0]
    last = None
    for block in blocks(PAGES[name]):
        if block.line in outputs:
            last = block
        elif block.language == "text" and last is not None and last.language in SHELL:
            missing = unlike(block.text, outputs[last.line])
            assert missing == [], f"line {block.line}: the commands print\n{outputs[last.line]}"
        else:
            last = None


@pytest.mark.slow
def test_the_readme_shows_what_the_demonstration_prints(tmp_path):
    """`make demo` would set up an environment of its own, in which it runs `heli demo`."""
    (shown,) = (block.text for block in blocks(PAGES["README.md"]) if block.text.startswith("$ make demo\n"))
    heli = Path(sys.executable).parent / "heli"
    done = subprocess.run([heli, "demo"], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert unlike(shown.partition("$ make test")[0].partition("\n")[2], done.stdout) == []


@pytest.mark.parametrize("name", PAGES)
def test_a_block_of_commands_is_run_or_says_why_not(name):
    for block in blocks(PAGES[name]):
        if block.language in ("sh", "shell", "zsh"):
            pytest.fail(f"line {block.line}: a block of {block.language} is never run; call it bash")
        if block.language in SHELL:
            assert typed(block) or block.reason, f"line {block.line}: nothing in this block is run"


NAMED = re.compile(r"`((?:heli_plant|heli_identifier|fmu_src|tests|benchmarks|docs)/[\w/.]+)`(?! of commit)")


@pytest.mark.parametrize("name", PAGES)
def test_a_file_of_the_project_that_a_page_names_exists(name):
    assert [path for path in NAMED.findall(PAGES[name]) if not (ROOT / path).exists()] == []


NOTEBOOKS = {path.name: json.loads(path.read_text(encoding="utf-8")) for path in DOCS.glob("notebooks/*.ipynb")}
LARGEST = 1_000_000
"""Bytes of a notebook with its outputs."""


def code_cells(name):
    return [cell for cell in NOTEBOOKS[name]["cells"] if cell["cell_type"] == "code"]


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_is_small_and_was_executed_once_from_top_to_bottom(name):
    assert (DOCS / "notebooks" / name).stat().st_size < LARGEST
    assert [cell["execution_count"] for cell in code_cells(name)] == list(range(1, len(code_cells(name)) + 1))
    assert all(output["output_type"] != "error" for cell in code_cells(name) for output in cell["outputs"])


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
