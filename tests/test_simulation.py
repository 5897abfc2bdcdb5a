"""A record simulated off line: shapes, initial state, what its rows are."""

import numpy as np
import pytest

from heli_plant.parameters import TABLE_2
from heli_plant.plant import measured_angles, step
from heli_plant.simulation import simulate
from heli_plant.state import PlantState, start_state

H = 0.01
RNG = np.random.default_rng(5)
VOLTAGES = np.repeat(RNG.uniform(-3, 4, (20, 2)), 25, axis=0)
START = start_state(0.1, 0.05, 0.3, *VOLTAGES[0], rates=(0.1, 0.0, 0.2))


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


def test_record_may_be_of_any_layout():
    expected, _ = simulate(VOLTAGES, H, START, TABLE_2)
    for layout in (np.asfortranarray(VOLTAGES), VOLTAGES.tolist(), np.repeat(VOLTAGES, 2, axis=0)[::2]):
        np.testing.assert_array_equal(simulate(layout, H, START, TABLE_2)[0], expected)


@pytest.mark.parametrize("voltages", [VOLTAGES[:, :1], VOLTAGES[0]])
def test_shapes_that_do_not_fit_are_refused(voltages):
    with pytest.raises(ValueError, match=r"must be \(N, 2\)"):
        simulate(voltages, H, START, TABLE_2)


def test_empty_record_gives_an_empty_simulation():
    states, angles = simulate(np.empty((0, 2)), H, START, TABLE_2)
    assert len(states) == len(angles) == 0
