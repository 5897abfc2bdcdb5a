"""Likelihood ratio of further columns without a simulation: chi-squared if they explain nothing, else a refit's."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binom, chi2

from heli_identifier.tracing.prediction.fit import BASE, fit
from heli_identifier.tracing.prediction.linear_refit import linear_refit
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.prediction.whitening import fit_whitener
from heli_identifier.tracing.search.candidates import Candidate
from heli_identifier.tracing.search.scan import raw_columns
from heli_plant.effects import AXES, effect
from heli_plant.parameters import TABLE_2
from tests.simulated import drive, noisy

SECONDS = 60.0


def fitted_to(truth, seed=1):
    records = tuple(noisy(truth, drive(SECONDS, s), s) for s in (seed, seed + 10))
    problem = Problem(records)
    return fit(problem, first_estimate(records, TABLE_2))


@pytest.fixture(scope="module")
def clean():
    return fitted_to(TABLE_2)


def autoregressive(random, count, columns, taps):
    return lfilter([1.0], taps, random.standard_normal((count + 300, *columns)), axis=0)[300:]


@pytest.mark.slow
@pytest.mark.parametrize(("axes", "count"), [((1,), 4), ((0, 1, 2), 4), ((0,), 1)])
def test_columns_that_explain_nothing_have_a_likelihood_ratio_of_chi_squared(clean, axes, count):
    random, draws, ratios = np.random.default_rng(count + len(axes)), 100, []
    for _ in range(draws):
        noise = [0.01 * autoregressive(random, n, (3,), [1.0, -1.5, 0.8]) for n in clean.problem.lengths]
        nothing = [np.zeros((n, 3, 1)) for n in clean.problem.lengths]
        whitener = fit_whitener(noise)
        white, columns_ = whitener.apply(noise), whitener.apply(nothing)
        null = replace(clean, residuals=noise, whitener=whitener, white=white, raw_jacobian=nothing, jacobian=columns_)
        columns = [autoregressive(random, n, (len(axes), count), [1.0, -0.8]) for n in clean.problem.lengths]
        ratios.append(linear_refit(null, columns, axes).likelihood_ratio)
    # the mean of 100 draws, three of its errors; refitting 25 taps to some 2700 samples adds a few 25/2700 a degree
    own = count * 0.03 * len(axes)
    assert np.mean(ratios) == pytest.approx(count, abs=3.0 * np.sqrt(2.0 * count / draws) + own)
    above = int(np.sum(np.array(ratios) > chi2.isf(0.05, count)))
    # of a nominal 5 %, which the same refit may make 7 %
    assert binom.ppf(0.001, draws, 0.05) <= above <= binom.ppf(0.999, draws, 0.07)


LINEAR = [("rotor_mismatch", "pitch", 0.012), ("quadratic_drag", "travel", 0.2), ("cable_stiffness", "travel", 0.006)]


@pytest.mark.parametrize(("name", "axis", "size"), LINEAR)
def test_the_likelihood_ratio_of_a_linear_effect_is_that_of_a_full_refit(name, axis, size):
    entry = effect(name, axis)
    null_fit = fitted_to(TABLE_2._replace(**{entry.field: size}))
    own = [AXES.index(a) for a in entry.axes]
    columns = [raw[:, own] for raw in raw_columns(null_fit, [Candidate(entry, 1e-3 * size)])]
    refit = linear_refit(null_fit, columns, own)
    full = fit(null_fit.problem, null_fit.parameters, (*BASE, entry.field))
    wanted = 2.0 * (full.log_likelihood - null_fit.log_likelihood)
    # far above chance, so that a tenth of it is not noise; what remains is the coupling to the other axes, which the
    # full refit sees as well, the last alternation, and a null model that has moved by some per cent under the effect
    assert wanted > 60.0
    assert refit.likelihood_ratio == pytest.approx(wanted, rel=0.1)
    value, error = getattr(full.parameters, entry.field), full.standard_error(entry.field)
    assert refit.coefficients[0] == pytest.approx(value, abs=0.5 * error + 0.03 * value)
    # without the sandwich's allowance it is smaller, with one axis alone to tell the parameters by it is larger
    assert 0.5 * error < np.sqrt(refit.covariance[0, 0]) < 2.0 * error
    assert refit.coefficients[0] == pytest.approx(size, abs=4.0 * error + 0.03 * size)


def test_a_column_of_one_axis_does_not_bend_what_the_other_axes_determine(clean):
    # what a wrong stiffness of the pitch would leave on the travel, which follows the pitch: no torque of the travel
    index = BASE.index("a_th")
    shift = 30.0 * clean.standard_error("a_th")
    bent = [r.copy() for r in clean.residuals]
    for residual, sensitivity in zip(bent, clean.raw_jacobian, strict=True):
        residual[:, 2] += shift * sensitivity[:, 2, index]
    whitener = fit_whitener(bent)
    missing = replace(clean, residuals=bent, whitener=whitener, white=whitener.apply(bent))
    nothing = [np.zeros((n, 1, 1)) for n in clean.problem.lengths]
    refit = linear_refit(missing, nothing, (2,))
    # the pitch's own innovations hold its stiffness to a standard error or two of its
    assert abs(refit.changes[index]) < 3.0 * clean.standard_error("a_th")
    assert refit.likelihood_ratio < 1.0


def test_the_unit_of_a_column_does_not_matter(clean):
    random = np.random.default_rng(3)
    columns = [random.standard_normal((n, 1, 2)) for n in clean.problem.lengths]
    plain = linear_refit(clean, columns, (2,))
    scaled = linear_refit(clean, [c * np.array([1e6, 1e-6]) for c in columns], (2,))
    assert scaled.likelihood_ratio == pytest.approx(plain.likelihood_ratio, rel=1e-6, abs=1e-6)
    np.testing.assert_allclose(scaled.coefficients * [1e6, 1e-6], plain.coefficients, rtol=1e-6)


def test_a_column_that_the_parameters_imitate_explains_nothing(clean):
    # twice the sensitivity to k_x, once more
    column = [2.0 * j[:, :1, BASE.index("k_x") : BASE.index("k_x") + 1] for j in clean.raw_jacobian]
    # the fit stands at the optimum of all axes together
    assert abs(linear_refit(clean, column, (0,)).likelihood_ratio) < 1.0


def test_what_is_left_is_orthogonal_to_what_was_explained():
    null_fit = fitted_to(TABLE_2._replace(rotor_mismatch_pitch=0.02))
    entry = effect("rotor_mismatch", "pitch")
    columns = [raw[:, :1] for raw in raw_columns(null_fit, [Candidate(entry, 1e-3)])]
    refit = linear_refit(null_fit, columns, (0,))
    assert refit.white[0].std() == pytest.approx(1.0, rel=0.02)
    again = replace(
        null_fit,
        residuals=[np.column_stack((g, r[:, 1:])) for g, r in zip(refit.residuals, null_fit.residuals, strict=True)],
    )
    again = replace(again, whitener=fit_whitener(again.residuals))
    assert abs(linear_refit(again, columns, (0,)).likelihood_ratio) < 0.01 * refit.likelihood_ratio
