"""The native twins show the bits of the pythonfmu units, in FMI 2.0 and 3.0; what they refuse, they refuse likewise."""

import ctypes
import json
from random import Random
from xml.etree import ElementTree

import pytest
from fmpy import read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu

from fmu_src import BuildError, build, unit_class
from fmu_src.native import NATIVE_UNITS
from fmu_src.native.toolchain import PLATFORMS, find_compiler
from heli_plant.effects import CATALOGUE
from heli_plant.parameters import BY_FIELD
from tests.hosts.unit_host import Unit
from tests.simulated import random_tables
from tests.test_fmu_builder import findings
from tests.units import read_archive, run_host, write_orders

ANGLES = {"pitch": [-0.6, 0.6], "elevation": [-0.5, 0.5], "travel": [-1.0, 3.0]}
VOLTAGES = {"v_front": [-5.0, 7.0], "v_rear": [-5.0, 7.0]}
FAST = {"report.interval": 0.5, "adaptation.forgetting": 0.02, "filter.frequency": 3.0}
ALL_ON = {
    f"effects.{entry.name}.{entry.axis}": min(0.02, entry.upper)
    for entry in CATALOGUE
    if entry.name not in ("moving_mass", "thrust_fade")
}

GROUPS, DRAW = ("transition", "drive", "innovation", "gain", "integral", "reference"), Random(5)
FEEDBACK = {
    name: DRAW.uniform(-0.1, 0.1) for name in [own.name for own in unit_class("StateFeedback").variables]
    if name.partition(".")[0] in GROUPS and name.count(".") == 2
}  # fmt: skip
"""Random matrices, small enough that the estimate stays bounded."""


def order(parameters, inputs, steps, shortest=0.001, longest=0.01):
    return dict(parameters=parameters, inputs=inputs, steps=steps, seed=3, shortest=shortest, longest=longest)


FLOWN = {**ANGLES, "excitation_front": [-1.0, 1.0], "reference.travel": [-0.3, 0.3]}
ORDERS = {
    "HelicopterPlant": [
        order(parameters, {**VOLTAGES, "mass_position": [-0.2, 0.2]}, 600, 2e-4, 0.03)
        for parameters in (
            {**ALL_ON, "encoder.enabled": True, "solver.step": 0.003},
            {**ALL_ON, "general.enabled": 1.0, "effects.input_delay.rotors": 0.07},
            {"effects.arm_bending.elevation": 0.02, "effects.input_delay.rotors": 0.013, "motor.time_constant": 0.0},
            {BY_FIELD[field].name: value for field, value in random_tables().items()},
            {"effects.moving_mass.elevation": 0.1, "effects.moving_mass.step_time": 2.0,
             "effects.thrust_fade.rotors": 1e-3},
        )
    ],
    "AdaptiveIdentifier": [
        order(parameters, {**VOLTAGES, **ANGLES}, steps)
        for parameters, steps in (
            (FAST, 2500),
            ({"pitch.rest_angle_known": True, "pitch.rest_angle": -0.1, "motor.time_constant": 0.0, **FAST}, 1500),
            ({"sample.time": 0.004, "adaptation.gain_limit": 1e300, "adaptation.forgetting": 0.0}, 800),
            ({"method": "prediction_error", "motor.lag_known": True, "sample.time": 0.002, "report.interval": 0.5},
             1000),
        )
    ],
    "PidController": [
        order(parameters, FLOWN, 1000)
        for parameters in (
            {},
            {"travel.enabled": True, "reference.step_pitch": 0.2, "reference.step_time": 2.0, "voltage_limit": 3.0},
        )
    ],
    "StateFeedback": [
        order({"sample.time": 0.1, **FEEDBACK, **more}, FLOWN, 1000)
        for more in ({}, {"travel.enabled": True, "sample.delay": 3, "voltage_limit": 3.0})
    ],
    "Exciter": [
        order({"excitation.experiment": kind, "excitation.channel": k, "multisine.seed": 77}, {}, 400, longest=0.1)
        for kind in range(4) for k in range(3)
    ],
}  # fmt: skip
HEADER = "time [s],v_front [V],v_rear [V],pitch [deg],elevation [rad],travel [rad]\n"
ROWS = "".join(f"{5.0 + 0.01 * k:.2f},{k / 7.0!r},{-k / 3.0!r},{k / 11.0!r},.2,-1e-3\n" for k in range(100))


