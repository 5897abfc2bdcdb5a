"""What comes in from a rig: datagrams that hold a sample, their order, and the clock by which they are shown."""

import json
import random
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from heli_identifier.errors import ConfigurationError
from heli_identifier.live import (
    JSON,
    USUAL_LAYOUT,
    Clock,
    ClockSettings,
    Counts,
    Datagram,
    Order,
    Timed,
    decode,
    encode,
    read_address,
    read_layout,
    release,
    take,
    tick,
    timed,
)

H = 0.01
USUAL = read_layout(USUAL_LAYOUT)
SAMPLE = Datagram(7, 0.07, (1.5, -2.5, 0.1, -0.2, 3.0))


def sent(numbers, h=H, offset=0.0):
    """Samples of these numbers, each with its number as the pitch."""
    return [Timed(offset + number * h, number, (0.0, 0.0, float(number), 0.0, 0.0)) for number in numbers]


def passed(arrivals, delay=5):
    """Numbers that an order gives out, each arrival releasing what is ``delay`` samples old; and the order."""
    order, out = Order(), []
    for sample in arrivals:
        order = take(order, sample)
        order, released = release(order, order.newest.time - (delay - 0.5) * H, H)
        out += [one.number for one in released]
    order, released = release(order, 1e9, H)
    return out + [one.number for one in released], order


# --- datagrams -------------------------------------------------------------------------------------------------------


def test_the_usual_layout_is_seven_doubles_little_endian():
    assert encode(SAMPLE, USUAL) == struct.pack("<7d", 7.0, 0.07, 1.5, -2.5, 0.1, -0.2, 3.0)
    assert decode(encode(SAMPLE, USUAL), USUAL) == SAMPLE


def test_a_layout_may_order_the_signals_leave_out_the_stamps_and_hold_degrees_and_other_doubles():
    layout = read_layout("pitch[deg] - elevation travel v_front v_rear")
    found = decode(struct.pack("<6d", 180.0, float("nan"), 0.2, 0.3, 4.0, 5.0), layout)
    assert found == Datagram(None, None, (4.0, 5.0, pytest.approx(3.14159265), 0.2, 0.3))


