"""The report for those who print it, and for those who have it read to them."""

import re
import shutil
import subprocess
from html.parser import HTMLParser
from importlib.util import find_spec
from pathlib import Path

import pytest

from heli_identifier.results.report import report_page
from tests.chromium import CHROMIUM, Chromium
from tests.diagnosis_example import adequate, example

PACKAGE = find_spec("axe_playwright_python")
AXE = Path(PACKAGE.origin or "").with_name("axe.min.js") if PACKAGE else None


class Outline(HTMLParser):
    """Levels of the headings, and the attributes of header cells, figures and the page."""

    def __init__(self, text):
        super().__init__()
        self.levels, self.tags = [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if re.fullmatch("h[1-6]", tag):
            self.levels.append(int(tag[1]))

    def of(self, wanted):
        return [attributes for tag, attributes in self.tags if tag == wanted]


@pytest.fixture(scope="module", params=[example, adequate], ids=["effects", "clean"])
def outline(request):
    return Outline(report_page(request.param(), "rig"))


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    file = tmp_path_factory.mktemp("page") / "report.html"
    file.write_text(report_page(example(), "rig"), encoding="utf-8")
    return file


def test_headings_begin_with_one_title_and_leave_no_level_out(outline):
    assert outline.levels[0] == 1
    assert outline.levels.count(1) == 1
    assert all(below <= above + 1 for above, below in zip(outline.levels, outline.levels[1:], strict=False))


def test_every_header_cell_says_that_it_heads_a_column(outline):
    assert outline.of("th")
    assert all(cell.get("scope") == "col" for cell in outline.of("th"))


def test_every_figure_is_an_image_with_a_sentence_and_the_page_has_a_language(outline):
    figures = [figure for figure in outline.of("svg") if figure.get("role") == "img"]
    assert figures
    assert len(figures) == len([svg for svg in outline.of("svg") if "figure" in (svg.get("class") or "")])
    assert all(len(figure.get("aria-label") or "") > 20 for figure in figures)
    assert outline.of("html")[0]["lang"] == "en"


@pytest.mark.skipif(CHROMIUM is None or AXE is None, reason="Chromium or axe-core (axe-playwright-python) is missing")
@pytest.mark.parametrize("width", [1280, 400])
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.slow
def test_axe_finds_nothing(page, tmp_path, width, dark):
    with Chromium(tmp_path / "profile") as browser:
        browser.open(page, width, dark)
        browser.value(f"{AXE.read_text(encoding='utf-8')}; 1")
        found = browser.awaited("axe.run(document).then(r => r.violations.map(v => [v.id, v.nodes[0].html]))")
        assert found == []
        assert browser.awaited("axe.run(document).then(r => r.passes.length)") > 10


@pytest.mark.skipif(CHROMIUM is None or shutil.which("pdftotext") is None, reason="Chromium or pdftotext is missing")
def test_no_page_of_the_print_ends_with_a_heading_or_begins_with_the_last_row_of_a_table(page, tmp_path):
    with Chromium(tmp_path / "profile") as browser:
        browser.open(page, 1280)
        browser.printed(tmp_path / "report.pdf")
    text = subprocess.run(
        ["pdftotext", "-layout", str(tmp_path / "report.pdf"), "-"], capture_output=True, text=True, check=True
    ).stdout
    pages = [[line.strip() for line in part.splitlines() if line.strip()] for part in text.split("\f")]
    headings = {re.sub(r"<[^>]+>", "", text).strip() for text in re.findall("<h[23]>(.*?)</h", page.read_text())}
    assert len(headings) > 5
    assert [lines[-1] for lines in pages if lines and lines[-1] in headings] == []
