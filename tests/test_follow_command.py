"""`heli follow` and `heli stream`: what came in is on disk whatever happens, and the twin sees uniform instants."""

import csv
import http.client
import json
import os
import random
import re
import signal
import socket
import subprocess
import sys
from contextlib import ExitStack
from io import StringIO
from threading import Thread
from time import monotonic, sleep

import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner

from heli_identifier.cli.app import app
from heli_identifier.cli.in_flight import Adviser, controller_of, part
from heli_identifier.errors import ConfigurationError
from heli_identifier.live import USUAL_LAYOUT, Datagram, Port, Timed, encode, read_layout
from heli_identifier.live.grid import Grid, continued, passed, place, rate_of
from heli_identifier.live.journal import Journal
from heli_identifier.live.listening import Listening
from heli_identifier.live.playing import played
from heli_identifier.live.screen import drawn
from heli_identifier.live.sending import resolved, send
from heli_identifier.live.server import served
from heli_identifier.live.session import Session, check_unused
from heli_identifier.online import Estimate
from heli_identifier.records import CONTRACT, Log, LogFormat, demo_logs, read_log, write_log
from heli_identifier.results.parameters import PLANT, ParameterSet, plant_values
from heli_plant.control import PidSettings
from heli_plant.parameters import TABLE_2

H = 0.01
LAYOUT = read_layout(USUAL_LAYOUT)
MAIN = [sys.executable, "-c", "from heli_identifier.cli import main; main()"]
LONGEST = 180.0
"""Time after which a process is taken for hung [s]; a loaded machine is no defect."""


def run(*words):
    return CliRunner().invoke(app, list(map(str, words)))


def timed(number, h=H, offset=0.0):
    return Timed(offset + number * h, number, (0.0, 0.0, 0.001 * number, 0.0, 0.0))


def rows_of(path):
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    assert header == ["time [s]", "v_front [V]", "v_rear [V]", "pitch [rad]", "elevation [rad]", "travel [rad]"]
    return [tuple(map(float, row)) for row in rows]


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    """A folder with a log of 12 s, too short for a diagnosis, and the parameters of a twin of this rig."""
    folder = tmp_path_factory.mktemp("flight")
    write_log(read_log(demo_logs("rig-c")[1][0], end=12.0), folder / "log.csv")
    ParameterSet(PLANT, plant_values(TABLE_2, {"k_x": Estimate(TABLE_2.k_x, 0.001, "rad/s^2/V")})).write(
        folder / "parameters.json"
    )
    return folder


# --- uniform instants ------------------------------------------------------------------------------------------------


def test_instants_are_counted_by_the_numbers_of_samples_and_without_numbers_by_their_times():
    for number in (7, -1):
        grid = Grid(H, Timed(0.07, number, ()))
        ticks = []
        for k in (7, 8, 11, 12):
            grid, tick = place(grid, Timed(k * H + 0.002, k if number >= 0 else -1, ()))
            ticks.append(tick)
        assert ticks == [0, 1, 4, 5]


def test_a_damaged_number_is_not_believed():
    grid, _ = place(Grid(H, timed(0)), timed(0))
    _, tick = place(grid, timed(1)._replace(number=2**50))
    assert tick == 1


def test_of_two_samples_in_one_instant_the_second_is_left_out():
    grid, first = place(Grid(H, Timed(0.0, -1, ())), Timed(0.0, -1, ()))
    _, second = place(grid, Timed(0.004, -1, ()))
    assert (first, second) == (0, -1)


def test_a_rig_whose_clock_stood_while_nothing_came_in_goes_on_at_the_next_instant():
    grid, _ = place(Grid(H, timed(0)), timed(0))
    grid, tick = place(passed(grid, 500), timed(1))
    assert tick == 501 and grid.time_of(timed(2)) == pytest.approx(5.02)
    assert continued(grid, timed(0, offset=1e6), 22)[1] == 523


def test_the_rate_is_found_from_uneven_times():
    generator = random.Random(1)
    times = [0.002 * k + 1e-4 * generator.random() for k in range(51)]
    assert rate_of([Timed(time, -1, ()) for time in times]) == 500.0


# --- what comes in by the network ------------------------------------------------------------------------------------


