"""Designed controllers, held to what physics promises of them; flights flown again."""

import ctypes
from dataclasses import replace
from pathlib import Path

import control
import numpy as np
import pytest

from fmu_src.native import controller_sources
from heli_identifier.errors import ConfigurationError
from heli_identifier.records import ControllerConfiguration, Log, write_log
from heli_identifier.tools import check_closed_loop, design_controller, margins
from heli_identifier.tools.closed_loop import answer_deviations
from heli_identifier.tools.judging import joint_bounds
from heli_identifier.tools.linearisation import linear_model, operating_point
from heli_identifier.tools.loop import (
    controller_parameters,
    fly,
    read_controller,
    start_at_rest,
    start_controller,
    step_controller,
)
from heli_identifier.tools.synthesis import design_feedback
from heli_plant.control import AxisGains, PidSettings
from heli_plant.geometry import RATIO_ERROR, Geometry
from heli_plant.parameters import TABLE_2
from heli_plant.state_feedback import Rotors, feedback_step, start_feedback
from tests.commands import heli, heli_json
from tests.diagnosis_example import parameter_set
from tests.units import LIBRARY, c_compiler, compile_c

H, AIM = 0.01, ControllerConfiguration()
COURSE = Geometry(0.72, 1.92, 0.46, 0.66, 0.175, 7.0)


def designed(plant=TABLE_2, other="pitch", integral=True, effort=1.0):
    model = linear_model(plant, None if other == "travel" else 0.0, 0.1, H)
    return design_feedback(model, AIM, other, integral, effort), model.point


def flown(plant, settings, point, references, load=Rotors(0.0, 0.0)):  # noqa: B008, a tuple
    """Fly the plant from its operating point with voltages ``load`` [V] that the controller is not told of."""
    moved = settings._replace(hover=Rotors(settings.hover.front + load.front, settings.hover.rear + load.rear))
    state, held = point.state(plant), (point.v_front, point.v_rear)
    return fly(plant, moved, references, state, held, H, start_at_rest(settings, point))


def references(point, seconds, **steps):
    held = np.tile((point.pitch, point.elevation, 0.0), (round(seconds / H), 1))
    for axis, size in steps.items():
        held[:, ("pitch", "elevation", "travel").index(axis)] += size
    return held


@pytest.mark.parametrize("other", ["pitch", "travel"])
def test_an_integral_removes_what_a_load_leaves(other):
    """Under .2 V on both rotors LQI comes back to its references; LQR stays off a hundred times as far."""
    left = {}
    for integral in (True, False):
        settings, point = designed(TABLE_2, other, integral)
        angles, _ = flown(TABLE_2, settings, point, references(point, 60.0), Rotors(0.2, 0.2))
        left[integral] = abs(angles[-1, 1] - point.elevation)
    assert left[True] < 1e-4  # its slowest pole is near .5 1/s: exp(-30) of what the load moved is left
    assert left[False] > 100.0 * left[True]


@pytest.mark.parametrize("periods", [1, 3])
def test_an_input_delay_shifts_the_response_and_nothing_else(periods):
    """The predictor makes LQR with m periods of delay the loop without, m periods later (Astrom, section 4.5). An
    integral would add the error of the m periods in which nothing can answer."""
    plain, point = designed(integral=False)
    late_plant = TABLE_2._replace(input_delay_rotors=periods * H)
    late = design_feedback(linear_model(late_plant, 0.0, 0.1, H), AIM, "pitch", False)
    wanted = references(point, 6.0, elevation=0.05)
    prompt, _ = flown(TABLE_2, plain, point, wanted)
    delayed, _ = flown(late_plant, late, point, wanted)
    # both plants are nearly linear over .05 rad; what the sine of gravity adds is of its third order
    np.testing.assert_allclose(delayed[periods:, 1], prompt[:-periods, 1], atol=2e-5)
    assert prompt[-1, 1] == pytest.approx(wanted[-1, 1], abs=2e-5)


def test_the_disk_margin_is_that_of_the_structured_singular_value_and_within_it_the_loop_stays_stable():
    """Of two complex numbers mu(M) is the largest spectral radius of diag(1, exp(j phi)) M (Packard, Doyle 1993)."""
    settings, _ = designed()
    model, omega = linear_model(TABLE_2, 0.0, 0.1, H), margins.frequencies(H)
    plant, law = margins.plant_response(model, omega), margins.controller_response(settings, H, omega)
    (margin,) = margins.disk_margins(plant[None], law)
    M = np.linalg.inv(np.eye(2) - law @ plant) - 0.5 * np.eye(2)
    turned = (np.array([1.0, np.exp(1j * phi)])[:, None] * M for phi in np.linspace(0.0, 2.0 * np.pi, 721))
    # half a step of .009 rad beside the worst phase costs 1e-5 of the radius
    assert margin == pytest.approx(1.0 / max(np.abs(np.linalg.eigvals(one)).max() for one in turned), rel=2e-5)
    for d in (-0.99 * margin, 0.0, 0.99 * margin):  # both rotors together
        system = model.sampled
        scaled = control.ss(system.A, (2.0 + d) / (2.0 - d) * system.B, system.C, system.D, H)
        assert margins.is_stable(margins.close_loop(replace(model, sampled=scaled), settings))


