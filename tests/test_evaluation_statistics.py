"""Intervals, whiteness and correlation: each says what it promises, as often as it promises."""

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binom, norm

from heli_identifier.tracing.validation.figures import SEGMENT, rms_figures
from heli_identifier.tracing.validation.whiteness import LAGS, input_correlation, ljung_box_p

SPACING = 0.25


def correlated(random, count, memory):
    """Unit-variance noise with a memory of some seconds."""
    pole = np.exp(-SPACING / memory) if memory > 0.0 else 0.0
    white = np.sqrt(1.0 - pole**2) * random.standard_normal((count + 200, 1))
    return lfilter([1.0], [1.0, -pole], white, axis=0)[200:]


@pytest.mark.parametrize("memory", [0.0, 1.0])
def test_bootstrap_intervals_cover_the_true_rms(memory):
    random, draws, covered = np.random.default_rng(1), 200, 0
    for _ in range(draws):
        (figure,) = rms_figures([correlated(random, 360, memory), correlated(random, 360, memory)], SPACING)
        covered += figure.low <= 1.0 <= figure.high
    # 36 segments, whose variance the bootstrap knows to 12 %, miss some per cent of their nominal 95; half of that
    # again for a second's memory across the segments' ends
    assert covered >= binom.ppf(1e-3, draws, 0.91 if memory == 0.0 else 0.89)


def test_a_figure_is_the_rms_over_all_records_whatever_their_order():
    random = np.random.default_rng(2)
    records = [random.standard_normal((n, 3)) * [1.0, 2.0, 0.1] for n in (300, 37, 120)]
    figures = rms_figures(records, SPACING)
    wanted = np.sqrt(np.mean(np.concatenate(records) ** 2, axis=0))
    np.testing.assert_allclose([f.value for f in figures], wanted, rtol=1e-12)
    for figure in figures:
        assert figure.low < figure.value < figure.high
    again = [f.value for f in rms_figures(records[::-1], SPACING)]
    np.testing.assert_allclose(again, wanted, rtol=1e-12)


def test_segments_hold_five_seconds_so_that_memory_widens_the_interval():
    random = np.random.default_rng(3)
    constant_within = np.repeat(random.standard_normal((72, 1)), round(SEGMENT / SPACING), axis=0)
    shuffled = random.permutation(constant_within)
    (slow,), (fast,) = rms_figures([constant_within], SPACING), rms_figures([shuffled], SPACING)
    assert slow.value == pytest.approx(fast.value, rel=1e-12)
    # the same values, twenty times in a row: sqrt(20) = 4.5 times as wide; either width is known to a tenth or two
    assert (slow.high - slow.low) / (fast.high - fast.low) == pytest.approx(np.sqrt(SEGMENT / SPACING), rel=0.3)


def test_segments_of_every_record_hold_five_seconds_whatever_its_rate():
    random = np.random.default_rng(4)
    levels = random.standard_normal((2, 40, 1))
    slow, fast = np.repeat(levels[0], 20, axis=0), np.repeat(levels[1], 100, axis=0)  # 5 s at 4 Hz, at 20 Hz
    (right,), (wrong,) = rms_figures([slow, fast], (0.25, 0.05)), rms_figures([slow, fast], 0.25)
    assert right.value == wrong.value
    # taken for 4 Hz, each level of the faster record would count as five, and the interval be sqrt(5) too narrow
    assert (right.high - right.low) / (wrong.high - wrong.low) == pytest.approx(np.sqrt(5.0), rel=0.3)


def test_intervals_of_one_seed_are_the_same():
    errors = [np.random.default_rng(4).standard_normal((400, 3))]
    assert rms_figures(errors, SPACING, 5) == rms_figures(errors, SPACING, 5)


def test_the_whiteness_test_rejects_white_noise_as_often_as_it_says():
    random, draws = np.random.default_rng(5), 200
    p = np.array([ljung_box_p(random.standard_normal(2000)) for _ in range(draws)])
    for level in (0.05, 0.5):
        low, high = binom.ppf((0.001, 0.999), draws, level)
        assert low <= np.sum(p < level) <= high


def test_a_weak_memory_is_no_white_noise():
    random = np.random.default_rng(6)
    assert ljung_box_p(lfilter([1.0], [1.0, -0.2], random.standard_normal(2000))) < 1e-4


def test_correlation_with_inputs_that_mean_nothing_stays_near_its_bound():
    random, draws = np.random.default_rng(7), 200
    found = [input_correlation([random.standard_normal(1500)], [random.standard_normal(1500)]) for _ in range(draws)]
    # the largest of 50 independent normals in units of 1.96: below x with probability (2 Phi(1.96 x) - 1)^50
    for level in (0.5, 0.9):
        wanted = norm.ppf(0.5 * (1.0 + level ** (1.0 / LAGS))) / 1.96
        low, high = binom.ppf((0.001, 0.999), draws, level)
        assert low <= np.sum(np.array(found) < wanted) <= high


def test_a_residual_that_follows_a_past_input_stands_out():
    random = np.random.default_rng(8)
    u = [random.standard_normal(1500) + 3.0, 2.0 * random.standard_normal(900) - 1.0]
    lag = 12
    z = [random.standard_normal(len(x)) for x in u]
    for residual, x in zip(z, u, strict=True):
        residual[lag:] += 0.2 * (x[:-lag] - x.mean()) / x.std()
    # a share of .2 over 2400 samples is .2 sqrt(2400) = 9.8 standard deviations, less 2 % for the larger variance
    assert input_correlation(z, u) == pytest.approx(9.6 / 1.96, abs=3.0 / 1.96)
    # a future input is none of its business
    ahead = [np.roll(x, 2 * lag) for x in u]
    assert input_correlation(z, ahead) < 2.2
