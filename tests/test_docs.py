"""Pages of the documentation as shell sessions: what a reader types, run in a fresh copy of a clone.

A block of ``bash`` is typed as it stands; in a block of ``console`` the lines behind ``$`` are. A block with a title is
a file that the reader writes (``title="heli.toml"``); of a GitHub workflow the ``run: heli ...`` lines are typed as
well. A block of ``text`` behind commands is what they print, but for lines of dots; figures may differ as little as
:func:`same` says, and those of lines that :data:`VARYING` names as they like. A comment ``<!-- not run: reason -->``
before a block keeps it from being typed, and ``<!-- continues: page.md -->`` at a page's beginning starts it where
another page ended."""

import json
import os
import re
import subprocess
import sys
import textwrap
from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from PIL import Image

from benchmarks.figures import DRAWN
from heli_identifier.results.svg import COLOURS
from tests.commands import run_bash, run_program, run_python
from tests.test_report_browser import CHROMIUM, Chromium

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
CLONED = ("README.md", "pyproject.toml", "benchmarks", "docs", "fmu_src", "heli_identifier", "heli_plant", "tests")
"""What a session finds in its folder, as somebody with a clone would."""

SHELL = ("bash", "console")
RELATIVE = Decimal("0.02")
"""Share of itself by which a printed figure may differ from the one that a page shows."""

VARYING = {
    r"\d kB$": "size of an archive, which follows every change of its sources",
    r" \d{4}-\d\d-\d\d ": "date and size in an archive's list of contents",
}
"""Lines whose figures are not compared, and why."""

PATIENCE = 1200.0
"""Seconds that a page may take before it is given up: commands that hang must not hang the tests."""

_FENCE = re.compile(
    r"^(?P<indent> *)```(?P<language>\w+)?(?P<rest>[^\n]*)\n(?P<body>.*?)^(?P=indent)```\s*$", re.M | re.S
)
_NOT_RUN = re.compile(r"<!-- not run: (\S.*?) -->\s*\Z", re.S)
_CONTINUES = re.compile(r"<!-- continues: (\S+) -->")
_MARK = "\x1e"


class Block(NamedTuple):
    """One fenced block: its language, its title if it is a file, its text, its line, and whether it says: not run."""

    language: str
    title: str
    text: str
    line: int
    left_out: bool


def blocks(markdown):
    """Every fenced block of a page, in order."""
    for fence in _FENCE.finditer(markdown):
        before, title = markdown[: fence.start()], re.search(r'title="([^"]+)"', fence["rest"])
        text = textwrap.dedent(fence["body"]) if fence["indent"] else fence["body"]
        own = (fence["language"] or "", title[1] if title else "", text)
        yield Block(*own, before.count("\n") + 1, bool(_NOT_RUN.search(before)))


def typed(block):
    """What a reader types for a block; nothing if it is no command, or is not run."""
    if block.left_out:
        return ""
    if block.title:
        folder = os.path.dirname(block.title) or "."
        runs = re.findall(r"^\s*(?:- )?run: (heli .*)$", block.text, re.M)
        return "\n".join([f"mkdir -p {folder}", f"cat > {block.title} <<'END'\n{block.text}END", *runs]) + "\n"
    if block.language == "console":
        return "".join(f"{line[2:]}\n" for line in block.text.splitlines() if line.startswith("$ "))
    return block.text if block.language == "bash" else ""


def clone(folder):
    """Make ``folder`` look like a clone: links to what is in the repository, nothing that was ever built."""
    folder.mkdir()
    for name in CLONED:
        (folder / name).symlink_to(ROOT / name)
    return folder


