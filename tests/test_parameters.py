"""Parameters: values of Table 2, ranges, names, and the messages of refused values."""

from math import inf, nan, radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from heli_plant.effects import CATALOGUE
from heli_plant.errors import ParameterError
from heli_plant.parameters import PARAMETERS, TABLE_2, checked, from_names

DESIGN = {
    "dry_friction": "pitch elevation travel", "breakaway_friction": "pitch elevation travel",
    "quadratic_drag": "pitch elevation travel", "constant_torque": "pitch travel", "rotor_mismatch": "pitch",
    "quadratic_thrust": "rotors", "reverse_thrust_loss": "rotors", "dead_zone": "rotors", "motor_lag": "rotors",
    "input_delay": "rotors", "thrust_fade": "rotors", "airspeed_thrust_loss": "pitch elevation",
    "gyroscopic_coupling": "pitch elevation", "rotor_drag_torque": "travel", "thrust_tilt": "elevation",
    "translational_lift": "elevation", "cable_stiffness": "travel", "inertial_coupling": "elevation travel",
    "large_angle_gravity": "elevation", "pitch_gravity_coupling": "pitch", "speed_stability": "pitch",
    "ground_effect": "elevation", "arm_bending": "elevation", "moving_mass": "elevation",
}  # fmt: skip
"""Names of all effects, which parameter sets and reports use, with the axes on which they act."""

def test_table_2_is_the_papers():
    p = TABLE_2
    assert (p.a_wx, p.a_th, p.k_x, p.theta0) == (0.060, 0.664, 0.293, radians(-7.8))
    assert (p.a_wz, p.a_e, p.a_1, p.a_lt, p.k_z) == (0.032, 2.59, -0.142, 0.026, 0.157)
    assert (p.a_wy, p.k_y, p.T_m, p.v_max) == (0.114, -0.112, 0.08, 5.0)


def test_every_row_has_a_unit_a_description_and_a_default_in_its_range():
    for row in PARAMETERS:
        assert row.unit and row.description, row.name
        assert row.minimum <= row.default <= row.maximum, row.name
    assert checked(TABLE_2) is TABLE_2


def test_catalogue_holds_every_effect_with_a_published_name():
    published = [(name, axis) for name in DESIGN for axis in DESIGN[name].split()]
    assert [own for e in CATALOGUE if (own := (e.name, e.axis)) in published] == published


def test_each_parameter_is_refused_beyond_either_bound_with_name_value_bounds_and_unit():
    for row in PARAMETERS:
        for value in (row.minimum - 1.0, row.maximum + 1.0, nan, inf, -inf):
            with pytest.raises(ParameterError) as caught:
                checked(TABLE_2._replace(**{row.field: value}))
            unit = "" if row.unit == "1" else f" {row.unit}"
            bounds = f"[{row.minimum:g}, {row.maximum:g}]"
            assert str(caught.value) == f"{row.name} = {value!r}{unit} must lie in {bounds}{unit}"


def test_unknown_name_is_refused_with_the_nearest_one():
    with pytest.raises(ParameterError, match=r"'effects.dry_frction.pitch'; did you mean 'effects.dry_friction.pitch'"):
        from_names({"effects.dry_frction.pitch": 0.1})


@given(st.data())
def test_parameters_survive_the_way_through_structured_names(data):
    rows = data.draw(st.lists(st.sampled_from(PARAMETERS), max_size=8, unique=True))
    values = {row.field: data.draw(st.floats(row.minimum, row.maximum)) for row in rows}
    p = TABLE_2._replace(**values)
    if p.T_m + p.motor_lag_rotors < 0.0:
        return  # refused, see above
    names = {row.name: getattr(p, row.field) for row in PARAMETERS}
    assert from_names(names, start=TABLE_2._replace(k_x=1.0)) == p
