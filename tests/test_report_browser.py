"""The page in a real browser: silent, fits a desk and a telephone, both themes, on paper, and for those who hear it.
The browser is a headless Chromium, driven over its DevTools pipe: no package is needed for it."""

import base64
import json
import os
import re
import shutil
import subprocess
from importlib.util import find_spec
from pathlib import Path

import pytest

from heli_identifier.results.report import report_page
from tests.diagnosis_example import example_diagnosis

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--hide-scrollbars", "--remote-debugging-pipe",
)  # fmt: skip


class Chromium:
    """One browser with one page; a context manager."""

    def __init__(self, profile: Path) -> None:
        order_in, order_out = os.pipe()
        answer_in, answer_out = os.pipe()
        # the browser reads its orders from descriptor 3 and answers on 4
        begin = ["bash", "-c", f'exec "$@" 3<&{order_in} 4>&{answer_out}', "bash", str(CHROMIUM)]
        self.process = subprocess.Popen(
            [*begin, *FLAGS, f"--user-data-dir={profile}"], pass_fds=(order_in, answer_out),
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(order_in)
        os.close(answer_out)
        self.orders, self.answers = os.fdopen(order_out, "wb", 0), os.fdopen(answer_in, "rb")
        self.count, self.buffer, self.events, self.session = 0, b"", [], None

    def __enter__(self):
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(120)
        self.orders.close()
        self.answers.close()

    def call(self, method, **parameters):
        """Give the answer to a command; events that come before it are kept."""
        self.count += 1
        order = {"id": self.count, "method": method, "params": parameters}
        if self.session:
            order["sessionId"] = self.session
        self.orders.write(json.dumps(order).encode() + b"\0")
        while True:
            message = self._next()
            if message.get("id") == self.count:
                assert "error" not in message, f"{method}: {message['error']}"
                return message["result"]
            self.events.append(message)

    def _next(self):
        while b"\0" not in self.buffer:
            chunk = self.answers.read1(1 << 20)
            assert chunk, "the browser has gone"
            self.buffer += chunk
        text, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(text)

    def open(self, page: Path, width: int, dark: bool = False) -> None:
        """Load a file at a width [CSS px] in a theme and wait until it is there."""
        self.events.clear()
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", media="", features=[scheme])
        self.call("Page.navigate", url=page.as_uri())
        while not any(event.get("method") == "Page.loadEventFired" for event in self.events):
            self.events.append(self._next())

    def value(self, script):
        """Give the value of a JavaScript expression, or what its promise resolves to."""
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def complaints(self):
        """Everything that the page wrote to the console or the log."""
        kinds = ("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded")
        return [event["params"] for event in self.events if event.get("method") in kinds]

    def requests(self):
        """Addresses that the page asked for."""
        sent = [event["params"] for event in self.events if event.get("method") == "Network.requestWillBeSent"]
        return [event["request"]["url"] for event in sent]


pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")

PACKAGE = find_spec("axe_playwright_python")
AXE = Path(PACKAGE.origin or "").with_name("axe.min.js") if PACKAGE else None

OVERFLOWING = """
Array.from(document.querySelectorAll('body *')).filter(e =>
  !e.closest('.scroll') && e.getBoundingClientRect().right > innerWidth + 1).map(e => e.outerHTML.slice(0, 80))
"""
CUT = """
Array.from(document.querySelectorAll('svg.figure text')).filter(t => {
  const word = t.getBoundingClientRect(), frame = t.ownerSVGElement.getBoundingClientRect();
  return word.left < frame.left || word.right > frame.right || word.top < frame.top || word.bottom > frame.bottom;
}).map(t => t.textContent)
"""
LETTERS = """
Math.min(...Array.from(document.querySelectorAll('svg.figure text')).map(t =>
  parseFloat(getComputedStyle(t).fontSize) * t.ownerSVGElement.getScreenCTM().a))
"""


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    file = tmp_path_factory.mktemp("page") / "report.html"
    file.write_text(report_page(example_diagnosis(), "rig"), encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with Chromium(tmp_path_factory.mktemp("profile")) as opened:
        yield opened


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize(("width", "longest"), [(1280, 5000), (390, 10_000)])
def test_the_page_is_silent_and_short_and_fits_and_can_be_read(browser, page, width, longest, dark):
    browser.open(page, width, dark)
    assert browser.complaints() == []
    assert [address for address in browser.requests() if not address.startswith(("file:", "data:"))] == []
    assert browser.value("document.documentElement.scrollWidth") == width
    assert browser.value("document.documentElement.scrollHeight") < longest
    assert browser.value(OVERFLOWING) == [] and browser.value(CUT) == []
    assert browser.value(LETTERS) > 7.0  # a label of fewer CSS px cannot be read on a telephone


def test_details_are_folded_on_a_screen_and_open_on_white_paper(browser, page):
    height = "document.querySelector('details.fold').getBoundingClientRect().height"
    background = "getComputedStyle(document.body).backgroundColor"
    browser.open(page, 390, dark=True)
    assert browser.value(height) < 100 and browser.value(background) == "rgb(15, 19, 24)"
    browser.call("Emulation.setEmulatedMedia", media="print")
    assert browser.value(height) > 300 and browser.value(background) == "rgb(255, 255, 255)"
    assert browser.value("getComputedStyle(document.body).color") == "rgb(27, 31, 36)"


@pytest.mark.skipif(AXE is None, reason="axe-core (axe-playwright-python) is missing")
@pytest.mark.parametrize("width", [1280, pytest.param(400, marks=pytest.mark.slow)])
@pytest.mark.parametrize("dark", [False, pytest.param(True, marks=pytest.mark.slow)], ids=["light", "dark"])
def test_axe_finds_nothing(browser, page, width, dark):
    browser.open(page, width, dark)
    browser.value(f"{AXE.read_text(encoding='utf-8')}; 1")
    found = browser.value("axe.run(document).then(r => r.violations.map(v => [v.id, v.nodes[0].html]))")
    assert found == [] and browser.value("axe.run(document).then(r => r.passes.length)") > 10


@pytest.mark.skipif(shutil.which("pdftotext") is None, reason="pdftotext is missing")
def test_no_page_of_the_print_ends_with_a_heading(browser, page, tmp_path):
    browser.open(page, 1280)
    printed = browser.call("Page.printToPDF", preferCSSPageSize=True, printBackground=True)["data"]
    (tmp_path / "report.pdf").write_bytes(base64.b64decode(printed))  # on A4
    text = subprocess.check_output(["pdftotext", "-layout", str(tmp_path / "report.pdf"), "-"], text=True)
    pages = [[line.strip() for line in part.splitlines() if line.strip()] for part in text.split("\f")]
    headings = {re.sub(r"<[^>]+>", "", text).strip() for text in re.findall("<h[23]>(.*?)</h", page.read_text())}
    assert len(headings) > 5
    assert [lines[-1] for lines in pages if lines and lines[-1] in headings] == []
