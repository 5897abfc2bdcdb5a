"""One step of the plant: its order, an independent integrator, the ADO, the bending arm; signals into and out of it."""

from math import log2, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.signal import cont2discrete

from heli_plant.communication import communicate, quantise, start_memory
from heli_plant.compiled import compile_function, parameter_record
from heli_plant.laws import motor_input, switched_on, thrust_voltages
from heli_plant.motor import approach, decay_factor, mean_held, remember, saturate
from heli_plant.parameters import TABLE_2, check_parameters
from heli_plant.plant import accelerations, delayed_input, measured_angles, rigid_start, step
from heli_plant.simulation import simulate
from heli_plant.state import PlantState, rest_state, start_state

START = PlantState(0.2, 0.1, 0.3, 0.4, -0.2, 0.3, 1.0, 0.4, cable_rest=0.1)
SMOOTH = TABLE_2._replace(
    quadratic_thrust_rotors=0.05, airspeed_thrust_loss_pitch=0.03, gyroscopic_coupling_pitch=0.04,
    inertial_coupling_elevation=1.0, inertial_coupling_travel=1.0, ground_effect_elevation=0.3,
    cable_stiffness_travel=0.02, large_angle_gravity_elevation=1.0, arm_bending_elevation=0.004,
)  # fmt: skip
MODELS = {"simplified": TABLE_2, "general": TABLE_2._replace(general_model=1.0), "effects": SMOOTH}
voltage, H = st.floats(-20.0, 20.0), 0.01


def run(state, seconds, h, p, v_front=1.5, v_rear=1.1, command=0.0):
    for k in range(round(seconds / h)):
        state = step(state, v_front, v_rear, command, k * h, h, p)
    return state


def reference(state, seconds, p):
    """The same motion by scipy's eighth-order method at tight tolerances, with motors and bending as further states."""
    u = np.array([motor_input(1.5, p), motor_input(1.1, p)])
    T, w_b = p.T_m + p.motor_lag_rotors, 2 * pi * p.bending_frequency

    def slope(t, x):
        mu_diff, mu_sum = thrust_voltages(x[6], x[7], t, p)
        a = accelerations(t, *x[:6], mu_diff, mu_sum, state.mass_position, state.cable_rest, switched_on(p), p)
        bend = w_b**2 * (p.arm_bending_elevation * mu_sum - x[8]) - 2 * p.bending_damping * w_b * x[9]
        return np.array([*x[3:6], *a, *((u - x[6:8]) / T), x[9], bend])

    return solve_ivp(slope, (0, seconds), list(state[:10]), method="DOP853", rtol=3e-14, atol=1e-15).y[:, -1]


@pytest.mark.parametrize("model", MODELS)
def test_step_is_of_order_four(model):
    p = MODELS[model]
    exact = reference(START, 2.0, p)[:6]
    errors = [np.abs(np.array(run(START, 2.0, h, p)[:6]) - exact).max() for h in (0.04, 0.02, 0.01)]
    orders = [log2(errors[0] / errors[1]), log2(errors[1] / errors[2])]
    # the leading error term dominates at these steps to about a fifth of the order
    assert min(orders) > 3.8 and max(orders) < 5.2, (errors, orders)


def test_motor_without_a_lag_acts_from_the_steps_start():
    p = check_parameters(TABLE_2._replace(T_m=0.0))
    after = step(START, -2.0, 2.0, 0.0, 0.0, 0.01, p)
    # over so short a step the acceleration is nearly constant: k_x mu_d and little else
    mu_diff = -4.0
    expected = p.k_x * mu_diff - p.a_wx * START.pitch_rate - p.a_th * sin(START.pitch - p.theta0)
    assert (after.pitch_rate - START.pitch_rate) / 0.01 == pytest.approx(expected, rel=0.01)
    assert (after.nu_front, after.nu_rear) == (-2.0, 2.0)


