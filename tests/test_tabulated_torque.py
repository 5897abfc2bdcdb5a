"""A tabulated torque is the curve that it was taken from, in the table and beyond it."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from heli_plant import plant
from heli_plant.effects import AXES
from heli_plant.laws import switched_on
from heli_plant.parameters import TABLE_2
from heli_plant.tabulated_torque import KNOTS, VARIABLES, tabulated_torque

MOTION = SimpleNamespace(
    t=2.0, th=0.2, ep=-0.1, la=0.7, w_th=0.4, w_ep=-0.3, w_la=0.9, mu_diff=0.6, mu_sum=4.1,
    mass_position=0.0, cable_rest=0.0,
)  # fmt: skip
VALUES = dict(zip(VARIABLES, (0.2, -0.1, 0.7, 0.4, -0.3, 0.9, 4.1, 0.6, 2.0), strict=True))
"""What each variable is in :data:`MOTION`."""


def tabled(axis, variable, first, last, law, p=TABLE_2):
    """``p`` with a table of ``law`` on an axis."""
    spacing = (last - first) / (KNOTS - 1)
    torques = {f"table_torque_{k + 1}_{axis}": float(law(first + k * spacing)) for k in range(KNOTS)}
    number = float(list(VARIABLES).index(variable) + 1)
    return p._replace(
        **{f"table_variable_{axis}": number, f"table_first_{axis}": first, f"table_spacing_{axis}": spacing, **torques}
    )


def added(p):
    """What a parameter set adds to the accelerations of Table 2 at :data:`MOTION`."""
    with_table = plant.accelerations(**vars(MOTION), switches=switched_on(p), p=p)
    without = plant.accelerations(**vars(MOTION), switches=switched_on(TABLE_2), p=TABLE_2)
    return np.subtract(with_table, without)


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("variable", VARIABLES)
def test_a_table_of_any_variable_turns_its_own_axis(axis, variable):
    x = VALUES[variable]
    p = tabled(axis, variable, x - 1.0, x + 0.9, lambda value: 0.3 + 0.1 * (value - x))
    expected = [0.3 if each == axis else 0.0 for each in AXES]
    assert added(p) == pytest.approx(expected, abs=1e-14)  # a straight line is its own interpolation


def test_between_the_values_of_the_table_runs_the_cubic_with_central_slopes_and_beyond_them_the_torque_stays():
    """scipy's Hermite spline with the slopes that the module's equation names."""
    y = np.random.default_rng(0).normal(size=KNOTS)
    first, spacing = -0.4, 0.07
    slopes = np.concatenate(([y[1] - y[0]], 0.5 * (y[2:] - y[:-2]), [y[-1] - y[-2]])) / spacing
    reference = CubicHermiteSpline(first + spacing * np.arange(KNOTS), y, slopes)
    last = first + (KNOTS - 1) * spacing
    x = np.array([-50.0, *np.linspace(first - 0.1, last + 0.1, 1001), 80.0])
    found = [tabulated_torque(float(value), first, spacing, tuple(y.tolist())) for value in x]
    assert found == pytest.approx(reference(np.clip(x, first, last)), abs=1e-12)


@pytest.mark.parametrize("turns", [-3.0, -1.0, 2.0, 40.0])
def test_a_torque_of_the_travel_repeats_with_every_turn(turns):
    p = tabled("travel", "travel", 0.0, math.tau, lambda x: 0.2 * math.sin(x))
    state = vars(MOTION)
    here = plant.accelerations(**state, switches=switched_on(p), p=p)
    there = plant.accelerations(**{**state, "la": state["la"] + turns * math.tau}, switches=switched_on(p), p=p)
    assert there == pytest.approx(here, abs=1e-13)  # some rounding errors of 40 turns times the slope
