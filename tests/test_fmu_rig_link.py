"""RigLink against a sender on this machine: what it shows, what it counts, and that it never waits."""

import socket
import threading
from contextlib import suppress

import psutil
import pytest

from fmu_src.units.rig_link import RigLink
from heli_identifier.live import JSON, USUAL_LAYOUT, Datagram, encode, read_layout
from tests.units import got, initialised

H = 0.01
USUAL = read_layout(USUAL_LAYOUT)


def created(**parameters):
    return initialised(RigLink, {f"link.{name}": value for name, value in {"port": 0, **parameters}.items()})


@pytest.fixture
def linked():
    """Make units, each with a socket that sends to it; all are closed in the end."""
    opened = []

    def make(**parameters):
        unit = created(**parameters)
        assert unit.log_queue == []
        rig = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        rig.connect(("127.0.0.1", int(got(unit, "port")[0])))
        opened.extend((unit, rig))
        return unit, rig

    yield make
    for one in opened:
        one.terminate() if isinstance(one, RigLink) else one.close()


def sample(number, layout=USUAL):
    return encode(Datagram(number, 1e6 + number * H, (1.0, 2.0, 0.001 * number, -0.1, 0.5)), layout)


def stepped(unit, k):
    assert unit.do_step(k * H, H), unit.log_queue[-1].msg


@pytest.mark.parametrize("layout", [USUAL_LAYOUT, JSON, "sequence travel elevation pitch v_rear v_front"])
def test_it_shows_what_the_rig_sends_with_the_delay(linked, layout):
    unit, rig = linked(layout=layout)
    for k in range(100):
        rig.send(sample(k, read_layout(layout)))
        stepped(unit, k)
    # sample 99 came in during the last step; what is shown is .05 s older
    assert got(unit, "v_front", "v_rear", "pitch", "elevation", "travel") == [1.0, 2.0, 0.094, -0.1, 0.5]
    assert got(unit, "fresh", "watchdog", "received", "lost", "waiting") == [1.0, 0.0, 100.0, 0.0, 5.0]


def test_a_stopped_stream_trips_the_watchdog_and_no_step_waits(linked):
    unit, rig = linked()
    assert got(unit, "watchdog", "fresh") == [1.0, 0.0]  # nothing has come in yet
    for k in range(50):
        rig.send(sample(k))
        stepped(unit, k)
    assert got(unit, "watchdog") == [0.0]
    for k in range(50, 550):  # a step that waited for the rig would never come back
        stepped(unit, k)
    assert got(unit, "watchdog", "fresh", "pitch") == [1.0, 0.0, 0.049]
    # all that waited has been shown, .05 s after it came in; the co-simulation is 5 s ahead of the newest
    assert got(unit, "age", "lead") == pytest.approx([4.95, 5.0])
    for k in range(550, 600):
        rig.send(sample(k))
        stepped(unit, k)
    assert got(unit, "watchdog", "fresh", "lost", "set_anew") == [0.0, 1.0, 500.0, 0.0]


def test_the_first_good_sender_is_the_rig_and_nobody_else(linked):
    unit, rig = linked()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.connect(rig.getpeername())
        other.send(b"rubbish first")  # locks nothing
        stepped(unit, 0)
        rig.send(sample(0))
        stepped(unit, 1)
        for k in range(1, 60):
            rig.send(sample(k))
            try:
                other.send(encode(Datagram(k, k * H, (9.0, 9.0, 1.0, 1.0, 1.0)), USUAL))
            except ConnectionRefusedError:  # the system says that nobody hears it there
                pass
            stepped(unit, k + 1)
    assert got(unit, "v_front", "pitch") == [1.0, 0.055 - 0.001]
    assert got(unit, "received", "duplicated") == [60.0, 0.0]


def test_a_sender_that_is_named_is_the_only_one_and_may_come_back_from_another_port(linked):
    unit, rig = linked(sender="127.0.0.1", look_ahead=10)
    strange, _ = linked(sender="127.0.0.2")
    for k in range(20):
        rig.send(sample(k))
        stepped(unit, k)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as again:
        again.connect(rig.getpeername())
        for k in range(20, 40):
            again.send(sample(k))
            stepped(unit, k)
        again.connect(("127.0.0.1", int(got(strange, "port")[0])))
        again.send(sample(0))
        stepped(strange, 0)
    assert got(unit, "received", "foreign") == [40.0, 0.0]
    assert got(strange, "received", "foreign") == [0.0, 1.0]
    for k in range(40, 140):
        rig.send(sample(k))
    stepped(unit, 40)
    assert got(unit, "received") == [50.0]  # a flood takes no more of a step than the look-ahead


def test_a_port_that_is_taken_is_refused_and_free_again_after_the_end_which_leaves_no_socket(linked):
    unit, _ = linked()
    port = int(got(unit, "port")[0])
    second = created(port=port)
    assert "cannot be listened on: Address already in use" in second.log_queue[0].msg
    unit.terminate()
    before = psutil.Process().net_connections("udp4")
    third = created(port=port)
    assert third.log_queue == [] and third.do_step(0.0, H)
    third.terminate()
    assert psutil.Process().net_connections("udp4") == before


def test_the_initialisation_waits_for_the_first_sample_and_shows_it_until_one_is_due(linked):
    early, rig = linked()  # finds a free port
    port = int(got(early, "port")[0])
    early.terminate()
    listening = threading.Event()

    def send():  # until the unit shows something
        while not listening.wait(0.02):
            with suppress(ConnectionRefusedError):
                rig.send(sample(40))

    sender = threading.Thread(target=send)
    sender.start()
    unit, _ = linked(port=port, wait=60.0)
    listening.set()
    sender.join()
    assert got(unit, "pitch", "received", "fresh", "watchdog") == [0.04, 1.0, 0.0, 1.0]
    for k in range(5):
        stepped(unit, k)
    assert got(unit, "pitch", "fresh", "watchdog") == [0.04, 1.0, 0.0]


def test_a_rig_that_does_not_send_is_said_where_it_is_waited_for_and_no_state_is_saved():
    unit = created(wait=0.05)
    assert unit.log_queue[0].msg.endswith("no sample of the rig came in within link.wait = 0.05 s")
    assert not unit.do_step(0.0, H)
    assert unit._get_fmu_state() == {} and "cannot be saved" in unit.log_queue[-1].msg
    unit.terminate()
