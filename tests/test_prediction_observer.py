"""The observer: silent on its own model, and to anything else it answers as the filter F(s) / omega_f^2."""

import numpy as np
import pytest
from scipy.signal import lsim

from fmu_src.units.helicopter_plant import HelicopterPlant
from heli_identifier.records import Log
from heli_identifier.tracing.prediction.observer import DAMPING, observe, observer_start
from heli_plant.effects import AXES, CATALOGUE, DELAY
from heli_plant.parameters import TABLE_2
from heli_plant.simulation import simulate
from heli_plant.state import PlantState, start_state
from tests.online_record import H
from tests.simulated import UNSTABLE, drive, exact, pushed

VOLTAGES = drive(30.0)
ZERO = np.zeros((len(VOLTAGES), 3))


def switched_on(entry):
    """Table 2 with one effect on by a tenth of its range, its shapes at their defaults, a mass that moves at 12 s."""
    size = 0.1 * min(entry.upper, 1.0)
    shapes = {shape.field: shape.default for shape in entry.shapes} | {"moving_mass_time": 12.0}
    return TABLE_2._replace(**{entry.field: size, **shapes})


@pytest.mark.parametrize("entry", CATALOGUE, ids=lambda e: e.field)
def test_every_effect_leaves_innovations_that_its_own_model_takes_away(entry):
    truth = switched_on(entry)
    record, start = exact(truth, VOLTAGES)
    own, _ = observe(record, truth, 4.0, start)
    # The observer runs the very step that made the record, so not a bit is left. Only a delay looks at the instants,
    # k h here and k / rate there: 1e-16 of 20 s in a voltage's share of a step, times 16 1/s^2 in the innovations.
    assert np.abs(own).max() <= (1e-9 if entry.place == DELAY else 0.0)
    null, _ = observe(record, TABLE_2, 4.0, start)
    # doubles round at 1e-14 here; a tenth of the least effect's range, were it never met, would leave that
    assert np.abs(null[:, [AXES.index(axis) for axis in entry.axes]]).max() > 1e-5


def test_a_start_read_off_the_record_is_forgotten_within_ten_time_constants():
    record, _ = exact(TABLE_2, VOLTAGES)
    for bandwidth in (2.0, 4.0, 8.0):
        left, _ = observe(record, TABLE_2, bandwidth, observer_start(record))
        settled = np.abs(left[int(10.0 / bandwidth / H) :]).max()
        # both poles decay as exp(-.7 omega_f t): exp(-7) = .0009 of the start's error, times a few for the rates' share
        assert settled < 0.005 * np.abs(left).max()


def constant_push(axis, size):
    pushes = ZERO.copy()
    pushes[:, axis] = size
    return Log("pushed", 1.0 / H, VOLTAGES, pushed(TABLE_2, VOLTAGES, pushes)[1])


@pytest.mark.parametrize("bandwidth", [2.0, 4.0, 8.0])
def test_a_constant_torque_is_read_at_its_true_size(bandwidth):
    size = 0.01
    record = constant_push(2, size)
    left, _ = observe(record, TABLE_2, bandwidth, observer_start(record))
    # at rest e = d / (omega_f^2 + 2 rho omega_f a_wy); the rest of the catalogue's torques see the same factor
    wanted = size / (1.0 + 2.0 * DAMPING * TABLE_2.a_wy / bandwidth)
    # corrections once a sample in place of continuous ones: off by the order of omega_f h
    assert left[-500:, 2].mean() == pytest.approx(wanted, rel=bandwidth * H)


def travel_gain_error(h, bandwidth, excess=0.02):
    """Innovations of the travel when k_y is wrong by ``excess``, and the filter's answer to the missing torque."""
    voltages = np.repeat(VOLTAGES, round(H / h), axis=0)
    truth = TABLE_2._replace(k_y=TABLE_2.k_y * (1.0 + excess))
    record, start = exact(truth, voltages, h=h)
    left, motion = observe(record, TABLE_2, bandwidth, start)
    missing = (truth.k_y - TABLE_2.k_y) * (motion[:, 6] + motion[:, 7]) * np.sin(motion[:, 0])
    damping, beta = TABLE_2.a_wy, 2.0 * DAMPING * bandwidth
    answer = ([bandwidth**2], [1.0, beta + damping, bandwidth**2 + beta * damping])
    _, expected, _ = lsim(answer, missing, h * np.arange(len(missing)))
    return left[:, 2], expected


