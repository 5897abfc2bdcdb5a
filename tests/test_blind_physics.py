"""The blind plant: comparison with closed forms and with scipy. It shares no code with the plant."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.blind.coefficients import Coefficients, Strange
from tests.blind.integration import STEPS_PER_SAMPLE, integrate
from tests.blind.signals import SAMPLE, square_and_chirp
from tests.blind.unknown import strange_torque

STEP = SAMPLE / STEPS_PER_SAMPLE
FREE = Coefficients(a_wx=0.0, a_wz=0.0, a_wy=0.0, a_lt=0.0, a_1=0.0, theta0=0.0)
"""No damping, no coupling, equilibrium at zero."""

ENCODER_COUNT = 2 * np.pi / 8192


def run(coefficients, seconds=40.0, start=(0.0, 0.0, 0.0), mu_s=0.0, mu_d=0.0, strange=None, torque_std=0.0, seed=1):
    n = round(seconds / SAMPLE)
    mu_s, mu_d = np.broadcast_to(mu_s, n), np.broadcast_to(mu_d, n)
    voltages = np.column_stack([(mu_s + mu_d) / 2, (mu_s - mu_d) / 2])
    noise = np.random.default_rng(seed)
    return integrate(voltages, np.array(start), coefficients, strange or Strange(), torque_std, 1.0, noise)


def times(seconds=40.0):
    return SAMPLE * np.arange(round(seconds / SAMPLE))


def period(t, x):
    up = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
    crossings = t[up] - x[up] * SAMPLE / (x[up + 1] - x[up])
    return np.diff(crossings).mean()


def test_energy_of_an_undamped_pitch_swing_is_kept():
    angles, rates = run(FREE, start=(1.0, 0.0, 0.0))
    energy = rates[:, 0] ** 2 / 2 + FREE.a_th * (1 - np.cos(angles[:, 0]))
    # The midpoint method is symplectic here: the energy ripples by a share of (omega h)^2/8 < 1e-7 and does not drift.
    assert np.ptp(energy) < 1e-6 * energy[0]


def test_energy_of_a_damped_swing_never_rises():
    angles, rates = run(FREE._replace(a_wx=0.06), start=(1.0, 0.0, 0.0))
    energy = rates[:, 0] ** 2 / 2 + FREE.a_th * (1 - np.cos(angles[:, 0]))
    assert np.all(np.diff(energy) < 1e-7 * energy[0])  # the same ripple


@pytest.mark.parametrize("mu_d", [0.0, 1.0])
def test_small_pitch_swings_have_the_frequency_of_their_equilibrium(mu_d):
    rest = np.arcsin(FREE.k_x * mu_d / FREE.a_th)
    angles, _ = run(FREE, start=(rest + 0.01, 0.0, 0.0), mu_d=mu_d)
    expected = 2 * np.pi / np.sqrt(FREE.a_th * np.cos(rest))
    # An amplitude of .01 rad changes the period by the share .01^2/16; about a tilted rest the change is similar.
    assert period(times(), angles[:, 0] - rest) == pytest.approx(expected, rel=5e-5)


def test_elevation_follows_the_damped_oscillator():
    p = FREE._replace(a_wz=0.5)
    angles, _ = run(p, start=(0.0, 0.3, 0.0))
    t, sigma = times(), p.a_wz / 2
    omega = np.sqrt(p.a_e - sigma**2)
    expected = 0.3 * np.exp(-sigma * t) * (np.cos(omega * t) + sigma / omega * np.sin(omega * t))
    # Second order: the error grows no faster than .3 omega^3 h^2 t/6, at most .3 * 4.2 * 1e-6 * 4 (t = 2/sigma) / 6.
    assert np.abs(angles[:, 1] - expected).max() < 1e-6


def test_base_model_agrees_with_scipy_on_the_training_signal():
    p = Coefficients()
    voltages = square_and_chirp(20.0, 1.0)
    start = np.array([p.theta0 + 0.02, 0.2, 0.0])
    angles, _ = integrate(voltages, start, p, Strange(), 0.0, 1.0, np.random.default_rng(0))

    def slope(_, x, v):
        th, e, _lam, w, w_e, w_l, f, r = x
        pitch = -p.a_wx * w - p.a_th * np.sin(th - p.theta0) + p.k_x * (f - r)
        elevation = -p.a_wz * w_e - p.a_e * e - p.a_1 - p.a_lt * w * w_l + p.k_z * (f + r) * np.cos(th)
        travel = -p.a_wy * w_l + p.k_y * (f + r) * np.sin(th)
        return [w, w_e, w_l, pitch, elevation, travel, (v[0] - f) / p.t_m, (v[1] - r) / p.t_m]

    x, worst = np.r_[start, 0.0, 0.0, 0.0, voltages[0]], 0.0
    for k, v in enumerate(voltages):
        worst = max(worst, np.abs(x[:3] - angles[k]).max())
        x = solve_ivp(slope, (0, SAMPLE), x, args=(v,), rtol=1e-9, atol=1e-11).y[:, -1]
    # A hundredth of a count: negligible beside the encoder.
    assert worst < ENCODER_COUNT / 100


def test_pitch_released_inside_the_friction_band_never_moves():
    p = FREE._replace(dry_friction_pitch=0.02)
    start = 0.9 * np.arcsin(0.02 / FREE.a_th)
    angles, rates = run(p, start=(start, 0.0, 0.0))
    assert np.all(rates[:, 0] == 0.0)
    assert np.all(angles[:, 0] == start)


def test_dry_friction_takes_two_bands_from_the_amplitude_every_period_half_and_then_holds_still():
    c, p = 0.02, FREE._replace(dry_friction_elevation=0.02)
    angles, rates = run(p, start=(0.0, 0.1, 0.0))
    turns = np.flatnonzero(np.diff(np.sign(rates[:, 1])) != 0)
    peaks = np.abs(angles[turns, 1])[:6]  # the first turn is the release
    band = c / p.a_e
    # A turning point lies between samples: its angle is off by at most omega^2 A SAMPLE^2/2 = 1.3e-5.
    assert np.diff(peaks) == pytest.approx(-2 * band, abs=3e-5)
    assert abs(angles[-1, 1]) <= band
    assert np.all(rates[-1000:, 1] == 0.0)


def test_axis_under_a_swinging_torque_sticks_for_whole_intervals_and_slips_between():
    swing = Strange(axis=2, periodic=0.05, frequency=0.2)
    _, rates = run(FREE._replace(k_y=0.0, a_wy=1.0, dry_friction_travel=0.03), strange=swing)
    stuck = rates[:, 2] == 0.0
    lengths = np.diff(np.flatnonzero(np.diff(stuck.astype(int))))
    assert 0.2 < stuck.mean() < 0.8
    assert lengths.max() > 50  # samples: half a second and more without any motion


def test_breakaway_friction_lets_go_at_its_sum_with_dry_friction():
    t = times(60.0)
    p = FREE._replace(a_th=0.0, a_wx=1.0, dry_friction_pitch=0.02, breakaway_friction_pitch=0.03, stribeck_rate=0.02)
    ramp = 0.005 * t
    _, rates = run(p, 60.0, mu_d=ramp)
    lets_go = t[np.flatnonzero(rates[:, 0])[0]]
    # The motor lags the ramp by T_m, the log by up to one sample.
    assert lets_go == pytest.approx(0.05 / (p.k_x * 0.005) + p.t_m, abs=2 * SAMPLE)
    # Sliding at three times w_s, the excess is .03 exp(-10) = 1e-6: w' = k mu_d - c - a w, a ramp's answer.
    expected = (p.k_x * 0.005 * (t[-1] - p.t_m - 1 / p.a_wx) - 0.02) / p.a_wx
    assert rates[-1, 0] == pytest.approx(expected, abs=1e-5)


def test_bristles_bend_like_a_spring_before_they_slip():
    c, x = 0.02, 0.001
    p = FREE._replace(a_th=0.0, a_wx=40.0, dry_friction_pitch=c, presliding=x)  # too slow to overshoot
    torque = 0.25 * c
    angles, _ = run(p, mu_d=np.where(times() < 1.0, 0.0, torque / FREE.k_x))
    # Dahl's law under a steady torque T < F: z = x T/F, reached after the slide -x log(1 - T/F).
    assert angles[-1, 0] == pytest.approx(-x * np.log(1 - torque / c), rel=0.02)


def test_quadratic_drag_gives_the_hyperbolic_tangent():
    drive, drag = 0.02, 0.06
    _, rates = run(FREE._replace(k_y=0.0, constant_torque_travel=drive, quadratic_drag_travel=drag))
    expected = np.sqrt(drive / drag) * np.tanh(np.sqrt(drive * drag) * times())
    assert rates[:, 2] == pytest.approx(expected, abs=1e-6)  # h^2 times rates below one


def test_input_delay_shifts_the_answer_by_whole_samples():
    mu_d = np.where(times() < 5.0, 0.0, 1.0)
    prompt, _ = run(FREE, mu_d=mu_d)
    late, _ = run(FREE._replace(input_delay=0.08), mu_d=mu_d)
    assert late[8:, 0] == pytest.approx(prompt[:-8, 0], abs=1e-9)


def test_delay_between_samples_interpolates_its_neighbours_linearly():
    mu_d = np.where(times() < 5.0, 0.0, 1.0)
    late = [run(FREE._replace(a_th=0.0, input_delay=c), mu_d=mu_d)[1][-1, 0] for c in (0.02, 0.0234, 0.03)]
    assert late[1] == pytest.approx(late[0] + 0.34 * (late[2] - late[0]), abs=1e-9)


def test_motor_lag_adds_to_the_time_constant():
    mu_d = np.where(times() < 1.0, 0.0, 1.0)
    _, rates = run(FREE._replace(a_th=0.0, motor_lag=0.07), mu_d=mu_d)
    # A free axis behind a lag T reaches w = k (t - T) at the time t after the step.
    assert rates[-1, 0] == pytest.approx(FREE.k_x * (times()[-1] - 1.0 - 0.15), abs=1e-6)


@pytest.mark.parametrize(
    ("change", "factor"),
    [
        ({"quadratic_thrust": 0.12}, 1 + 0.12 * 1.0),
        ({"dead_zone": 0.15}, 0.85),
        ({"thrust_fade": 0.005}, 1 - 0.005 * 20.0),  # mean gain over the 40 s
        ({"ground_effect": 0.4, "ground_angle": 0.0, "ground_length": 1e6}, 1.4),
    ],
)
def test_lift_at_one_volt_per_rotor_is_scaled_by(change, factor):
    rates = [run(FREE._replace(a_e=0.0, **c), mu_s=2.0)[1][-1, 1] for c in ({}, change)]
    assert rates[1] / rates[0] == pytest.approx(factor, rel=1e-3)  # 39.99 s stand for 40


def test_reverse_thrust_loss_acts_on_negative_thrust_alone():
    p = FREE._replace(a_e=0.0, reverse_thrust_loss=0.6)
    down, up = (run(p, mu_s=mu_s)[1][-1, 1] for mu_s in (-2.0, 2.0))
    assert down / up == pytest.approx(-0.4)


def test_moving_mass_shifts_the_rest_of_the_arm():
    p = FREE._replace(a_wz=4.0, moving_mass=0.06, mass_time=10.0)
    angles, _ = run(p)
    assert np.all(angles[:1000, 1] == 0.0)
    assert angles[-1, 1] == pytest.approx(-0.06 / p.a_e, rel=1e-6)


def test_arm_bends_at_its_own_frequency_and_the_rigid_arm_does_not_feel_it():
    mu_s = np.where(times() < 1.0, 0.0, 2.0)
    bent, _ = run(FREE._replace(arm_bending=0.004, bending_damping=0.0), mu_s=mu_s)
    rigid, _ = run(FREE, mu_s=mu_s)
    bend = bent[:, 1] - rigid[:, 1]
    late = slice(2000, None)
    assert bend[late].mean() == pytest.approx(0.008, rel=0.02)  # part of a swing may be cut at the end
    # The motor's lag rounds the step, so the swing is 1/sqrt(1 + (2 pi 3 * .08)^2) = .553 of a sharp step's.
    assert np.ptp(bend[late]) / 2 == pytest.approx(0.553 * 0.008, rel=0.02)
    assert period(times()[late], bend[late] - 0.008) == pytest.approx(1 / 3, rel=2e-3)


def test_inertial_coupling_keeps_the_angular_momentum_of_a_rod():
    # At c = 1 the inertial terms are those of a rod: without torque, cos(eps)^2 lambda' stays constant.
    p = FREE._replace(inertial_coupling_elevation=1.0, inertial_coupling_travel=1.0, constant_torque_travel=0.0)
    swing = Strange(axis=2, by_travel=0.3, waves=1.0, phase=np.pi / 2)
    angles, rates = run(p, 2.0, start=(0.0, 0.2, 0.0), strange=swing)
    spin = np.cos(angles[:, 1]) ** 2 * rates[:, 2]
    drive = 0.3 * np.cos(angles[:, 2]) * np.cos(angles[:, 1]) ** 2
    expected = np.concatenate([[0.0], np.cumsum((drive[1:] + drive[:-1]) / 2) * SAMPLE])
    assert spin == pytest.approx(expected, abs=1e-5)  # trapezoidal sum at 10 ms


def test_process_noise_has_its_deviation_and_its_correlation_time():
    std = 0.003
    p = FREE._replace(a_th=0.0, a_e=0.0, k_x=0.0, k_y=0.0, k_z=0.0)
    rates = [run(p, 400.0, torque_std=std, seed=seed)[1] for seed in range(4)]
    torque = np.concatenate([np.diff(r, axis=0) / SAMPLE for r in rates], axis=1)
    # 12 records of 400 correlation times: 2400 independent values, 1/sqrt(2 * 2400) = 1.5 % on the deviation.
    assert torque.std() == pytest.approx(std, rel=0.06)
    lag = round(1.0 / SAMPLE)
    assert np.mean(torque[lag:] * torque[:-lag]) / torque.var() == pytest.approx(np.exp(-1), abs=0.08)


def test_detent_pulls_in_at_its_centre_and_is_strongest_a_width_away():
    notch = Strange(axis=0, detent=0.06, centre=0.1, width=0.05)
    x = np.linspace(-0.2, 0.4, 601)
    torque = np.array([strange_torque(0.0, angle, 0.0, notch) for angle in x])
    assert x[torque.argmin()] == pytest.approx(0.15)
    assert torque.min() == pytest.approx(-0.06)
    assert np.interp(0.1, x, torque) == pytest.approx(0.0, abs=1e-12)
