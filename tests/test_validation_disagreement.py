"""Under a controller prediction errors favour small gains; the interval that is reported holds the true one."""

import pytest

from benchmarks.field_rigs import field_sources
from heli_identifier.online import Estimate
from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.prediction.problem import Problem, reduce_log
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.validation.disagreement import disagree, spanning
from heli_identifier.tracing.validation.plants import Plants
from heli_plant.parameters import TABLE_2


@pytest.fixture(scope="module")
def rig():
    return field_sources(("clean",), {"clean": 2})["clean clean_linear 1 b"][1].load()


def test_an_interval_under_a_controller_holds_the_true_gain_of_the_elevation(rig):
    problem = Problem(tuple(reduce_log(log) for log in rig.training))
    plant = Plants(fit(problem, first_estimate(problem.records, TABLE_2))).before
    true = rig.truth.parameters["k_z"]
    (gain,) = (d for d in plant.disputed if d.field == "k_z")
    # the loop's bias: by errors alone the gain is less than half of the true one, with a small interval
    assert gain.by_errors.interval[1] < true
    low, high = plant.estimates["k_z"].interval
    assert low < true < high
    assert plant.parameters.k_z == gain.by_errors.value


def test_two_estimates_disagree_beyond_the_spread_of_their_difference():
    near, far = Estimate(1.0, 0.3, "1"), Estimate(1.0, 0.1, "1")
    other = Estimate(2.0, 0.45, "1")
    # the difference of 1 is 1.85 and 2.17 standard deviations of its own
    assert not disagree(near, other)
    assert disagree(far, other)


def test_a_spanning_interval_holds_both_values():
    one = spanning(Estimate(1.0, 0.1, "1"), Estimate(2.0, 0.2, "1"))
    assert one.value == 1.0
    assert one.interval[0] < 1.0 and one.interval[1] > 2.0