@given(voltage, voltage, st.floats(0.1, 8.0))
def test_voltages_are_clipped_both_ways_and_beyond_the_limit_act_as_the_limit(v_front, v_rear, limit):
    assert saturate(v_front, limit) == float(np.clip(v_front, -limit, limit))
    clipped = [min(max(v, -5.0), 5.0) for v in (v_front, v_rear)]
    assert step(START, v_front, v_rear, 0, 0, 0.01, TABLE_2) == step(START, *clipped, 0, 0, 0.01, TABLE_2)


def test_moving_mass_travels_at_the_lead_screws_speed_to_its_goal_and_shifts_the_elevations_rest():
    p = TABLE_2
    states = [START]
    for _ in range(300):
        states.append(step(states[-1], 0.0, 0.0, 0.1, 0.0, 0.01, p))
    x = [state.mass_position for state in states]
    assert np.diff(x).max() == pytest.approx(p.ado_speed * 0.01)
    assert x[100] == pytest.approx(0.05) and x[-1] == 0.1
    assert step(START._replace(mass_position=0.25), 0.0, 0.0, 5.0, 0.0, 1.0, p).mass_position == p.ado_travel  # its end
    p = TABLE_2._replace(a_wz=2.0)  # so that an oscillation has decayed by exp(-30)
    for x in (0.2, -0.2):
        state = run(rest_state(p), 30.0, 0.01, p, 0.0, 0.0, command=x)
        assert state.mass_position == x
        assert state.elevation == pytest.approx(-(p.a_1 + p.ado_offset * x) / (p.a_e + p.ado_stiffness * x), abs=1e-9)


BENDING = TABLE_2._replace(arm_bending_elevation=0.004, bending_frequency=3.0, bending_damping=0.05)


def test_bending_step_is_of_order_four_and_begins_at_rest():
    exact = reference(START, 1.0, BENDING)[8:]
    errors = [np.abs(np.array(run(START, 1.0, h, BENDING)[8:10]) - exact).max() for h in (0.01, 0.005)]
    assert log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.3)  # w h = .19: the leading term dominates
    # a record starts with the arm settled and reads the elevation that it was given
    start = rigid_start(start_state(0.1, 0.2, 0.0, 1.5, 1.5), BENDING)
    assert measured_angles(start)[1] == pytest.approx(0.2, abs=1e-16)
    assert start.bending == pytest.approx(0.004 * 3.0, rel=1e-12)  # the coefficient times the sum of the voltages
    after = run(start, 1.0, 0.01, BENDING, 1.5, 1.5)
    assert after.bending == pytest.approx(start.bending, rel=1e-12) and abs(after.bending_rate) < 1e-12


def test_row_k_of_a_record_is_the_state_before_voltage_k_acts_and_its_angles_are_what_encoders_read():
    held = np.repeat(np.random.default_rng(5).uniform(-3, 4, (20, 2)), 25, axis=0)
    start = start_state(0.1, 0.05, 0.3, *held[0], rates=(0.1, 0.0, 0.2))
    assert start == (0.1, 0.05, 0.3, 0.1, 0.0, 0.2, *held[0], 0.0, 0.0, 0.0, 0.3)  # arm straight, mass at zero
    states, angles = simulate(held, 0.01, start, BENDING)
    assert angles[0] == pytest.approx(start[:3])  # the start's elevation is the encoder's, bending included
    following = step(PlantState(*states[0].tolist()), *held[0].tolist(), 0.0, 0.0, 0.01, BENDING)
    np.testing.assert_allclose(states[1], following, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(angles, [measured_angles(PlantState(*row)) for row in states])
    for layout in (np.asfortranarray(held), held.tolist(), np.repeat(held, 2, axis=0)[::2]):
        np.testing.assert_array_equal(simulate(layout, 0.01, start, BENDING)[0], states)
    assert len(simulate(held[:0], 0.01, start, BENDING)[0]) == 0
    for voltages in (np.zeros((5, 1)), np.zeros(5)):
        with pytest.raises(ValueError, match=r"must be \(N, 2\)"):
            simulate(voltages, 0.01, start, BENDING)


angle = st.floats(-20.0, 20.0)
records = st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=1, max_size=40)


