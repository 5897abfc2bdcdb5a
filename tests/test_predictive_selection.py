"""Predictive effects: the quadratic problem is that of direct fits, truth is found, a clean rig is left alone."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from heli_identifier.tracing.multistep.fit import fit_multistep
from heli_identifier.tracing.multistep.nested import growth, search_without, with_fields
from heli_identifier.tracing.multistep.priors import ENTRIES, EVERYTHING
from heli_identifier.tracing.predictive.families import FAMILIES, family_of, members_of, together
from heli_identifier.tracing.predictive.judge import Judge
from heli_identifier.tracing.predictive.quadratic import Quadratic, quadratic_of
from heli_identifier.tracing.predictive.selection import select_predictive
from heli_plant.parameters import TABLE_2
from tests.test_multistep_fit import noisy_records, problem_of

TRUE = np.array([1.0, -0.5, 0.0, 0.2, 0.0])


@cache
def linear(seed=0, blocks=24, fields=5, rows=30):
    """Rows of a linear problem by block and axis, whose noise has unit variance, and its sums."""
    random = np.random.default_rng(seed)
    J = random.standard_normal((blocks, 3, rows, fields))
    y = J @ TRUE + random.standard_normal((blocks, 3, rows))
    G, h = np.einsum("barp,barq->bapq", J, J), np.einsum("barp,bar->bap", J, y)
    wide = np.full(fields, np.inf)
    problem = Quadratic(
        G, h, (y**2).sum(axis=2), np.arange(blocks), float(y.size), -wide, wide,
    )  # fmt: skip
    return J, y, problem


def directly(J, y, kept):
    """Ridge regression on the columns ``kept``, from the rows themselves."""
    rows, x = J.reshape(-1, J.shape[-1])[:, kept], np.zeros(J.shape[-1])
    stacked, target = np.vstack((rows, np.eye(len(kept)))), np.concatenate((y.ravel(), np.zeros(len(kept))))
    x[kept] = np.linalg.lstsq(stacked, target, rcond=None)[0]
    return x


@pytest.mark.parametrize("kept", [[0], [0, 1, 3], [0, 1, 2, 3, 4]])
def test_subset_is_the_direct_fit(kept):
    J, y, problem = linear()
    x, _ = problem.solve(np.array(kept))
    np.testing.assert_allclose(x, directly(J, y, kept), atol=1e-10)
    left = ((y - J @ x) ** 2).sum(axis=(0, 2))
    np.testing.assert_allclose(problem.losses(x), left)


def test_part_is_the_direct_fit_to_its_blocks():
    J, y, problem = linear()
    half = np.array([0, 3, 4, 11])
    np.testing.assert_allclose(problem.part(half).solve(np.arange(5))[0], directly(J[half], y[half], list(range(5))))


def test_bounds_hold_a_coordinate_and_the_others_are_fitted_beside_it():
    J, y, problem = linear()
    problem = replace(problem, lower=np.array([-np.inf, 0.0, -np.inf, -np.inf, -np.inf]))
    x, free = problem.solve(np.arange(5))
    assert x[1] == 0.0 and 1 not in free
    np.testing.assert_allclose(x, directly(J, y, [0, 2, 3, 4]), atol=1e-10)


def test_covariance_is_that_of_unit_noise():
    J, _, problem = linear()
    rows = J.reshape(-1, 5)
    expected = np.sqrt(np.diag(np.linalg.inv(rows.T @ rows)))
    # a variance from 24 blocks is itself uncertain by sqrt(2 / 23), its root by 15 %; two of those
    np.testing.assert_allclose(np.sqrt(np.diag(problem.fit(np.arange(5)).covariance)), expected, rtol=0.3)


def judge():
    names = ("base", "strong", "nothing", "weak", "nothing_else")
    return Judge(linear()[2], names, ("base",), {name: (name,) for name in names[1:]})


def test_steady_families_are_those_that_are_there_and_worth_it():
    """The weak column explains .2^2 of a unit variance, 2 % of the error: less than is worth a parameter."""
    assert judge().steady() == ["strong"]
    support = judge().support(["strong", "weak"], ["strong", "weak"])
    assert support["weak"].score > 5.0
    assert support["weak"].worth == pytest.approx(0.02, abs=0.01)


def test_stability_is_one_of_what_every_half_finds_and_low_of_noise():
    support, stability = judge().around(["strong"])
    assert stability["strong"] == 1.0
    assert support["strong"].score > 10.0
    # noise passes sqrt(2) standard errors in 16 % of the halves on average, of halves that share it in some or none
    assert stability["nothing"] < 0.8


def torque_by_record(by_record, seed=0, blocks=6, rows=30):
    """Judge of a constant column whose coefficient is another in each record, beside a base and unit noise."""
    random, records = np.random.default_rng(seed), np.repeat(np.arange(len(by_record)), blocks)
    J = random.standard_normal((len(records), 1, rows, 2))
    J[..., 1] = 1.0
    y = J[..., 0] + np.asarray(by_record)[records, None, None] + random.standard_normal((len(records), 1, rows))
    G, h = np.einsum("barp,barq->bapq", J, J), np.einsum("barp,bar->bap", J, y)
    wide = np.full(2, np.inf)
    problem = Quadratic(G, h, (y**2).sum(axis=2), records, float(y.size), -wide, wide)
    return Judge(problem, ("base", "torque"), ("base",), {"torque": ("torque",)})


def test_what_differs_from_record_to_record_is_rarely_significant():
    """Five torques drawn about zero: Student's t with 4 degrees of freedom passes 2 in 12 % of the draws.

    More than 12 of 40 have a probability of .1 %. Taken for independent, pieces let 17 of these pass: the
    spread .5 of the torques is worth 6.7 standard errors of a record's 180 rows.
    """
    random = np.random.default_rng(1)
    drawn = [torque_by_record(random.normal(0.0, 0.5, 5), seed) for seed in range(40)]
    passed = sum(one.support(["torque"], ["torque"])["torque"].score >= 2.0 for one in drawn)
    assert passed <= 12


def test_what_all_records_share_is_as_significant_as_its_rows():
    """A torque of .3 in 900 rows of unit noise: 9 standard errors, known within a factor by four degrees of freedom."""
    score = torque_by_record([0.3] * 5).support(["torque"], ["torque"])["torque"].score
    assert 4.0 < score < 11.0


def test_worth_on_unseen_records_is_that_of_what_records_share():
    """A torque t that all records have takes sqrt(1 + t^2) - 1 off the error of each, also of one that is left out."""
    shared = torque_by_record([0.6] * 5).unseen_worth(["torque"], {"torque": "torque"})["torque"]
    assert shared == pytest.approx(np.sqrt(1.36) - 1.0, abs=0.06)


def test_what_one_record_has_is_worth_nothing_on_the_others():
    own = torque_by_record([1.5, 0.0, 0.0, 0.0, 0.0])
    assert own.support(["torque"], ["torque"])["torque"].worth > 0.02
    assert own.unseen_worth(["torque"], {"torque": "torque"})["torque"] < 0.0


def test_parts_of_a_single_record_stand_for_records():
    assert torque_by_record([0.6]).unseen_worth(["torque"], {"torque": "torque"})["torque"] > 0.05


def test_families_part_the_catalogue():
    fields = [field for family in FAMILIES for field in family.members]
    assert sorted(fields) == sorted(entry.field for entry in ENTRIES)
    assert set(EVERYTHING) > set(fields)
    assert all(field in members_of(family_of(field)) for field in fields)


def test_lag_and_delay_come_to_one_figure_together():
    plant = TABLE_2._replace(T_m=0.08, motor_lag_rotors=0.03, input_delay_rotors=0.01)
    assert together(("motor_lag_rotors", "input_delay_rotors"), plant).endswith("120 ms")
    assert together(("motor_lag_rotors",), plant) == ""


def test_quadratic_problem_has_its_optimum_where_the_fit_has():
    """With offsets held at zero by their mean (one log), the solve over every field gives the fit back."""
    fit = fit_multistep(problem_of(noisy_records(TABLE_2, 6, count=1)))
    np.testing.assert_allclose(quadratic_of(fit).solve(np.arange(len(fit.x)))[0], fit.x, atol=0.05)


TRUTH = TABLE_2._replace(constant_torque_travel=0.08, speed_stability_pitch=0.4, dry_friction_pitch=0.06)
TRUE_FAMILIES = {"torque on the travel", "speed stability of the pitch", "friction of the pitch"}


@cache
def null_of(truth, seed):
    return fit_multistep(problem_of(noisy_records(truth, seed)))


def test_larger_nested_model_is_never_worse():
    null = null_of(TRUTH, 7)
    larger = with_fields(null, ["constant_torque_travel"])
    assert growth(larger, null.errors) > 0.0
    back = search_without(larger, {"constant_torque_travel"})
    # the descent ends where a step gains less than one unit of log-likelihood of some hundred
    np.testing.assert_allclose(back.objective(), null.objective, rtol=0.05)


def test_selection_finds_what_is_there():
    selection = select_predictive(null_of(TRUTH, 7))
    assert {finding.family for finding in selection.predictive} >= TRUE_FAMILIES
    assert all(0.0 <= finding.stability <= 1.0 for finding in (*selection.predictive, *selection.possible))
    assert selection.fit.parameters.speed_stability_pitch == pytest.approx(0.4, abs=0.1)
    assert selection.fit.parameters.constant_torque_travel == pytest.approx(0.08, abs=0.02)


def test_what_is_shown_is_not_named_again():
    shown = with_fields(null_of(TRUTH, 7), ["speed_stability_pitch"])
    selection = select_predictive(shown)
    assert "speed stability of the pitch" not in {f.family for f in (*selection.predictive, *selection.possible)}
    assert "speed_stability_pitch" in selection.fit.names


def test_selection_of_a_clean_rig_is_empty():
    selection = select_predictive(null_of(TABLE_2, 8))
    assert not selection.predictive
