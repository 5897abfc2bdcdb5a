"""Windy rigs: the air has the level, rate and colour that it says, and the logs follow from their seed alone."""

import numpy as np
import pytest

from tests.blind.air import DRIFT_RATE, DRIFT_SHARE, SWIRL_DAMPING, Noise, torque
from tests.blind.coefficients import Coefficients
from tests.blind.encoders import COUNTS_PER_TURN
from tests.blind.field.control import V_MAX, Control
from tests.blind.field.flight import fly
from tests.blind.rotors import beyond_dead_zone, thrust
from tests.blind.windy import DURATION, QUIET, WindyTruth, windy_rig

LEVEL = (0.2, 0.04, 0.015)

FEW = {"a": 1, "c": 1}


def long_torque(colour, rate, duration, h):
    return torque(Noise(colour, LEVEL, rate), round(duration / h), h, np.random.default_rng(7))


@pytest.fixture(scope="module")
def rig():
    return windy_rig(5, counts=FEW)


# --- the air -------------------------------------------------------------------------------------------------------


def test_gusts_have_their_level_and_their_rate():
    rate, duration, h = 2.5, 8000.0, 0.01
    air = long_torque("ou", rate, duration, h) / LEVEL
    # Bartlett: the variance's relative variance is 2/(c T); that of the correlation at 1/c is (1 - 3/e^2)/(c T).
    assert air.std(axis=0) == pytest.approx(1.0, abs=4 * np.sqrt(0.5 / (rate * duration)))
    lag = round(1 / rate / h)
    at_lag = (air[lag:] * air[:-lag]).mean(axis=0) / (air**2).mean(axis=0)
    assert at_lag == pytest.approx(np.exp(-1), abs=4 * np.sqrt((1 - 3 / np.e**2) / (rate * duration)))


def test_slow_drift_is_left_when_the_gusts_have_forgotten():
    rate, duration, h, lag = 2.5, 40000.0, 0.1, 4.0
    air = long_torque("slow", rate, duration, h) / LEVEL
    k = round(lag / h)
    left = (air[k:] * air[:-k]).mean(axis=0)
    # Variance of an autocovariance: 1/T int r(t)^2 + r(t + lag) r(t - lag) dt, at most 2/T int r(t)^2 dt.
    share = DRIFT_SHARE**2
    integral = 1 / rate + 4 * share / (rate + DRIFT_RATE) + share**2 / DRIFT_RATE
    expected = share * np.exp(-DRIFT_RATE * lag) + np.exp(-rate * lag)
    assert left == pytest.approx(expected, abs=4 * np.sqrt(2 * integral / duration))


def test_swirl_has_its_level_and_the_peak_of_its_spectrum_at_its_rate():
    c, duration, h = 2.5, 6000.0, 0.05
    air = long_torque("swirl", c, duration, h) / LEVEL
    # r(t) is exp(-zeta c t) times a cosine of amplitude 1/sqrt(1 - zeta^2): int r^2 < 1/(2 zeta c (1 - zeta^2)).
    spread = np.sqrt(0.5 / (2 * SWIRL_DAMPING * c * (1 - SWIRL_DAMPING**2)) * 2 / duration)
    assert air.std(axis=0) == pytest.approx(1.0, abs=4 * spread)
    f = 2 * np.pi * np.fft.rfftfreq(len(air), h)
    power = np.abs(np.fft.rfft(air, axis=0)) ** 2
    band = (f > 0.3) & (f < 8.0)
    # Smoothed over .2 rad/s, 191 lines of three axes, the spectrum is known to 1/sqrt(573) = 4 %; near the peak it
    # falls as 1 - ((f - c)/(zeta c))^2, so 4 standard errors move the maximum by .4 zeta c.
    width = round(0.2 / (f[1] - f[0]))
    smooth = np.convolve(power.sum(axis=1), np.ones(width) / width, mode="same")
    assert f[band][smooth[band].argmax()] == pytest.approx(c, abs=0.4 * SWIRL_DAMPING * c)


# --- the flight ----------------------------------------------------------------------------------------------------


def flown(voltages, p, trims=(0.0, 0.0, 0.0), wind=None):
    return fly(
        np.zeros((len(voltages), 3)), voltages, np.array([p.theta0, 0.2, 0.0]), 0, False, p, Control(), (0.2, 3.0),
        (0.0, 1.0, 0.0), ((0.0, 0.0, 0.0), 1.0), ((0.0, 0.0, 0.0), 1.0, trims), np.empty((0, 4)), 100.0,
        np.random.default_rng(0), wind,
    )[1]  # fmt: skip


