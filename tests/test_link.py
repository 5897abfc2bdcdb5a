"""The link to a rig: datagrams that hold a sample, their order, the clock and its instants; the RigLink never waits."""

import socket
import struct
import threading
from collections import Counter
from contextlib import suppress
from math import inf, nan

import psutil
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmu_src.units.rig_link import RigLink
from heli_identifier.live import Clock, Datagram, read_address
from heli_identifier.live.align import Order
from heli_identifier.live.datagrams import decode, encode
from tests.units import get_values, initialise

H = 0.01
SAMPLE = Datagram(7, 0.07, (1.5, -2.5, 0.1, -0.2, 3.0))


def make_samples(numbers):
    """Samples of these numbers, each with its number as the pitch."""
    return [Datagram(number, number * H, (0.0, 0.0, float(number), 0.0, 0.0)) for number in numbers]


def pass_through(arrivals):
    """Numbers that an order gives out, each arrival releasing what is five samples old; and the order."""
    order, out = Order(H), []
    for sample in arrivals:
        order.take(sample, 0.0)
        out += [one.number for one in order.release(order.newest.time - 4.5 * H)]
    return out + [one.number for one in order.release(1e9)], order


def test_a_datagram_is_seven_doubles_little_endian_with_nan_for_no_stamp_and_addresses_are_read():
    assert encode(SAMPLE) == struct.pack("<7d", 7.0, 0.07, 1.5, -2.5, 0.1, -0.2, 3.0)
    assert decode(encode(SAMPLE), {}) == SAMPLE
    bare = Datagram(-1, nan, SAMPLE.signals)
    assert encode(bare)[:16] == struct.pack("<2d", nan, nan) and repr(decode(encode(bare), {})) == repr(bare)
    found = decode(struct.pack("<7d", 7.0, 70.0, 1.5, -2.5, 18.0, -0.2, 3.0), {"time": 1e-3, "pitch": 0.01})
    assert (found.number, found.time, found.signals[2]) == (7, pytest.approx(0.07), pytest.approx(0.18))
    assert read_address("[::1]:25000", "x") == ("::1", 25000)
    assert read_address("localhost", "x") == ("127.0.0.1", -1)


NO_SAMPLES = [
    *(b"", b"\0", bytes(55), bytes(57), bytes(60_000)),
    *(
        struct.pack("<7d", *(bad if k == place else 0.0 for k in range(7)))
        for place in range(7)
        for bad in (*[nan] * (place > 1), inf, -inf, 1e300, -1e300)
    ),
    struct.pack("<7d", 0.5, *6 * [0.0]),  # no whole number
    struct.pack("<7d", -1.0, *6 * [0.0]),
    struct.pack("<7d", 0.0, 0.0, 31.0, *4 * [0.0]),  # [V]
    struct.pack("<7d", *4 * [0.0], 999.0, 0.0, 0.0),  # a pitch of 999 rad is a sentinel
]


@given(st.binary(max_size=100))
def test_what_holds_no_sample_is_refused_with_the_reason_and_no_bytes_make_decoding_fail(random):
    assert isinstance(decode(random, {}), (str, Datagram))
    assert all(isinstance(decode(content, {}), str) for content in NO_SAMPLES)


def test_a_sample_without_a_stamp_is_at_its_number_times_the_interval_or_when_it_came_in():
    for sample, wanted in ((SAMPLE, 0.07), (SAMPLE._replace(time=nan), 0.14), (Datagram(-1, nan, ()), 9.0)):
        order = Order(0.02)
        order.take(sample, 9.0)
        assert order.newest.time == wanted


@pytest.mark.parametrize("numbers, wanted, counts", [
    (range(100), range(100), Counter(received=100)),
    ([0, 1, 3, 2, 4, 6, 7, 5, 8], range(9), Counter(received=9, reordered=2)),
    ([0, 1, 1, 2, 0, *range(3, 40), 5, 39], range(40), Counter(received=40, duplicated=4)),
    # a lost sample is lost, and one that comes after it was given up is late instead
    ([*range(10), *range(11, 20), *range(21, 40), 10], [*range(10), *range(11, 20), *range(21, 40)],
     Counter(received=38, lost=1, late=1)),
    # a pause is a gap and not a new start
    ([*range(100), *range(600, 700)], [*range(100), *range(600, 700)], Counter(received=200, lost=500)),
    # what waited when the rig went away is not shown: nobody knows how long ago it was
    ([*range(500, 600), *range(100)], [*range(500, 595), *range(100)], Counter(received=200, restarted=1)),
], ids=["in order", "overtaken", "twice", "lost and late", "pause", "started again"])  # fmt: skip
def test_samples_come_out_in_order_and_once_and_the_rest_is_counted(numbers, wanted, counts):
    out, order = pass_through(make_samples(numbers))
    assert out == list(wanted) and order.counts == counts
    # without numbers lost samples are counted by time, and a damaged time changes nothing
    _, order = pass_through([sample._replace(number=-1) for sample in make_samples([0, 1, 2, 5, 6])])
    assert order.counts["lost"] == 2
    good = make_samples(range(50))
    out, order = pass_through([*good[:20], good[20]._replace(time=1e9), *good[20:]])
    assert out == list(range(50)) and order.counts == Counter(received=50, stray=1)


