"""Field rigs: their physics against independent equations, its flights within bounds, its truth correct."""

from dataclasses import replace

import numpy as np
import pytest

from tests.blind.coefficients import Coefficients
from tests.blind.encoders import COUNTS_PER_TURN
from tests.blind.field.control import V_MAX, Control
from tests.blind.field.draw import AIR_STD, GAIN_STD, ZERO_STD, draw_field_rig
from tests.blind.field.flight import fly
from tests.blind.field.generator import fly_log
from tests.blind.field.truth import Air
from tests.blind.rigs import AXES, Room

EVERYTHING = "+".join((
    "speed_stability", "quadratic_thrust", "rotor_drag_torque", "constant_torque", "cable_stiffness", "rotor_mismatch",
    "input_delay", "quadratic_drag:pitch", "gyroscopic_coupling", "airspeed_thrust_loss", "dry_friction:travel",
))  # fmt: skip

STILL = Room(torque_std=0.0)


def logs_of(truth):
    return [fly_log(truth, number).log for number in range(len(truth.logs))]


# --- form ----------------------------------------------------------------------------------------------------------


def test_logs_have_the_columns_the_rates_and_the_resolution_of_measured_ones():
    rigs = [draw_field_rig(seed, "field", touched=seed % 2 == 1) for seed in (9, 10)]
    for rig in rigs:
        assert 10 <= len(rig.logs) <= 16
        for own, log in zip(rig.logs, logs_of(rig), strict=True):
            assert log.shape == (round(own.duration * rig.rate), 6)
            assert 20.0 <= own.duration <= 40.0
            assert log[:, 0] == pytest.approx(np.arange(len(log)) / rig.rate, abs=1e-9)
            assert np.abs(log[:, 1:3]).max() <= V_MAX
            assert np.array_equal(log[:, 1:3], log[:, 1:3].round(5))
            counts = log[:, 3:] * COUNTS_PER_TURN / (2 * np.pi)
            # Six decimals of a radian are 8192/(2 pi) 5e-7 = 7e-4 counts.
            assert np.abs(counts - counts.round()).max() < 1e-3
            # no flight runs away
            assert np.abs(log[:, 3]).max() < 1.0
            assert -0.5 < log[:, 4].min() < log[:, 4].max() < 0.6
            assert np.abs(np.gradient(log[::50, 5], log[::50, 0])).max() < 2.5
    assert {rig.rate for rig in rigs} == {100.0, 500.0}


# --- what is drawn -------------------------------------------------------------------------------------------------


def test_zeros_and_gains_vary_from_log_to_log_with_the_stated_deviations():
    logs = [own for seed in range(150) for own in draw_field_rig(seed).logs]
    # A normal variable cut at two standard deviations keeps .96 of its deviation; 1900 logs determine it to 2 %.
    zeros, gains = np.array([own.zeros for own in logs]), np.array([own.gain for own in logs])
    assert zeros.std(axis=0) == pytest.approx(0.96 * np.array(ZERO_STD), rel=0.07)
    assert gains.std() == pytest.approx(0.96 * GAIN_STD, rel=0.07)
    assert gains.mean() == pytest.approx(1.0, abs=4 * GAIN_STD / len(logs) ** 0.5)


# --- equations of motion -------------------------------------------------------------------------------------------


