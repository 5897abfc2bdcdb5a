"""Torques that no catalogue names: found on the right axis, by the right variable, and drawn as they are."""

import numpy as np
import pytest
from scipy.stats import chi2

from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.search.candidates import candidates
from heli_identifier.tracing.search.description import described
from heli_identifier.tracing.search.model import Model, with_unknown
from heli_identifier.tracing.search.noise import noise_whitener
from heli_identifier.tracing.search.periodic import strongest_frequencies
from heli_identifier.tracing.search.scan import scan
from heli_identifier.tracing.search.settings import UNKNOWN_LEVEL
from heli_identifier.tracing.search.unknown import one_degree_equivalent, refine_periodic, search
from heli_plant.parameters import TABLE_2
from tests.online_record import H
from tests.simulated import drive, noisy

SECONDS = 60.0
CENTRE, WIDTH, DEPTH = -0.1, 0.06, 0.06
FREQUENCY, AMPLITUDE = 0.37, 0.05
WAVES, SWING, PHASE = 2, 0.05, 0.3


def detent(k, state):
    """A notch that holds the pitch: outside of it nothing, ``DEPTH`` at one width from its middle [rad/s^2]."""
    x = (state.pitch - CENTRE) / WIDTH
    return (-DEPTH * x * np.exp(0.5 - 0.5 * x * x), 0.0, 0.0)


def hum(k, state):
    return (0.0, AMPLITUDE * np.sin(2.0 * np.pi * FREQUENCY * H * k + 1.0), 0.0)


def slope(k, state):
    return (0.0, 0.0, SWING * np.sin(WAVES * state.travel + PHASE))


def searched(law):
    records = tuple(noisy(TABLE_2, drive(SECONDS, seed), seed, law) for seed in (1, 2))
    fitted = fit(Problem(records), first_estimate(records, TABLE_2))
    of_noise = noise_whitener(fitted, scan(fitted, candidates(records, fitted.parameters)).raw)
    return fitted, search(fitted, of_noise)


@pytest.fixture(scope="module")
def in_clean():
    return searched(None)


@pytest.fixture(scope="module")
def in_notched():
    return searched(detent)


@pytest.fixture(scope="module")
def in_humming():
    return searched(hum)


@pytest.fixture(scope="module")
def in_sloping():
    return searched(slope)


def drawn(fitted, found):
    return described(with_unknown(Model(fitted), found[0]), 0)


def test_a_clean_record_holds_no_unknown(in_clean):
    _, found = in_clean
    assert found[0].likelihood_ratio < UNKNOWN_LEVEL


def without_line(x, y):
    """Deviation from the best straight line."""
    return y - np.polyval(np.polyfit(x, y, 1), x)


def test_a_notch_is_found_where_it_lies_and_drawn_within_its_band(in_notched):
    fitted, found = in_notched
    best = found[0]
    assert (best.axis, best.variable, best.frequency) == ("pitch", "pitch", None)
    assert best.likelihood_ratio > 5.0 * max(u.likelihood_ratio for u in found if u.axis != "pitch")
    shape = drawn(fitted, found)
    x, low, high = shape.band.T
    truth = np.array([detent(0, type("At", (), {"pitch": p}))[0] for p in x])
    visited = np.concatenate([r.angles[:, 0] for r in fitted.problem.records])
    often = (x > np.quantile(visited, 0.05)) & (x < np.quantile(visited, 0.95))
    y = shape.curve[:, 1]
    # up to a straight line in pitch, which belongs to stiffness and rest angle; a spline over a fifteenth of the range
    # rounds off a notch of that width
    error = without_line(x[often], y[often]) - without_line(x[often], truth[often])
    assert np.sqrt(np.mean(error**2)) < 0.25 * truth.std() + 0.5 * np.mean(high - low)
    words = shape.description
    assert words.startswith("a torque of pitch")
    assert "localised near" in words
    near = float(words.split("near ")[1].split(" rad")[0])
    assert abs(near - CENTRE) < 2.0 * WIDTH