@pytest.mark.parametrize("step, least, most", [(0.05, 10, 200), (0.002, 2, 200)], ids=["ahead", "behind"])
def test_a_co_simulation_that_is_not_paced_stays_within_the_maximum_age(step, least, most):
    clock = Clock(delay=0.05, maximum_age=0.2, sample_time=H)
    for k in range(200):  # simulated time per sample of 10 ms
        clock.tick(step * k, make_samples([k]))
        assert abs(clock.lead) <= clock.maximum_age + 1e-9 or step < H
        assert clock.lead >= -clock.maximum_age - 1e-9
    assert least < clock.resynchronised < most and len(clock.order.waiting) < 30


def test_a_sample_that_comes_in_after_it_was_due_is_shown_but_is_not_of_this_instant():
    """Of a network with jitter: sample 5 is lost, sample 4 comes in when 5 is due. Taken for 5 it lags by 10 ms."""
    clock = Clock(delay=0.0, maximum_age=0.2, sample_time=H)
    arrivals = {k: make_samples([k]) for k in (0, 1, 2, 3, 6, 7)} | {5: make_samples([4])}
    shown = []
    for k in range(8):
        clock.tick(k * H, arrivals.get(k, ()))
        shown.append((clock.order.last.number, clock.fresh))
    assert shown == [(0, True), (1, True), (2, True), (3, True), (3, False), (4, False), (6, True), (7, True)]
    assert clock.order.counts["received"] == 7


@pytest.mark.parametrize("slow, jitter, late", [(0.0, 1e-4, 0), (5e-4, 0.0, 0), (0.0, 0.0, 6)])
def test_a_clock_that_jitters_or_is_slow_leaves_nearly_every_step_a_fresh_sample(slow, jitter, late):
    """Slower by .5 ms a second it is set again every 100 s; one sample that comes in late does not set it again."""
    clock, fresh, held = Clock(delay=0.05, maximum_age=0.2, sample_time=H), [], []
    for k in range(30_000):
        held.append(Datagram(k, k * H * (1.0 - slow) + jitter * (0.618 * k % 1.0), (0.0,) * 5))
        count = len(held) if (k + 250) % 500 > late else int((k + 250) % 500 == late)
        clock.tick(k * H, held[:count])
        del held[:count]
        fresh.append(clock.fresh)
    assert sum(fresh[100:]) > 0.97 * len(fresh[100:]) and clock.resynchronised == round(slow / 5e-4) * 2


def create_link(**parameters):
    return initialise(RigLink, {f"link.{name}": value for name, value in {"port": 0, **parameters}.items()})


@pytest.fixture
def make_link():
    """Make units, each with a socket that sends to it; all are closed in the end."""
    opened = []

    def make(**parameters):
        unit = create_link(**parameters)
        assert unit.log_queue == []
        rig = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        rig.connect(("127.0.0.1", int(get_values(unit, "port")[0])))
        opened.extend((unit, rig))
        return unit, rig

    yield make
    for one in opened:
        one.terminate() if isinstance(one, RigLink) else one.close()


def sample(number):
    return encode(Datagram(number, 1e6 + number * H, (1.0, 2.0, 0.001 * number, -0.1, 0.5)))


def do_step(unit, k):
    assert unit.do_step(k * H, H), unit.log_queue[-1].msg


def test_it_shows_what_the_rig_sends_with_the_delay(make_link):
    unit, rig = make_link()
    for k in range(100):
        rig.send(sample(k))
        do_step(unit, k)
    # sample 99 came in during the last step; what is shown is .05 s older
    assert get_values(unit, "v_front", "v_rear", "pitch", "elevation", "travel") == [1.0, 2.0, 0.094, -0.1, 0.5]
    assert get_values(unit, "fresh", "watchdog", "received", "lost", "waiting") == [1.0, 0.0, 100.0, 0.0, 5.0]


