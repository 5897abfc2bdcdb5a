"""Every fault of tests/faults is answered as it should be, and docs/reliability.md says so."""

import pytest

from tests.faults.page import FAULTS, PAGE, _cell, tried


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize(("section", "fault"), FAULTS, ids=[f"{section}: {fault.what}" for section, fault in FAULTS])
def test_a_fault_gets_one_sentence_and_its_exit_code_and_leaves_nothing_behind(tmp_path, section, fault):
    answer = tried(fault, tmp_path)
    assert answer.code == fault.code, answer.printed
    assert fault.said in answer.sentence, answer.printed
    assert "Traceback" not in answer.printed
    assert answer.left == ()
    if fault.code == 2 and not fault.shell:
        refusals = [line for line in answer.printed.splitlines() if line.startswith("heli: ")]
        assert len(refusals) == 1


@pytest.mark.parametrize(("section", "fault"), FAULTS, ids=[f"{section}: {fault.what}" for section, fault in FAULTS])
def test_the_page_has_every_fault_with_what_is_said(section, fault):
    part = PAGE.read_text(encoding="utf-8").partition(f"### {section}\n")[2].partition("\n### ")[0]
    (row,) = [line for line in part.splitlines() if line.startswith(f"| {_cell(fault.what)} | {fault.code} |")]
    assert _cell(fault.said) in row