@pytest.mark.parametrize("unit", NATIVE_UNITS)
def test_a_native_unit_of_either_version_of_fmi_has_the_bits_of_the_pythonfmu_unit(tmp_path, fmus, twins, unit):
    """Random inputs and steps; states are saved, serialised and restored in between; no difference is allowed."""
    builds = (fmus[unit], twins[unit], twins[unit, 3])
    (tmp_path / "played.csv").write_text(HEADER + ROWS)
    player = [order({"log.path": str(tmp_path / "played.csv"), "log.start": 0.2}, {}, 300)]
    for run in run_host("lockstep.py", *builds, write_orders(tmp_path, ORDERS.get(unit, player))):
        assert run["different"] == 0 and run["status"] == [0, 0, 0], run


IN_BOTH = """
import json
def said(unit, parameters):
    unit.log.clear()
    unit.instantiate()
    status = 0
    try:
        unit.start(parameters)
    except Exception as problem:
        status = getattr(problem, "status", -1)
    step = unit.step(0.0, 0.03 - 2e-6)  # a row may come early by so little
    return status, step, unit.log[0][2] if unit.log else "", unit.shown() if step == 0 else None
"""


def test_odd_logs_are_played_or_refused_alike(tmp_path, fmus, twins):
    """One grammar, the same words: bytes are put into a good log, taken out and replaced."""
    script = """
import random
units = [Unit(path) for path in sys.argv[1:3]]
good, path = open(sys.argv[3], "rb").read(), sys.argv[4]
pieces = [b'"', b",", b"\\n", b"\\r\\n", b"\\r", b" ", b"\\t", b"\\0", b"\\xc3\\xbc", b"nan", b"1e999", b"1_0",
          b"0x1p3", b"inf", b"-", b"+", b"e5", b".", b"1e", b"\\n  \\n", b"\\xef\\xbb\\xbf"]
draw, different, played = random.Random(5), [], 0
for k in range(600):
    text = bytearray(good)
    for _ in range(draw.choice([0, 1, 1, 2])):
        at = draw.randrange(len(text))
        text[at : at + draw.choice([0, 0, 1, 20])] = draw.choice([*pieces, b""])
    with open(path, "wb") as file:
        file.write(text)
    (_, *ours), (_, *theirs) = [said(unit, {"log.path": path}) for unit in units]
    played += ours[0] == 0
    if ours != theirs:
        different.append([repr(bytes(text))[:300], ours, theirs])
answer([different[:2], played])
"""
    (tmp_path / "good.csv").write_text("note," + HEADER + "".join(f"a,{row}\n" for row in ROWS.split()[:5]))
    paths = [fmus["LogPlayer"], twins["LogPlayer"], tmp_path / "good.csv", tmp_path / "odd.csv"]
    different, played = run_host(IN_BOTH + script, *paths)
    assert different == [] and 100 < played < 500


@pytest.mark.parametrize("unit, parameters, reason", [
    ("LogPlayer", {}, "log.path is empty"),
    ("LogPlayer", {"log.path": "/dev/zero"}, "the log /dev/zero is no file"),
    ("Exciter", {"excitation.experiment": 3, "multisine.period": 0.1}, "has no harmonic near 0.0333333 Hz"),
    ("AdaptiveIdentifier", {"filter.frequency": 100.0}, "filter.frequency = 100.0 rad/s must lie in [0.001, 20]"),
    ("HelicopterPlant", {"effects.motor_lag.rotors": -0.07, "motor.time_constant": 0.05}, "must not be negative"),
])  # fmt: skip
def test_what_the_initialisation_refuses_is_said_as_python_says_it(fmus, twins, unit, parameters, reason):
    script = IN_BOTH + "answer([said(Unit(path), json.loads(sys.argv[3]))[::2] for path in sys.argv[1:3]])"
    (_, theirs), (status, ours) = run_host(script, fmus[unit], twins[unit], json.dumps(parameters))
    assert status == 3 and reason in ours and ours == theirs


