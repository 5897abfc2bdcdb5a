"""Native units by the commands, many runs of them; Model Exchange: an importer's solver finds the motion."""

import io
import json

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu

from fmu_src import CLOSED_LOOP, OPEN_LOOP, MasterError
from fmu_src.master import run_apart
from heli_plant.parameters import from_names
from heli_plant.plant import STATES, rates_of_change
from heli_plant.simulation import simulate
from heli_plant.state import PlantState, start_state
from tests.commands import heli, heli_json
from tests.diagnosis_example import parameter_set
from tests.hosts.unit_host import Unit
from tests.units import read_archive, require_compiler

OUTPUTS = ("pitch", "elevation", "travel", "pitch_rate", "elevation_rate", "travel_rate")
VOLTAGES = (1.9, 1.6)
DURATION = 4.0
EFFECTS = {
    "effects.dry_friction.pitch": 0.02, "effects.quadratic_thrust.rotors": 0.05,
    "effects.arm_bending.elevation": 0.01, "effects.gyroscopic_coupling.elevation": 0.01,
}  # fmt: skip
STEPPING_MASS = {"effects.moving_mass.elevation": 0.2, "effects.moving_mass.step_time": 1.2345}
BASE = {"initial.pitch": 0.2, "initial.elevation": -0.1, "initial.v_front": 1.0, "initial.v_rear": 1.0}


@pytest.fixture(params=[2, 3], ids=["FMI 2.0", "FMI 3.0"])
def unit(request, twins):
    return twins["HelicopterPlant", request.param, "X"]


def simulated(path, kind, parameters, **settings):
    given = np.array([(0.0, *VOLTAGES), (DURATION, *VOLTAGES)],
                     dtype=[("time", float), ("v_front", float), ("v_rear", float)])  # fmt: skip
    rows = fmpy.simulate_fmu(
        str(path), fmi_type=kind, start_values={**BASE, **parameters}, input=given, output=list(OUTPUTS),
        stop_time=DURATION, output_interval=0.01, **settings,
    )  # fmt: skip
    return rows["time"], np.column_stack([rows[name] for name in OUTPUTS])


def reference(parameters):
    """Outputs at k 10 ms by Runge and Kutta's fourth order, which test_plant.py holds to scipy's eighth. The arm's
    bending has the fastest rate, 19 1/s: over 4 s steps of .1 ms err by 4 19 (19e-4)^4 / 120 = 1e-11."""
    p, states = from_names(parameters), [start_state(0.2, -0.1, 0.0, 1.0, 1.0)]
    pieces = [(40_000, p)]
    if p.moving_mass_elevation:  # no step of the method goes across that of a law
        pieces = [(12_345, p._replace(moving_mass_elevation=0.0)), (27_655, p._replace(moving_mass_time=0.0))]
    for count, own in pieces:
        held = np.tile(VOLTAGES, (count + 1, 1))
        states += simulate(held, 1e-4, PlantState(*states.pop()), own)[0].tolist()
    rows = np.array(states[::100])
    rows[:, [1, 4]] += rows[:, [8, 9]]  # the encoder's elevation includes the bending
    return np.linspace(0.0, DURATION, len(rows)), rows[:, :6]


@pytest.mark.parametrize("parameters", [{}, EFFECTS, STEPPING_MASS, {"general.enabled": 1.0}],
                         ids=["plain", "effects", "a law that steps", "general model"])  # fmt: skip
def test_an_importers_solver_finds_the_solution_of_the_differential_equation(unit, parameters):
    """CVode keeps the error of a step to twice the tolerance (nominal values of 1), over some hundred steps to 1000
    times as much; a tighter tolerance must show it."""
    expected_time, expected = reference(parameters)
    for tolerance in (1e-8, 1e-10):
        time, found = simulated(unit, "ModelExchange", parameters, relative_tolerance=tolerance, solver="CVode")
        places = np.searchsorted(time, expected_time - 1e-9)  # an event has two rows, before and behind
        np.testing.assert_allclose(time[places], expected_time, atol=1e-9)
        assert np.abs(found[places] - expected).max() < 1000.0 * tolerance


def modelled(path, parameters, begin=0.0):
    """A model of either version, initialised, in event mode."""
    return Unit(str(path), "ModelExchange").fresh(parameters, begin)


