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


def check_slopes(function, given, by, h, tolerance):
    """Values of a function keep their bits; slopes by the arguments at the places ``by`` are central differences."""
    duals = list(given)
    for place, number in zip(by, seeded([given[place] for place in by]), strict=True):
        duals[place] = number
    after = with_duals(function)(*duals)
    assert [x.value if isinstance(x, Dual) else x for x in after] == list(function(*given))
    found = slopes(after, len(by))
    for column, place in enumerate(by):
        up, down = list(given), list(given)
        up[place] += h
        down[place] -= h
        expected = (np.array(function(*up)) - np.array(function(*down))) / (2.0 * h)
        scale = max(1.0, np.abs(expected).max())
        np.testing.assert_allclose(found[:, column], expected, rtol=0.0, atol=tolerance * scale)
    return found


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


def stepped(*row):
    return step(PlantState(*row[:12]), row[12], row[13], 0.0, 0.0, 0.01, TABLE_2)


def drawn(draw):
    state = [draw.uniform(-0.8, 0.8) for _ in range(6)] + [draw.uniform(0.5, 5.0) for _ in range(2)] + [0.01, -0.02]
    voltages = [draw.uniform(0.5, 4.8) for _ in range(2)]
    return [draw.uniform(0.0, 50.0), *state, *voltages, draw.uniform(-0.1, 0.1), 0.3]


@pytest.mark.parametrize("name", parameter_sets())
def test_the_jacobian_is_that_of_central_differences(name):
    """Differences of h = 1e-5: truncation h^2/6 f''', 2e-7 where friction is smoothed; rounding eps f/h, 1e-9."""
    p, draw = parameter_sets()[name], Random(3)
    for _ in range(50):
        check_slopes(rates_of_change, [*drawn(draw), p], BY, 1e-5, 2e-6)


def test_a_mass_at_rest_in_its_middle_has_a_slope_all_the_same():
    """The law of the moving mass is skipped at x = 0, but not for a dual number with a slope."""
    given = [0.0, *[0.1] * 10, 1.0, 1.0, 0.0, 0.0, TABLE_2]
    found = check_slopes(rates_of_change, given, (13,), 1e-5, 1e-8)
    assert found[4, 0] == -(TABLE_2.ado_offset + TABLE_2.ado_stiffness * 0.1) != 0.0


def test_a_whole_step_keeps_its_bits_and_has_slopes():
    """Halves of differences of 1e-4: truncation 1e-9, rounding 1e-12."""
    row = [0.1, -0.2, 0.3, 0.4, -0.1, 0.2, 2.0, 2.5, 0.0, 0.0, 0.0, 0.0, 3.0, 2.0]
    check_slopes(stepped, row, range(len(row)), 1e-4, 1e-8)


def test_the_next_step_of_a_law_is_told():
    on = TABLE_2._replace(moving_mass_elevation=0.1, moving_mass_time=5.0)
    assert next_step_time(0.0, on) == 5.0
    assert next_step_time(5.0, on) == inf
    assert next_step_time(0.0, TABLE_2) == inf