def test_a_line_is_found_at_its_frequency_with_its_amplitude(in_humming):
    fitted, found = in_humming
    best = found[0]
    assert (best.axis, best.variable) == ("elevation", "time")
    # a bin of the record is 1/60 Hz; the search lands within it and the refinement within a tenth
    assert best.frequency == pytest.approx(FREQUENCY, abs=1.0 / SECONDS)
    shape = drawn(fitted, found)
    assert shape.frequency_hz == pytest.approx(FREQUENCY, abs=0.1 / SECONDS)
    # an amplitude of noisy weights is biased by their variance over it, here nothing
    assert shape.amplitude == pytest.approx(AMPLITUDE, abs=5.0 * shape.amplitude_standard_error)
    assert shape.amplitude_standard_error < 0.1 * AMPLITUDE
    assert shape.description.startswith("periodic in time at 0.37")


def test_refinement_gains_and_strongest_frequencies_list_the_line_first(in_humming):
    fitted, found = in_humming
    assert strongest_frequencies(fitted, 1)[0] == pytest.approx(FREQUENCY, abs=1.0 / SECONDS)
    off = FREQUENCY + 0.6 / SECONDS
    assert refine_periodic(fitted, 1, off).frequency == pytest.approx(FREQUENCY, abs=0.1 / SECONDS)


def test_a_torque_by_the_travel_has_its_waves_counted(in_sloping):
    fitted, found = in_sloping
    best = found[0]
    assert (best.axis, best.variable) == ("travel", "travel")
    shape = drawn(fitted, found)
    assert f"periodic with {WAVES} waves per turn" in shape.description
    x, y = shape.curve.T
    band = shape.band
    truth = SWING * np.sin(WAVES * x + PHASE)
    # 14 splines a turn follow two waves to a few per cent; a constant is not told from the rest of the model
    assert np.std(y - truth) < 0.1 * SWING + 0.5 * np.mean(band[:, 2] - band[:, 1])
    assert y[0] == pytest.approx(y[-1], abs=1e-9)


@pytest.mark.parametrize("found", ["in_notched", "in_humming", "in_sloping"])
def test_an_unknown_beside_the_model_gives_the_parameters_back(found, request):
    fitted, unknowns = request.getfixturevalue(found)
    model = with_unknown(Model(fitted), unknowns[0])
    assert model.fit.log_likelihood > fitted.log_likelihood + 50.0
    # what the torque did to the gain and the damping of its axis is taken back; a straight line in the angle is the
    # splines' to share with the stiffness, so that stays out of it
    names = {"in_notched": ("k_x",), "in_humming": ("k_z", "a_e", "a_wz"), "in_sloping": ("k_y",)}[found]
    for name in names:
        away = abs(getattr(model.fit.parameters, name) - getattr(TABLE_2, name))
        assert away < 4.5 * model.fit.standard_error(name) + 0.01 * abs(getattr(TABLE_2, name)), name


@pytest.mark.parametrize("gain", [1.5, 4.0, 20.0, 300.0, 650.0])
def test_a_gain_of_one_degree_is_its_own_equivalent(gain):
    # the last by the asymptotic form, in which one degree is an identity as well
    assert one_degree_equivalent(gain, 1) == pytest.approx(gain, rel=1e-9)


@pytest.mark.parametrize("degrees", [2, 6, 16])
def test_equivalents_are_as_rare_and_grow_with_the_gain(degrees):
    for gain in (degrees + 1.0, degrees + 20.0, 200.0):
        equal = one_degree_equivalent(gain, degrees)
        assert chi2.logsf(equal, 1) == pytest.approx(chi2.logsf(gain, degrees), rel=1e-6)
        assert equal < gain
    gains = np.concatenate((np.linspace(0.0, 900.0, 1801), np.geomspace(1e3, 1e7, 60)))
    equal = [one_degree_equivalent(float(g), degrees) for g in gains]
    assert np.all(np.isfinite(equal))
    # across the seam of the two forms, near 620, as well
    assert np.all(np.diff(equal)[gains[1:] > degrees + 1.0] > 0.0)
    assert equal[-1] == pytest.approx(1e7, rel=1e-4)


def test_what_noise_gains_is_worth_nothing():
    assert one_degree_equivalent(5.9, 6) == 0.0
    assert one_degree_equivalent(-3.0, 6) == 0.0