def test_constant_wind_is_a_constant_torque():
    voltages, torques = np.full((400, 2), 1.5), (0.05, 0.02, 0.01)
    wind = np.tile(torques, (4000, 1))
    calm = flown(voltages, Coefficients())
    blown = flown(voltages, Coefficients(), wind=wind)
    assert np.abs(blown - calm).max(axis=0).min() > 0.005  # some counts of 1.5 mrad
    assert blown == pytest.approx(flown(voltages, Coefficients(), torques), abs=1e-12)


def test_dead_zone_takes_its_width_off_the_voltages_of_a_flight():
    voltages = 1.5 + np.random.default_rng(1).uniform(-0.5, 0.5, (400, 2))
    with_zone = flown(voltages, Coefficients(dead_zone=0.25))
    assert with_zone == pytest.approx(flown(voltages - 0.25, Coefficients()), abs=1e-12)


# --- the rigs ------------------------------------------------------------------------------------------------------


def test_a_rig_is_reproduced_from_its_seed_and_another_seed_gives_another(rig):
    again, other = windy_rig(5, counts=FEW), windy_rig(6, counts=FEW)
    assert again.truth == rig.truth
    assert again.noise == rig.noise
    for name, log in rig.logs.items():
        assert np.array_equal(log.angles, again.logs[name].angles)
        assert np.array_equal(log.voltages, again.logs[name].voltages)
        assert log.angles[:100].tobytes() != other.logs[name].angles[:100].tobytes()
    assert other.truth != rig.truth


def test_other_logs_and_their_references_do_not_change_a_log(rig):
    alone = windy_rig(5, counts={"c": 1}, references=False)
    assert list(alone.logs) == ["c1"]
    assert np.array_equal(alone.logs["c1"].angles, rig.logs["c1"].angles)
    assert alone.logs["c1"].references == {}


def test_a_quiet_rig_is_the_same_rig_with_references_a_fifth_as_large(rig):
    quiet = windy_rig(5, quiet=True, counts=FEW)
    assert (quiet.truth, quiet.noise, quiet.controls) == (rig.truth, rig.noise, rig.controls)
    for name, log in rig.logs.items():
        assert quiet.logs[name].references["pitch"] == pytest.approx(QUIET * log.references["pitch"], abs=1e-12)
        assert quiet.logs[name].angles[:, 1].std() < log.angles[:, 1].std()


@pytest.mark.parametrize(("colour", "rate"), [("ou", 100.0), ("slow", 500.0), ("swirl", 100.0)])
def test_logs_have_the_form_of_measured_ones_and_no_flight_runs_away(colour, rate):
    for name, log in windy_rig(11, colour, rate=rate, counts=FEW).logs.items():
        n = len(log.time)
        assert log.voltages.shape == (n, 2)
        assert log.angles.shape == (n, 3)
        assert np.diff(log.time) == pytest.approx(1 / rate)
        assert DURATION[0] - 1 / rate <= n / rate <= DURATION[1] + 1 / rate
        assert {"pitch", "elevation"} <= set(log.references) <= {"pitch", "elevation", "travel"}
        assert all(reference.shape == (n,) for reference in log.references.values())
        assert log.angles[0, 2] == 0.0
        counts = log.angles * COUNTS_PER_TURN / (2 * np.pi)
        assert counts == pytest.approx(counts.round(), abs=1e-6)
        assert np.abs(log.angles[:, 0]).max() < 1.0, name
        assert np.mean(np.abs(log.voltages) == V_MAX) < 0.05


def test_slopes_are_those_of_the_thrust_that_the_rotors_give():
    parameters = {"k_x": 0.3, "k_z": 0.15, "k_y": -0.1}
    truth = WindyTruth(parameters, {"dead_zone/rotors": 0.25, "quadratic_thrust/rotors": 0.1})
    p, v, d = Coefficients(dead_zone=0.25, quadratic_thrust=0.1), 1.7, 1e-4
    low, at, high = (thrust(beyond_dead_zone(u, p.dead_zone), 0.0, p) for u in (v - d, v, v + d))
    slope, share = (high - low) / (2 * d), at / v
    expected = {"k_x": 0.3 * slope, "k_z": 0.15 * slope, "k_y": -0.1 * share}
    assert truth.slopes(v) == pytest.approx(expected, rel=1e-9)
