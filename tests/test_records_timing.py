"""From stated instants to a uniform rate."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from heli_identifier.errors import LogError
from heli_identifier.records.timing import GAP_STEPS, find_sampling, mean_of_held


def sampling_of(time):
    return find_sampling(time, "log.csv", 2)


@pytest.mark.parametrize("rate_hz", [50.0, 62.5, 99.5, 100.0, 2000.0])
def test_an_even_time_keeps_its_samples_and_is_not_commented_on(rate_hz):
    found, grid, notes = sampling_of(3.0 + np.arange(12000) / rate_hz)
    assert (grid, notes) == (None, [])
    assert found == pytest.approx(rate_hz, rel=1e-12)


@pytest.mark.parametrize("rate_hz", [60, 256, 300, 333, 2000 / 3, 700, 800])
@pytest.mark.parametrize("printed", [np.round, np.floor], ids=["rounded", "cut off"])
def test_neighbouring_multiples_of_the_printed_digit_in_turns_are_an_even_clock(rate_hz, printed):
    found, grid, notes = sampling_of(printed(1e3 * np.arange(7000) / rate_hz) / 1e3)
    # the ends are known to a digit: 1 ms of some 10 s
    assert found == pytest.approx(rate_hz, rel=1.5e-4) and grid is None
    interval = f"{1e3 / found:.5g} ms ({found:g} Hz)"
    assert notes == [f"time column printed to 1 ms; sampling interval taken as the mean, {interval}"]


TENTH = np.flatnonzero(np.random.default_rng(3).random(9_990) < 0.1) + 5


@pytest.mark.parametrize(
    ("rate_hz", "count", "lost", "seen"),
    [(1e3, 10_000, TENTH, 1e3), (100.0, 2000, np.arange(4, 1990, 3), 100.0), (300.0, 7000, 700, 300.0)]
    + [(700.0, 7000, at, 1000.0) for at in (3500, 6300)],  # steps of 1 and 2 ms with a loss look like 1 kHz
)
def test_lost_samples_are_lost_and_no_coarse_print(rate_hz, count, lost, seen):
    """All instants behind a loss are a step late: off any line by half a step and half a digit, more than a digit."""
    found, grid, notes = sampling_of(np.delete(np.round(np.arange(count) / rate_hz, 3), lost))
    assert grid is not None and "uneven" in notes[0]
    assert found == pytest.approx(seen, rel=1.5e-4)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), spread=st.floats(0.05, 0.2))
def test_jitter_of_either_sign_still_shows_the_rate_of_the_clock(seed, spread):
    # Up to a fifth of a step either way no interval rounds to another number of steps than one.
    random = np.random.default_rng(seed)
    found, grid, notes = sampling_of((np.arange(2000) + random.uniform(-spread, spread, 2000)) / 100.0)
    assert grid is not None and "uneven" in notes[0]
    assert found == 100.0


def test_the_longest_bridged_gap_is_five_steps_and_a_longer_one_names_its_row():
    whole = np.arange(2000) / 100.0
    bridged = GAP_STEPS - 1
    assert sampling_of(np.delete(whole, slice(100, 100 + bridged)))[1] is not None
    # Samples 100 .. 104 are lost, so the first row after the gap is that of sample 100 in what is left.
    with pytest.raises(LogError, match=r"log.csv, row 102: no samples for 0.06 s before 1.05 s"):
        sampling_of(np.delete(whole, slice(100, 101 + bridged)))


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_resampling_a_held_voltage_keeps_its_impulse(seed):
    random = np.random.default_rng(seed)
    time = np.concatenate(([0.0], np.cumsum(random.uniform(0.005, 0.02, 199))))
    voltage = random.uniform(-5.0, 5.0, 200)
    grid = np.linspace(0.0, time[-1], 150)
    step = grid[1] - grid[0]
    resampled = mean_of_held(time, voltage, grid)
    # Up to the last instant of the log the impulse is a sum of rectangles, exact to rounding.
    assert step * resampled[:-1].sum() == pytest.approx(np.sum(voltage[:-1] * np.diff(time)), abs=1e-10)
    assert np.abs(resampled).max() <= np.abs(voltage).max() + 1e-9


def test_a_log_a_little_too_short_is_refused_with_a_length_below_the_bound():
    with pytest.raises(LogError, match="^log.csv: 4.9995 s of log are shorter than 5 s"):
        sampling_of(np.arange(9999) / 2000.0)