def heard(samples, until, pause=0.0, at=0, format=CONTRACT, layout=LAYOUT, rate=None):
    """Instants and kept rows of a listener to whom ``samples`` are sent without delay, but for a ``pause`` before one.

    The instants are those of the rig's clock, in the datagrams, so that a busy machine changes none of them.
    """
    kept, seen = [], []
    port = Port("127.0.0.1", 0, "", layout)
    try:
        listening = Listening(port, rate, format, lambda time, signals: kept.append((time, *signals)))
    except ConfigurationError:
        port.close()
        raise

    def sender():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as rig:
            for place_, (_, content) in enumerate(samples):
                if place_ == at:
                    sleep(pause)
                rig.sendto(content, port.address)

    thread = Thread(target=sender)
    thread.start()
    began = monotonic()
    try:
        for sample in listening.instants():
            if sample is not None:
                seen.append(sample)
            elif until(listening, seen, kept):
                break
            assert monotonic() - began < LONGEST
    finally:
        thread.join()
        port.close()
    return seen, kept, listening


def datagram(number):
    return encode(Datagram(number, number * H, (1.0, 2.0, 0.001 * number, 0.1, 0.2)), LAYOUT)


def test_a_network_that_loses_doubles_and_delays_gives_every_instant_once():
    """5 % lost, 2 % twice, 20 ms of jitter, and rubbish; 2 s of flight."""
    generator = random.Random(3)
    there = [k for k in range(200) if generator.random() > 0.05 or k in (0, 199)]
    sent = [(k * H + 0.02 * generator.random(), datagram(k)) for k in there]
    sent += [(at + 0.005, content) for at, content in sent if generator.random() < 0.02]
    sent += [(at, b"rubbish") for at in (0.3, 0.9)]
    sent = [(0.0, datagram(0)), *sorted(sent)[1:]]
    seen, kept, listening = heard(sent, lambda rig, seen, kept: len(seen) >= 200)
    fresh = [k for k, sample in enumerate(seen[:200]) if sample.fresh]
    assert fresh == there
    assert all(seen[k].pitch == 0.001 * k for k in fresh)
    assert [row[0] for row in kept] == sorted({row[0] for row in kept})
    assert listening.status.refused == 2 and listening.rate == 100.0


def test_while_a_stream_stops_instants_go_on_without_samples_and_then_with_them():
    sent = [(k * H, datagram(k)) for k in (*range(60), *range(160, 220))]
    brought = []

    def until(rig, seen, kept):
        brought.append(len(seen) if len(kept) == 60 else 0)
        return sum(sample.fresh for sample in seen) == 120

    seen, kept, listening = heard(sent, until, pause=1.0, at=60)
    fresh = [bool(sample.fresh) for sample in seen]
    first = fresh.index(False)
    again = fresh.index(True, first)
    # The clock of this computer brings instants while the rig is silent, and the clock of the rig those that are still
    # missing when it sends again; a busy machine may find the silence longer than it was.
    assert first == 60 and max(brought) > 60
    assert again == 160 or (again == max(brought) > 160)
    assert fresh[again:] == [True] * 60
    assert len(kept) == 120


def test_the_signs_of_the_rig_are_put_right_as_in_its_logs():
    form = LogFormat(signs={"pitch": -1}, swap_rotors=True, clip=True, voltage_limit=1.5)
    sent = [(k * H, datagram(k)) for k in range(60)]
    _, kept, _ = heard(sent, lambda rig, seen, kept: len(seen) >= 60, format=form)
    assert kept[50][1:] == (1.5, 1.0, -0.05, 0.1, 0.2)


def test_a_stream_without_time_needs_the_rate():
    layout = read_layout("v_front v_rear pitch elevation travel")
    with pytest.raises(ConfigurationError, match="--rate"):
        heard([], lambda *_: True, layout=layout)
    sent = [(k * H, datagram(k)[16:]) for k in range(60)]
    seen, kept, _ = heard(sent, lambda rig, seen, kept: len(seen) >= 60, layout=layout, rate=100.0)
    assert [round(row[0] / H) for row in kept] == list(range(60)) and len(seen) >= 60


def test_a_rig_too_slow_to_be_followed_is_refused():
    sent = [(0.1 * k, encode(Datagram(k, 0.1 * k, (0.0,) * 5), LAYOUT)) for k in range(60)]
    with pytest.raises(ConfigurationError, match="the rig sends at 10 Hz, 50 to 2000 Hz are followed"):
        heard(sent, lambda *_: False)


# --- files, screen and page ------------------------------------------------------------------------------------------


def test_a_row_is_with_the_system_as_soon_as_it_is_flushed_and_an_old_recording_is_never_replaced(tmp_path):
    journal = Journal(tmp_path / "a.csv", ("x", "y"))
    journal.add((0.1, 1e-300))
    journal.flush()
    assert (tmp_path / "a.csv").read_text() == "x,y\n0.1,1e-300\n"
    with pytest.raises(ConfigurationError, match="is there already and is not replaced"):
        Journal(tmp_path / "a.csv", ("x",))
    journal.close()


