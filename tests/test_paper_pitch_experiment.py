"""The pitch experiment off line: Table 2 comes back, an effect biases it, a torque moves the plant as it should."""

import numpy as np
import pytest

from heli_identifier.workbench.paper.pitch_experiment import (
    STEP,
    identify_pitch,
    pitch_voltages,
    random_torque,
    simulate_under_torque,
)
from heli_identifier.workbench.paper.published import EXPERIMENTS, PITCH, TABLE_1, TRUTH
from heli_identifier.workbench.paper.spread import HALF_WIDTHS
from heli_identifier.workbench.paper.within import matched_torque, under_torque
from heli_plant.parameters import TABLE_2
from heli_plant.simulation import simulate
from heli_plant.state import rest_state


@pytest.mark.parametrize("experiment", [1, 2])
def test_both_experiments_give_table_2_on_a_plant_that_obeys_the_model(experiment):
    found = identify_pitch(TABLE_2, experiment)
    # Exact angles, Gamma(0) = 1e6: what is left is the straight line between samples, h^2 / 12 of the fastest motion
    # (2 Hz): (.01 * 12.6)^2 / 12 = .13 % of a chirp that carries a tenth of the power.
    assert found == pytest.approx([getattr(TRUTH, name) for name in PITCH], rel=5e-4)


def test_a_steady_torque_and_a_delay_split_the_experiments_as_the_paper_s_are_split():
    # Rounded from `heli paper`: what its search through the catalogue ends with.
    biased = TABLE_2._replace(
        a_wx=0.0518, a_th=0.787, k_x=0.2307, constant_torque_pitch=0.094, input_delay_rotors=0.032
    )
    for experiment in EXPERIMENTS:
        for name, value in identify_pitch(biased, experiment)._asdict().items():
            printed = TABLE_1[experiment][name]
            assert printed.lowest < value < printed.highest, (experiment, name)


def test_a_rotor_mismatch_on_a_steady_sum_is_a_constant_torque():
    base, mismatch = 0.5, 0.05
    of_mismatch = identify_pitch(TABLE_2._replace(rotor_mismatch_pitch=mismatch), 1, base)
    of_torque = identify_pitch(TABLE_2._replace(constant_torque_pitch=mismatch * 2.0 * base), 1, base)
    # v_f + v_r never changes in the pitch experiment and the motors have settled: the same motion.
    assert of_mismatch == pytest.approx(of_torque, rel=1e-9)


def test_a_plant_that_runs_away_is_reported_as_nan():
    found = identify_pitch(TABLE_2._replace(a_wx=-10.0, a_th=-100.0), 1, duration=100.0)
    assert np.isnan(found).all()


def test_no_torque_leaves_the_plant_alone():
    held = pitch_voltages(1, 0.5, 20.0)
    start = rest_state(TABLE_2, 1.0)
    _, expected = simulate(held, STEP, start, TABLE_2)
    found = simulate_under_torque(held, np.zeros(len(held)), STEP, start, TABLE_2)
    # The same step through two compiled loops; contraction of products may round differently.
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_a_steady_torque_moves_the_plant_as_the_effect_of_that_name_does():
    held = pitch_voltages(1, 0.5, 20.0)
    start = rest_state(TABLE_2, 1.0)
    _, expected = simulate(held, STEP, start, TABLE_2._replace(constant_torque_pitch=0.05))
    found = simulate_under_torque(held, np.full(len(held), 0.05), STEP, start, TABLE_2)
    # Strang's splitting errs by h^2 / 12 times the stiffness .66 in the torque: 6e-6 of a motion of .2 rad.
    np.testing.assert_allclose(found[:, 0], expected[:, 0], atol=2e-6)


def test_a_torque_and_voltages_of_different_length_are_refused():
    with pytest.raises(ValueError, match="must have N rows each"):
        simulate_under_torque(np.zeros((5, 2)), np.zeros(4), STEP, rest_state(TABLE_2), TABLE_2)


def test_the_random_torque_has_the_strength_and_memory_that_were_asked_for():
    deviation, tau, count = 0.02, 0.5, 400_000
    torque = random_torque(deviation, tau, count, STEP, seed=1)
    independent = count * STEP / (2.0 * tau)
    # Standard error of a standard deviation: 1 / sqrt(2 n) of it, here .011; four of them.
    assert torque.std() == pytest.approx(deviation, rel=4.0 / np.sqrt(2.0 * independent))
    lag = round(tau / STEP)
    correlation = float(torque[lag:] @ torque[:-lag]) / float(torque @ torque)
    # Bartlett: the standard error of a correlation is below sqrt(2 / n) with n independent stretches.
    assert correlation == pytest.approx(np.exp(-1.0), abs=4.0 * np.sqrt(2.0 / independent))
    assert np.array_equal(torque, random_torque(deviation, tau, count, STEP, seed=1))


def test_a_weak_torque_widens_the_ranges_in_proportion():
    weak, twice = (under_torque(1.0, deviation, runs=4, duration=60.0) for deviation in (1e-4, 2e-4))
    # First order in the torque; what is of second order is a share of some 1e-4 / .1 of it.
    np.testing.assert_allclose(twice.widths, 2.0 * weak.widths, rtol=0.05)


def test_the_matched_torque_makes_ranges_as_wide_as_the_paper_s_in_geometric_mean():
    found = matched_torque(1.0, runs=4)
    # Three rounds on a map that is nearly proportional.
    assert np.exp(np.mean(np.log(found.widths / (2.0 * HALF_WIDTHS)))) == pytest.approx(1.0, abs=0.1)
