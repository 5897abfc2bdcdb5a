"""The joint selection: its algebra is that of direct fits, truth is found, a clean rig is left alone."""

from functools import cache

import numpy as np
import pytest

from benchmarks.joint.blocks import Blocks, blocks_of
from benchmarks.joint.families import FAMILIES, members
from benchmarks.joint.selection import fit_everything, select_predictive
from heli_identifier.tracing.multistep.fit import fit_multistep
from heli_identifier.tracing.multistep.priors import ENTRIES, EVERYTHING
from heli_plant.parameters import TABLE_2
from tests.test_multistep_fit import noisy_records, problem_of


@cache
def linear(seed=0, blocks=6, fields=5, rows=30):
    """Rows of a linear problem by block and axis, and its sums at a reference that is not the optimum."""
    random = np.random.default_rng(seed)
    J = random.standard_normal((blocks, 3, rows, fields))
    y = J @ np.array([1.0, -0.5, 0.0, 0.2, 0.0]) + random.standard_normal((blocks, 3, rows))
    curvature, slope = np.einsum("barp,barq->bapq", J, J), np.einsum("barp,bar->bap", J, y)
    wide = np.full(fields, np.inf)
    problem = Blocks(random.standard_normal(fields), curvature, slope, (y**2).sum(axis=-1), np.eye(fields), -wide, wide)
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
    np.testing.assert_allclose(problem.solve(np.array(kept)), directly(J, y, kept), atol=1e-10)


def test_left_out_losses_are_those_of_direct_fits_to_the_others():
    J, y, problem = linear()
    kept = [0, 1, 3]
    direct = [
        ((y[b] - J[b] @ directly(np.delete(J, b, 0), np.delete(y, b, 0), kept)) ** 2).sum(axis=-1) for b in range(6)
    ]
    np.testing.assert_allclose(problem.left_out_losses(np.array(kept))[0], direct)


def test_resample_flips_the_residual_of_whole_blocks():
    J, y, problem = linear()
    signs = np.random.default_rng(3).choice((-1.0, 1.0), size=(6, 1, 1))
    fitted = J @ problem.reference
    sample, direct = problem.resamples(1, np.random.default_rng(3)), fitted + signs * (y - fitted)
    np.testing.assert_allclose(sample.slope[0], np.einsum("barp,bar->bap", J, direct))
    np.testing.assert_allclose(sample.constant[0], (direct**2).sum(axis=-1))


def test_bounds_hold_a_coordinate_and_the_others_are_fitted_beside_it():
    J, y, problem = linear()
    lower = np.full(5, -np.inf)
    lower[1] = 0.0
    x = Blocks(
        problem.reference, problem.curvature, problem.slope, problem.constant, problem.precision, lower, problem.upper
    ).solve(np.arange(5))
    assert x[1] == 0.0
    np.testing.assert_allclose(x, directly(J, y, [0, 2, 3, 4]), atol=1e-10)


def test_families_part_the_catalogue():
    assert sorted(members(FAMILIES)) == sorted(entry.field for entry in ENTRIES)
    assert set(EVERYTHING) > set(members(FAMILIES))


def test_quadratic_problem_has_its_optimum_where_the_fit_has():
    """With offsets held at zero by their mean (one log), the solve over every field gives the fit back."""
    fit = fit_multistep(problem_of(noisy_records(TABLE_2, 6, count=1)))
    np.testing.assert_allclose(blocks_of(fit).solve(np.arange(len(fit.x))), fit.x, atol=0.05)


TRUTH = TABLE_2._replace(constant_torque_travel=0.08, speed_stability_pitch=0.4, dry_friction_pitch=0.06)
TRUE_FAMILIES = {"torque on the travel", "speed stability of the pitch", "friction of the pitch"}


def test_selection_finds_what_is_there():
    selection = select_predictive(fit_everything(problem_of(noisy_records(TRUTH, 7))))
    assert TRUE_FAMILIES <= {finding.family.name for finding in selection.predictive}
    assert all(0.0 <= finding.stability <= 1.0 for finding in (*selection.predictive, *selection.possible))
    assert selection.fit.parameters.speed_stability_pitch == pytest.approx(0.4, abs=0.1)
    assert selection.fit.parameters.constant_torque_travel == pytest.approx(0.08, abs=0.02)


def test_selection_of_a_clean_rig_is_nearly_empty():
    selection = select_predictive(fit_everything(problem_of(noisy_records(TABLE_2, 8))))
    # the list is predictive and holds no level: one family may creep in
    assert len(selection.predictive) <= 1
