"""First estimates: least squares on smoothed derivatives finds the neighbourhood of the truth, whatever its signs."""

import numpy as np
import pytest

from heli_identifier.tracing.prediction.start import first_estimate, lagged_voltages
from heli_plant.parameters import TABLE_2
from heli_plant.simulation import simulate
from tests.simulated import UNSTABLE, closed_loop, drive, exact, rest

GIVEN = TABLE_2._replace(a_wx=0.0, a_th=0.0, k_x=0.0, theta0=0.0, a_wz=0.0, a_e=0.0, a_1=0.0, a_lt=0.0, k_z=0.0)
"""What is given carries nothing of what is estimated."""


@pytest.mark.parametrize("signs", [{}, {"k_x": -0.293}, {"k_x": -0.2, "k_y": 0.112, "theta0": 0.3}])
def test_exact_records_give_the_parameters_up_to_what_smoothing_takes(signs):
    truth = TABLE_2._replace(**signs)
    found = first_estimate([exact(truth, drive(60.0, seed))[0] for seed in (1, 2)], GIVEN)
    # A local cubic over .6 s keeps .94 of an acceleration at .5 Hz and .76 at 1 Hz, where little of the motion lies:
    # everything comes out too small by up to a tenth. theta0 is the ratio of two such numbers and does not suffer.
    for name in ("a_th", "k_x", "a_e", "k_z", "k_y", "a_1"):
        assert getattr(found, name) == pytest.approx(getattr(truth, name), rel=0.1), name
    for name in ("a_wx", "a_wz", "a_wy", "a_lt"):
        assert getattr(found, name) == pytest.approx(getattr(truth, name), rel=0.12), name
    assert found.theta0 == pytest.approx(truth.theta0, abs=0.002)
    assert found.T_m == GIVEN.T_m


def test_an_unstable_pitch_in_closed_loop_gets_a_negative_stiffness():
    found = first_estimate([closed_loop(UNSTABLE, 60.0, 1)], GIVEN)
    # biased by noise in the loop; only the sign and the size matter to the fit that starts here
    assert found.a_th == pytest.approx(UNSTABLE.a_th, rel=0.5)
    assert found.k_x == pytest.approx(UNSTABLE.k_x, rel=0.3)
    assert found.theta0 == pytest.approx(UNSTABLE.theta0, abs=0.1)


@pytest.mark.parametrize("time_constant", [0.0, 0.03, 0.08])
def test_lagged_voltages_are_those_of_the_plants_motors(time_constant):
    voltages = drive(10.0, 4)
    parameters = TABLE_2._replace(T_m=time_constant)
    record, _ = exact(parameters, voltages)
    states, _ = simulate(voltages, record.step, rest(parameters, voltages), parameters)
    np.testing.assert_allclose(lagged_voltages(record, time_constant), states[:, 6:8], rtol=0.0, atol=1e-12)
