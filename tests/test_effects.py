"""Every effect of the catalogue: its sign, its value at rest, that off is off, interpreted and compiled; torque tables;
ranges and names of parameters. The laws themselves are compared in :mod:`tests.test_effect_files`."""

import math
from math import inf, nan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from heli_plant import plant
from heli_plant.effects import ACCELERATION, AXES, CATALOGUE, ROTORS
from heli_plant.errors import PlantError
from heli_plant.laws import switched_on
from heli_plant.parameters import PARAMETERS, TABLE_2, check_parameters, from_names
from heli_plant.plant import advance, rigid_start, step
from heli_plant.simulation import simulate
from heli_plant.state import PlantState, start_state
from heli_plant.tabulated_torque import KNOTS, VARIABLES, tabulated_torque
from tests.blind.coefficients import BASE
from tests.blind.rigs import STRENGTHS
from tests.simulated import random_tables

ALL_ON = TABLE_2._replace(**{e.field: 0.01 for e in CATALOGUE})
h = 0.01


def on(e, c, **shapes):
    """Table 2 with one effect switched on."""
    return TABLE_2._replace(**{e.field: c, **shapes})


START = PlantState(0.3, 0.2, 0.5, 0.3, -0.4, 0.6, 1.2, -0.8, cable_rest=0.2)


def test_shapes_of_effects_that_are_off_change_no_bit_and_an_effect_switches_its_own_axis_on():
    shaped = TABLE_2._replace(**{s.field: 0.5 * (s.lower + s.upper) for e in CATALOGUE for s in e.shapes})
    plain = changed = START
    for k in range(50):
        plain = step(plain, 3.0, -1.0, 0.0, k * h, h, TABLE_2)
        changed = step(changed, 3.0, -1.0, 0.0, k * h, h, shaped)
    assert changed == plain and switched_on(TABLE_2) == (False, False, False)
    for e in [e for e in CATALOGUE if e.place == ACCELERATION]:
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
    index = [AXES.index(axis) for axis in (AXES if e.axis == ROTORS else (e.axis,))]
    # a tenth of the range is far above rounding, 1e-15
    assert np.abs(measured - without)[:, index].max(axis=0).min() > 1e-7


def test_friction_at_the_catalogues_bound_is_integrated_without_chatter():
    """c = 1 rad/s^2 smoothed over .005 rad/s is a rate of 200 1/s, within Runge-Kutta's 2.78/h at 10 ms."""
    p = TABLE_2._replace(a_wy=0.0, dry_friction_travel=1.0)
    states, _ = simulate(np.zeros((400, 2)), h, start_state(p.theta0, 0.05, 0.0, rates=(0, 0, 0.5)), p)
    assert np.all(states[100:, 5] >= 0.0) and np.all(np.diff(states[:, 5]) <= 0.0)


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


MOTION = dict(
    t=2.0, th=0.2, ep=-0.1, la=0.7, w_th=0.4, w_ep=-0.3, w_la=0.9, mu_diff=0.6, mu_sum=4.1,
    mass_position=0.0, cable_rest=0.0,
)  # fmt: skip
VALUES = dict(zip(VARIABLES, (0.2, -0.1, 0.7, 0.4, -0.3, 0.9, 4.1, 0.6, 2.0), strict=True))
"""What each variable is in :data:`MOTION`."""


def tabled(axis, variable, first, last, law):
    """Table 2 with a table of ``law`` on an axis."""
    spacing = (last - first) / (KNOTS - 1)
    torques = {f"table_torque_{k + 1}_{axis}": float(law(first + k * spacing)) for k in range(KNOTS)}
    number = float(list(VARIABLES).index(variable) + 1)
    return TABLE_2._replace(
        **{f"table_variable_{axis}": number, f"table_first_{axis}": first, f"table_spacing_{axis}": spacing, **torques}
    )


def accelerated(p, **changed):
    """Accelerations at :data:`MOTION`, some of it changed."""
    return np.array(plant.accelerations(**{**MOTION, **changed}, switches=switched_on(p), p=p))


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("variable", VARIABLES)
def test_a_table_of_any_variable_turns_its_own_axis(axis, variable):
    x = VALUES[variable]
    p = tabled(axis, variable, x - 1.0, x + 0.9, lambda value: 0.3 + 0.1 * (value - x))
    expected = [0.3 if each == axis else 0.0 for each in AXES]
    # a straight line is its own interpolation
    assert accelerated(p) - accelerated(TABLE_2) == pytest.approx(expected, abs=1e-14)


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
    # some rounding errors of 40 turns times the slope
    assert accelerated(p, la=MOTION["la"] + turns * math.tau) == pytest.approx(accelerated(p), abs=1e-13)


def test_numbers_and_names_are_the_blind_rigs_and_every_default_is_in_its_range():
    assert {name: getattr(TABLE_2, "T_m" if name == "t_m" else name) for name in BASE} == pytest.approx(BASE)
    assert check_parameters(TABLE_2) is TABLE_2
    blind = {(name, axis) for name, options in STRENGTHS.items() for option in options for axis, _ in option}
    assert blind < {(e.name, e.axis) for e in CATALOGUE}


def test_each_parameter_is_refused_beyond_either_bound_and_an_unknown_name_with_the_nearest_one():
    for row in PARAMETERS:
        for value in (row.minimum - 1.0, row.maximum + 1.0, nan, inf, -inf):
            with pytest.raises(PlantError) as caught:
                check_parameters(TABLE_2._replace(**{row.field: value}))
            unit = "" if row.unit == "1" else f" {row.unit}"
            bounds = f"[{row.minimum:g}, {row.maximum:g}]"
            assert str(caught.value) == f"{row.name} = {value!r}{unit} must lie in {bounds}{unit}"
    with pytest.raises(PlantError, match=r"'effects.dry_frction.pitch'; did you mean 'effects.dry_friction.pitch'"):
        from_names({"effects.dry_frction.pitch": 0.1})


@given(st.data())
def test_parameters_survive_the_way_through_structured_names(data):
    rows = data.draw(st.lists(st.sampled_from(PARAMETERS), max_size=8, unique=True))
    values = {row.field: data.draw(st.floats(row.minimum, row.maximum)) for row in rows}
    p = TABLE_2._replace(**values)
    if p.T_m + p.motor_lag_rotors < 0.0:
        return  # refused, see above
    names = {row.name: getattr(p, row.field) for row in PARAMETERS}
    assert from_names(names) == p
