"""The process that draws the report beside the command: the same page, and the command does without it."""

import os
import subprocess
import sys
from textwrap import dedent

import pytest
from heli_identifier.workbench.report.drawn_beside import drawn_beside

from heli_identifier.workbench.report.page import report_page
from tests.diagnosis_example import example

DIAGNOSIS = example()
ORDER = (DIAGNOSIS, DIAGNOSIS.provenance, "a <rig>")


def test_the_page_is_the_one_drawn_here():
    with drawn_beside() as draw:
        assert draw(*ORDER) == report_page(*ORDER)


@pytest.mark.parametrize("reason", ["one core", "no process to be had", "it ends at once"])
def test_the_command_draws_itself_where_there_is_no_process(monkeypatch, reason):
    if reason == "one core":
        monkeypatch.setattr(os, "cpu_count", lambda: 1)
    else:
        executable = "/nowhere/python" if reason == "no process to be had" else "/bin/false"
        monkeypatch.setattr(sys, "executable", executable)
    with drawn_beside() as draw:
        assert draw(*ORDER) == report_page(*ORDER)


@pytest.mark.skipif(sys.platform != "linux", reason="finds children where Linux shows them")
def test_a_block_that_fails_leaves_no_process_behind():
    program = """
        import os
        from pathlib import Path
        from heli_identifier.workbench.report.drawn_beside import drawn_beside

        def children():
            return Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()

        try:
            with drawn_beside():
                print(len(children()))
                raise ZeroDivisionError
        except ZeroDivisionError:
            print(len(children()))
    """
    done = subprocess.run([sys.executable, "-c", dedent(program)], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["1" if (os.cpu_count() or 1) > 1 else "0", "0"]
