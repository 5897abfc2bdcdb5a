"""docs/reliability.md: every fault that is tried, and what the software says to it."""

import signal
import tempfile
from pathlib import Path

from tests.faults import flights, inputs, logs, outputs, units, usage
from tests.faults.case import ROOT, Fault, tried

PAGE = ROOT / "docs" / "reliability.md"
SECTIONS: dict[str, tuple[Fault, ...]] = {
    **outputs.SECTIONS,
    **logs.SECTIONS,
    **inputs.SECTIONS,
    **units.SECTIONS,
    **flights.SECTIONS,
    **usage.SECTIONS,
}
FAULTS = [(section, fault) for section, faults in SECTIONS.items() for fault in faults]

_BEGIN = "<!-- the tests write what follows: python -m tests.faults -->"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;")


def main() -> None:
    """Try every fault and write the page."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # it is ignored, also by children, in the background
    lines = []
    for section, faults in SECTIONS.items():
        lines += [f"### {section}", "", "| fault | exit code | what is said |", "|---|---|---|"]
        for fault in faults:
            with tempfile.TemporaryDirectory() as folder:
                code, sentence, printed, left = tried(fault, Path(folder))
            if code != fault.code or not sentence or left or "Traceback" in printed:
                print(f"{section}: {fault.what}: code {code}, left {left}\n{printed[-1500:]}\n")
            lines.append(f"| {_cell(fault.what)} | {code} | {_cell(sentence.removeprefix('heli: '))} |")
        lines.append("")
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text("\n".join([text[: text.index(_BEGIN)] + _BEGIN, "", *lines]), encoding="utf-8")
