"""docs/reliability.md: every fault that is tried, and the answer of the software."""

from tests.faults import flights, inputs, logs, outputs, units, usage
from tests.faults.case import ROOT, Fault

PAGE = ROOT / "docs" / "reliability.md"
SECTIONS: dict[str, tuple[Fault, ...]] = {}
for one in (outputs, logs, inputs, units, flights, usage):
    SECTIONS |= one.SECTIONS
FAULTS = [(section, fault) for section, faults in SECTIONS.items() for fault in faults]


def cell(text: str) -> str:
    """Return a text as a cell of a table."""
    return text.replace("|", "\\|").replace("<", "&lt;")