@pytest.fixture(scope="module")
def followed(flight, tmp_path_factory):
    """A session that has followed the log as fast as it goes, with the views that it showed."""
    from heli_identifier.results.parameter_file import read_parameters

    folder = tmp_path_factory.mktemp("session")
    session = Session(folder, read_parameters(flight / "parameters.json"))
    log, views = read_log(flight / "log.csv"), []
    session.run(
        played(log, 0.0, session.keep), lambda: log.step, lambda: False, lambda view, status: views.append(view)
    )
    session.close()
    return folder, session, views, log


def test_predictions_stand_beside_what_was_measured(followed):
    folder, session, views, log = followed
    with (folder / "predictions.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    assert header[:4] == ["time [s]", "pitch [rad]", "elevation [rad]", "travel [rad]"] and len(header) == 10
    assert len(rows) > 20
    for row in rows:
        k = round(float(row[0]) / H)
        assert [float(cell) for cell in row[1:4]] == log.angles[k].tolist()
    assert json.loads((folder / "events.json").read_text()) == session.events


def test_what_was_recorded_is_the_log(followed):
    folder, _, _, log = followed
    recorded = read_log(folder / "recorded.csv")
    assert (recorded.angles == log.angles).all() and (recorded.voltages == log.voltages).all()


def test_the_screen_shows_every_axis_and_every_parameter(followed):
    view = followed[2][-1]
    console = Console(file=StringIO(), width=120)
    console.print(drawn("a title", view, None))
    shown = console.file.getvalue()
    for word in ("a title", "pitch", "elevation", "travel", "pitch.gain", "travel.damping", view.mode):
        assert word in shown


@pytest.mark.parametrize(("path", "kind"), [("/", "text/html"), ("/follow.js", "javascript"), ("/follow.css", "css")])
def test_the_page_loads_nothing_from_elsewhere_and_runs_no_inline_script(path, kind):
    with served("127.0.0.1:0", "title") as (url, _):
        answer, content = asked(url, path)
    policy = answer.getheader("Content-Security-Policy")
    assert answer.status == 200 and kind in answer.getheader("Content-Type")
    assert policy.startswith("default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self';")
    assert "http" not in content.replace("http://www.w3.org/2000/svg", "")
    assert not re.search(r"<script>|<style>| style=| on\w+=", content)


def asked(url, path, host=None):
    address = url.removeprefix("http://").rstrip("/")
    connection = http.client.HTTPConnection(address, timeout=LONGEST)
    connection.request("GET", path, headers={} if host is None else {"Host": host})
    answer = connection.getresponse()
    content = answer.read().decode()
    connection.close()
    return answer, content


def test_a_page_that_is_opened_late_has_the_past_and_then_the_end(followed):
    view = followed[2][-1]
    with served("127.0.0.1:0", "title") as (url, board):
        for shown in followed[2]:
            board.show(shown, None)
        board.end("all over")
        answer, content = asked(url, "/events")
    assert answer.getheader("Content-Type") == "text/event-stream"
    events = re.findall(r"event: (\w+)\ndata: (.*)\n\n", content)
    assert [name for name, _ in events] == ["title", "view", "end"]
    told = json.loads(events[1][1])
    assert told["view"]["time"] == view.time and told["view"]["mode"] == view.mode
    assert [due["time"] for due in told["due"]] == sorted({due["time"] for due in told["due"]}) != []


@pytest.mark.parametrize("host", ["evil.example", "evil.example:8042", "", "127.0.0.2:80"])
def test_a_foreign_name_that_points_here_gets_nothing(host):
    with served("127.0.0.1:0", "title") as (url, _):
        assert asked(url, "/events", host)[0].status == 421
        assert asked(url, "/../etc/passwd")[0].status == 404


@pytest.mark.parametrize("name", ["recorded.csv", "predictions.csv", "diagnosis.json"])
def test_a_folder_with_an_earlier_flight_or_diagnosis_is_refused(tmp_path, name):
    check_unused(tmp_path)
    (tmp_path / name).write_text("kept", encoding="utf-8")
    with pytest.raises(ConfigurationError, match=f"{name} is there already"):
        check_unused(tmp_path)


@pytest.mark.slow
def test_a_flight_goes_on_where_the_process_that_judges_the_controller_is_killed(tmp_path):
    adviser = Adviser(tmp_path, None)
    try:
        for _ in range(2):
            adviser.ask(TABLE_2, {}, 0.0)
            assert adviser.pool is not None
            for process in list(adviser.pool._processes.values()):
                process.kill()
            assert "was ended from outside" in adviser.look(wait=True)
    finally:
        adviser.close()


# --- what is diagnosed -----------------------------------------------------------------------------------------------


def test_the_longest_stretch_after_the_last_change_is_diagnosed():
    times = [k * H for k in range(10000) if not 7000 <= k < 7100]
    times = np.array(times)
    alarm = {"what": "alarm", "since_s": 30.0}
    assert part(times, [])[:2] == pytest.approx((0.0, 69.99))
    assert part(times, [alarm])[:2] == pytest.approx((30.0, 69.99))
    late = part(times, [alarm, {"what": "adopted", "since_s": 80.0}])
    assert late[:2] == pytest.approx((0.0, 69.99)) and "may have changed" in late[2]
    assert part(times[:1], []) == (0.0, 0.0, "")


# --- the commands ----------------------------------------------------------------------------------------------------


@pytest.fixture
def started(interruptible, tmp_path):
    """Start ``heli follow --listen`` on a free port; returns the process and the port. No process is left."""
    with ExitStack() as processes:

        def start(*words):
            process = subprocess.Popen(
                [*MAIN, "follow", "--listen", "127.0.0.1:0", *map(str, words)],
                cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            )  # fmt: skip
            processes.enter_context(process)
            processes.callback(process.kill)
            line = process.stderr.readline()
            return process, int(line.rpartition(":")[2])

        yield start


def waited_for(path, rows):
    """Wait until a file has this many rows below its header."""
    began = monotonic()
    while not path.exists() or path.read_bytes().count(b"\n") < rows + 1:
        assert monotonic() - began < LONGEST
        sleep(0.02)


def test_a_log_that_is_streamed_is_followed_and_ctrl_c_leaves_every_file(flight, tmp_path, started):
    parameters = flight / "parameters.json"
    process, port = started("-p", parameters, "-o", "out")
    sent = subprocess.run(
        [*MAIN, "stream", str(flight / "log.csv"), "--to", f"127.0.0.1:{port}", "--speed", "12"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert sent.returncode == 0 and "1201 samples" in sent.stdout, sent.stderr
    waited_for(tmp_path / "out/recorded.csv", 1201)
    process.send_signal(signal.SIGINT)
    out, said = process.communicate(timeout=LONGEST)
    assert process.returncode == 130, said
    folder = tmp_path / "out"
    names = {"events.json", "recorded.csv", "predictions.csv", "following.json", "parameters.json", f"{PLANT}.fmu"}
    assert {path.name for path in folder.iterdir()} == names
    log = read_log(flight / "log.csv")
    recorded = rows_of(folder / "recorded.csv")
    assert [row[1:] for row in recorded] == [
        (*v, *a) for v, a in zip(log.voltages.tolist(), log.angles.tolist(), strict=True)
    ]
    assert [row[0] for row in recorded] == pytest.approx(log.time.tolist(), abs=1e-9)
    assert "too short for a diagnosis" in said and "1201 samples" in out


def samples_to(port, count):
    """Send the first samples of a rig, a millisecond apart."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as rig:
        for k in range(count):
            rig.sendto(datagram(k), ("127.0.0.1", port))
            sleep(0.001)


def test_what_came_in_before_a_kill_is_on_disk(flight, tmp_path, started):
    process, port = started("-p", flight / "parameters.json", "-o", "out")
    samples_to(port, 300)
    waited_for(tmp_path / "out/recorded.csv", 300)
    process.kill()
    process.communicate(timeout=LONGEST)
    rows = rows_of(tmp_path / "out/recorded.csv")
    assert [round(1000 * row[3]) for row in rows] == list(range(300))
    assert isinstance(json.loads((tmp_path / "out/events.json").read_text()), list)


def test_sigterm_ends_it_at_once_with_the_files_complete(flight, tmp_path, started):
    process, port = started("-p", flight / "parameters.json", "-o", "out")
    samples_to(port, 100)
    waited_for(tmp_path / "out/recorded.csv", 100)
    process.terminate()
    _, said = process.communicate(timeout=LONGEST)
    assert process.returncode == 143 and "Traceback" not in said
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"events.json", "recorded.csv", "predictions.csv"}


@pytest.mark.slow
def test_a_log_is_followed_to_its_end_and_diagnosed(flight, tmp_path):
    log = demo_logs("rig-c")[1][0]
    done = subprocess.run(
        [*MAIN, "follow", str(log), "-p", str(flight / "parameters.json"), "--speed", "0", "-o", "out"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    names = {"recorded.csv", "predictions.csv", "events.json", "following.json"}
    names |= {"diagnosis.json", "report.html", "parameters.json", f"{PLANT}.fmu"}
    left = {path.name for path in (tmp_path / "out").iterdir()}
    # the twin is of another rig, so that it may adopt a change, which brings advice on the controller
    assert left - {"control_advice.json", "controller.json"} == names


@pytest.mark.slow
def test_the_controller_is_judged_beside_the_loop_and_its_gains_are_offered(tmp_path):
    adviser = Adviser(tmp_path, PidSettings())
    assert adviser.look() == ""
    adviser.ask(TABLE_2._replace(k_z=2.0 * TABLE_2.k_z), {"elevation.gain": 0.01}, 0.1)
    sentence = adviser.look(wait=True)
    adviser.close()
    advice = json.loads((tmp_path / "control_advice.json").read_text())
    assert advice["sentence"] == sentence and set(advice["sensitivity"]) == {"pitch", "elevation"}
    assert (tmp_path / "controller.json").exists() is bool(advice["gains"])


def test_the_controller_of_the_rig_is_taken_from_its_file(tmp_path, flight):
    gains = ParameterSet("PidController", {"pitch.integral": Estimate(1.25, None, "V/(rad s)")})
    found = controller_of(gains.write(tmp_path / "controller.json"))
    assert found == PidSettings()._replace(pitch=PidSettings().pitch._replace(integral=1.25))
    with pytest.raises(ConfigurationError, match="those of the PidController are needed"):
        controller_of(flight / "parameters.json")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "one of the two"),
        (("log.csv", "--listen", "127.0.0.1:0"), "one of the two"),
        (("log.csv", "--rate", "100"), "belong to --listen"),
        (("--listen", "127.0.0.1:0", "--speed", "2"), "belong to a log"),
        (("--listen", "127.0.0.1"), "names no port"),
        (("--listen", "0.0.0.0:0"), "would hear every network"),
        (("--listen", "127.0.0.1:0", "--layout", "pitch"), "lacks v_front"),
        (("log.csv", "--speed", "-1"), "--speed"),
        (("log.csv", "--output", "used"), "is there already and is not replaced"),
        (("log.csv", "--output", "log.csv"), "is read by this command and not written over"),
        (("log.csv", "--serve", "--serve-at", "here"), "--serve-at"),
    ],
)
def test_what_cannot_be_followed_is_refused_in_one_sentence(flight, monkeypatch, words, said):
    monkeypatch.chdir(flight)
    (flight / "used").mkdir(exist_ok=True)
    (flight / "used/recorded.csv").write_text("precious\n")
    done = run("follow", *words)
    assert done.exit_code == 2 and done.output.count("heli: ") == 1 and said in " ".join(done.output.split())
    assert os.listdir("used") == ["recorded.csv"] and (flight / "used/recorded.csv").read_text() == "precious\n"
    assert not (flight / "flight").exists()


@pytest.mark.parametrize("address", ["nowhere", "127.0.0.1:", "127.0.0.1:0", ":5", "host.invalid:5", "x" * 300 + ":5"])
def test_an_address_to_send_to_that_is_none_is_refused(flight, address):
    done = run("stream", flight / "log.csv", "--to", address)
    assert done.exit_code == 2 and "--to" in done.output
    assert resolved("127.0.0.1:7", "--to")[1] == ("127.0.0.1", 7)


def test_a_log_is_sent_at_its_own_instants():
    """20 datagrams of 10 ms at half the pace take at least .38 s."""
    log = Log("short", 1.0 / H, np.zeros((20, 2)), np.zeros((20, 3)))
    arrived = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as rig:
        rig.bind(("127.0.0.1", 0))
        rig.settimeout(LONGEST)
        began = monotonic()
        thread = Thread(target=send, args=(log, f"127.0.0.1:{rig.getsockname()[1]}", 0.5, LAYOUT))
        thread.start()
        for _ in range(20):
            arrived.append((rig.recv(100), monotonic() - began))
        thread.join()
    assert [content[:8] for content, _ in arrived] == [
        encode(Datagram(k, 0.0, (0.0,) * 5), LAYOUT)[:8] for k in range(20)
    ]
    assert arrived[-1][1] >= 0.38
