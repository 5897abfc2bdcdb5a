"""Faults, tried by the tests, and what the software says to each: tries all of them and writes docs/reliability.md."""

import signal
import tempfile
from pathlib import Path

from tests.faults.case import try_fault
from tests.faults.page import PAGE, SECTIONS, cell

BEGIN = "<!-- the tests write what follows: python -m tests.faults -->"

signal.signal(signal.SIGINT, signal.default_int_handler)  # it is ignored, also by children, in the background
lines = []
for section, faults in SECTIONS.items():
    lines += [f"### {section}", "", "| fault | exit code | what is said |", "|---|---|---|"]
    for fault in faults:
        with tempfile.TemporaryDirectory() as folder:
            code, sentence, printed, left = try_fault(fault, Path(folder))
        if code != fault.code or not sentence or left or "Traceback" in printed:
            print(f"{section}: {fault.what}: code {code}, left {left}\n{printed[-1500:]}\n")
        lines.append(f"| {cell(fault.what)} | {code} | {cell(sentence.removeprefix('heli: '))} |")
    lines.append("")
text = PAGE.read_text(encoding="utf-8")
PAGE.write_text("\n".join([text[: text.index(BEGIN)] + BEGIN, "", *lines]), encoding="utf-8")