def motor_states(truth, flight, number):
    """State of both motors at the samples, from the written voltages, by the exact response of the lag over 1 ms."""
    own, p = truth.logs[number], truth.coefficients()
    lead, held = len(flight.before), np.vstack([flight.before, flight.log[:, 1:3]])
    per_sample = round(1000.0 / truth.rate)
    middle = (np.arange(len(held) * per_sample) + 0.5) * 1e-3 - p.input_delay
    index = np.clip(np.floor(middle * truth.rate).astype(int), 0, None)
    stay = np.exp(-1e-3 / (p.t_m + p.motor_lag))
    nu, states = own.gain * held[0], np.empty((len(held), 2))
    for k, v in enumerate(own.gain * held[index]):
        if k % per_sample == 0:
            states[k // per_sample] = nu
        nu = stay * nu + (1.0 - stay) * v
    return states[lead:]


def smooth_accelerations(truth, flight, number):
    """Accelerations by the published laws, with angles from the encoder's zero, without dry friction and touches."""
    c = {f"{effect.name}_{effect.axis}": effect.coefficient for effect in truth.effects}
    p, own, z = truth.base, truth.logs[number], truth.horizontal_offset
    nu = motor_states(truth, flight, number)
    nu = nu + c["quadratic_thrust_rotors"] * nu * np.abs(nu)
    mu_s, mu_d = nu.sum(axis=1), nu[:, 0] - nu[:, 1]
    (th, e, lam), (w, w_e, w_l) = flight.angles.T, flight.rates.T
    pitch = (
        -p.a_wx * w - p.a_th * np.sin(th - p.theta0) + p.k_x * mu_d
        + c["rotor_mismatch_pitch"] * mu_s
        - c["airspeed_thrust_loss_pitch"] * mu_s * w - c["gyroscopic_coupling_pitch"] * mu_s * w_e
        - c["quadratic_drag_pitch"] * w * np.abs(w) + c["speed_stability_pitch"] * w_l
    )  # fmt: skip
    elevation = (
        -p.a_wz * w_e - p.a_e * np.sin(e) - p.a_1 * np.cos(e) - p.a_lt * w * w_l + p.k_z * mu_s * np.cos(th)
        - c["airspeed_thrust_loss_elevation"] * mu_s * w_e * np.cos(th) + c["gyroscopic_coupling_elevation"] * mu_s * w
        - 0.5 * np.sin(2 * (e + z)) * w_l**2
    )  # fmt: skip
    # The truth states the drag torque for cos(e); the rig has cos(e + z), with the same torque in hover.
    turned = np.cos(e + z) * np.cos(truth.hover[0]) / np.cos(truth.hover[0] + z)
    travel = (
        -p.a_wy * w_l + p.k_y * mu_s * np.sin(th) + 2 * np.tan(e + z) * w_e * w_l + c["constant_torque_travel"]
        + c["rotor_drag_torque_travel"] * mu_s * np.cos(th) * turned - c["cable_stiffness_travel"] * (lam - lam[0])
    )  # fmt: skip
    return np.column_stack([pitch, elevation, travel]) + own.trims


def unexplained(truth, flight, number):
    """Acceleration of the true motion beyond the equations, at the middles between samples [rad/s^2]."""
    a = smooth_accelerations(truth, flight, number)
    return np.diff(flight.rates, axis=0) * truth.rate - (a[1:] + a[:-1]) / 2


@pytest.fixture(scope="module")
def quiet():
    """A rig with many effects, in still air, at 500 Hz."""
    truth = draw_field_rig(2, EVERYTHING, touched=True)
    return replace(truth, rate=500.0, air=Air(), room=STILL, presliding=0.0)


def test_flights_obey_the_catalogues_equations_of_motion(quiet):
    number = next(i for i, own in enumerate(quiet.logs) if not own.touches)
    flight = fly_log(quiet, number)
    left = unexplained(quiet, flight, number)
    # A delay ends within a sample, where a voltage that jumps by V bends the acceleration: a sum by trapezoids over
    # 2 ms and a delay known to half a millisecond are off by up to k V .5e-3 / T = 2e-3 rad/s^2 at V = 1 V, T = .08 s,
    # by a sixth of it at the usual jumps; the weakest effect here, the cable, reaches .01 rad/s^2.
    assert np.abs(left[:, :2]).max() < 3e-3
    assert left[:, :2].std(axis=0).max() < 5e-4
    # The rest of the travel is dry friction: minus its level times the sign of the rate while it slips.
    (level,) = (effect.coefficient for effect in quiet.effects if effect.name == "dry_friction")
    w = flight.rates[:, 2]
    slipping = np.minimum(np.abs(w[1:]), np.abs(w[:-1])) > 0.01
    assert slipping.mean() > 0.2
    assert left[slipping, 2] == pytest.approx(-level * np.sign(w[1:][slipping]), abs=3e-3)


def test_touches_are_where_and_as_strong_as_the_truth_says(quiet):
    calm = replace(quiet, effects=tuple(effect for effect in quiet.effects if effect.name != "dry_friction"))
    zero_friction = {"dry_friction_travel": 0.0}
    touched = [number for number, own in enumerate(calm.logs) if own.touches]
    assert len(touched) == max(1, round(0.2 * len(calm.logs)))
    for number in touched:
        flight = fly_log(replace(calm, base=calm.base._replace(**zero_friction)), number)
        left = unexplained(calm, flight, number)
        time = flight.log[:-1, 0] + 0.5 / calm.rate
        (touch,) = calm.logs[number].touches
        axis = AXES.index(touch.axis)
        inside = (time > touch.start + 0.05) & (time < touch.end - 0.05)
        outside = (time < touch.start - 0.01) | (time > touch.end + 0.01)
        # The tolerance is that of the test of the equations of motion above.
        assert left[inside, axis] == pytest.approx(touch.acceleration, abs=3e-3)
        assert np.abs(left[outside]).max() < 3e-3
        others = [i for i in range(3) if i != axis]
        assert np.abs(left[:, others]).max() < 3e-3


def test_touch_changes_its_own_log_only_and_only_afterwards():
    calm, touched = (draw_field_rig(4, "field", touched=on) for on in (False, True))
    changed = 0
    for own, log, other in zip(touched.logs, logs_of(calm), logs_of(touched), strict=True):
        if not own.touches:
            assert np.array_equal(log, other)
            continue
        (touch,) = own.touches
        before = log[:, 0] <= touch.start
        assert np.array_equal(log[before], other[before])
        after = (log[:, 0] > touch.end) & (log[:, 0] < touch.end + 2.0)
        # The touch adds a rate of at least .25 s times .5 rad/s^2, which shows within two seconds despite the loop.
        assert np.abs(log[after, 3:] - other[after, 3:]).max() > 0.02
        changed += 1
    assert changed >= 1


# --- what varies from log to log, air and controller ---------------------------------------------------------------


def hovering(zeros=(0.0, 0.0, 0.0), gain=1.0):
    """Mean reading, true angles and voltages of the last seconds of a flight whose pilot holds still."""
    truth = draw_field_rig(11, "clean_loop")
    truth = replace(truth, liveliness=0.0, room=STILL)
    control = truth.control
    control = control._replace(k_ip=0.25 * control.k_pp, k_ie=0.5 * control.k_pe, b_p=0.0, b_r=0.0)
    own = replace(truth.logs[0], zeros=zeros, gain=gain, duration=40.0)
    flight = fly_log(replace(truth, control=control, logs=(own,)), 0)
    late = slice(-1000, None)
    return truth, flight.log[late, 3:5].mean(axis=0), flight.angles[late, :2].mean(axis=0), flight.log[late, 1:3]


def test_controller_holds_the_reading_of_the_encoders_and_not_the_true_angle():
    truth, read, angles, _ = hovering(zeros=(0.0, 0.03, 0.0))
    # The integral removes all but the noise of the encoders, a count or less.
    assert read == pytest.approx((0.0, truth.hover[0]), abs=2e-3)
    assert angles == pytest.approx((0.0, truth.hover[0] - 0.03), abs=2e-3)


def test_controller_compensates_the_gain_of_a_log():
    truth, _, _, voltages = hovering()
    _, _, _, weaker = hovering(gain=0.96)
    # Hover needs a given thrust, so the mean voltages go with 1/gain; 10 s of encoder noise leave some millivolts.
    assert voltages.sum(axis=1).mean() == pytest.approx(truth.hover[1], rel=5e-3)
    assert 0.96 * weaker.mean(axis=0) == pytest.approx(voltages.mean(axis=0), rel=5e-3)


@pytest.mark.parametrize("share", [1.0, 2.0])
def test_torque_of_the_air_grows_with_the_thrust_and_has_its_correlation_time(share):
    free = Coefficients(
        a_wx=0.0, a_wz=0.0, a_wy=0.0, a_lt=0.0, a_th=0.0, a_e=0.0, a_1=0.0, k_x=0.0, k_z=0.0, k_y=0.0
    )  # fmt: skip
    n, std, tau = 40_000, (0.004, 0.008, 0.012), 0.5
    held = np.full((n, 2), share * 1.5)
    _, _, rates, _ = fly(
        np.zeros((n, 3)), held, np.zeros(3), 0, False, free, Control(), (0.0, 3.0), (0.0, 1.0, 0.0), (std, tau),
        ((0.0, 0.0, 0.0), 1.0, (0.0, 0.0, 0.0)), np.empty((0, 4)), 100.0, np.random.default_rng(5),
    )  # fmt: skip
    torque = np.diff(rates, axis=0) * 100.0
    # 400 s hold about 400 independent values of a process of .5 s: 1/sqrt(800) = 3.5 % on a deviation.
    assert torque.std(axis=0) == pytest.approx(share * np.array(std), rel=0.14)
    lag = round(tau * 100)
    correlation = (torque[lag:] * torque[:-lag]).mean(axis=0) / torque.var(axis=0)
    assert correlation == pytest.approx(np.exp(-1), abs=0.17)
    assert AIR_STD[0] <= min(std)