def test_a_controller_whose_estimate_overflows_refuses_the_step_and_shows_no_nan(fmus, twins):
    script = """
def first_refused(unit):
    unit.fresh({"transition.pitch.pitch": 1e6, "gain.front.pitch": 1.0, "point.pitch": 0.1})
    return next(k for k in range(100) if unit.step(0.01 * k, 0.01)), unit.shown(), unit.log[-1][2]
answer([first_refused(Unit(path)) for path in sys.argv[1:]])
"""
    ours, theirs = run_host(script, fmus["StateFeedback"], twins["StateFeedback"])
    assert ours == theirs and ours[1] == [5.0, 0.0] and "no finite voltages follow" in ours[2]


def test_after_a_refused_step_the_unit_says_how_far_it_came_and_that_the_run_goes_on(twins):
    unit = Unit(twins["PidController"]).fresh()
    assert (unit.step(0.0, 0.01), unit.step(5.0, 0.01)) == (0, 2)
    time, ends = ctypes.c_double(), ctypes.c_int(7)
    for name, kind, value, status in (("Real", 2, time, 0), ("Boolean", 3, ends, 0), ("Integer", 0, ends, 2)):
        call = unit.slave.dll[f"fmi2Get{name}Status"]
        assert call(ctypes.c_void_p(unit.slave.component), kind, ctypes.byref(value)) == status
    assert (time.value, ends.value) == (0.01, 0)
    third, last, flag = Unit(twins["PidController", 3]).fresh(), ctypes.c_double(7.0), ctypes.byref(ctypes.c_bool())
    step = [ctypes.c_void_p(third.slave.component), ctypes.c_double(5.0), ctypes.c_double(0.01), True, *[flag] * 3]
    assert third.slave.dll.fmi3DoStep(*step, ctypes.byref(last)) == 2 and last.value == 0.0


def test_a_damaged_state_is_refused_and_changes_nothing(log, twins):
    """Every bit of some bytes of a state is flipped; one is cut off, one is of another unit."""
    draw, others = Random(1), [b"x"]
    for kind, parameters in (("LogPlayer", {"log.path": str(log)}), ("HelicopterPlant", {})):
        unit = Unit(twins[kind]).fresh(parameters)
        unit.step(0.0, 0.01)
        data, before = bytes(unit.slave.serializeFMUstate(unit.slave.getFMUstate())), unit.shown()
        flipped = [*range(45, 90), *(draw.randrange(len(data)) for _ in range(100))]
        for bad in (data[:-1], data[: len(data) // 2], others[-1], *(
            data[:at] + bytes([data[at] ^ (1 << draw.randrange(8))]) + data[at + 1 :] for at in flipped
        )):  # fmt: skip
            with pytest.raises(FMICallException):
                unit.slave.setFMUstate(unit.slave.deSerializeFMUstate(bad))
            assert unit.log.pop()[2].endswith("no state of this unit; nothing was changed") and unit.shown() == before
        unit.restore(unit.slave.deSerializeFMUstate(data))
        assert unit.step(0.01, 0.01) == 0
        others.append(data)


def test_a_state_is_restored_whole_or_not_at_all(log, fmus, twins, tmp_path):
    """Over another log that was read while initialising, and where its own log is gone."""
    script = """
import os
def tried(player, log, other):
    with open(log) as first, open(other, "w") as second:
        second.write(first.read().replace(",.1,", ",.4,"))
    state = player.fresh({"log.path": other}).saved(True)
    player.instantiate().slave.setupExperiment(startTime=0.0)
    player.slave.enterInitializationMode()
    player.set("log.path", log)
    seen = player.get("pitch")
    player.set("log.path", other)
    player.slave.setFMUState(state)
    seen += [player.step(0.0, 0.01), *player.get("pitch")]
    player.fresh({"log.path": log}).step(0.0, 0.01)
    os.remove(other)
    try:
        player.restore(state)
    except Exception as problem:
        assert problem.status == 2
    return seen + player.get("pitch"), player.step(0.01, 0.01), player.log[-1][2]
answer([tried(Unit(path), *sys.argv[3:]) for path in sys.argv[1:3]])
"""
    ours, theirs = run_host(script, fmus["LogPlayer"], twins["LogPlayer"], log, tmp_path / "other.csv")
    assert ours == theirs and ours[:2] == [[0.1, 0, 0.4, 0.1], 0]
    assert "other.csv cannot be read: No such file or directory" in ours[2]