@pytest.mark.parametrize("bandwidth", [2.0, 4.0, 8.0])
def test_a_wrong_gain_leaves_the_filtered_torque_that_it_misses(bandwidth):
    found, expected = travel_gain_error(H, bandwidth)
    error = np.std(found - expected) / np.std(expected)
    # the correction acts once a sample: of first order in omega_f h, at most the real part of its poles times h
    assert error < 2.0 * DAMPING * bandwidth * H
    finer, expected_finer = travel_gain_error(H / 4, bandwidth)
    # first order: a quarter of the step leaves a quarter of the error (a fifth more for the second order)
    assert np.std(finer - expected_finer) / np.std(expected_finer) < 1.2 * error / 4.0


def test_the_innovations_of_an_unstable_pitch_stay_bounded():
    # without feedback this pitch runs away; the innovations, which the observer closes, see only the missing torque
    voltages = np.tile([0.4, 0.4], (1000, 1))
    start = PlantState(pitch=UNSTABLE.theta0 + 0.01, nu_front=0.4, nu_rear=0.4)
    truth = UNSTABLE._replace(a_th=1.05 * UNSTABLE.a_th)
    record = Log("falling", 1.0 / H, voltages, simulate(voltages, H, start, truth)[1])
    left, _ = observe(record, UNSTABLE, 4.0, start)
    fallen = np.abs(record.angles[:, 0] - UNSTABLE.theta0)
    missing = 0.05 * abs(UNSTABLE.a_th) * np.sin(np.minimum(fallen, np.pi / 2))
    assert fallen[-1] > 20.0 * fallen[0]
    assert np.all(np.abs(left[:, 0]) <= missing.max() * 1.01)


def test_a_start_is_the_straight_line_through_the_first_samples():
    time = H * np.arange(200)
    line = np.column_stack((0.1 + 0.2 * time, -0.05 + 0.03 * time, 2.0 - 0.4 * time))
    start = observer_start(Log("line", 1.0 / H, np.tile([0.7, 0.2], (200, 1)), line))
    wanted = start_state(0.1, -0.05, 2.0, 0.7, 0.2, (0.2, 0.03, -0.4))
    # least squares on a line is exact up to the condition of the fit
    np.testing.assert_allclose(start, wanted, rtol=0.0, atol=1e-12)


def test_a_unit_that_starts_where_the_observer_does_moves_as_the_plant_under_a_cable():
    """A log's first sample is off the line through its first samples; the cable rests at one travel in both."""
    stiff = TABLE_2._replace(cable_stiffness_travel=0.3)
    record, _ = exact(stiff, VOLTAGES)
    angles = record.angles + np.random.default_rng(0).normal(0.0, 2e-3, record.angles.shape)
    start = observer_start(Log("noisy", record.rate_hz, record.voltages, angles))
    expected = simulate(VOLTAGES[:300], H, start, stiff)[1]
    unit = HelicopterPlant(instance_name="unit", resources="")
    initial = {f"initial.{name}": getattr(start, name) for name in (*AXES, *(f"{axis}_rate" for axis in AXES))}
    settled = {"initial.v_front": start.nu_front, "initial.v_rear": start.nu_rear}
    for name, value in {**initial, **settled, "effects.cable_stiffness.travel": 0.3}.items():
        unit.set_real([unit.references[name]], [float(value)])
    unit.setup_experiment(0.0)
    unit.enter_initialization_mode()
    unit.exit_initialization_mode()
    outputs = [unit.references[axis] for axis in AXES]
    for k in range(299):
        unit.set_real([0, 1], VOLTAGES[k].tolist())
        assert unit.do_step(k * H, H)
        # the same arithmetic; the start times k h of the steps are rounded alike
        assert unit.get_real(outputs) == pytest.approx(expected[k + 1].tolist(), abs=1e-12)
