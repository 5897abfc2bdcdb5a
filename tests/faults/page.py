"""docs/reliability.md: every fault that is tried, and what the software says to it."""

import signal
import tempfile
from pathlib import Path

from tests.faults import flights, inputs, logs, outputs, units, usage
from tests.faults.case import ROOT, Answer, Fault, tried

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


def row(fault: Fault, answer: Answer) -> str:
    """Give the row of a fault."""
    said = answer.sentence.removeprefix("heli: ")
    return f"| {_cell(fault.what)} | {answer.code} | {_cell(said)} |"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;")


def tables(answers: dict[tuple[str, str], Answer]) -> str:
    """Give the tables of all faults; ``answers`` by section and fault."""
    parts = []
    for section, faults in SECTIONS.items():
        rows = [row(fault, answers[section, fault.what]) for fault in faults]
        parts.append(
            "\n".join([f"### {section}", "", "| fault | exit code | what is said |", "|---|---|---|", *rows, ""])
        )
    return "\n".join(parts)


def main() -> None:
    """Try every fault and write the page."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # it is ignored, also by children, in the background
    answers = {}
    for section, fault in FAULTS:
        with tempfile.TemporaryDirectory() as folder:
            answer = answers[section, fault.what] = tried(fault, Path(folder))
        good = answer.code == fault.code and answer.sentence and not answer.left and "Traceback" not in answer.printed
        if not good:
            print(f"{section}: {fault.what}: code {answer.code}, left {answer.left}\n{answer.printed[-1500:]}\n")
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(f"{text[: text.index(_BEGIN)]}{_BEGIN}\n\n{tables(answers)}", encoding="utf-8")