def test_the_robust_design_keeps_more_where_the_plant_is_known_badly():
    aim = replace(AIM, disk_margin=1.3)
    made = design_controller(parameter_set(error=0.15), "lqi", "pitch", 0.1, aim=aim, draws=60)
    assert made.delivered.figures["disk"].promised > made.controllers["nominal"].figures["disk"].promised
    assert made.delivered.stable_share >= 0.95
    # where spring and lift are known to a half, a few of 100 plants are unstable, which their response does not show
    aim, known = replace(AIM, disk_margin=0.74), parameter_set(0.5, ("a_e", "k_z"))
    robust = design_controller(known, "lqr", "pitch", 0.1, aim=aim, draws=100).delivered
    assert 0.95 <= robust.stable_share < 1.0 and robust.figures["disk"].value >= aim.disk_margin


def test_a_robust_design_that_the_identified_plant_cannot_stand_is_passed_over():
    """Its arm bends by .3 mrad/V, that of the one drawn plant by a third of it: dearer voltages shake the first."""
    known = parameter_set(10.0, ("k_y", "arm_bending_elevation"), TABLE_2._replace(arm_bending_elevation=3e-4))
    aim = replace(AIM, weights=replace(AIM.weights, voltage=0.003))
    made = design_controller(known, "lqi", "pitch", 0.1, aim=aim, draws=1)
    assert made.controllers["nominal"].is_stable and made.delivered.is_stable
    # an arm that bends by 4 mrad/V shakes the design by the weights, not the robust one, which is delivered
    bent = parameter_set(plant=TABLE_2._replace(arm_bending_elevation=4e-3))
    made = design_controller(bent, "lqi", "pitch", 0.1, draws=5)
    assert not made.controllers["nominal"].is_stable and made.delivered.is_stable


def test_what_is_promised_is_kept_by_95_percent_of_the_plants_at_once():
    """Figure by figure .95^4 = .81 of independent figures would be kept together."""
    figures = np.random.default_rng(1).standard_normal((2000, 4))
    kept = joint_bounds(figures)
    assert np.mean((figures >= kept).all(1)) >= 0.95 and np.mean((figures >= kept).all(1)) < 0.96
    assert np.all(np.mean(figures < kept, axis=0) < 0.05)


def test_the_parameters_of_the_unit_are_the_controller(tmp_path):
    settings, point = designed(TABLE_2, "travel")
    pid = PidSettings(travel=AxisGains(0.3, 0.1, 1.1), travel_enabled=True, trim=-0.7, voltage_limit=4.0)
    for own in (settings, pid):
        assert read_controller(controller_parameters(own, point).write(tmp_path / "controller.json"), 5.0) == own


def test_masses_and_lengths_give_the_ratios_of_the_gains():
    """K_f cancels: a rig of twice the thrust has the same ratios; with the hover's K_f the priors hold both."""
    twice = replace(COURSE, hover_voltage=3.5)
    assert twice.ratios == COURSE.ratios
    assert {field: low for field, (low, _) in COURSE.ratios.items()} == pytest.approx(
        {"k_x": 6.479, "k_z": 1.0427}, rel=1e-3
    )
    assert COURSE.deviations("k_x", 9.0, 0.0) < 0.0
    assert COURSE.deviations("k_x", 0.5 * 6.479, 0.0) == pytest.approx(np.log(2.0) / RATIO_ERROR, rel=1e-3)
    assert twice.priors()["k_y"][0] == pytest.approx(2.0 * COURSE.priors()["k_y"][0])
    assert Geometry(m_p=0.7).priors() == {}


def test_the_controller_in_c_gives_the_same_bits(tmp_path):
    settings, point = designed(TABLE_2._replace(input_delay_rotors=0.02), "travel")
    for name, text in controller_sources(settings).items():
        (tmp_path / name).write_text(text)
    built = compile_c(c_compiler(), [tmp_path / "controller.c"], tmp_path / "controller.so", *LIBRARY)
    library, three, two = ctypes.CDLL(str(built)), ctypes.c_double * 3, ctypes.c_double * 2
    memory, volts = ctypes.create_string_buffer(8 * 28), two()
    start = [ctypes.c_double(x) for x in (0.0, 0.05, 0.2)]
    library.controller_start(memory, *start)
    state = start_feedback(0.0, 0.05, 0.2, settings)
    for k in range(300):
        angles, wanted = (0.1 * np.sin(0.03 * k), 0.1 * np.cos(0.02 * k), 0.3 * k * H), (0.0, 0.15, 0.4 * (k > 50))
        library.controller_step(memory, three(*angles), three(*wanted), volts)
        state = feedback_step(state, *map(float, angles), wanted, Rotors(), settings)
        assert tuple(volts) == (settings.hover.front + state.now.front, settings.hover.rear + state.now.rear)


