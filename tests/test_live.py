"""A rig in flight: every instant once, all that came in on disk, and what is shown of it."""

import csv
import http.client
import json
import math
import random
import re
import socket
from contextlib import ExitStack
from io import StringIO
from threading import Thread
from time import monotonic, sleep

import numpy as np
import psutil
import pytest
from rich.console import Console

from heli_identifier.errors import ConfigurationError
from heli_identifier.live import Datagram, Port
from heli_identifier.live.align import Grid
from heli_identifier.live.datagrams import encode
from heli_identifier.live.listening import Listening
from heli_identifier.live.page import serve_page
from heli_identifier.live.screen import draw_screen
from heli_identifier.live.session import Journal, Session
from heli_identifier.live.sources import Player, send
from heli_identifier.records import CONTRACT, Log, LogFormat, demo_files, read_log
from heli_plant.parameters import TABLE_2
from heli_plant.simulation import simulate
from tests.diagnosis_example import parameter_set
from tests.simulated import COUNT, drive, process_noise, start_at_rest
from tests.test_files import files_of_at_most

H = 0.01
LONGEST = 180.0
"""Time after which something is taken for hung [s]; a loaded machine is no defect."""


def make_datagram(number, time=None, is_counted=True):
    time = number * H if time is None else time
    return encode(Datagram(number if is_counted else -1, time, (1.0, 2.0, 0.001 * number, 0.1, 0.2)))


def listen_to(contents, until, pauses=(), format=CONTRACT, rate=None, others=()):
    """Return instants and recorded rows of a listener that gets ``contents``, with pauses (at, seconds), and itself.
    The instants are those of the rig's clock, in the datagrams, so that a busy machine changes none of them. ``others``
    are sent by another sender before the rig's first."""
    rows, seen = [], []
    port = Port("127.0.0.1", 0, "")

    def sender():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
            for content in others:
                other.sendto(content, port.address)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as rig:
            for place, content in enumerate(contents):
                sleep(dict(pauses).get(place, 0.0))
                rig.sendto(content, port.address)

    thread, began = Thread(target=sender), monotonic()
    listening = Listening(port, rate, format)
    thread.start()
    try:
        for sample in listening.instants(lambda time, signals: rows.append((time, *signals)), lambda: False):
            if sample is not None:
                seen.append(sample)
            elif until(seen, rows):
                break
            assert monotonic() - began < LONGEST
    finally:
        thread.join()
        port.close()
    return seen, rows, listening


def test_a_network_that_loses_doubles_and_delays_gives_every_instant_once_and_counts_the_rest():
    """5 % lost, 2 % twice, 20 ms of jitter, and rubbish; 2 s of flight."""
    generator = random.Random(3)
    numbers = [k for k in range(200) if generator.random() > 0.05 or k in (0, 199)]
    sent = [(k * H + 0.02 * generator.random(), make_datagram(k)) for k in numbers]
    twice = [(at + 0.005, content) for at, content in sent if generator.random() < 0.02]
    sent += [*twice, *((at, b"rubbish") for at in (0.3, 0.9))]
    contents = [make_datagram(0), *(content for _, content in sorted(sent)[1:])]
    seen, rows, listening = listen_to(contents, lambda seen, rows: len(seen) >= 200)
    fresh = [k for k, sample in enumerate(seen[:200]) if sample.fresh]
    assert fresh == numbers and all(seen[k].pitch == 0.001 * k for k in fresh)
    assert [row[0] for row in rows] == sorted({row[0] for row in rows})
    counts = listening.order.counts
    assert listening.port.refused == 2 and listening.rate == 100.0
    assert f"{200 - len(numbers)} were lost" in listening.status.faults
    assert [counts[one] for one in ("received", "lost", "duplicated")] == [len(numbers), 200 - len(numbers), len(twice)]