def test_derivatives_have_the_bits_of_python(unit):
    model = modelled(unit, {**BASE, **EFFECTS})
    model.set("v_front", VOLTAGES[0])
    model.set("v_rear", VOLTAGES[1])
    states = [f"state.{name}" for name, _, _ in STATES]
    rates = [f"der({name})" for name in states]
    x = model.get(*states)
    assert model.get(*rates) == list(rates_of_change(0.0, *x, *VOLTAGES, 0.0, 0.0, from_names(EFFECTS)))


@pytest.mark.parametrize("begin", [0.7, 1e8])
def test_an_event_in_time_passes_at_any_start_and_a_state_that_is_restored_keeps_it(unit, begin):
    """Begin + .1 s is rounded: what is left of it since the begin is less than .1 s."""
    model = modelled(unit, {"effects.moving_mass.elevation": 0.5, "effects.moving_mass.step_time": 0.1}, begin)
    update = model.slave.updateDiscreteStates if model.is_third else model.slave.newDiscreteStates
    told, before = update()[-1], model.get("der(state.elevation_rate)")
    model.slave.setTime(told)
    assert told - begin < 0.1 and model.get("der(state.elevation_rate)") == before
    model.restore(model.saved())
    assert update()[-1] == np.inf
    model.restore(model.saved())
    assert model.get("der(state.elevation_rate)") != before and update()[-1] == np.inf


def test_what_is_no_differential_equation_is_refused_and_parameters_are_fixed_once_it_is_initialised(unit):
    """The solver's states belong to one differential equation; only voltages and mass move while it integrates."""
    for parameters in ({"effects.input_delay.rotors": 0.03}, {"encoder.enabled": True}):
        with pytest.raises(FMICallException):
            modelled(unit, parameters)
    model = modelled(unit, BASE)
    before = model.get("pitch.damping", "der(state.pitch_rate)")
    with pytest.raises(FMICallException):
        model.set("pitch.damping", 0.3)
    assert model.get("pitch.damping", "der(state.pitch_rate)") == before
    model.set("v_front", 2.0)
    assert model.get("v_front") == [2.0]


def test_fmpy_finds_no_problem_and_the_variables_of_the_other_build_come_first(unit, twins):
    assert validate_fmu(str(unit)) == []
    description = fmpy.read_model_description(str(unit))
    fmi = 2 if description.fmiVersion == "2.0" else 3
    plain = fmpy.read_model_description(str(twins["HelicopterPlant", fmi])).modelVariables
    names, others = ([v.name for v in listed] for listed in (description.modelVariables, plain))
    count = len(others) - (fmi == 3)  # the time stands last
    assert names[:count] == others[:count] and len(names) == len(others) + 2 * len(STATES)
    assert description.modelExchange is not None and description.coSimulation is not None


def test_a_state_of_co_simulation_is_refused_in_model_exchange_and_changes_nothing(twins):
    path = str(twins["HelicopterPlant", 2, "X"])
    source = Unit(path).fresh({"effects.input_delay.rotors": 0.03})
    data = source.slave.serializeFMUstate(source.slave.getFMUstate())
    model = modelled(path, {})
    before = model.get("effects.input_delay.rotors", "pitch")
    with pytest.raises(FMICallException):
        model.slave.setFMUstate(model.slave.deSerializeFMUstate(data))
    assert model.log[-1][2].endswith("an instance for co-simulation; nothing was changed")
    assert model.get("effects.input_delay.rotors", "pitch") == before


RECORD = ["plant.pitch", "plant.elevation"]


@pytest.fixture(scope="module")
def files(twins):
    return {name: str(twins[kind]) for name, kind in OPEN_LOOP.units}


def many(files, variations, **more):
    return run_apart(OPEN_LOOP, DURATION, 0.01, {}, files, variations=variations, record=RECORD, **more)


def test_units_in_python_and_native_ones_give_the_same_bits_and_the_same_refusal(twins, fmus):
    """They are stepped by two loops, one in Python and one in machine code."""
    found, said = [], []
    for units in (fmus, twins):
        files = {name: str(units[kind]) for name, kind in CLOSED_LOOP.units}
        found.append(run_apart(CLOSED_LOOP, DURATION, 0.01, {"plant.encoder.enabled": True}, files))
        with pytest.raises(MasterError) as caught:
            run_apart(CLOSED_LOOP, 4.0, 2.0, {"plant.solver.step": 1e-5}, files)
        said.append(str(caught.value))
    assert found[0].names == found[1].names and np.array_equal(found[0].values, found[1].values)
    assert said[0] == said[1] and said[0].startswith("plant.doStep at t = 0 s answered discard: ")