def test_a_flight_flown_again_by_its_own_plant_errs_by_its_start_alone():
    """Under an LQI. Local cubics begin each stretch: a gain that is 20 % off errs twice as much."""
    settings, point = designed()
    wanted = references(point, 40.0)
    wanted[500:2000, 1] += 0.1
    wanted[1000:3000, 0] += 0.15
    angles, voltages = flown(TABLE_2, settings, point, wanted)
    log = Log("flight", 1.0 / H, voltages, angles)
    own = check_closed_loop(log, TABLE_2, settings)
    wrong = check_closed_loop(log, TABLE_2._replace(k_x=0.8 * TABLE_2.k_x, a_1=TABLE_2.a_1 - 0.05), settings)
    assert [outcome.axis for outcome in own.outcomes] == ["elevation", "pitch"]
    for right, off in zip(own.outcomes, wrong.outcomes, strict=True):
        assert right.error.value < 0.5 * off.error.value
    with pytest.raises(ConfigurationError, match="must be a multiple of the log's"):
        check_closed_loop(replace(log, rate_hz=70.0), TABLE_2, settings)


@pytest.mark.parametrize("every", [1, 2])
def test_the_answer_to_deviations_is_that_of_the_controller(every):
    """A controller that acts at every sample or at every second one: two flights of it differ by its answer."""
    settings, point = designed(other="travel")
    delta = 1e-3 * np.random.default_rng(3).standard_normal((50, 3)) + 0.01
    answered = answer_deviations(settings, np.repeat(delta, every, axis=0), H / every)
    memory = [start_controller(settings, *at) for at in ((0.0, 0.1, 0.0), (0.0, 0.1, 0.0))]
    for k in range(49):
        volts = []
        for i, share in enumerate((0.0, 1.0)):
            angles = (np.array([0.0, 0.1, 0.0]) + share * delta[k]).tolist()
            memory[i], pair = step_controller(settings, memory[i], angles, (0.0, 0.1, 0.0), H)
            volts.append(pair)
        np.testing.assert_allclose(answered[every * (k + 1)], np.subtract(*reversed(volts)), atol=1e-9)


def test_the_command_writes_what_the_next_commands_read(tmp_path):
    file = parameter_set().write(tmp_path / "parameters.json")
    made = heli_json("design-controller", file, "--axis", "pitch", "--plants", 20, "-o", tmp_path / "c")
    assert made["robust"]["stable_share"] == 1.0
    kept = {p.name for p in (tmp_path / "c").iterdir()}
    assert kept == {"design.json", "design.svg", "controller.json", "controller.m", "controller.c", "controller.h"}
    heli_json("design-controller", file, "--kind", "pid", "--axis", "pitch", "--plants", 20, "-o", tmp_path / "c")
    assert {p.name for p in (tmp_path / "c").iterdir()} == kept - {"controller.c", "controller.h"}


def test_gains_in_the_configuration_fly_a_log_again(tmp_path, monkeypatch):
    """The flight is one of the units' own PID; a plant of its own errs less than one whose loop is another."""
    monkeypatch.chdir(tmp_path)
    parameter_set().write(tmp_path / "parameters.json")
    settings, point = PidSettings(), operating_point(TABLE_2, 0.0, 0.0)
    wanted = np.zeros((4000, 3))
    wanted[500:2500, 1] = 0.1
    held, still = (point.v_front, point.v_rear), start_controller(settings, *wanted[0])
    angles, voltages = fly(TABLE_2, settings, wanted, point.state(TABLE_2), held, H, still)
    write_log(Log("flight", 1.0 / H, voltages, angles), "flight.csv")
    assert "--limit needs --controller FILE" in heli("check", "flight.csv", "--limit", 1000).stderr
    rows = [f"{axis} = {list(getattr(settings, axis))}" for axis in ("pitch", "elevation")]
    Path("heli.toml").write_text("\n".join(["[controller.pid]", *rows, f"trim = {settings.trim}", ""]))
    outcomes = heli_json("check", "flight.csv", "--limit", 1000)["outcomes"]
    assert [(outcome["axis"], outcome["passed"]) for outcome in outcomes] == [("elevation", True), ("pitch", True)]
