"""Dual numbers of the plant's own source: values keep their bits, slopes are those of differences."""

from math import inf
from random import Random

import numpy as np
import pytest

from heli_plant.dual import Dual, seeded, slopes, with_duals
from heli_plant.effects import CATALOGUE
from heli_plant.laws import next_step_time
from heli_plant.parameters import TABLE_2
from heli_plant.plant import rates_of_change, step
from heli_plant.state import PlantState

BY = tuple(range(1, 14))
"""States and inputs among the arguments of rates_of_change."""


def jacobian(function, arguments, by):
    """Values of a function and their slopes by the arguments at the places ``by``."""
    given = list(arguments)
    for place, number in zip(by, seeded([arguments[place] for place in by]), strict=True):
        given[place] = number
    found = with_duals(function)(*given)
    return np.array([x.value if isinstance(x, Dual) else x for x in found]), slopes(found, len(by))


def parameter_sets():
    small = {e.field: min(0.02, e.upper) for e in CATALOGUE if e.field != "input_delay_rotors"}
    every = TABLE_2._replace(**small)
    return {
        "plain": TABLE_2,
        "general model": TABLE_2._replace(general_model=1.0),
        "every effect": every,
        "every effect, general model": every._replace(general_model=1.0),
        "no lag": TABLE_2._replace(T_m=0.0),
    }


def drawn(draw):
    state = [draw.uniform(-0.8, 0.8) for _ in range(6)] + [draw.uniform(0.5, 5.0) for _ in range(2)] + [0.01, -0.02]
    voltages = [draw.uniform(0.5, 4.8) for _ in range(2)]
    return [draw.uniform(0.0, 50.0), *state, *voltages, draw.uniform(-0.1, 0.1), 0.3]


@pytest.mark.parametrize("name", parameter_sets())
def test_the_jacobian_is_that_of_central_differences(name):
    """Differences of h = 1e-5: truncation h^2/6 f''', 2e-7 where friction is smoothed; rounding eps f/h, 1e-9."""
    p, draw, h = parameter_sets()[name], Random(3), 1e-5
    for _ in range(50):
        given = [*drawn(draw), p]
        values, found = jacobian(rates_of_change, given, BY)
        assert values.tolist() == list(rates_of_change(*given))
        for column, place in enumerate(BY):
            up, down = list(given), list(given)
            up[place] += h
            down[place] -= h
            expected = (np.array(rates_of_change(*up)) - np.array(rates_of_change(*down))) / (2.0 * h)
            scale = max(1.0, np.abs(expected).max())
            np.testing.assert_allclose(found[:, column], expected, rtol=0.0, atol=2e-6 * scale)


def test_a_mass_at_rest_in_its_middle_has_a_slope_all_the_same():
    """The law of the moving mass is skipped at x = 0, but not for a dual number with a slope."""
    given = [0.0, *[0.1] * 10, 1.0, 1.0, 0.0, 0.0, TABLE_2]
    _, found = jacobian(rates_of_change, given, (13,))
    assert found[4, 0] == -(TABLE_2.ado_offset + TABLE_2.ado_stiffness * 0.1) != 0.0


def test_a_whole_step_keeps_its_bits_and_has_slopes():
    """Halves of differences of 1e-4: truncation 1e-9, rounding 1e-12."""
    row, h = [0.1, -0.2, 0.3, 0.4, -0.1, 0.2, 2.0, 2.5, 0.0, 0.0, 0.0, 0.0, 3.0, 2.0], 1e-4

    def moved(row):
        return step(PlantState(*row[:12]), row[12], row[13], 0.0, 0.0, 0.01, TABLE_2)

    duals = seeded(row)
    after = with_duals(step)(PlantState(*duals[:12]), duals[12], duals[13], 0.0, 0.0, 0.01, TABLE_2)
    assert [x.value if isinstance(x, Dual) else x for x in after] == list(moved(row))
    found = slopes(after, len(row))
    for place in range(len(row)):
        up, down = list(row), list(row)
        up[place] += h
        down[place] -= h
        expected = (np.array(moved(up)) - np.array(moved(down))) / (2.0 * h)
        np.testing.assert_allclose(found[:, place], expected, rtol=0.0, atol=1e-8)


def test_the_next_step_of_a_law_is_told():
    on = TABLE_2._replace(moving_mass_elevation=0.1, moving_mass_time=5.0)
    assert next_step_time(0.0, on) == 5.0
    assert next_step_time(5.0, on) == inf
    assert next_step_time(0.0, TABLE_2) == inf