@given(voltage, voltage, st.floats(1e-3, 1.0), st.floats(1e-3, 1.0))
def test_lag_is_scipys_zero_order_hold_discretisation(nu, v, h, T):
    A, B = np.array([[-1 / T]]), np.array([[1 / T]])
    a, b, *_ = cont2discrete((A, B, np.eye(1), np.zeros((1, 1))), h, "zoh")
    assert decay_factor(h, T) == pytest.approx(a[0, 0], rel=1e-9, abs=1e-14)  # scipy's exponential at h/T up to 1000
    assert approach(nu, v, decay_factor(h, T)) == pytest.approx(a[0, 0] * nu + b[0, 0] * v, rel=1e-9, abs=1e-9)
    assert approach(nu, v, decay_factor(h, 0.0)) == v


@given(angle, angle, st.sampled_from([360, 4096, 8192]))
def test_reading_is_the_nearest_whole_count_and_never_turns_back(x, y, n):
    read = quantise(x, n)
    # plus the rounding error of an angle of up to 20 rad, which is 26e3 counts
    assert abs(read - x) <= pi / n + 1e-14
    assert read * n / (2 * pi) == pytest.approx(round(read * n / (2 * pi)), abs=1e-10)
    assert quantise(min(x, y), n) <= quantise(max(x, y), n) and quantise(x, 0) == x


def delayed(record, k, delay):
    """Voltages that arrive over step ``k`` of a record sampled every 10 ms."""
    p = TABLE_2._replace(input_delay_rotors=delay)
    return delayed_input([H * i for i in range(len(record))], record, k, H * k, H, p)


@given(records, st.floats(0.0, 0.5))
def test_mean_is_the_integral_of_the_held_voltage(record, delay):
    """The reference is a sum over 2000 points of the window; at a jump it is off by up to 10 V / 2000."""
    k = len(record) - 1
    t = H * k - delay + H * (np.arange(2000) + 0.5) / 2000
    held = np.array(record)[np.clip(np.floor(t / H).astype(int), 0, k)]
    assert delayed(record, k, delay) == pytest.approx(tuple(held.mean(axis=0)), abs=0.02)


@given(records, st.floats(0.0, 0.1))
def test_compiled_code_and_a_growing_history_give_what_the_whole_record_gives(record, delay):
    """A unit keeps only the voltages that its delay can reach; a diagnosis has arrays of the whole record."""
    p = parameter_record(TABLE_2._replace(input_delay_rotors=delay))
    time, since, held = [H * i for i in range(len(record))], [], []
    for k, pair in enumerate(record):
        since, held = remember(since, held, H * k, *pair, delay)
        expected = pytest.approx(delayed(record, k, delay), abs=1e-12)
        assert mean_held(since, held, len(since) - 1, H * k - delay, H * (k + 1) - delay) == expected
        assert compile_function(delayed_input)(np.array(time), np.array(record), k, H * k, H, p) == expected


def test_history_keeps_only_the_voltages_that_the_delay_reaches_and_none_behind_a_step_that_is_repeated():
    since, held = [], []
    for k in range(1000):
        since, held = remember(since, held, 0.01 * k, float(k), 0.0, 0.035)
    assert len(since) == len(held) == 5  # three whole steps, the one that the delay reaches in part, the current one
    since, held = remember([0.0, 0.01, 0.02], [(1.0, 1.0), (2.0, 2.0), (3.0, 3.0)], 0.01, 9.0, 9.0, 1.0)
    assert (since, held) == ([0.0, 0.01], [(1.0, 1.0), (9.0, 9.0)])  # a step that is repeated


def test_a_communication_step_is_the_integration_steps_of_a_record_that_holds_its_voltages():
    p = SMOOTH._replace(thrust_fade_rotors=0.05, input_delay_rotors=0.013)
    held = np.random.default_rng(7).uniform(-3, 4, (10, 2))
    states, memory = simulate(np.repeat(held, 4, axis=0), 0.01, START, p)[0], start_memory(START, p)
    for k in range(9):
        memory = communicate(memory, *held[k], 0.0, 5.0 + 0.04 * k, 5.0, 0.04, 0.01, 0.013, p)
        # instants are sums that are rounded differently
        np.testing.assert_allclose(memory.state, states[4 * (k + 1)], rtol=0, atol=1e-12)
