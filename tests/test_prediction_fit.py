"""The fit: true parameters within their standard errors, in open and closed loop, stable or not, and honest errors."""

import numpy as np
import pytest
from scipy.stats import binom

from heli_identifier.tracing.prediction.covariance import block_labels
from heli_identifier.tracing.prediction.fit import BASE, clipped, fit, sensitivities
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.prediction.torque import torque_responses
from heli_identifier.tracing.validation.noise_floor import synthetic_record
from heli_plant.parameters import TABLE_2
from tests.online_record import H
from tests.simulated import PROCESS_NOISE, UNSTABLE, closed_loop, drive, noisy

SECONDS = 60.0

FAR = 4.5
"""Distance in standard errors that eleven parameters exceed once in 10^4 fits; with errors 10 % too small, in 10^3."""


def pulls(fitted, truth):
    """Distance of every parameter from the truth in standard errors."""
    return np.array([(getattr(fitted.parameters, n) - getattr(truth, n)) / fitted.standard_error(n) for n in BASE])


def fitted_to(*records):
    return fit(Problem(records), first_estimate(records, TABLE_2))


@pytest.fixture(scope="module")
def records():
    return tuple(noisy(TABLE_2, drive(SECONDS, seed), seed) for seed in (1, 2))


@pytest.fixture(scope="module")
def fitted(records):
    return fitted_to(*records)


def test_table_2_is_recovered_within_its_errors(fitted):
    assert fitted.converged
    assert np.all(np.abs(pulls(fitted, TABLE_2)) < FAR)
    # and the errors say something: gains to a per cent, stiffnesses too, dampings to a tenth
    for name, share in {"k_x": 0.01, "k_z": 0.01, "k_y": 0.02, "a_th": 0.01, "a_e": 0.01, "a_wx": 0.1}.items():
        assert fitted.standard_error(name) < share * abs(getattr(TABLE_2, name)), name


def test_the_optimum_does_not_depend_on_where_the_search_began(fitted):
    random = np.random.default_rng(1)
    away = {name: getattr(TABLE_2, name) * random.uniform(0.7, 1.3) for name in BASE}
    again = fit(fitted.problem, TABLE_2._replace(**away))
    apart = [getattr(again.parameters, n) - getattr(fitted.parameters, n) for n in BASE]
    # each search stops when a step is below three hundredths of a standard error; what steps to come would add up to
    # is a few of those
    assert np.all(np.abs(apart) < 0.1 * np.sqrt(np.diag(fitted.covariance)))
    assert again.log_likelihood == pytest.approx(fitted.log_likelihood, abs=0.05)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("truth", [TABLE_2, UNSTABLE], ids=["stable", "unstable"])
def test_a_record_in_closed_loop_gives_the_truth_as_well(truth, seed):
    found = fitted_to(closed_loop(truth, SECONDS, seed))
    assert np.all(np.abs(pulls(found, truth)) < FAR)
    # whose sign is beyond doubt
    assert abs(found.parameters.a_th) > 20.0 * found.standard_error("a_th")


def test_a_pitch_that_turns_against_its_voltage_is_fitted_with_a_negative_gain():
    truth = TABLE_2._replace(k_x=-0.293)
    found = fitted_to(noisy(truth, drive(SECONDS, 5), 5))
    assert np.all(np.abs(pulls(found, truth)) < FAR)
    assert found.parameters.k_x < 0.0


def test_twice_the_noise_has_twice_the_errors():
    # process noise of five times the usual size: the encoders then add hardly anything
    errors = []
    for share in (5.0, 10.0):
        found = fitted_to(noisy(TABLE_2, drive(SECONDS, 3), 3, deviation=share * PROCESS_NOISE))
        errors.append(np.sqrt(np.diag(found.covariance)))
    # the same torque twice as large; block sums of 15 blocks are known to 1/sqrt(30) = 18 % each, but alike in both
    np.testing.assert_allclose(errors[1] / errors[0], 2.0, rtol=0.25)


@pytest.mark.slow
def test_intervals_of_95_per_cent_cover_as_often_as_they_say():
    pattern, draws = noisy(TABLE_2, drive(SECONDS, 9), 9), 40
    made = [synthetic_record(pattern, TABLE_2, 4.0, seed) for seed in range(draws)]
    distances = np.array([pulls(fit(Problem((record,)), TABLE_2), TABLE_2) for record in made])
    covered = np.abs(distances) < 1.96
    # any one parameter: once in 10^3 an honest interval covers less often, for one of eleven once in 10^2
    assert covered.sum(axis=0).min() >= binom.ppf(1e-3, draws, 0.95)
    # all together: 440 intervals, of which three or four axes' worth are independent; two errors of 130 draws
    assert 0.95 - 2.0 * np.sqrt(0.05 * 0.95 / 130) <= covered.mean() <= 0.95 + 2.0 * np.sqrt(0.05 * 0.95 / 130)


def test_a_line_in_the_torque_is_fitted_beside_the_parameters():
    frequency, amplitude = 0.7, 0.03
    count = round(SECONDS / H)
    wave = np.sin(2.0 * np.pi * frequency * H * np.arange(count))

    def push(k, state):
        return (0.0, amplitude * wave[k], 0.0)

    record = noisy(TABLE_2, drive(SECONDS, 6), 6, push)
    problem = Problem((record,))
    response = torque_responses(problem, 1, TABLE_2, [wave[:, None]])[0]
    columns = np.zeros((problem.lengths[0], 3, 1))
    columns[:, 1] = -response  # a torque in the model lowers what is left of the data
    found = fit(problem, first_estimate((record,), TABLE_2), extra=[columns])
    assert found.linear.shape == (1,)
    assert np.all(np.abs(pulls(found, TABLE_2)) < FAR)
    assert found.linear[0] == pytest.approx(amplitude, abs=4.0 * np.sqrt(found.covariance[-1, -1]))
    left = found.model_residuals[0] + columns @ found.linear
    np.testing.assert_array_equal(found.residuals[0], left)


