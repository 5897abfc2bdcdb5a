"""Linear models, margins and gains, held to closed forms, to python-control and to simulation of the whole plant."""

import json
from dataclasses import replace

import control
import numpy as np
import pytest
from scipy.io import loadmat

from heli_identifier.errors import ConfigurationError
from heli_identifier.online import Estimate
from heli_identifier.results import document_text, read_parameters
from heli_identifier.results.parameters import Covariance, ParameterSet, corrected_parameters, plant_values
from heli_identifier.tools import design_controller, margins
from heli_identifier.tools.linearisation import linear_model, linear_system, operating_point
from heli_identifier.tools.loop import step_response
from heli_identifier.tools.plants import draw_plants
from heli_identifier.tools.synthesis import PEAK, retune_pid, weighted_error
from heli_plant.control import AxisGains, PidSettings, pid_step, start_pid
from heli_plant.parameters import TABLE_2
from heli_plant.simulation import simulate
from tests.commands import heli, heli_json
from tests.diagnosis_example import AFTER, example_diagnosis, parameter_set

H = 0.01
PID = PidSettings()


def margins_of(model, settings):
    """Margins around one plant."""
    omega = margins.frequencies(H)
    plant, law = margins.plant_response(model, omega), margins.controller_response(settings, H, omega)
    gains = {name: margins.loop_gain(plant, law, index) for index, name in enumerate(margins.LOOPS)}
    return {name: margins.loop_margins(gain) for name, gain in gains.items()}


@pytest.mark.parametrize("pitch", [-0.2, 0.0, 0.15])
def test_the_plant_stays_at_its_operating_point(pitch):
    plant = TABLE_2._replace(quadratic_thrust_rotors=0.1, dead_zone_rotors=0.1, rotor_mismatch_pitch=0.01)
    point = operating_point(plant, pitch, 0.2)
    held = np.tile((point.v_front, point.v_rear), (500, 1))
    states, angles = simulate(held, H, point.state(plant), plant)
    # the acceleration left is below 1e-9 rad/s^2, over 5 s that is 1e-8 rad
    assert np.abs(angles[:, :2] - (pitch, 0.2)).max() < 2e-8
    assert np.abs(states[:, 5] - point.travel_rate).max() < 2e-8


def test_a_heavy_rig_whose_thrust_goes_with_the_square_of_the_voltage_hovers_where_its_thrust_lifts_it():
    """4 V and 164 V of thrust each; the pitch at rest needs some tenths of a volt between the rotors."""
    plant = TABLE_2._replace(k_x=0.02, k_z=0.003, k_y=-0.003, quadratic_thrust_rotors=10.0, a_1=0.006 * 164.0)
    assert operating_point(plant).lift == pytest.approx(8.0, abs=0.1)


def test_the_matrices_are_the_partial_derivatives_of_the_simplified_model():
    pitch, p = 0.1, TABLE_2
    point = operating_point(p, pitch, 0.2)
    total = point.v_front + point.v_rear
    A = np.zeros((8, 8))
    A[0, 3] = A[1, 4] = A[2, 5] = 1.0
    A[3] = [-p.a_th * np.cos(pitch - p.theta0), 0, 0, -p.a_wx, 0, 0, p.k_x, -p.k_x]
    lift = p.k_z * np.cos(pitch)
    A[4] = [-p.k_z * total * np.sin(pitch), -p.a_e, 0, -p.a_lt * point.travel_rate, -p.a_wz, 0, lift, lift]
    pull = p.k_y * np.sin(pitch)
    A[5] = [p.k_y * total * np.cos(pitch), 0, 0, 0, 0, -p.a_wy, pull, pull]
    A[6, 6] = A[7, 7] = -1.0 / p.T_m
    B = np.zeros((8, 2))
    B[6, 0] = B[7, 1] = 1.0 / p.T_m
    model = linear_system(p, point)
    assert np.abs(model.A - A).max() < 1e-8 and np.abs(model.B - B).max() < 1e-8  # rounding of a rate of 100 V/s
    assert np.abs(model.C - np.eye(3, 8)).max() < 1e-9


