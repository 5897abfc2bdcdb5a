"""Faults of tests/faults are answered by heli_identifier, heli_plant and fmu_src as docs/reliability.md says."""

import pytest

from tests.faults.case import try_fault
from tests.faults.page import FAULTS, PAGE, SECTIONS, cell

# Faults that need processes of their own take seconds each: the first of every third section, and every third FMU that
# is no unit, are tried each time, the others by `make test-all`.
QUICK = {next((fault.what for fault in faults if fault.shell), "") for faults in list(SECTIONS.values())[::3]}
QUICK |= {fault.what for fault in SECTIONS["FMU files"][::3]}
CASES = [
    pytest.param(
        fault,
        id=f"{section}: {fault.what}",
        marks=[pytest.mark.slow] if (fault.shell or section == "FMU files") and fault.what not in QUICK else [],
    )
    for section, fault in FAULTS
]


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize("fault", CASES)
def test_a_fault_gets_one_sentence_and_its_exit_code_and_leaves_nothing_behind(tmp_path, fault):
    answer = try_fault(fault, tmp_path)
    assert answer.code == fault.code, answer.printed
    assert fault.said in answer.sentence, answer.printed
    assert "Traceback" not in answer.printed
    assert answer.left == ()
    if fault.code == 2 and not fault.shell:
        refusals = [line for line in answer.printed.splitlines() if line.startswith("heli: ")]
        assert len(refusals) == 1


def test_the_page_has_every_fault_with_what_is_said():
    text = PAGE.read_text(encoding="utf-8")
    for section, fault in FAULTS:
        part = text.partition(f"### {section}\n")[2].partition("\n### ")[0]
        (row,) = [line for line in part.splitlines() if line.startswith(f"| {cell(fault.what)} | {fault.code} |")]
        assert cell(fault.said) in row
