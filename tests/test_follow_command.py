"""`heli follow` and `heli stream`: what came in is on disk whatever happens, and the twin sees uniform instants."""

import json
import signal
import socket
import subprocess
import sys
from contextlib import ExitStack
from time import monotonic, sleep

import numpy as np
import pytest

from heli_identifier.cli.flight import choose_part
from heli_identifier.records import demo_files, read_log, write_log
from heli_identifier.results.parameters import PLANT
from tests.commands import HELI, run_python
from tests.diagnosis_example import parameter_set
from tests.test_live import LONGEST, H, make_datagram


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    """A folder with a log of 12 s, too short for a diagnosis, and the parameters of a twin of this rig."""
    folder = tmp_path_factory.mktemp("flight")
    write_log(read_log(demo_files("rig-c")[1][0], end=12.0), folder / "log.csv")
    parameter_set(0.003, ["k_x"]).write(folder / "parameters.json")
    return folder


def test_the_longest_stretch_after_the_last_change_is_diagnosed():
    times = np.array([k * H for k in range(10000) if not 7000 <= k < 7100])
    alarm = {"what": "alarm", "since_s": 30.0}
    assert choose_part(times, []) == pytest.approx((0.0, 69.99))
    assert choose_part(times, [alarm]) == pytest.approx((30.0, 69.99))
    assert choose_part(times, [alarm, {"what": "adopted", "since_s": 80.0}]) == pytest.approx((80.0, 99.99))
    assert choose_part(times[:1], []) == (0.0, 0.0)


FLOWN = {"events.json", "recorded.csv", "predictions.csv"}
CONCLUDED = {*FLOWN, "following.json", f"{PLANT}.fmu"}


@pytest.fixture
def start_follow(interruptible, tmp_path):
    """Start ``heli follow --listen`` on a free port; returns the process and the port. No process is left."""
    with ExitStack() as processes:

        def start(*words):
            process = subprocess.Popen(
                [sys.executable, "-c", HELI, "follow", "--listen", "127.0.0.1:0", *map(str, words)],
                cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            )  # fmt: skip
            processes.enter_context(process)
            processes.callback(process.kill)
            line = process.stderr.readline()
            return process, int(line.rpartition(":")[2])

        yield start


def wait_for_rows(path, rows):
    """Wait until a file has this many rows below its header."""
    began = monotonic()
    while not path.exists() or path.read_bytes().count(b"\n") < rows + 1:
        assert monotonic() - began < LONGEST
        sleep(0.02)


def test_a_log_that_is_streamed_is_followed_and_ctrl_c_leaves_every_file(flight, tmp_path, start_follow):
    parameters = flight / "parameters.json"
    process, port = start_follow("-p", parameters, "-o", "out")
    sent = run_python(HELI, "stream", flight / "log.csv", "--address", f"127.0.0.1:{port}", "--speed", 12)
    assert "1201 samples" in sent.stdout
    wait_for_rows(tmp_path / "out/recorded.csv", 1201)
    process.send_signal(signal.SIGINT)
    out, errors = process.communicate(timeout=LONGEST)
    assert process.returncode == 130, errors
    folder = tmp_path / "out"
    assert {path.name for path in folder.iterdir()} == CONCLUDED
    log, recorded = read_log(flight / "log.csv"), read_log(folder / "recorded.csv")
    assert (recorded.voltages == log.voltages).all() and (recorded.angles == log.angles).all()
    assert recorded.time == pytest.approx(log.time, abs=1e-9)
    assert "too short for a diagnosis" in errors and "1201 samples" in out


@pytest.mark.parametrize("end, code", [("kill", None), pytest.param("terminate", 143, marks=pytest.mark.slow)])
def test_what_came_in_before_the_flight_was_ended_is_on_disk(flight, tmp_path, start_follow, end, code):
    """Each sample is recorded as soon as it is in order."""
    process, port = start_follow("-p", flight / "parameters.json", "-o", "out")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as rig:
        for k in range(40):
            rig.sendto(make_datagram(k), ("127.0.0.1", port))
            sleep(0.001)
    wait_for_rows(tmp_path / "out/recorded.csv", 40)
    getattr(process, end)()
    _, errors = process.communicate(timeout=LONGEST)
    assert code in (None, process.returncode) and "Traceback" not in errors
    rows = np.loadtxt(tmp_path / "out/recorded.csv", delimiter=",", skiprows=1)
    assert (1000 * rows[:, 3]).round().tolist() == list(range(40))
    assert {path.name for path in (tmp_path / "out").iterdir()} == FLOWN
    assert isinstance(json.loads((tmp_path / "out/events.json").read_text()), list)
