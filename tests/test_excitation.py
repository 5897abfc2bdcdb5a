"""The excitation: the paper's signals, multisines, and how they reach the rotors."""

from math import isclose, pi, sqrt

import numpy as np
import pytest
import scipy.signal

from heli_identifier.errors import ConfigurationError
from heli_identifier.online.excitation import (
    Excitation,
    Multisine,
    SquareChirp,
    combined,
    paper_excitation,
    phases,
    voltages,
)

H = 0.01


def sampled(signal, seconds):
    return np.array([signal.at(k * H) for k in range(round(seconds / H))])


def test_the_chirp_is_the_linear_chirp_of_scipy():
    signal = SquareChirp(low=0.0, high=0.0, chirp_amplitude=0.2)
    t = np.arange(1000) * H
    reference = 0.2 * scipy.signal.chirp(t, 2.0, 10.0, 0.5, phi=-90)
    # Both evaluate one sine of at most 80 rad: rounding only.
    np.testing.assert_allclose(sampled(signal, 10.0), reference, atol=1e-13)


def test_the_difference_drives_pitch_and_the_total_drives_elevation():
    pitch, elevation = paper_excitation(1, "difference", base=1.5), paper_excitation(1, "total", base=0.5)
    for t in (0.0, 3.3, 12.7, 25.0):
        front, rear = voltages(t, pitch)
        assert isclose(front - rear, SquareChirp().at(t), abs_tol=1e-15)
        assert isclose(front + rear, 3.0)
        front, rear = voltages(t, elevation)
        assert front == rear
        assert isclose(front + rear, 1.0 + 2.0 * SquareChirp().at(t))
    strong = Excitation(base=4.9, difference=SquareChirp(), total=SquareChirp())
    assert voltages(0.0, strong) == (5.0, 4.9)  # the amplifiers' limit


def test_a_measured_square_and_chirp_log_is_reproduced():
    # Samples of a rig's training log, printed to 1e-5 V: its start, an edge of the difference at 11.70 s, and two
    # late ones, where a wrong period or chirp rate would have run away.
    square = SquareChirp(-0.5, 0.5, 15.4, chirp_amplitude=0.0)  # runs 3.7 s ahead
    chirp = SquareChirp(0.0, 0.0, 15.4, 0.25, 1.5, 0.3, 13.0)
    total = SquareChirp(0.5, 2.0, 20.0, 0.4, 2.0, 0.5, 10.0)
    log = {0: (1.75, 1.25), 1: (1.78682, 1.26330), 2: (1.82311, 1.27629), 3: (1.85839, 1.28870)}
    log |= {1169: (0.79644, 1.04887), 1170: (1.30687, 0.55847), 4321: (1.59268, 1.08791), 8888: (1.48723, 1.18325)}
    for k, expected in log.items():
        t = k * H
        found = combined(0.5, square.at(t + 3.7) + chirp.at(t), total.at(t), 5.0)
        assert found == pytest.approx(expected, abs=1.5e-5)


def test_a_multisine_has_its_rms_and_only_its_tones():
    signal = Multisine(rms=0.45, lowest=1 / 30, highest=2.5, tones=12, period=90.0)
    values = sampled(signal, 90.0)
    spectrum = 2.0 * np.abs(np.fft.rfft(values)) / len(values)
    lines = np.flatnonzero(spectrum > 1e-9)
    # All tones are harmonics of 1/90 Hz, so that a whole period leaks nothing (rounding alone remains).
    assert len(lines) == 12
    np.testing.assert_allclose(lines[[0, -1]] / 90.0, [1 / 30, 2.5])
    np.testing.assert_allclose(spectrum[lines], 0.45 * sqrt(2 / 12), rtol=1e-9)
    assert isclose(float(np.sqrt(np.mean(values**2))), 0.45, rel_tol=1e-9)


def test_a_seed_fixes_the_multisine_and_another_seed_changes_it():
    assert Multisine(seed=3).components == Multisine(seed=3).components
    assert Multisine(seed=3).components != Multisine(seed=4).components
    # Drawn once from Python's Mersenne twister, whose sequence the language guarantees.
    assert isclose(phases(3, 1)[0], 2 * pi * 0.23796462709189137)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: SquareChirp(period=0.0), "square.period = 0.0 s must be positive"),
        (lambda: SquareChirp(high=float("nan")), "square.high = nan V"),
        (lambda: Multisine(highest=0.01), "multisine.highest = 0.01 Hz must lie in"),
        (lambda: Multisine(lowest=1e-4, highest=2e-4, tones=1), "has no harmonic near 0.0001 Hz"),
        (lambda: Excitation(base=6.0), "excitation.base = 6.0 V must lie in"),
        (lambda: paper_excitation(3), "experiment = 3 must be 1 or 2"),
        (lambda: paper_excitation(1, "sum"), "channel = 'sum'"),
    ],
)
def test_impossible_settings_are_refused_with_name_value_and_bound(make, message):
    with pytest.raises(ConfigurationError, match=message.replace("[", r"\[")):
        make()