def test_a_rig_whose_datagrams_all_come_twice_has_its_rate():
    _, _, listening = listen_to([make_datagram(k // 2) for k in range(120)], lambda seen, rows: len(rows) == 60)
    assert listening.rate == 100.0 and listening.order.counts["duplicated"] == 60


def test_while_a_stream_stops_instants_go_on_without_samples_and_then_with_them():
    brought = []

    def until(seen, rows):
        brought.append(len(seen) if len(rows) == 60 else 0)
        return sum(sample.fresh for sample in seen) == 120

    contents = [make_datagram(k) for k in (*range(60), *range(160, 220))]
    seen, rows, _ = listen_to(contents, until, pauses=[(60, 1.0)])
    fresh = [bool(sample.fresh) for sample in seen]
    first = fresh.index(False)
    again = fresh.index(True, first)
    # The clock of this computer brings instants while the rig is silent, and the clock of the rig those that are still
    # missing when it sends again; a busy machine may find the silence longer than it was.
    assert first == 60 and max(brought) > 60
    assert again == 160 or (again == max(brought) > 160)
    assert fresh[again:] == [True] * 60 and len(rows) == 120


def test_what_comes_in_while_the_caller_waits_for_its_disk_is_no_silence():
    delays = iter([1.0])  # [s]
    until = lambda seen, rows: bool(rows and sleep(next(delays, 0.0))) or len(rows) == 120  # noqa: E731
    seen, rows, _ = listen_to([make_datagram(k) for k in range(120)], until, pauses=[(60, 0.1)])
    assert all(one.fresh for one in seen) and [row[0] for row in rows] == pytest.approx([k * H for k in range(120)])


@pytest.mark.parametrize("form, wanted", [
    (LogFormat(signs={"pitch": -1}, swap_rotors=True, clip=True, voltage_limit=1.5), (1.5, 1.0, -0.05, 0.1, 0.2)),
    (LogFormat(signs={"v_difference": -1}), (2.0, 1.0, 0.05, 0.1, 0.2)),
    (LogFormat(units={"pitch": "deg", "v_front": "mV"}), (0.001, 2.0, np.radians(0.05), 0.1, 0.2)),
])  # fmt: skip
def test_signs_units_and_rotors_are_put_right_as_in_logs_and_a_rig_too_slow_is_refused(form, wanted):
    contents = [make_datagram(k) for k in range(60)]
    _, rows, _ = listen_to(contents, lambda seen, rows: len(seen) >= 60, format=form)
    assert rows[50][1:] == pytest.approx(wanted)
    with pytest.raises(ConfigurationError, match="the rig sends at 10 Hz, 50 to 2000 Hz are followed"):
        listen_to([make_datagram(k, 0.1 * k) for k in range(60)], lambda *_: False)


@pytest.mark.parametrize("clock, is_counted", [
    (lambda k: 1.7e12 + 1e3 * H * k, True),
    (lambda k: 5.0, True),
    (lambda k: k * H // 0.0156 * 0.0156, True),
    (lambda k: math.nan, True),
    (lambda k: math.nan, False),
    (lambda k: 5.0, False),
], ids=["milliseconds since 1970", "stuck", "coarse", "no time", "neither", "stuck, no number"])  # fmt: skip
def test_a_rigs_clock_that_is_of_no_use_loses_no_sample_and_is_said(clock, is_counted, monkeypatch):
    monkeypatch.setattr("heli_identifier.live.listening.SILENCE", LONGEST)  # a loaded machine sends with pauses
    contents = [make_datagram(k, clock(k), is_counted) for k in range(120)]
    is_useful = clock(1) > 1e12
    more = {"format": LogFormat(units={"time": "ms"})} if is_useful else {"rate": 100.0}
    _, rows, listening = listen_to(contents, lambda seen, rows: len(rows) == 120, **more)
    assert [row[3] for row in rows] == pytest.approx([0.001 * k for k in range(120)])
    assert [row[0] for row in rows] == pytest.approx([k * H for k in range(120)], abs=1e-3)
    assert listening.rate == 100.0 and is_useful != ("no clock that tells its samples apart" in listening.status.line)
    if not is_useful:
        with pytest.raises(ConfigurationError, match="give its sampling rate with --rate"):
            listen_to(contents, lambda *_: False)


def test_numbers_count_the_instants_of_a_rig_whose_rate_is_not_quite_the_assumed_one():
    grid = Grid(H, Datagram(0, 0.0, (0.0,) * 5))  # 1.6 s in 200 s are no damaged numbers
    assert [grid.place(Datagram(k, k / 99.2, (0.0,) * 5)) for k in range(20_000)] == [*range(20_000)]


def test_a_stray_datagram_before_the_rigs_first_is_dropped():
    others = [encode(Datagram(7, 99.0, (0.0,) * 5))]
    _, rows, _ = listen_to([make_datagram(k) for k in range(80)], lambda seen, rows: len(rows) >= 60, others=others)
    assert [round(1000.0 * row[3]) for row in rows] == list(range(len(rows)))


def test_a_log_is_sent_at_its_own_instants():
    """20 datagrams of 10 ms at half the pace take at least .38 s."""
    log = Log("short", 1.0 / H, np.zeros((20, 2)), np.zeros((20, 3)))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as rig:
        rig.bind(("127.0.0.1", 0))
        rig.settimeout(LONGEST)
        began = monotonic()
        send(log, f"127.0.0.1:{rig.getsockname()[1]}", 0.5, lambda what, share: None)
        assert monotonic() - began >= 0.38
        assert [rig.recv(100)[:8] for _ in range(20)] == [encode(Datagram(k, 0.0, (0.0,) * 5))[:8] for k in range(20)]


def test_a_disk_that_fills_up_in_flight_leaves_whole_rows(tmp_path):
    journal = Journal(tmp_path / "a.csv", ("x", "y"))
    with files_of_at_most(1000):
        for k in range(200):
            journal.add((0.123456789 * k, 1.0))
        with pytest.raises(OSError, match="a.csv"):
            journal.flush()
    journal.close()
    rows = (tmp_path / "a.csv").read_text()
    assert rows.endswith("\n") and len(rows) > 900 and all(row.count(",") == 1 for row in rows.splitlines())


@pytest.fixture(scope="module")
def followed(tmp_path_factory):
    """A session that has followed a log as fast as it goes, with the views that it showed."""
    folder = tmp_path_factory.mktemp("session")
    session = Session(folder, parameter_set(0.003, ["k_x"]))
    log, views = read_log(demo_files("rig-c")[1][0], end=12.0), []
    session.run(Player(log), lambda: False, views.append)
    session.close()
    return folder, session, views, log


def test_a_rig_at_1_khz_whose_plant_is_the_twins_raises_no_alarm(tmp_path):
    """In usual air: its encoders give ten samples in the time of which the twin's observer takes one."""
    voltages, air = (np.repeat(of_10_ms, 10, axis=0) for of_10_ms in (drive(60.0, 3), process_noise(6000, 3, 0.012)))
    start = np.array(start_at_rest(TABLE_2, voltages), dtype=float)
    _, angles = simulate(voltages, 0.001, start, TABLE_2, air)
    counts = np.round(angles / COUNT + 0.25 * np.random.default_rng(0).standard_normal(angles.shape))
    session = Session(tmp_path / "flight", parameter_set())
    session.run(Player(Log("fast", 1000.0, voltages, COUNT * counts)), lambda: False, lambda view: None)
    session.close()
    assert session.recorded.rows == len(voltages) and session.events == []


def test_what_was_recorded_is_the_log_and_predictions_stand_beside_what_was_measured(followed):
    folder, session, _, log = followed
    recorded = read_log(folder / "recorded.csv")
    assert (recorded.angles == log.angles).all() and (recorded.voltages == log.voltages).all()
    with (folder / "predictions.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    assert header[:4] == ["time [s]", "pitch [rad]", "elevation [rad]", "travel [rad]"] and len(header) == 10
    assert len(rows) > 20
    for row in rows:
        assert [float(cell) for cell in row[1:4]] == log.angles[round(float(row[0]) / H)].tolist()
    assert json.loads((folder / "events.json").read_text()) == session.events


def test_the_screen_shows_every_axis_and_every_parameter_and_a_page_that_is_opened_late_has_the_past(followed):
    view = followed[2][-1]
    console = Console(file=StringIO(), width=120)
    console.print(draw_screen("a title", view))
    shown = console.file.getvalue()
    for word in ("a title", "pitch", "elevation", "travel", "pitch.gain", "travel.damping", view.mode):
        assert word in shown
    with serve_page("127.0.0.1:0", "title") as (url, show):
        show(view)
        document = json.loads(request(url, "/view")[1])
    assert [document[key] for key in ("title", "time", "mode")] == ["title", view.time, view.mode]
    assert [due["time"] for due in document["past"]] == [due["time"] for due in view.past] != []


def request(url, path, host=None):
    connection = http.client.HTTPConnection(url.removeprefix("http://").rstrip("/"), timeout=LONGEST)
    connection.request("GET", path, headers={} if host is None else {"Host": host})
    answer = connection.getresponse()
    content = answer.read().decode()
    connection.close()
    return answer, content


def test_the_page_loads_nothing_from_elsewhere_and_runs_no_inline_script_and_a_foreign_name_gets_nothing():
    with serve_page("127.0.0.1:0", "title") as (url, _):
        for path, kind in (("/", "text/html"), ("/follow.js", "javascript"), ("/follow.css", "css")):
            answer, content = request(url, path)
            policy = answer.getheader("Content-Security-Policy")
            assert answer.status == 200 and kind in answer.getheader("Content-Type")
            assert policy.startswith("default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self';")
            assert "http" not in content.replace("http://www.w3.org/2000/svg", "")
            assert not re.search(r"<script>|<style>| style=| on\w+=", content)
        assert request(url, "/../etc/passwd")[0].status == 404
        for name in ("evil.example", "evil.example:8042", "", "127.0.0.2:80", "[::1", "127.0.0.1.evil"):
            assert request(url, "/", name)[0].status == 421
        for name in ("127.0.0.1", "127.0.0.1:8042", "localhost"):  # without a port it is 80
            assert request(url, "/", name)[0].status == 200


def test_half_open_connections_leave_descriptors_for_the_recording():
    def sockets():
        return len(psutil.Process().net_connections("tcp"))

    with serve_page("127.0.0.1:0", "title") as (url, _), ExitStack() as opened:
        before, host = sockets(), url.removeprefix("http://").rstrip("/").split(":")
        for _ in range(3):
            opened.enter_context(socket.create_connection(host))
        sleep(0.3)  # the server is at the first of them
        assert sockets() - before - 3 <= 1
        assert request(url, "/")[0].status == 200
