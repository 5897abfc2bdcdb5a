"""The moves that a search tries: the whole catalogue, inside its ranges, and nothing twice."""

import numpy as np
import pytest

from heli_identifier.records import Log
from heli_identifier.tracing.search.candidates import candidates, shape_fields, stepping_at
from heli_plant.effects import CATALOGUE, effect
from heli_plant.parameters import TABLE_2, checked
from tests.simulated import drive, exact

RECORD, _ = exact(TABLE_2, drive(20.0))
OFFERED = candidates([RECORD], TABLE_2)


def test_every_entry_of_the_catalogue_is_tried_but_the_mass_whose_time_is_open():
    assert {c.effect.field for c in OFFERED} == {e.field for e in CATALOGUE} - {"moving_mass_elevation"}


@pytest.mark.parametrize("candidate", OFFERED, ids=lambda c: f"{c.effect.field} {c.size:g} {c.shapes}")
def test_every_move_is_a_plant_that_could_be(candidate):
    moved = checked(TABLE_2._replace(**candidate.move(TABLE_2)))
    assert getattr(moved, candidate.effect.field) == candidate.size != 0.0
    assert candidate.effect.lower <= candidate.size <= candidate.effect.upper


def test_grids_of_coefficients_and_shapes_are_crossed():
    by_field = {}
    for candidate in OFFERED:
        by_field.setdefault(candidate.effect.field, []).append(candidate)
    assert [c.size for c in by_field["dead_zone_rotors"]] == list(effect("dead_zone", "rotors").grid)
    stribeck = effect("breakaway_friction", "pitch").shapes[0].grid
    assert [c.shapes for c in by_field["breakaway_friction_pitch"]] == [{"stribeck_rate_pitch": w} for w in stribeck]
    assert len(by_field["dry_friction_pitch"]) == 1


def test_an_effect_that_is_on_is_not_offered_again():
    on = TABLE_2._replace(dry_friction_pitch=0.02, moving_mass_elevation=0.05)
    assert {c.effect.field for c in candidates([RECORD], on)} == {c.effect.field for c in OFFERED} - {
        "dry_friction_pitch"
    }
    assert stepping_at((10.0, 20.0), on) == []


def test_a_motor_faster_than_no_lag_at_all_is_not_offered():
    lags = [c.size for c in candidates([RECORD], TABLE_2._replace(T_m=0.03)) if c.effect.name == "motor_lag"]
    assert lags == [size for size in effect("motor_lag", "rotors").grid if size > -0.03]


def test_a_mass_may_move_at_any_time_that_is_asked_for():
    moves = stepping_at((10.0, 42.5), TABLE_2)
    assert [m.shapes["moving_mass_time"] for m in moves] == [10.0, 42.5]
    assert {m.effect.field for m in moves} == {"moving_mass_elevation"}


def test_the_ground_lies_at_the_lowest_elevation_of_all_records():
    deep = Log("deep", RECORD.rate_hz, RECORD.voltages, RECORD.angles - np.array([0.0, 0.4, 0.0]))
    lowest = min(RECORD.angles[:, 1].min(), deep.angles[:, 1].min())
    for candidate in candidates([RECORD, deep], TABLE_2):
        if candidate.effect.name == "ground_effect":
            assert candidate.shapes["ground_elevation"] == pytest.approx(lowest, abs=0.005)


def test_shapes_that_a_coefficient_can_imitate_are_not_estimated():
    assert shape_fields(effect("ground_effect", "elevation")) == ("ground_height",)
    assert shape_fields(effect("inertial_coupling", "travel")) == ()
    assert shape_fields(effect("arm_bending", "elevation")) == ("bending_frequency", "bending_damping")
