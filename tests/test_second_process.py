"""The process beside a command: it gives what the command would make itself, and leaves nothing behind."""

import os
import subprocess
import sys
from textwrap import dedent
from time import monotonic, sleep

import pytest

from heli_identifier.report.page import report_page
from heli_identifier.report.provenance import provenance
from heli_identifier.second_process import SecondProcess
from tests.diagnosis_example import example

ORDER = (example(), provenance(["heli"]), "a <rig>")


def test_page_is_the_one_drawn_here():
    with SecondProcess() as second:
        second.wait_until_compiled()
        assert second.report_page(*ORDER) == report_page(*ORDER)


def test_page_does_not_wait_for_somebody_to_hear_that_all_is_compiled():
    with SecondProcess() as second:
        assert second.report_page(*ORDER) == report_page(*ORDER)


def test_command_draws_itself_when_the_process_is_gone():
    with SecondProcess() as second:
        second.process.kill()
        second.process.join()
        second.wait_until_compiled()
        assert second.report_page(*ORDER) == report_page(*ORDER)


def test_single_core_has_no_second_process(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    with SecondProcess() as second:
        second.wait_until_compiled()
        assert not hasattr(second, "process")
        assert second.report_page(*ORDER) == report_page(*ORDER)


def test_command_goes_on_where_no_process_can_be_started(monkeypatch):
    def refused(*_arguments):
        raise BlockingIOError("Resource temporarily unavailable")

    monkeypatch.setattr("multiprocessing.context.SpawnProcess.start", refused)
    with SecondProcess() as second:
        second.wait_until_compiled()
        assert second.report_page(*ORDER) == report_page(*ORDER)


def test_block_that_fails_ends_the_process_at_once():
    began = monotonic()
    with pytest.raises(ZeroDivisionError), SecondProcess() as second:
        raise ZeroDivisionError
    assert not second.process.is_alive()
    # far less than it takes to import what it draws with
    assert monotonic() - began < 5.0


def is_running(process: int) -> bool:
    """Whether a process has not ended; one that nobody has collected yet has."""
    try:
        with open(f"/proc/{process}/stat") as stat:
            return stat.read().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="looks at processes where Linux shows them")
def test_killed_command_leaves_no_process_behind():
    program = """
        import time
        from heli_identifier.second_process import SecondProcess

        if __name__ == "__main__":
            with SecondProcess() as second:
                print(second.process.pid, flush=True)
                time.sleep(60)
    """
    with subprocess.Popen([sys.executable, "-c", dedent(program)], stdout=subprocess.PIPE, text=True) as command:
        assert command.stdout is not None
        own = int(command.stdout.readline())
        assert is_running(own)
        command.kill()
    deadline = monotonic() + 60.0  # it notices when it next says or hears something
    while is_running(own) and monotonic() < deadline:
        sleep(0.1)
    assert not is_running(own)


def test_everything_that_a_diagnosis_runs_is_compiled_before_it_is_wanted(tmp_path):
    program = """
        from numba.core import event
        from heli_identifier.diagnosis import compiling

        compiling.compile_observer()
        assert compiling.observer_is_compiled()
        compiling.compile_whitening()
        compiling.compile_judgement()

        import heli_identifier as hi
        from heli_identifier.records import demo_logs, read_logs

        class Compiled(event.Listener):
            names = []
            def on_start(self, found):
                self.names.append(found.data["dispatcher"].py_func.__qualname__)
            def on_end(self, found):
                pass

        training, held_out = map(read_logs, demo_logs("rig-a"))
        listener = Compiled()
        event.register("numba:compile", listener)
        assert hi.diagnose(training, validate=held_out).effects
        print("compiled:", listener.names)
    """
    done = subprocess.run(
        [sys.executable, "-c", dedent(program)],
        env={**os.environ, "HELI_CACHE_DIR": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.strip() == "compiled: []", done.stderr