def session(markdown, folder):
    """Type a page's commands into one shell; returns what each block printed, by the block's line."""
    script = ["set -euo pipefail"]
    for block in blocks(markdown):
        if text := typed(block):
            script += [f"printf '{_MARK}{block.line}\\n'", text]
    environment = {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    code, printed = run_bash("\n".join(script), folder, environment, PATIENCE, stderr=subprocess.STDOUT)
    parts = (part.partition("\n") for part in printed.split(_MARK)[1:])
    outputs = {int(line): text for line, _, text in parts}
    last = max(outputs, default=0)
    assert code == 0, f"the block at line {last} ended with {code}:\n{outputs.get(last, printed)}"
    return outputs


TOKEN = re.compile(r"[^\W\d][\w.]*|(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
"""A word or a figure; digits within a word, as in ``train1.csv``, are no figure."""


def same(shown, printed):
    """Whether a word is what a page shows, or a figure is near it.

    Every run is seeded, but an optimiser stops where its tolerance is met, and another processor or linear algebra
    brings it there another way: estimates move by far less than their standard errors, which are a per cent and more of
    them. A figure with a fraction may besides round to the digit next to the one that was shown; counts may not.
    """
    if not all(re.match(r"[-+]?\d", token) for token in (shown, printed)):
        return shown == printed
    wanted, there = Decimal(shown), Decimal(printed)
    digit = Decimal(1).scaleb(wanted.as_tuple().exponent) if wanted.as_tuple().exponent < 0 else 0
    return abs(there - wanted) <= RELATIVE * abs(wanted) + digit


def unlike(shown, printed):
    """Lines of ``shown`` whose words and figures, in order, are in no line of ``printed``."""
    actual = [TOKEN.findall(line.replace("−", "-")) for line in printed.splitlines()]
    missing = []
    for line in shown.splitlines():
        wanted = TOKEN.findall(line.replace("−", "-"))
        if any(re.search(pattern, line) for pattern in VARYING):
            wanted = [token for token in wanted if token[0].isalpha()]
        if not any(all(any(same(one, other) for other in rest) for one in wanted) for rest in map(iter, actual)):
            missing.append(line)
    return missing


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
            before = _CONTINUES.search(PAGES[name])
            new = tmp_path_factory.mktemp("docs") / "heli-twin"
            folder = typed_once(f"docs/{before[1]}")[1] if before else clone(new)
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
    printed = run_program([heli, "demo"], cwd=tmp_path).stdout
    assert unlike(shown.partition("\n")[2], printed) == []


NAMED = re.compile(r"`((?:heli_plant|heli_identifier|fmu_src|tests|benchmarks|docs)/[\w/.]+)`")


@pytest.mark.parametrize("name", PAGES)
def test_a_block_of_commands_is_run_or_says_why_not_and_files_of_the_project_that_are_named_exist(name):
    assert [path for path in NAMED.findall(PAGES[name]) if not (ROOT / path).exists()] == []
    for block in blocks(PAGES[name]):
        if block.language in ("sh", "shell", "zsh"):
            pytest.fail(f"line {block.line}: a block of {block.language} is never run; call it bash")
        if block.language in SHELL:
            assert typed(block) or block.left_out, f"line {block.line}: nothing in this block is run"


NOTEBOOKS = {path.name: json.loads(path.read_text(encoding="utf-8")) for path in DOCS.glob("notebooks/*.ipynb")}


def code_cells(name):
    return [cell for cell in NOTEBOOKS[name]["cells"] if cell["cell_type"] == "code"]


@pytest.mark.slow
@pytest.mark.parametrize("name", NOTEBOOKS)
def test_the_code_of_a_notebook_runs_and_prints_what_it_shows(name, tmp_path):
    script = "\n".join("".join(cell["source"]) for cell in code_cells(name))
    environment = {**os.environ, "MPLBACKEND": "agg"}
    done = run_python(script, cwd=tmp_path, env=environment, timeout=300)
    outputs = [output for cell in code_cells(name) for output in cell["outputs"] if output["output_type"] == "stream"]
    assert unlike("".join("".join(output["text"]) for output in outputs), done.stdout) == []


SHOWN = {name for text in PAGES.values() for name in re.findall(r"!\[[^]]*\]\([./docs]*/?figures/([^)]+)\)", text)}
BESIDE = "tutorial-beside.svg"
"""What a command of the tutorial draws; all others are drawn by the benchmark `figures`."""


def kept(name):
    return (DOCS / "figures" / name).read_bytes()


def same_drawing(one, other):
    """Whether two SVG texts have the same words, and lines within two pixels of one another."""
    words, places = (
        [re.findall(pattern, text) for text in (one, other)] for pattern in (r">([^<]+)<", r"-?\d+(?:\.\d+)?")
    )
    return words[0] == words[1] and np.allclose(*(np.array(own, float) for own in places), atol=2.0)


def test_every_picture_of_the_pages_is_drawn_by_a_command_and_none_is_left_over():
    assert {*DRAWN, BESIDE} == SHOWN == {path.name for path in (DOCS / "figures").iterdir()}


def test_the_pictures_of_tables_are_those_of_the_tables_and_that_of_the_report_has_the_colours_of_the_page():
    for name in ("detection.svg", "measured.svg", "windy.svg"):
        assert kept(name).decode() == DRAWN[name](), name
    with Image.open(DOCS / "figures" / "report.png") as image:
        picture = np.array(image)[..., :3]
    for role in ("measured", "before", "after"):
        assert (picture == [*bytes.fromhex(COLOURS[role][1:])]).all(-1).any(), role


@pytest.mark.slow
def test_the_pictures_of_the_scenario_and_the_tutorial_are_those_of_today(typed_page):
    assert same_drawing(kept("closed-loop-identifier.svg").decode(), DRAWN["closed-loop-identifier.svg"]())
    (drawn,) = typed_page("docs/tutorial.md")[1].rglob("beside.svg")
    assert same_drawing(kept(BESIDE).decode(), drawn.read_text())


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")
def test_the_search_works_in_a_page_that_is_opened_as_a_file(tmp_path):
    mkdocs = Path(sys.executable).with_name("mkdocs")
    run_program([mkdocs, "build", "--quiet", "--site-dir", tmp_path / "site"], cwd=ROOT)
    with Chromium(tmp_path / "profile") as browser:
        browser.open(tmp_path / "site" / "index.html", 1280)
        browser.value("document.querySelector('input.md-search__input').focus()")
        for letter in "friction":
            browser.call("Input.insertText", text=letter)
        hits = "document.querySelectorAll('.md-search-result__item').length"
        browser.value(f"new Promise(done => setInterval(() => {hits} && done(), 50))")
        assert not [address for address in browser.requests() if not address.startswith(("file:", "data:"))]
