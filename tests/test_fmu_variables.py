"""Descriptions of variables and the checks of their values."""

import math

import pytest

from fmu_src import UNITS, BuildError, problem_with, unit_class
from fmu_src.description import base_exponents, unit_definitions
from fmu_src.variables import parameter

DAMPING = parameter("pitch.damping", 0.06, "damping", "1/s", -10.0, 10.0)


def test_a_good_value_has_no_problem():
    assert problem_with(DAMPING, 0.1) is None
    assert problem_with(DAMPING, -10.0) is None


@pytest.mark.parametrize("bad", [math.nan, math.inf, 11.0])
def test_a_problem_names_variable_value_bounds_and_unit(bad):
    assert problem_with(DAMPING, bad) == f"pitch.damping = {bad!r} 1/s must lie in [-10, 10] 1/s"


def test_whole_numbers_and_truth_values_are_told_from_others():
    assert problem_with(parameter("n", 1, "", None, 0, 9), 2.5) == "n = 2.5 must be a whole number"
    assert problem_with(parameter("b", True, ""), 0.5) == "b = 0.5 must be 0 or 1"
    assert problem_with(parameter("b", True, ""), 1.0) is None


@pytest.mark.parametrize(
    ("name", "exponents"),
    [
        ("1", {}),
        ("rad/s^2/V", {"rad": 1, "s": 1, "kg": -1, "m": -2, "A": 1}),  # V = kg m^2 s^-3 A^-1
        ("1/(V s)", {"s": 2, "kg": -1, "m": -2, "A": 1}),
        ("N.m.s", {"kg": 1, "m": 2, "s": -1}),
        ("V s/rad", {"kg": 1, "m": 2, "s": -2, "A": -1, "rad": -1}),
        ("Hz", {"s": -1}),
    ],
)
def test_unit_names_resolve_to_base_units(name, exponents):
    assert base_exponents(name) == exponents


def test_an_unknown_unit_is_refused_by_name():
    with pytest.raises(BuildError, match="furlong"):
        base_exponents("furlong/s")


def test_radians_are_shown_in_degrees():
    (unit,) = unit_definitions(["rad"])
    assert unit.find("DisplayUnit").get("name") == "deg"
    assert float(unit.find("DisplayUnit").get("factor")) == math.degrees(1.0)


def test_every_unit_of_every_fmu_variable_resolves():
    for name in UNITS:
        for variable in unit_class(name).variables:
            if variable.unit:
                base_exponents(variable.unit)