def test_a_long_step_has_the_bits_of_python(fmus, twins):
    script = """
units = [Unit(path).fresh({"method": "prediction_error"}) for path in sys.argv[1:3]]
def step(unit, begin, length, pitch):
    for name, value in {"v_front": 1.0, "v_rear": 0.5, "pitch": pitch, "elevation": 0.1, "travel": 0.3}.items():
        unit.set(name, value)
    return unit.step(begin, length)
shown = []
for unit in units:
    statuses = [step(unit, 0.0, 0.01, 0.0), step(unit, 0.01, 30.0, 0.2), step(unit, 30.01, 1e-3, 0.3)]
    shown.append([statuses, unit.shown()])
answer(shown)
"""
    ours, theirs = run_host(script, fmus["AdaptiveIdentifier"], twins["AdaptiveIdentifier"])
    assert ours == theirs and ours[0] == [0, 0, 0]


@pytest.mark.parametrize("unit", NATIVE_UNITS)
def test_fmpy_finds_no_problem_and_all_variables_are_those_of_the_pythonfmu_unit(fmus, twins, unit):
    assert validate_fmu(str(twins[unit])) == validate_fmu(str(twins[unit, 3])) == []
    assert [text for text in findings(twins[unit]) if "no binary" not in text] == []
    paths = (twins[unit], fmus[unit])
    ours, theirs = (ElementTree.fromstring(read_archive(path)["modelDescription.xml"]) for path in paths)
    for part in ("ModelVariables", "ModelStructure"):
        assert ElementTree.tostring(ours.find(part)) == ElementTree.tostring(theirs.find(part))
    old, (*new, time) = (
        [(v.name, v.valueReference, v.causality, v.variability, v.description, v.unit, v.start) for v in found]
        for found in (read_model_description(path).modelVariables for path in (twins[unit], twins[unit, 3]))
    )
    assert new == old
    assert time[:3] == ("time", len(old), "independent")


def test_sources_and_their_description_are_always_there(tmp_path, twins):
    names = read_archive(twins["PidController"])
    described, root = (
        ElementTree.fromstring(names[name]) for name in ("sources/buildDescription.xml", "modelDescription.xml")
    )
    compiled = [node.get("name") for node in described.iter("SourceFile")]
    assert compiled == [node.get("name") for node in root.iter("File")]
    assert {f"sources/{name}" for name in compiled} <= names.keys()
    assert not [name for name in names if name.endswith(".py")]
    for target in PLATFORMS:
        assert (f"binaries/{target.fmi2}/PidController{target.suffix}" in names) is (find_compiler(target) is not None)
    assert build("PidController", tmp_path, native=True).read_bytes() == twins["PidController"].read_bytes()


def test_a_native_twin_of_a_unit_that_runs_in_python_only_and_an_exchange_but_of_the_plant_are_refused(tmp_path):
    for option in ({"fmi": 3}, {"all_platforms": True}, {"model_exchange": True}, {"fmi": 4, "native": True}):
        with pytest.raises(BuildError, match="belongs to native units|native units exist for FMI 2 and 3"):
            build("HelicopterPlant", tmp_path, **option)
    with pytest.raises(BuildError, match="Corrector runs in Python only"):
        build("Corrector", tmp_path, native=True)
    with pytest.raises(BuildError, match="PidController has no model exchange.*HelicopterPlant has"):
        build("PidController", tmp_path, model_exchange=True, native=True)


def test_without_a_compiler_the_unit_holds_its_sources_and_the_user_is_told_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setattr("fmu_src.native.toolchain.find_compiler", lambda target: None)
    from fmu_src.native import missing_compilers

    unit = build("PidController", tmp_path, native=True)
    assert not [name for name in read_archive(unit) if name.startswith("binaries")]
    said = missing_compilers()
    assert said.startswith("there is no C compiler for linux64 and win64, the units hold sources")
    assert "pip install 'heli-twin[native]'" in said
