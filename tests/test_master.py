"""The master: its results are those of the library, its delays those of the wiring table, its errors name the place."""

import tempfile
from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave

from fmu_src import SCENARIOS, MasterError, Scenario, WiringError
from fmu_src.master import run, run_apart
from heli_identifier.following import FollowPlan, FollowSettings, Sample, correct, start_correcting
from heli_identifier.online import IdentifierSettings, output_of, prepare, start, step
from heli_identifier.online.excitation import Excitation, paper_channels, voltages
from heli_identifier.records import Log, write_log
from heli_plant.communication import quantise
from heli_plant.control import PidSettings, pid_step, start_pid
from heli_plant.observer import CORRECTED, FIELDS
from heli_plant.parameters import TABLE_2, from_names
from heli_plant.plant import measured_angles
from heli_plant.plant import step as plant_step
from heli_plant.simulation import simulate
from heli_plant.state import rest_state, start_state
from tests.simulated import H, changing_rig, simulate_record

ANGLES = ("plant.pitch", "plant.elevation", "plant.travel")
EXACT = 1e-12
"""Both sides run the same arithmetic on a record of some tens of seconds; compiled code may fuse a multiply-add, a
relative 1e-16 each, over 3000 steps of a stable plant."""


@pytest.fixture
def ran(fmus):
    """Run a scenario, or the one of a name, with the units that all tests share."""

    def run_with_units(scenario, seconds, step=H, parameters=None, **more):
        wiring = SCENARIOS.get(scenario, scenario) if isinstance(scenario, str) else scenario
        files = {name: fmus[kind] for name, kind in wiring.units}
        return run_apart(scenario, seconds, step, parameters or {}, files, **more)

    return run_with_units


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A log of 20 s of the simulated plant, written with all digits."""
    held, angles, _ = simulate_record(20.01, Excitation(0.5, *paper_channels(1, "both")), encoders=False)
    return write_log(Log("log", 1.0 / H, held, angles), tmp_path_factory.mktemp("log") / "log.csv"), held


def test_in_real_time_no_step_is_taken_before_it_is_due_and_progress_goes_to_the_error_stream(ran, capfd):
    result = ran(replace(SCENARIOS["open_loop"], in_real_time=True), 0.5, 0.1, progress=True)
    assert result.seconds >= 0.4  # step k of 5 is due after k 0.1 s
    out, err = capfd.readouterr()
    assert out == "" and "100%" in err


def test_every_unit_of_the_open_loop_shows_what_the_library_gives_and_results_read_back_to_the_bit(ran, tmp_path):
    shown = ran("open_loop", 30.0, H, {"identifier.adaptation.hold_time": 2.0})
    held, excitation = shown.columns("exciter.v_front", "exciter.v_rear"), Excitation(0.5, *paper_channels(1, "both"))
    # the exciter shows the signal of t_k at t_k: it forms t_k as (k - 1) H + H, one rounding error of time, times the
    # chirp's 2.5 V/s
    assert np.abs(held - [voltages(k * H, excitation) for k in range(3001)]).max() < 1e-12
    # the plant hears the exciter without delay
    _, angles = simulate(held, H, rest_state(TABLE_2), TABLE_2)
    assert np.abs(shown.columns(*ANGLES) - angles).max() < EXACT
    # the identifier shows at each point what it knows from the samples before it
    plan = prepare(IdentifierSettings(hold_time=2.0))
    samples = shown.columns("exciter.v_front", "exciter.v_rear", *ANGLES)
    state = start(plan, samples[0])
    expected = [output_of(state, plan).parameters]
    for sample in samples[1:-1]:
        state, estimate = step(state, sample, plan)
        expected.append(estimate.parameters)
    names = [f"identifier.{name}" for name in estimate.parameters._fields]
    assert np.array_equal(shown.columns(*names)[1:], np.array(expected))
    path = shown.write_csv(tmp_path / "run.csv")
    header = path.read_text().splitlines()[0].split(",")
    assert header[:3] == ["time [s]", "exciter.v_front [V]", "exciter.v_rear [V]"]
    back = np.loadtxt(path, delimiter=",", skiprows=1)
    assert np.array_equal(back, np.column_stack([np.arange(3001) * H, shown.values]))  # k H, not a running sum


@pytest.mark.parametrize("effects", [
    {"effects.dry_friction.pitch": 0.02, "effects.quadratic_thrust.rotors": 0.1},
    {"effects.input_delay.rotors": 0.034, "motor.time_constant": 0.05},
    {"effects.arm_bending.elevation": 0.02, "effects.moving_mass.elevation": 0.1},
    pytest.param({"general.enabled": 1.0}, marks=pytest.mark.slow),
    {"encoder.enabled": True},
], ids=lambda effects: next(iter(effects)))  # fmt: skip
def test_a_corrected_plant_under_a_log_is_the_offline_plant(ran, log, effects):
    path, held = log
    encoders = effects == {"encoder.enabled": True}
    parameters = TABLE_2 if encoders else from_names(effects)
    first = start_state(0.1, 0.05, 0.3, held[0, 0], held[0, 1], (0.02, -0.03, 0.04))
    names = (*first._fields[:6], "v_front", "v_rear")
    given = {f"plant.initial.{name}": value for name, value in zip(names, first[:8], strict=True)}
    given |= {f"plant.{name}": value for name, value in effects.items()}
    result = ran("plant_beside_log", 20.0, H, {"player.log.path": str(path), **given})
    assert np.array_equal(result.columns("player.v_front", "player.v_rear"), held)
    _, angles = simulate(held, H, first, parameters)
    if encoders:
        angles = np.array([[quantise(a, n) for a, n in zip(row, (4096, 4096, 8192), strict=True)] for row in angles])
    # the delayed voltage is a mean over a window here and a weighted pair there: rounding only
    assert np.abs(result.columns(*ANGLES) - angles).max() < EXACT


def test_the_controllers_voltages_hold_one_step_after_the_angles_that_they_follow_from(ran):
    order = {"controller.reference.step_pitch": 0.2, "controller.reference.step_time": 1.0}
    result = ran("closed_loop", 10.0, H, order | {"exciter.excitation.experiment": 0})
    plant, controller, settings = rest_state(TABLE_2), None, PidSettings()
    shown = (0.5 * settings.trim, 0.5 * settings.trim)
    for k in range(1001):
        angles = measured_angles(plant)
        assert result.columns(*ANGLES)[k] == pytest.approx(angles, abs=EXACT)
        assert result.columns("controller.v_front", "controller.v_rear")[k] == pytest.approx(shown, abs=1e-9)
        plant = plant_step(plant, *shown, 0.0, k * H, H, TABLE_2)
        controller = controller or start_pid(*angles)
        controller, shown = pid_step(controller, *angles, (0.2 if k >= 100 else 0.0, 0.0, 0.0), H, settings)


def test_a_long_communication_step_keeps_the_inner_step(ran, log):
    path, held = log
    seen = ran("plant_beside_log", 19.8, 0.03, {"player.log.path": str(path)})
    # the voltage of t_k holds over .03 s, three inner steps of .01 s each
    stretched = np.repeat(held[:1981:3], 3, axis=0)[:1981]
    _, angles = simulate(stretched, H, rest_state(TABLE_2), TABLE_2)
    # inner steps are H/3: t + .03/3 is .01 to one rounding error
    assert np.abs(seen.columns(*ANGLES) - angles[::3]).max() < 1e-10


def test_a_parameter_that_a_unit_does_not_have_or_take_is_named(ran):
    for name, value, said in (
        ("plant.pitch.gian", 1.0, "plant has no variable 'pitch.gian'; did you mean 'pitch.gain'"),
        ("plant.v_front", 1.0, "plant.v_front is not a parameter; its causality is input"),
        ("plant.pitch.gain", 60.0, "plant.set pitch.gain at t = 0 s.*pitch.gain = 60.0 rad"),
        ("plant.pitch.gain", None, "plant.pitch.gain = None must be a number"),
        ("plant.encoder.enabled", 2, "plant.encoder.enabled = 2 must be 0 or 1"),
        ("exciter.multisine.seed", 2**32 + 5, "seed = 4294967301 must lie in"),
    ):
        with pytest.raises(MasterError, match=said):
            ran("open_loop", 0.1, H, {name: value})


@pytest.mark.parametrize(("given", "said"), [
    ({"scenario_name": ["open_loop"]}, "no scenario is called"),
    ({"duration": "1"}, "0 < step <= duration is needed"),
    ({"step": 0.0}, "0 < step <= duration is needed"),
    ({"parameters": [1]}, "parameters = .1. must be a mapping of names to values"),
    ({"fmus": {"plant": None}}, "must be a mapping of names to files"),
    ({"record": [3]}, "has no output 3"),
    ({"variations": 3}, "variations = 3 must be a list"),
    ({"inputs": {"plant.mass_position": ["a"]}}, "has 1 values, 10 steps need as many numbers"),
])  # fmt: skip
def test_an_argument_of_a_wrong_type_is_named_in_one_sentence(twins, given, said):
    files = {name: twins[kind] for name, kind in SCENARIOS["open_loop"].units}
    with pytest.raises(WiringError, match=said):
        run(**{"scenario_name": "open_loop", "duration": 0.1, "fmus": files, **given})
    with pytest.raises(WiringError, match="units or connections have a wrong type"):
        Scenario("alone", "", ("plant",), ())


def test_values_of_inputs_have_to_fit_the_scenario(ran):
    for target, count, said in (
        ("plnt.mass_position", 100, "no unit of scenario open_loop is called 'plnt'"),
        ("plant.v_front", 100, "plant.v_front is connected to exciter.v_front"),
        ("plant.mass_position", 3, "has 3 values, 10 steps need as many"),
    ):
        with pytest.raises(WiringError, match=said):
            ran("open_loop", 0.1, H, inputs={target: np.zeros(count)})
    # values after the last step change nothing
    alone = Scenario("alone", "the plant alone", (("plant", "HelicopterPlant"),), {})
    volts = [{"plant.v_front": np.ones(10), "plant.v_rear": np.ones(count)} for count in (10, 100)]
    short, long = (ran(alone, 0.1, H, inputs=values).values for values in volts)
    assert np.array_equal(short, long) and np.ptp(short, axis=0).any()
    with pytest.raises(WiringError, match="has no output 'plant.ptch'; did you mean 'plant.pitch'"):
        ran(alone, 0.1, H).column("plant.ptch")


def test_a_unit_that_refuses_to_terminate_costs_neither_results_nor_the_reason_of_a_failure(twins, monkeypatch):
    monkeypatch.setattr(FMU2Slave, "terminate", Mock(side_effect=FMICallException("fmi2Terminate", 3)))
    files = {name: twins[kind] for name, kind in SCENARIOS["open_loop"].units}
    assert len(run("open_loop", 0.1, H, fmus=files).values) == 11
    with pytest.raises(MasterError, match="plant.set pitch.gain at t = 0 s"):
        run("open_loop", 0.1, H, {"plant.pitch.gain": 60.0}, files)


def test_units_run_below_a_folder_of_any_name(tmp_path, monkeypatch):
    (tmp_path / "ü%# [1]").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "ü%# [1]"))
    assert run_apart("open_loop", 0.1, H).values.shape[0] > 1


def test_files_of_the_working_folder_are_not_taken_for_modules(ran, tmp_path, monkeypatch):
    for name in ("attrs", "fields", "fmpy", "pickle", "random"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('a file of the user was imported')")
    monkeypatch.chdir(tmp_path)
    assert ran("open_loop", 0.1).values.shape[0] > 1


def test_the_units_give_corrections_and_events_of_the_pure_follower_and_the_plant_predicts_the_sample_to_come(tmp_path):
    steps, rows = 4100, changing_rig(45.0, TABLE_2._replace(k_z=1.2 * TABLE_2.k_z), 15.0, seed=4)
    table = np.array(rows)
    path = write_log(Log("rig", 1.0 / H, table[:, :2], table[:, 2:]), tmp_path / "log.csv")
    first = {f"plant.initial.{name}": value for name, value in zip(Sample._fields[:5], rows[0], strict=True)}
    result = run("follow", steps * H, H, {"player.log.path": str(path), **first})
    plan = FollowPlan(FollowSettings())
    state, states, events = start_correcting(plan, Sample(*rows[0])), [], []
    for row in rows[1 : steps - 1]:
        state, said = correct(state, Sample(*row), plan)
        states.append(state)
        events.extend(said)
    # the units show one step later what the follower knows after samples 1, 2, ...
    for field, (name, _) in zip(FIELDS, CORRECTED, strict=True):
        wanted = [getattr(state.twin, field) - getattr(plan.alone, field) for state in states]
        assert result.column(f"corrector.correction.{name}")[2:steps].tolist() == wanted
    change = [change.name for change in plan.changes].index(events[-1].name) + 1
    assert events[-1].what == "adopted"
    for name, value in (("count", len(events)), ("change", change), ("value", events[-1].value)):
        assert result.column(f"corrector.event.{name}")[steps - 1] == value
    # after the adoption the plant's error is that of the encoders: counts of 1.5e-3 rad, shaken by a quarter
    error = (result.column("plant.elevation")[:steps] - table[:steps, 3])[-600:-1]
    assert np.sqrt(np.mean(error**2)) < 1e-3