def test_the_linear_controller_is_the_controller():
    random = np.random.default_rng(2)
    K, z, state = margins.controller_system(PID, H), np.zeros(6), start_pid(0.0, 0.0, 0.0)
    for _ in range(200):
        angles, references = 1e-3 * random.normal(size=(2, 3))
        state, voltages = pid_step(state, *angles, tuple(references), H, PID._replace(trim=0.0))
        assert np.abs(K.C @ z + K.D @ (*angles, *references) - voltages).max() < 1e-9
        z = K.A @ z + K.B @ (*angles, *references)
    # rounding of a difference at the integrals' scale
    assert np.abs(z - state).max() < 1e-9


@pytest.mark.parametrize(("axis", "channel"), [("pitch", (1.0, -1.0)), ("elevation", (1.0, 1.0))])
def test_the_loop_becomes_unstable_where_its_gain_margin_says(axis, channel):
    model = linear_model(TABLE_2)
    plant, only = model.sampled, np.outer(channel, channel) / 2.0  # the other channel keeps its gain

    def stable(factor):
        louder = control.ss(plant.A, plant.B @ (np.eye(2) + (factor - 1.0) * only), plant.C, plant.D, H)
        return margins.is_stable(margins.close_loop(replace(model, sampled=louder), PID))

    # the grid has a per cent from one frequency to the next, and the margin is interpolated
    margin = margins_of(model, PID)[axis].gain
    assert stable(0.99 * margin) and not stable(1.01 * margin)


def test_the_phase_margin_is_that_of_python_control():
    model = linear_model(TABLE_2)
    K = margins.controller_system(PID, H)
    pid = control.ss(K.A, K.B[:, :3], K.C, K.D[:, :3], H)
    plant, wait = model.sampled, control.tf([1], [1, 0], H)
    split, join = np.array([[0.5], [-0.5]]), np.array([[1.0, -1.0]])
    loop = -control.ss([], [], [], join, H) * pid * plant * control.ss([], [], [], split, H)
    _, phase, *_ = control.margin(control.frequency_response(loop * wait, margins.frequencies(H, 2000)))
    found = margins_of(model, PID)["pitch"]
    assert found.phase == pytest.approx(phase, abs=0.5)
    # of three crossings of the unit circle, at half the way in phase, the last is the nearest to -1
    several = np.array([2.0, 0.5, 2.0, 0.5]) * np.exp(-1j * np.radians([100.0, 120.0, 150.0, 170.0]))
    assert margins.loop_margins(several).phase == pytest.approx(20.0)


def pid_around(plant, known=None, **more):
    """The PID designed for a plant, some of whose parameters have errors, of two draws."""
    return design_controller(ParameterSet("HelicopterPlant", plant_values(plant, known or {})), "pid", draws=2, **more)


def test_a_point_that_no_allowed_plant_can_hold_and_a_plant_without_motor_lag_are_refused():
    with pytest.raises(ConfigurationError, match="positive lag"):
        linear_model(TABLE_2._replace(T_m=0.0))
    # Two draws of a spring that is known to a hundred times its stiffness: both lie far from any that 5 V can hold.
    loose = {"a_e": Estimate(AFTER.a_e, 100.0 * AFTER.a_e, "1/s^2")}
    with pytest.raises(ConfigurationError, match="none of 2 plants that the data allow has an equilibrium at pitch 0"):
        pid_around(AFTER, loose, elevation=0.3)


def test_a_loop_without_margins_is_refused_and_a_rig_that_the_present_pid_cannot_hold_gets_one_with_them():
    # 22 times the published gain behind motors four times as slow: no PID gets to a peak of 1.6
    with pytest.raises(ConfigurationError, match="retuned pitch loop peaks at .* take --kind lqi"):
        pid_around(TABLE_2._replace(k_x=6.0, a_wx=0.0, T_m=0.3))
    # with the pitch counted the other way the open loop's gain never comes near -1, and the loop diverges
    with pytest.raises(ConfigurationError, match="designed loop is unstable on the identified plant.*WRONG SIGN: k_x"):
        pid_around(TABLE_2._replace(k_x=-TABLE_2.k_x), {"k_x": Estimate(-TABLE_2.k_x, 0.01, "rad/s^2/V")})
    # six times the published gain, as a measured rig has: the search begins with a tenth of the gains
    made = pid_around(TABLE_2._replace(k_x=1.66, a_wx=0.0, T_m=0.18))
    assert not made.controllers["present"].is_stable and made.delivered.is_stable


