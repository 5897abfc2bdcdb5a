"""The identifier: it recovers Table 2, keeps its word through rest and restore, and needs no library."""

from dataclasses import replace
from math import inf, nan, radians

import numpy as np
import pytest

from heli_identifier.errors import ConfigurationError
from heli_identifier.online import IdentifierSettings, ModelParameters
from heli_identifier.online.excitation import paper_excitation
from heli_plant.parameters import TABLE_2
from tests.simulated import identified, multisines, record

TRUTH = ModelParameters(*(getattr(TABLE_2, name) for name in ModelParameters._fields))
KNOWN = IdentifierSettings(rest_angle=TABLE_2.theta0)


def relative(found):
    return np.array(found) / np.array(TRUTH) - 1.0


@pytest.mark.slow
def test_table_2_is_recovered_within_a_thousandth_through_encoders():
    # With the paper's gain, forgetting and filter. The weakest parameter is a_lt: at a travel rate of .6 rad/s its term
    # .026 theta' lambda' has some 5e-3 rad/s^2, and the standard error that encoder noise causes is .1 % in 300 s of
    # it. 2000 s and a memory of 1000 s bring it to .04 %.
    held, angles, _ = record(2000.0, multisines(seed=1, period=2000.0, base=2.5))
    assert np.abs(relative(identified(held, angles, IdentifierSettings())[1].parameters)).max() < 1e-3


@pytest.mark.parametrize("omega", [pytest.param(1.0, marks=pytest.mark.slow), 4.0])
def test_without_encoders_the_error_is_that_of_the_discretisation_alone(omega):
    held, angles, _ = record(300.0, multisines(seed=2, period=300.0), encoders=False)
    # No pull of Omega(0) = 0: a gain of 1e9. Left: straight lines between samples, some (h^2/12) omega^2 of each term,
    # 1e-5 at omega = 1, on damping ratios of .01 to .08 ten times that.
    found = identified(held, angles, replace(KNOWN, filter_frequency=omega, initial_gain=1e9, gain_limit=inf))[
        1
    ].parameters
    assert np.abs(relative(found)).max() < 1e-4 * max(omega, 1.0)


def test_the_adaptation_rests_for_ten_filter_times():
    held, angles, _ = record(11.0, paper_excitation(1))
    for omega, samples in ((1.0, 1000), (2.0, 500)):
        settings = replace(KNOWN, filter_frequency=omega, initial=ModelParameters(a_th=0.5))
        _, before = identified(held[:samples], angles[:samples], settings)
        assert not before.adapting
        assert before.parameters == ModelParameters(a_th=0.5, theta0=TABLE_2.theta0)
        _, after = identified(held[: samples + 1], angles[: samples + 1], settings)
        assert after.adapting
        assert after.parameters.a_th != 0.5


def test_standard_errors_cover_the_error_that_encoders_cause_and_a_rest_angle_is_estimated_along():
    tilted = TABLE_2._replace(theta0=radians(5.0))
    held, angles, _ = record(200.0, multisines(seed=6, period=200.0), tilted)
    # A gain of 1e6 takes the pull of Omega(0) out, which no standard error knows of.
    _, estimate = identified(held, angles, IdentifierSettings(initial_gain=1e6, gain_limit=1e6))
    # Encoder noise behind F against a_th: 3e-5 rad/s^2 / .66 / sqrt(200 s) = 3e-6 rad, a hundred times below.
    assert estimate.parameters.theta0 == pytest.approx(radians(5.0), abs=3e-4)
    assert estimate.parameters.k_x == pytest.approx(TRUTH.k_x, rel=2e-3)
    truth = TRUTH._replace(theta0=tilted.theta0)
    ratio = (np.array(estimate.parameters) - np.array(truth)) / np.array(estimate.standard_errors)
    # Eleven numbers of about unit variance, with tails of a t distribution of ten degrees of freedom. (Over twenty
    # seeds the root mean square was .5 to 1.2, parameter by parameter.)
    assert np.abs(ratio).max() < 4.5
    assert 0.4 < np.sqrt(np.mean(ratio**2)) < 2.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"filter_frequency": 25.0}, r"filter.frequency = 25.0 rad/s must lie in \[0.001, 20\]"),
        ({"gain_limit": nan}, "adaptation.gain_limit = nan must be positive"),
        ({"initial": ModelParameters(k_x=nan)}, "initial.k_x = nan"),
    ],
)
def test_impossible_settings_are_refused_with_name_value_and_bound(change, message):
    with pytest.raises(ConfigurationError, match=message):
        IdentifierSettings(**change)
