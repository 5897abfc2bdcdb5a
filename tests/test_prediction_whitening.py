"""Whitening: the spectrum of a known process is found, the rest is white, and neither mean nor period is lost."""

import numpy as np
import pytest
from scipy.signal import lfilter
from statsmodels.regression.linear_model import burg
from statsmodels.stats.diagnostic import acorr_ljungbox

from heli_identifier.tracing.prediction.whitening import ORDER, Whitener, fit_axis, fit_whitener

AR2 = np.array([1.0, -1.5, 0.8])
"""1 - 1.5 z^-1 + .8 z^-2: poles of radius .89, a resonance at an eleventh of the rate."""


def process(count, seed, taps=AR2, scale=0.01):
    noise = scale * np.random.default_rng(seed).standard_normal(count + 500)
    return lfilter([1.0], taps, noise)[500:]


def test_a_second_order_process_is_recovered_within_its_sampling_error():
    count = 20000
    taps, scale = fit_axis([process(count, 1)], order=2)
    # asymptotic standard error of either coefficient: sqrt((1 - a_2^2) / N) (Box and Jenkins, section 7.2)
    error = np.sqrt((1.0 - 0.8**2) / count)
    np.testing.assert_allclose(taps, AR2, rtol=0.0, atol=4.0 * error)
    # of a standard deviation: 1 / sqrt(2 N)
    assert scale == pytest.approx(0.01, rel=4.0 / np.sqrt(2.0 * count))


def test_further_taps_than_the_process_has_come_out_as_nothing():
    count = 20000
    taps, _ = fit_axis([process(count, 2)])
    assert len(taps) == ORDER + 1
    # beyond the true order a partial autocorrelation has the standard error 1 / sqrt(N), a tap that of the process's
    # inverse: sqrt(1 + 1.5^2 + .8^2) times as much
    error = np.sqrt((AR2**2).sum() / count)
    np.testing.assert_allclose(taps, np.append(AR2, np.zeros(ORDER - 2)), rtol=0.0, atol=4.5 * error)


def test_what_another_record_of_the_process_leaves_is_white():
    whitener = fit_whitener([np.column_stack([process(8000, seed) for seed in (1, 2, 3)])])
    for axis, seed in enumerate((11, 12, 13)):
        left = whitener.apply_axis(axis, [process(4000, seed)])
        # four numbers in a thousand by chance; of the process itself p is 0 to the last digit
        assert acorr_ljungbox(left, lags=[50])["lb_pvalue"].iloc[0] > 0.004
        assert acorr_ljungbox(process(4000, seed), lags=[50])["lb_pvalue"].iloc[0] < 1e-100
        assert left.std() == pytest.approx(1.0, rel=4.0 / np.sqrt(2.0 * len(left)))


def test_a_mean_drives_no_unit_root():
    noise = process(5000, 4)
    taps, scale = fit_axis([noise])
    same, same_scale = fit_axis([noise + 100.0])
    # Burg's recursion is exact; subtracting a mean of 100 leaves 1e-14 of it
    np.testing.assert_allclose(same, taps, rtol=0.0, atol=1e-9)
    assert same_scale == pytest.approx(scale, rel=1e-9)
    # the constant torque stays visible: the filter's gain at zero frequency is that of the process, 1 - 1.5 + .8 = .3;
    # 26 taps of error 1/sqrt(N) times their norm add up to .1
    assert taps.sum() == pytest.approx(AR2.sum(), abs=0.15)


def test_contraction_scales_the_radius_of_every_pole():
    line = np.sin(0.3 * np.arange(4000)) + 1e-4 * np.random.default_rng(5).standard_normal(4000)
    plain, _ = fit_axis([line], order=6)
    inside, scale = fit_axis([line], order=6, contraction=0.98)
    # a clean line pulls a pair of poles to the unit circle (Burg keeps them inside)
    assert np.abs(np.roots(plain)).max() == pytest.approx(1.0, abs=1e-3)
    np.testing.assert_allclose(np.sort(np.abs(np.roots(inside))), 0.98 * np.sort(np.abs(np.roots(plain))), rtol=1e-6)
    # the line is no longer whitened away: what is left is many times its noise
    assert scale > 50.0 * 1e-4


def test_poles_lie_inside_the_unit_circle_for_any_record():
    random = np.random.default_rng(6)
    walk = np.cumsum(random.standard_normal(3000))
    step = np.where(np.arange(3000) > 1500, 1.0, 0.0) + 0.01 * random.standard_normal(3000)
    for record in (walk, step, process(3000, 7)):
        taps, _ = fit_axis([record])
        assert np.abs(np.roots(taps)).max() < 1.0


def test_applying_is_convolution_record_by_record_without_the_first_samples():
    random = np.random.default_rng(8)
    records = [random.standard_normal((200, 3, 2)), random.standard_normal((120, 3, 2))]
    filters = np.column_stack((np.ones(3), 0.3 * random.standard_normal((3, 4))))
    whitener = Whitener(filters, np.array([0.5, 1.0, 2.0]))
    wanted = [
        np.column_stack([np.convolve(r[:, axis, m], filters[axis], "valid") / whitener.scales[axis] for m in range(2)])
        for axis in range(3)
        for r in records
    ]
    np.testing.assert_allclose(whitener.apply(records), np.concatenate(wanted), rtol=0.0, atol=1e-12)


def test_one_record_gives_the_reference_implementation_of_burg():
    record = process(3000, 9)
    taps, scale = fit_axis([record])
    reference, variance = burg(record, ORDER, demean=True)
    np.testing.assert_allclose(taps[1:], -reference, rtol=0.0, atol=1e-12)
    # the reference also counts errors of prediction backward: the sums differ by some of the ORDER samples at the ends
    assert scale**2 == pytest.approx(variance, rel=ORDER / len(record))


def test_records_joined_end_to_end_give_the_spectrum_of_one_long_record():
    whole = process(12000, 9)
    joined, _ = fit_axis([whole[:3000], whole[3000:7000], whole[7000:]])
    one, _ = fit_axis([whole])
    np.testing.assert_array_equal(joined, one)
    # two records of the same process whose joint does not fit: ORDER samples of 12000 are spoilt
    apart, _ = fit_axis([process(6000, 10), process(6000, 11)])
    np.testing.assert_allclose(apart[:3], AR2, rtol=0.0, atol=4.5 * np.sqrt((AR2**2).sum() / 12000))


@pytest.mark.parametrize("offset", [0.0, 0.01, 0.3])
def test_scale_is_that_of_what_is_left_of_the_records_themselves(offset):
    """At the joint of two records the filter meets a jump, which is no part of either."""
    records = [
        np.column_stack([process(800, 3 * i + k) + sign * offset for k in range(3)]) for i, sign in ((1, 1), (2, -1))
    ]
    mean = np.concatenate(records).mean(axis=0)
    records = [record - mean for record in records]
    left = fit_whitener(records).apply(records)
    assert float(np.mean(left**2)) == pytest.approx(1.0, rel=1e-9)