def test_the_retuned_pid_is_better_keeps_its_margins_everywhere_and_makes_no_more_noise():
    parameters = parameter_set(0.01)
    model = linear_model(AFTER)
    others = [linear_model(plant) for plant in draw_plants(parameters, 8)]
    new = retune_pid(model, PID, others)
    off = AxisGains(0.0, 0.0, 0.0)  # heli.toml need not state every loop, nor all gains of one
    from_less = retune_pid(model, PID._replace(pitch=off, elevation=PID.elevation._replace(derivative=0.0)))
    assert margins.is_stable(margins.close_loop(model, from_less))
    assert new.trim == model.point.lift and new.travel == PID.travel
    for loop, axis in enumerate(("pitch", "elevation")):
        assert weighted_error(model, new, loop) < weighted_error(model, PID, loop)
        # the bound is a penalty; four digits of the gains leave a per cent
        assert max(margins_of(one, new)[axis].sensitivity for one in (model, *others)) < 1.01 * PEAK
        loud = [getattr(s, axis).proportional + getattr(s, axis).derivative / s.rate_time_constant for s in (new, PID)]
        assert loud[0] < 1.01 * loud[1]


@pytest.mark.parametrize("delay", [0.0, 0.03])
def test_a_small_step_of_the_whole_plant_is_that_of_the_linear_loop(delay):
    plant = TABLE_2._replace(input_delay_rotors=delay)
    point = operating_point(plant, 0.0, 0.1)
    settings = PID._replace(trim=point.v_front + point.v_rear)
    model = linear_model(plant, 0.0, 0.1)
    simulated = step_response(model, settings, "pitch", size=1e-3, duration=4.0)
    loop = margins.close_loop(model, settings)
    linear = 1e-3 * margins.unit_step(loop, 0, 400)[:, 0]
    assert np.abs(step_response(model, settings, "pitch", size=0.0, duration=1.0)).max() < 1e-9
    # the square of a motion of 1e-3 rad
    assert np.abs(simulated - linear).max() < 2e-6


def test_drawn_plants_scatter_as_the_standard_errors_say_and_given_values_stay():
    plants = draw_plants(parameter_set(0.01), 400)
    gains = np.array([plant.k_x for plant in plants])
    # the spread of 400 draws is known to 3.5 %, the mean to a twentieth of the error
    assert gains.std() == pytest.approx(0.01 * AFTER.k_x, rel=0.15)
    assert gains.mean() == pytest.approx(AFTER.k_x, rel=0.002)
    assert {plant.T_m for plant in plants} == {AFTER.T_m}


def drawn_by(plant, *names, error=0.01):
    """400 draws by the covariance of a gain, known to 20 % at 3 V, and another parameter, known to its error."""
    known = Covariance(names, 3.0, np.diag([0.2, error]) ** 2)
    return draw_plants(ParameterSet("HelicopterPlant", plant_values(plant, {}), covariance=known), 400)