def test_a_json_line_is_the_same_sample():
    layout = read_layout(JSON)
    assert decode(encode(SAMPLE, layout), layout) == SAMPLE
    bare = json.dumps({"v_front": 1, "v_rear": 2, "pitch": 0, "elevation": 0, "travel": 0}).encode()
    assert decode(bare, layout) == Datagram(None, None, (1.0, 2.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    "text", ["pitch", USUAL_LAYOUT + " pitch", USUAL_LAYOUT + " roll", "pitch[grad]", "", "json -"]
)
def test_a_layout_that_cannot_be_is_refused(text):
    with pytest.raises(ConfigurationError, match="layout"):
        read_layout(text)


HOSTILE = [
    b"",
    b"\0",
    bytes(55),
    bytes(57),
    bytes(60_000),
    *(
        struct.pack("<7d", *(bad if k == place else 0.0 for k in range(7)))
        for place in range(7)
        for bad in (float("nan"), float("inf"), -float("inf"), 1e300, -1e300)
    ),
    struct.pack("<7d", 0.5, *6 * [0.0]),  # no whole number
    struct.pack("<7d", -1.0, *6 * [0.0]),
    struct.pack("<7d", 0.0, 0.0, 31.0, *4 * [0.0]),  # [V]
    struct.pack("<7d", *4 * [0.0], 999.0, 0.0, 0.0),  # a pitch of 999 rad is a sentinel
]


@pytest.mark.parametrize("content", HOSTILE)
def test_what_holds_no_sample_is_refused_with_the_reason(content):
    assert isinstance(decode(content, USUAL), str)


@pytest.mark.parametrize(
    "content",
    [
        b"", b"{", b"[" * 1000, b'{"a":' * 200, b"null", b"[1,2,3]", b"\xff\xfe", b'"' + b"x" * 2000 + b'"', b"{}",
        b'{"v_front": true, "v_rear": 0, "pitch": 0, "elevation": 0, "travel": 0}',
        b'{"v_front": "1", "v_rear": 0, "pitch": 0, "elevation": 0, "travel": 0}',
        b'{"v_front": NaN, "v_rear": 0, "pitch": 0, "elevation": 0, "travel": 0}',
        b'{"v_front": 1' + b"0" * 400 + b', "v_rear": 0, "pitch": 0, "elevation": 0, "travel": 0}',
        b'{"v_front": 0, "v_rear": 0, "pitch": 0, "elevation": 0, "travel": 0, "time": "now"}',
        b'{"v_front": 0, "v_rear": 0, "pitch": 0, "elevation": 0, "travel": 0, "sequence": -3}',
    ],
)  # fmt: skip
def test_json_that_holds_no_sample_is_refused_with_the_reason(content):
    assert isinstance(decode(content, read_layout(JSON)), str)


@given(st.binary(max_size=100))
def test_no_bytes_make_decoding_fail(content):
    for layout in (USUAL, read_layout(JSON)):
        assert isinstance(decode(content, layout), (str, Datagram))


def test_a_sample_without_a_stamp_is_at_its_number_times_the_interval_or_when_it_came_in():
    assert timed(SAMPLE, 9.0, H).time == 0.07
    assert timed(SAMPLE._replace(time=None), 9.0, 0.02).time == 0.14
    assert timed(SAMPLE._replace(time=None, sequence=None), 9.0, H) == Timed(9.0, -1, SAMPLE.signals)


@pytest.mark.parametrize("text", ["127.0.0.1:70000", "example.org:5", "1.2.3:4", "127.0.0.1:x", "127.0.0.1:-4"])
def test_an_address_is_numeric_because_a_name_would_be_waited_for(text):
    with pytest.raises(ConfigurationError, match="numeric address"):
        read_address(text, "link.sender")
    assert read_address("[::1]:25000", "x") == ("::1", 25000)
    assert read_address("localhost", "x") == ("127.0.0.1", -1)


# --- their order -----------------------------------------------------------------------------------------------------


def test_samples_in_order_come_out_as_they_came_in():
    out, order = passed(sent(range(100)))
    assert out == list(range(100)) and order.counts == Counts(received=100)


def test_overtaken_samples_come_out_in_order_and_are_counted():
    out, order = passed(sent([0, 1, 3, 2, 4, 6, 7, 5, 8]))
    assert out == list(range(9)) and order.counts == Counts(received=9, reordered=2)


def test_a_sample_that_comes_twice_comes_out_once():
    numbers = [0, 1, 1, 2, 0, *range(3, 40), 5, 39]
    out, order = passed(sent(numbers))
    assert out == list(range(40)) and order.counts == Counts(received=40, duplicated=4)


def test_a_lost_sample_is_counted_and_a_late_one_is_late_instead():
    out, order = passed(sent([*range(10), *range(11, 20), 21, *range(22, 40), 10]))
    assert out == [k for k in range(40) if k not in (10, 20)]
    assert order.counts == Counts(received=38, lost=1, late=1)


def test_lost_samples_are_counted_by_time_where_there_are_no_numbers():
    _, order = passed([sample._replace(number=-1) for sample in sent([0, 1, 2, 5, 6])])
    assert order.counts.lost == 2


def test_a_random_network_gives_every_sample_once_in_order_and_counts_the_rest():
    generator = random.Random(5)
    there = [k for k in range(4000) if generator.random() > 0.05]
    # 20 ms of jitter at 10 ms: samples overtake each other by one or two places, never by the delay of five
    arrivals = [(0.01 * k + 0.02 * generator.random(), k) for k in there]
    arrivals += [(at + 0.02 * generator.random(), k) for at, k in arrivals if generator.random() < 0.02]
    out, order = passed(sent(k for _, k in sorted(arrivals)), delay=5)
    assert out == there
    assert order.counts.received == len(there) and order.counts.duplicated == len(arrivals) - len(there)
    assert order.counts.lost == there[-1] - there[0] + 1 - len(there) and order.counts.late == 0


def test_a_damaged_time_changes_nothing():
    good = sent(range(50))
    damaged = [*good[:20], Timed(1e9, 20, good[20].signals), *good[20:]]
    out, order = passed(damaged)
    assert out == list(range(50)) and order.counts == Counts(received=50, stray=1)


def test_a_pause_of_five_seconds_is_a_gap_and_not_a_new_start():
    out, order = passed(sent([*range(100), *range(600, 700)]))
    assert out == [*range(100), *range(600, 700)]
    assert order.counts == Counts(received=200, lost=500)


def test_a_rig_that_starts_anew_is_followed():
    out, order = passed(sent([*range(500, 600), *range(100)]))
    # what waited when the rig went away is not shown: nobody knows how long ago it was
    assert out == [*range(500, 595), *range(100)] and order.counts.restarted == 1


# --- the clock -------------------------------------------------------------------------------------------------------

SETTINGS = ClockSettings(delay=0.05, maximum_age=0.2, sample_time=H)


def test_a_sample_is_shown_with_the_delay_whatever_the_rigs_clock_says():
    clock, pitches = Clock(), []
    for k in range(40):
        clock, seen = tick(clock, k * H, tuple(sent([k], offset=1e6)), SETTINGS)
        pitches.append(None if seen.latest is None else seen.latest.signals[2])
    assert pitches[:5] == [None] * 5 and pitches[5:] == list(range(35))
    assert seen.fresh and abs(seen.lead) < 1e-8 and seen.age < 1e-8 and clock.set_anew == 0


def test_while_nothing_comes_in_the_data_grow_old_and_then_go_on_where_the_rig_is():
    clock = Clock()
    for k in range(700):
        there = tuple(sent([k])) if not 100 <= k < 600 else ()
        clock, seen = tick(clock, k * H, there, SETTINGS)
        if k == 599:
            # 5 s after the last arrival all that waited has been shown; the co-simulation is 5 s ahead of its newest
            assert not seen.fresh and seen.lead == pytest.approx(5.0) and seen.age == pytest.approx(4.95)
    assert seen.latest.number == 694 and seen.fresh and clock.set_anew == 0


def test_a_co_simulation_that_is_not_paced_runs_ahead_and_its_clock_is_set_anew():
    clock, leads = Clock(), []
    for k in range(200):  # 50 ms simulated per sample of 10 ms
        clock, seen = tick(clock, 0.05 * k, tuple(sent([k])), SETTINGS)
        leads.append(seen.lead)
    assert max(leads) <= SETTINGS.maximum_age + 1e-9 and clock.set_anew > 10


def test_a_slow_co_simulation_is_behind_and_skips():
    clock = Clock()
    for k in range(200):  # 2 ms simulated per sample of 10 ms
        clock, seen = tick(clock, 0.002 * k, tuple(sent([k])), SETTINGS)
        assert seen.lead >= -SETTINGS.maximum_age - 1e-9
    assert clock.set_anew > 2 and len(clock.order.waiting) < 30


def test_a_sample_that_comes_in_after_it_was_due_is_shown_but_is_not_of_this_instant():
    """Of a network with jitter: sample 5 is lost, sample 4 comes in when 5 is due. Taken for 5 it lags by 10 ms."""
    clock, settings = Clock(), ClockSettings(0.0, 0.2, H)
    arrivals = {k: (Timed(k * H, k, (float(k),)),) for k in (0, 1, 2, 3, 6, 7)} | {5: (Timed(4 * H, 4, (4.0,)),)}
    shown = []
    for k in range(8):
        clock, seen = tick(clock, k * H, arrivals.get(k, ()), settings)
        shown.append((seen.latest.number, seen.fresh))
    assert shown == [(0, True), (1, True), (2, True), (3, True), (3, False), (4, False), (6, True), (7, True)]
    assert clock.order.counts.received == 7
