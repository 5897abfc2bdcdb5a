"""A record simulated off line: comparison with an independent integrator, shapes, initial state."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from heli_plant.parameters import TABLE_2
from heli_plant.plant import measured_angles, step
from heli_plant.simplified_model import simplified_accelerations
from heli_plant.simulation import simulate
from heli_plant.state import PlantState, start_state

H = 0.01
RNG = np.random.default_rng(5)
VOLTAGES = np.repeat(RNG.uniform(-3, 4, (20, 2)), 25, axis=0)
START = start_state(0.1, 0.05, 0.3, *VOLTAGES[0], rates=(0.1, 0.0, 0.2))


def test_simulation_agrees_with_scipy_over_a_record_of_held_voltages():
    states, _ = simulate(VOLTAGES, H, START, TABLE_2)

    def slope(t, x, u):
        a = simplified_accelerations(x[0], x[1], *x[3:6], x[6] - x[7], x[6] + x[7], TABLE_2)
        return [*x[3:6], *a, *((u - x[6:8]) / TABLE_2.T_m)]

    x = np.array(START[:8])
    for k in range(0, 500, 25):  # voltages change every .25 s; the integrator starts again at each kink
        # 1e-8 rad are stated for angles; the error of a rate is about the motors' 12.5 1/s times as large
        np.testing.assert_allclose(states[k, :3], x[:3], rtol=0, atol=1e-8)
        np.testing.assert_allclose(states[k, 3:8], x[3:8], rtol=0, atol=1e-7)
        x = solve_ivp(slope, (0, 0.25), x, args=(VOLTAGES[k],), method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]


def test_each_model_is_compiled_with_its_own_right_hand_side():
    """Code compiled for one model does not contain the other; every parameter set still gets the model it selects."""
    for parameters in (TABLE_2, TABLE_2._replace(general_model=1.0), TABLE_2):
        states, _ = simulate(VOLTAGES[:30], H, START, parameters)
        state = START
        for k in range(30):
            # the same operations: only the libraries' sines may differ, by a unit in the last place a step
            np.testing.assert_allclose(states[k], state, rtol=0, atol=1e-13)
            state = step(state, *VOLTAGES[k], 0.0, k * H, H, parameters)


def test_row_k_is_the_state_before_voltage_k_acts():
    states, angles = simulate(VOLTAGES, H, START, TABLE_2)
    assert tuple(states[0]) == START
    np.testing.assert_allclose(states[1], step(START, *VOLTAGES[0], 0.0, 0.0, H, TABLE_2), rtol=0, atol=1e-15)
    assert states.shape == (500, len(PlantState._fields)) and angles.shape == (500, 3)


def test_angles_are_what_the_encoders_read():
    bending = TABLE_2._replace(arm_bending_elevation=0.01)
    states, angles = simulate(VOLTAGES, H, START, bending)
    assert angles[0] == pytest.approx(START[:3])  # the start's elevation is the encoder's, bending included
    np.testing.assert_array_equal(angles, [measured_angles(PlantState(*row)) for row in states])


def test_moving_mass_follows_its_commands():
    commands = np.where(np.arange(500) < 100, 0.0, 0.1)
    states, _ = simulate(VOLTAGES, H, START, TABLE_2, commands)
    x = states[:, PlantState._fields.index("mass_position")]
    assert np.all(x[:101] == 0.0) and x[-1] == pytest.approx(0.1)


def test_simulation_changes_none_of_its_inputs():
    voltages = VOLTAGES.copy()
    simulate(voltages, H, START, TABLE_2)
    np.testing.assert_array_equal(voltages, VOLTAGES)


def test_record_may_be_of_any_layout():
    expected, _ = simulate(VOLTAGES, H, START, TABLE_2)
    for layout in (np.asfortranarray(VOLTAGES), VOLTAGES.tolist(), np.repeat(VOLTAGES, 2, axis=0)[::2]):
        np.testing.assert_array_equal(simulate(layout, H, START, TABLE_2)[0], expected)


@pytest.mark.parametrize(
    "voltages, commands", [(VOLTAGES[:, :1], None), (VOLTAGES, np.zeros(499)), (VOLTAGES[0], None)]
)
def test_shapes_that_do_not_fit_are_refused(voltages, commands):
    with pytest.raises(ValueError, match=r"must be \(N, 2\) and \(N,\)"):
        simulate(voltages, H, START, TABLE_2, commands)


def test_empty_record_gives_an_empty_simulation():
    states, angles = simulate(np.empty((0, 2)), H, START, TABLE_2)
    assert len(states) == len(angles) == 0