def test_every_run_begins_at_the_start_and_has_the_bits_of_a_run_alone(files):
    """With two equal variations both ends of the band are that run: nothing is left of the runs before."""
    variation = {"plant.pitch.gain": 0.25, "plant.effects.dry_friction.pitch": 0.02}
    result = many(files, [variation, variation])
    for values, given in ((result.values, {}), (result.bands.low, variation), (result.bands.high, variation)):
        alone = run_apart(OPEN_LOOP, DURATION, 0.01, given, files, record=RECORD)
        assert alone.names == result.names and np.array_equal(values, alone.values)


def test_the_bands_lie_where_95_of_100_runs_do(files):
    """At one instant 5 of 100 runs lie outside; the ends are quantiles between neighbours, so at most one more does."""
    gains = np.linspace(0.2, 0.3, 100)
    result = many(files, [{"plant.pitch.gain": gain} for gain in gains])
    column = result.names.index("plant.pitch")
    last = [
        run_apart(OPEN_LOOP, DURATION, 0.01, {"plant.pitch.gain": gain}, files, record=RECORD).values[-1, column]
        for gain in (gains[1], gains[5], gains[94], gains[98])
    ]
    low, high = result.bands.low[-1, column], result.bands.high[-1, column]
    assert [low <= value <= high for value in last] == [False, True, True, False]


def test_a_run_that_a_unit_refuses_is_counted_with_its_reason_and_units_in_python_are_refused(files, fmus):
    bands = many(files, [{"plant.pitch.gain": 0.25}, {"plant.pitch.gain": 1e9}]).bands
    assert bands.runs == 1 and len(bands.refused) == 1
    assert "pitch.gain = 1000000000.0" in bands.refused[0]
    with pytest.raises(MasterError, match="every one of 1 varied runs was refused; the first: plant"):
        many(files, [{"plant.pitch.gain": 1e9}])
    with pytest.raises(MasterError, match="many runs need native units; plant is none"):
        many({**files, "plant": str(fmus["HelicopterPlant"])}, [{}])


@pytest.mark.slow
def test_the_command_repeats_with_its_seed_and_draws_figure_and_table(tmp_path, files):
    file = parameter_set(0.05, ["a_wx", "k_x", "a_th"]).write(tmp_path / "parameters.json")
    given = [f"--fmu={name}={path}" for name, path in files.items()]
    words = ("simulate", "open_loop", "--runs", 20, "--duration", 2, "--parameters", file, *given)
    figure, table = tmp_path / "runs.svg", tmp_path / "runs.csv"
    first = heli(*words, "--plot", figure, "--output", table, "--json")
    assert first.exit_code == 0, first.output
    answer = json.loads(first.stdout)
    assert (answer["runs"], answer["refused"]) == (20, 0)
    pitch = next(row for row in answer["outputs"] if row["name"] == "plant.pitch")
    assert pitch["last_low"] < pitch["last_high"]
    assert heli_json(*words) == answer != heli_json(*words, "--seed", 1)
    assert "95 % of the runs" in figure.read_text()
    header = table.read_text().splitlines()[0]
    assert "plant.pitch low [rad]" in header and "plant.pitch high [rad]" in header
    assert "3 parameters are drawn" in first.stderr and "independently by their standard errors" in first.stderr


def test_build_and_ssp_write_native_units_of_either_version(tmp_path):
    require_compiler()
    for fmi, folder in (("2", "linux64"), ("3", "x86_64-linux")):
        words = ("build", "PidController", "--native", "--fmi", fmi, "--output", tmp_path, "--set", "trim=-1.25")
        assert heli(*words).exit_code == 0
        found = read_archive(tmp_path / "PidController.fmu")
        assert f"binaries/{folder}/PidController.so" in found and b"-1.25" in found["sources/variables.c"]
    assert heli("ssp", "open_loop", "--native", "--output", tmp_path / "open.ssp").exit_code == 0
    assert "sources/model.c" in read_archive(io.BytesIO(read_archive(tmp_path / "open.ssp")["resources/plant.fmu"]))