SHAPED = [
    # truth, and a start of the same fields as a search's grid would give it
    ({"input_delay_rotors": 0.047}, (0.03,)),
    ({"motor_lag_rotors": 0.05}, (0.12,)),
    ({"motor_lag_rotors": -0.03}, (-0.05,)),
    ({"dead_zone_rotors": 0.2}, (0.3,)),
    ({"thrust_fade_rotors": 0.002}, (0.0005,)),
    ({"breakaway_friction_pitch": 0.04, "stribeck_rate_pitch": 0.09}, (0.02, 0.06)),
    ({"moving_mass_elevation": 0.05, "moving_mass_time": 31.3}, (0.02, 30.8)),
    ({"arm_bending_elevation": 0.004, "bending_frequency": 3.1, "bending_damping": 0.06}, (0.001, 2.8, 0.05)),
    ({"ground_effect_elevation": 0.5, "ground_height": 0.12}, (0.2, 0.15)),
]
GROUND = TABLE_2._replace(ground_elevation=-0.05)
"""The table at the lowest elevation of the records: where a ground effect's coefficient is stated."""


@pytest.mark.parametrize(("truth", "start"), SHAPED, ids=[next(iter(truth)) for truth, _ in SHAPED])
def test_effects_with_memory_or_shape_give_their_numbers_with_honest_errors(truth, start):
    record = noisy(GROUND._replace(**truth), drive(SECONDS, 4), 4)
    begin = first_estimate((record,), GROUND)._replace(**dict(zip(truth, start, strict=True)))
    found = fit(Problem((record,)), begin, (*BASE, *truth))
    for name, value in truth.items():
        # where responses have corners the difference is taken over some samples; a tenth of an error at most
        assert abs(getattr(found.parameters, name) - value) < FAR * found.standard_error(name), name
        # a number and not a shrug: the coefficient known to a fifth
    first = next(iter(truth))
    assert found.standard_error(first) < 0.2 * abs(truth[first])


def test_what_the_data_do_not_feel_has_no_bounded_error(records):
    # a ground 1.5 rad below the arm and a cushion of .01 rad: exp(-145) of an effect, nothing to the last bit
    far = TABLE_2._replace(ground_effect_elevation=0.1, ground_elevation=-1.5, ground_height=0.01)
    blind = fit(Problem(records[:1]), far, (*BASE, "ground_effect_elevation", "ground_height"), iterations=3)
    assert np.isinf(blind.standard_error("ground_effect_elevation"))
    assert np.isinf(blind.standard_error("ground_height"))
    sighted = fit(Problem(records[:1]), TABLE_2, iterations=3)
    for name in BASE:
        assert blind.standard_error(name) == pytest.approx(sighted.standard_error(name), rel=0.05), name


@pytest.mark.parametrize(("name", "axis", "torque"), [("k_x", 0, (1.0, -1.0)), ("k_z", 1, (1.0, 1.0))])
def test_sensitivity_to_a_gain_is_the_answer_to_the_voltage_it_multiplies(fitted, name, axis, torque):
    problem, at = fitted.problem, fitted.model_residuals
    column = sensitivities(problem, fitted.parameters, (name,), at)
    motion = problem.motion(fitted.parameters)
    pushes = [(m[:, 6:8] @ np.array(torque))[:, None] for m in motion]
    if name == "k_z":
        pushes = [push * np.cos(m[:, :1]) for push, m in zip(pushes, motion, strict=True)]
    answers = torque_responses(problem, axis, fitted.parameters, pushes)
    for found, wanted in zip(column, answers, strict=True):
        # voltages move within the sample that the answer holds them for: h / 2 of delay, omega_f h / 2 = 2 %
        assert np.linalg.norm(found[:, axis, 0] + wanted[:, 0]) < 0.03 * np.linalg.norm(wanted)


def test_a_coefficient_at_the_end_of_its_range_is_differenced_inwards(fitted):
    name = "large_angle_gravity_elevation"
    slopes = {}
    for value in (1.0, 0.99):
        at = fitted.parameters._replace(**{name: value})
        (slopes[value], *_) = sensitivities(fitted.problem, at, (name,), fitted.problem.residuals(at))
    # the law is linear in its coefficient; the observer's states feel it a little
    np.testing.assert_allclose(slopes[1.0], slopes[0.99], rtol=0.0, atol=1e-3 * np.abs(slopes[1.0]).max())


def test_a_step_never_leaves_a_parameters_range():
    free = ("dry_friction_pitch", "input_delay_rotors", "motor_lag_rotors", "a_th")
    moved = clipped(TABLE_2, free, np.array([-0.5, 9.0, -0.3, -2.0]))
    assert (moved.dry_friction_pitch, moved.input_delay_rotors) == (0.0, 0.5)
    assert moved.a_th == TABLE_2.a_th - 2.0
    # a lag of the motors stays a lag
    assert moved.T_m + moved.motor_lag_rotors == pytest.approx(1e-3, abs=1e-12)


def test_blocks_span_axes_and_never_two_records(fitted):
    labels = block_labels(fitted.problem, fitted.whitener.order).reshape(3, -1)
    assert labels.size == len(fitted.white)
    assert np.all(labels == labels[0])
    first, second = (length - fitted.whitener.order for length in fitted.problem.lengths)
    assert set(labels[0, :first]).isdisjoint(labels[0, first:])
    assert set(labels[0]) == set(range(labels.max() + 1))
    # four seconds at 25 Hz, the last of a record may be shorter
    assert np.bincount(labels[0]).max() == 100