def test_a_stopped_stream_trips_the_watchdog_and_no_step_waits(make_link):
    unit, rig = make_link()
    assert get_values(unit, "watchdog", "fresh") == [1.0, 0.0]  # nothing has come in yet
    for k in range(50):
        rig.send(sample(k))
        do_step(unit, k)
    assert get_values(unit, "watchdog") == [0.0]
    for k in range(50, 550):  # a step that waited for the rig would never come back
        do_step(unit, k)
    assert get_values(unit, "watchdog", "fresh", "pitch") == [1.0, 0.0, 0.049]
    # all that waited has been shown, .05 s after it came in; the co-simulation is 5 s ahead of the newest
    assert get_values(unit, "age", "lead") == pytest.approx([4.95, 5.0])
    for k in range(550, 600):
        rig.send(sample(k))
        do_step(unit, k)
    assert get_values(unit, "watchdog", "fresh", "lost", "resynchronised") == [0.0, 1.0, 500.0, 0.0]
    # a rig that does not send is said where it is waited for, and no state is saved
    unit = create_link(wait=0.05)
    assert unit.log_queue[0].msg.endswith("no sample of the rig came in within link.wait = 0.05 s")
    assert not unit.do_step(0.0, H)
    assert unit._get_fmu_state() == {} and "cannot be saved" in unit.log_queue[-1].msg
    unit.terminate()


def test_one_host_is_heard_from_any_port_the_one_that_is_named_or_the_first_good_sender(make_link):
    unit, rig = make_link(look_ahead=10)
    with socket.socket(type=socket.SOCK_DGRAM) as other, socket.socket(type=socket.SOCK_DGRAM) as again:
        again.connect(rig.getpeername())
        other.bind(("127.0.0.2", 0))
        other.sendto(b"rubbish first", rig.getpeername())  # locks nothing
        do_step(unit, 0)
        for k in range(20):
            (rig if k < 10 else again).send(sample(k))
            do_step(unit, 2 * k + 1)
            other.sendto(encode(Datagram(k, k * H, (9.0, 9.0, 1.0, 1.0, 1.0))), rig.getpeername())
            do_step(unit, 2 * k + 2)
        named, _ = make_link(sender="127.0.0.2")
        again.connect(("127.0.0.1", int(get_values(named, "port")[0])))
        again.send(sample(0))
        other.sendto(sample(0), again.getpeername())
        do_step(named, 0)
    assert get_values(unit, "received", "foreign", "refused", "v_front") == [20.0, 20.0, 1.0, 1.0]
    assert get_values(named, "received", "foreign") == [1.0, 1.0]
    assert "name its address alone" in create_link(sender="127.0.0.2:9").log_queue[0].msg
    for k in range(20, 120):
        rig.send(sample(k))
    do_step(unit, 41)
    assert get_values(unit, "received") == [30.0]  # a flood takes no more of a step than the look-ahead


def test_a_port_that_is_taken_is_refused_and_free_again_after_the_end_which_leaves_no_socket(make_link):
    unit, _ = make_link()
    port = int(get_values(unit, "port")[0])
    second = create_link(port=port)
    assert "cannot be listened on: Address already in use" in second.log_queue[0].msg
    unit.terminate()
    before = psutil.Process().net_connections("udp4")
    third = create_link(port=port)
    assert third.log_queue == [] and third.do_step(0.0, H)
    third.terminate()
    assert psutil.Process().net_connections("udp4") == before


def test_the_initialisation_waits_for_the_first_sample_and_shows_it_until_one_is_due(make_link):
    early, rig = make_link()  # finds a free port
    port = int(get_values(early, "port")[0])
    early.terminate()
    listening = threading.Event()

    def send():  # until the unit shows something
        while not listening.wait(0.02):
            with suppress(ConnectionRefusedError):
                rig.send(sample(40))

    sender = threading.Thread(target=send)
    sender.start()
    unit, _ = make_link(port=port, wait=60.0)
    listening.set()
    sender.join()
    assert get_values(unit, "pitch", "received", "fresh", "watchdog") == [0.04, 1.0, 0.0, 1.0]
    for k in range(5):
        do_step(unit, k)
    assert get_values(unit, "pitch", "fresh", "watchdog") == [0.04, 1.0, 0.0]
