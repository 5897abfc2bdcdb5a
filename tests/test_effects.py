"""Every effect of the catalogue: its sign, its value at rest, that off is off, interpreted and compiled.

The laws themselves are compared in :mod:`tests.test_effect_files`.
"""


import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from heli_plant.effects import ACCELERATION, AXES, CATALOGUE, ROTORS
from heli_plant.laws import switched_on
from heli_plant.parameters import TABLE_2
from heli_plant.plant import accelerations, advance, rigid_start, step
from heli_plant.simulation import simulate
from heli_plant.state import PlantState, start_state
from tests.simulated import random_tables

BY_AXIS = [e for e in CATALOGUE if e.place == ACCELERATION]
OF_ROTORS = [e for e in CATALOGUE if e.axis == ROTORS]
ALL_ON = TABLE_2._replace(**{e.field: 0.01 for e in CATALOGUE})
h = 0.01


def on(e, c, **shapes):
    """Table 2 with one effect switched on."""
    return TABLE_2._replace(**{e.field: c, **shapes})


# --- off is off --------------------------------------------------------------------------------------------------

START = PlantState(0.3, 0.2, 0.5, 0.3, -0.4, 0.6, 1.2, -0.8, cable_rest=0.2)


def test_shapes_of_effects_that_are_off_change_no_bit():
    shaped = TABLE_2._replace(**{s.field: 0.5 * (s.lower + s.upper) for e in CATALOGUE for s in e.shapes})
    plain = changed = START
    for k in range(50):
        plain = step(plain, 3.0, -1.0, 0.0, k * h, h, TABLE_2)
        changed = step(changed, 3.0, -1.0, 0.0, k * h, h, shaped)
    assert changed == plain
    assert switched_on(TABLE_2) == (False, False, False)


def test_any_effect_of_an_axis_switches_this_axis_on_and_no_other():
    for e in BY_AXIS:
        assert switched_on(on(e, 1e-9)) == tuple(axis == e.axis for axis in AXES), e.field


@pytest.mark.parametrize("e", CATALOGUE, ids=lambda e: e.field)
def test_effect_vanishes_with_its_coefficient_and_shows_within_a_second(e):
    """A law that did not vanish with its coefficient would jump where the coefficient leaves zero."""
    # an axis moves by some rad/s^2 per unit of c: 1e-12 of the range moves no state by more than 1e-11 in 10 ms
    vanishing, without = (step(START, 2.0, 1.0, 0, 0, h, p) for p in (on(e, 1e-12 * e.upper), TABLE_2))
    np.testing.assert_allclose(vanishing, without, rtol=0, atol=1e-11)
    V = np.random.default_rng(1).uniform(-4, 4, (100, 2))
    shapes = {"moving_mass_time": 0.2} if e.name == "moving_mass" else {}
    slow = START._replace(pitch_rate=0.03, elevation_rate=-0.04, travel_rate=0.06)  # breakaway friction fades above
    _, without = simulate(V, h, slow, TABLE_2)
    _, measured = simulate(V, h, slow, on(e, 0.1 * e.upper, **shapes))
    index = [AXES.index(axis) for axis in (AXES if e in OF_ROTORS else (e.axis,))]
    # a tenth of the range is far above rounding, 1e-15
    assert np.abs(measured - without)[:, index].max(axis=0).min() > 1e-7


# --- sign and dissipation ----------------------------------------------------------------------------------------

DISSIPATIVE = [e for e in BY_AXIS if e.name in ("dry_friction", "breakaway_friction", "quadratic_drag")]


@given(
    st.sampled_from(DISSIPATIVE), st.floats(0.01, 1.0), st.tuples(*[st.floats(-2.0, 2.0)] * 3), st.floats(-10.0, 10.0)
)
def test_friction_and_drag_never_add_power(e, share, rates, mu_sum):
    axis, p = AXES.index(e.axis), on(e, share * e.upper)
    found, without = (
        accelerations(0.0, 0.3, -0.2, 0.7, *rates, 0.5, mu_sum, 0.0, 0.1, switched_on(own), own)[axis]
        for own in (p, TABLE_2)
    )
    assert (found - without) * rates[axis] <= 0.0


def test_friction_at_the_catalogues_bound_is_integrated_without_chatter():
    """c = 1 rad/s^2 smoothed over .005 rad/s is a rate of 200 1/s, within Runge-Kutta's 2.78/h at 10 ms."""
    p = TABLE_2._replace(a_wy=0.0, dry_friction_travel=1.0)
    states, _ = simulate(np.zeros((400, 2)), h, start_state(p.theta0, 0.05, 0.0, rates=(0, 0, 0.5)), p)
    assert np.all(states[100:, 5] >= 0.0) and np.all(np.diff(states[:, 5]) <= 0.0)


# --- both ways of running ----------------------------------------------------------------------------------------


def interpreted(V, start, p):
    """Step by step, in plain Python."""
    state, states = rigid_start(start, p), []
    pairs, time = [tuple(pair) for pair in V.tolist()], [k * h for k in range(len(V))]
    for k in range(len(V)):
        states.append(state)
        state = advance(state, time, pairs, k, 0.0, h, p)
    return np.array(states)


@pytest.mark.parametrize(
    "p", [TABLE_2, TABLE_2._replace(general_model=1.0), ALL_ON, ALL_ON._replace(general_model=1.0, **random_tables())]
)
def test_compiled_record_moves_as_the_interpreted_steps(p):
    V = np.random.default_rng(7).uniform(-5.5, 5.5, (150, 2))
    batch, _ = simulate(V, h, START, p)
    # the compiler may not reorder operations: only sines and exponentials of another library could differ, by roundings
    np.testing.assert_allclose(batch, interpreted(V, START, p), rtol=0, atol=1e-12)