def test_drawn_plants_keep_the_slope_at_the_operating_point_and_lift_their_weight_as_the_estimated_one_does():
    """A quadratic thrust and the gain at 0 V trade off: the slope at 3 V, 1.3 times it, is known to 20 %."""
    plant = AFTER._replace(quadratic_thrust_rotors=0.05)
    drawn = drawn_by(plant, "pitch.gain", "effects.quadratic_thrust.rotors")
    slopes = np.array([p.k_x * (1.0 + 6.0 * p.quadratic_thrust_rotors) for p in drawn])
    # the spread of 400 draws is known to 3.5 %; 4 standard deviations of that
    assert np.log(slopes).std() == pytest.approx(0.2, rel=0.14)
    assert np.std([p.quadratic_thrust_rotors for p in drawn]) == pytest.approx(0.01, rel=0.14)
    assert np.corrcoef([p.k_x for p in drawn], [p.quadratic_thrust_rotors for p in drawn])[0, 1] < -0.1
    # rotors that are all but purely quadratic, whose coefficient may as well be 1 or beyond all bounds
    square = AFTER._replace(quadratic_thrust_rotors=9.0)
    drawn = drawn_by(square, "pitch.gain", "effects.quadratic_thrust.rotors", error=75.0)
    slopes = np.array([p.k_x * (1.0 + 6.0 * p.quadratic_thrust_rotors) for p in drawn])
    assert np.log(slopes / square.k_x / 55.0).std() == pytest.approx(0.2, rel=0.14)
    # an arm does not fall: the weight beyond what 3 V on both rotors lift is known to .01 rad/s^2
    beyond = np.array([p.a_1 - 6.0 * p.k_z for p in drawn_by(AFTER, "elevation.gain", "elevation.offset")])
    # four standard deviations of the mean and of the spread of 400 draws
    assert beyond.mean() == pytest.approx(AFTER.a_1 - 6.0 * AFTER.k_z, abs=4.0 * 0.01 / 20.0)
    assert beyond.std() == pytest.approx(0.01, rel=0.14)


def test_the_covariance_of_a_diagnosis_is_written_and_read_and_its_damage_named(tmp_path):
    fields, variances = ("k_x", "motor_lag_rotors", "k_y"), np.array([4e-6, 1e-4, 1e-4])
    found = replace(example_diagnosis(), covariance=np.diag(variances), covariance_fields=fields)
    written, file = corrected_parameters(found), tmp_path / "parameters.json"
    covariance = read_parameters(written.write(file)).covariance
    # a lag that is no finding is part of the time constant; a gain counts with its logarithm
    assert covariance.names == ("pitch.gain", "motor.time_constant", "travel.gain")
    assert covariance.not_determined == ("travel.gain",)
    slopes = [found.parameters["k_x"].estimate.value, 1.0, found.parameters["k_y"].estimate.value]
    assert covariance.matrix == pytest.approx(np.diag(variances / np.square(slopes)))
    assert "do not determine travel.gain" in written.drawn_from_prior
    document = written.to_dict()
    for change, said in (({"names": ["pitch.x"]}, "none of the values"), ({"matrix": [[1.0]]}, "3 rows of 3 numbers")):
        file.write_text(document_text({**document, "covariance": {**document["covariance"], **change}}))
        with pytest.raises(ConfigurationError, match=said):
            read_parameters(file)


def test_the_commands_leave_a_model_that_matlab_reads_and_gains_that_build_a_controller(tmp_path):
    file = parameter_set(0.01).write(tmp_path / "parameters.json")
    out, rig = tmp_path / "control", tmp_path / "heli.toml"
    rig.write_text("[controller]\nperiod = 0.02\n")
    document = heli_json("linearise", file, "--elevation", 0.1, "--config", rig, "--output", out)
    assert document["period"] == 0.02
    rig.write_text("[controller]\nperiod = 2\n")
    assert "controller.period = 2.0 s must" in heli("linearise", file, "--config", rig).output
    assert {path.name for path in out.iterdir()} == {"linear_model.json", "linear_model.mat"}
    assert document == json.loads((out / "linear_model.json").read_text())
    matrices = loadmat(out / "linear_model.mat")
    A = np.array(document["A"])
    assert np.array_equal(matrices["A"], A)
    low, high = np.array(document["A_low"]), np.array(document["A_high"])
    # the estimate lies inside the interval that is drawn around it
    assert np.all((low - 1e-9 <= A) & (high + 1e-9 >= A))
    made = heli_json("design-controller", file, "--kind", "pid", "--axis", "pitch", "--plants", 20, "--output", out)
    assert made["retuned"]["stable_share"] == 1.0
    gains = read_parameters(out / "controller.json").start_values
    assert gains["pitch.proportional"] != PID.pitch.proportional
    words = ("build", "PidController", "--parameters", out / "controller.json", "--output", tmp_path)
    assert heli(*words).exit_code == 0
