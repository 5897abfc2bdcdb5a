"""Thresholds: the quantile of the largest of many scores, against closed forms, and no lower for an uneven noise."""

import numpy as np
import pytest
from scipy.stats import norm

from heli_identifier.tracing.prediction.covariance import block_labels
from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.search.candidates import Candidate
from heli_identifier.tracing.search.scan import Scan
from heli_identifier.tracing.search.threshold import DRAWS, largest_scores, quantile
from heli_plant.effects import effect
from heli_plant.parameters import TABLE_2
from tests.simulated import drive, noisy

ONE_SIDED = Candidate(effect("dry_friction", "pitch"), 1e-3)
TWO_SIDED = Candidate(effect("rotor_mismatch", "pitch"), 1e-3)


@pytest.fixture(scope="module")
def fitted():
    return fit(Problem((noisy(TABLE_2, drive(120.0), 1),)), TABLE_2)


def scan_of(fitted, directions, white, candidates):
    """Scan with given columns of unit length and a given residual."""
    nothing = np.zeros(len(candidates))
    return Scan(
        fitted, fitted.whitener, white, tuple(candidates), [], directions, -(directions.T @ white), nothing, nothing,
        nothing,
    )  # fmt: skip


def orthonormal(fitted, count):
    random = np.random.default_rng(1)
    return np.linalg.qr(random.standard_normal((len(fitted.white), count)))[0]


def sampling_error(level, slope):
    """Standard error of the quantile at ``level`` of DRAWS draws whose density there is ``slope``."""
    return np.sqrt(level * (1.0 - level) / DRAWS) / slope


@pytest.mark.parametrize("level", [0.05, 0.005])
@pytest.mark.parametrize(("count", "one_sided"), [(1, True), (1, False), (40, True), (40, False)])
def test_independent_scores_have_the_largest_of_independent_normals(fitted, count, one_sided, level):
    candidate, sides = (ONE_SIDED, 1) if one_sided else (TWO_SIDED, 2)
    quiet = 0.5 * np.random.default_rng(2).standard_normal(len(fitted.white))
    scan = scan_of(fitted, orthonormal(fitted, count), quiet, [candidate] * count)
    # the blocks of a residual of half the unit variance stay below; what rules is the Gaussian floor: of n scores the
    # largest exceeds x with probability 1 - Phi(x)^n, with both signs 1 - (2 Phi(x) - 1)^n
    share = (1.0 - level) ** (1.0 / count)
    x = norm.ppf(share) if one_sided else norm.ppf(0.5 * (1.0 + share))
    slope = count * sides * norm.pdf(x) * share ** (count - 1)
    assert quantile(largest_scores(scan), level) == pytest.approx(x, abs=4.0 * sampling_error(level, slope))


def test_the_same_column_many_times_counts_once(fitted):
    column = orthonormal(fitted, 1)
    quiet = 0.5 * np.random.default_rng(2).standard_normal(len(fitted.white))
    scan = scan_of(fitted, np.repeat(column, 40, axis=1), quiet, [TWO_SIDED] * 40)
    x = norm.ppf(0.9975)
    wanted = pytest.approx(x, abs=4.0 * sampling_error(0.005, 2.0 * norm.pdf(x)))
    assert quantile(largest_scores(scan), 0.005) == wanted


def test_noise_that_comes_in_bursts_does_not_set_the_level_of_all(fitted):
    random = np.random.default_rng(3)
    labels = block_labels(fitted.problem, fitted.whitener.order)
    level = np.where(labels % 6 == 0, np.sqrt(6.0), 1e-3)  # unit variance, all of it in every sixth block
    slow = np.ones(100)
    burst = level * np.convolve(random.standard_normal(len(labels) + 99), slow / 10.0, "valid")
    directions = np.convolve(random.standard_normal(len(labels) + 99), slow / 10.0, "valid")[:, None]
    directions /= np.linalg.norm(directions)
    # noise and column that both stay the same over a block: the score has many times the variance of white noise, and
    # so has its standard error; in units of that it is a normal number
    threshold = quantile(largest_scores(scan_of(fitted, directions, burst, [TWO_SIDED])), 0.05)
    assert threshold == pytest.approx(norm.ppf(0.975), abs=4.0 * sampling_error(0.05, 2.0 * norm.pdf(norm.ppf(0.975))))


def test_an_effect_that_is_there_does_not_raise_its_own_bar(fitted):
    directions = orthonormal(fitted, 1)
    noise = np.random.default_rng(4).standard_normal(len(fitted.white))
    silent = scan_of(fitted, directions, noise - directions[:, 0] * (directions[:, 0] @ noise), [TWO_SIDED])
    loud = scan_of(fitted, directions, silent.white - 40.0 * directions[:, 0], [TWO_SIDED])
    assert loud.scores[0] == pytest.approx(40.0, rel=1e-9)
    # what the effect leaves in each block is taken out again: the surrogates are those of the noise alone
    np.testing.assert_allclose(largest_scores(loud), largest_scores(silent), rtol=0.0, atol=1e-6)


def test_surrogates_of_one_seed_are_the_same(fitted):
    scan = scan_of(fitted, orthonormal(fitted, 5), fitted.white, [TWO_SIDED] * 5)
    np.testing.assert_array_equal(largest_scores(scan, 7), largest_scores(scan, 7))
    assert np.all(np.diff(largest_scores(scan, 7)) >= 0.0)
