"""Every unit under a real host: each test runs the real binary in a process of its own."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from fmu_src import UNITS, build, unit_class
from fmu_src.native import NATIVE_UNITS, build_native
from tests.native_builds import needs_a_compiler

LOG_ROWS = 400
SAVED = [unit for unit in UNITS if unit_class(unit).saves_state]
"""Units that depend on nothing outside; test_fmu_rig_link.py tests the life of the one that does."""


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A log of 4 s in which every signal moves."""
    path = tmp_path_factory.mktemp("log") / "log.csv"
    rows = ["time [s],v_front [V],v_rear [V],pitch [rad],elevation [rad],travel [rad]"]
    for k in range(LOG_ROWS):
        t = 0.01 * k
        rows.append(f"{t:.2f},{1 + t / 7},{1 - t / 9},{t / 11},{-t / 13},{t * t / 17}")
    path.write_text("\n".join(rows) + "\n")
    return path


def parameters(unit, log):
    """Parameters under which a unit has hidden state to lose: delay, bending, multisine, a reference step."""
    return {
        "HelicopterPlant": {
            "effects.input_delay.rotors": 0.034,
            "effects.arm_bending.elevation": 0.02,
            "effects.dry_friction.pitch": 0.02,
            "encoder.enabled": True,
            "solver.step": 0.004,
        },
        "FollowingPlant": {"effects.input_delay.rotors": 0.034},
        "AdaptiveIdentifier": {"adaptation.hold_time": 0.2, "report.interval": 0.1},
        "PidController": {"reference.step_pitch": 0.2, "reference.step_time": 0.5},
        "StateFeedback": {"sample.time": 0.03, "gain.front.pitch": 3.0, "integral.rear.elevation": 2.0},
        "Exciter": {"excitation.experiment": 2},
        "LogPlayer": {"log.path": str(log)},
        "RigLink": {"link.port": 0},
        "Corrector": {"window": 4.0},
    }[unit]


DRIVE = """
import json
unit, parameters = Unit(sys.argv[1]), json.loads(sys.argv[2])
inputs = [v.name for v in unit.description.modelVariables if v.causality == "input"]
# a friction never pushes, and samples come in
inputs = [name for name in inputs if not name.startswith("correction.effects.") and not name.endswith("fresh")]
STEPS = (0.01, 0.013, 0.002, 0.025)

def drive(first, last):
    '''Step with inputs and steps that keep changing; returns what was shown.'''
    seen = []
    for k in range(first, last):
        time = sum(STEPS[i % 4] for i in range(k))
        for i, name in enumerate(inputs):
            unit.set(name, 0.3 * ((k * (i + 2)) % 7 - 3) / 3)
        assert unit.step(time, STEPS[k % 4]) == 0, unit.log
        seen.append(unit.shown())
    return seen
"""


@pytest.mark.parametrize(
    "unit", [pytest.param(u, marks=[] if u == "HelicopterPlant" else [pytest.mark.slow]) for u in SAVED]
)
def test_a_hundred_instances_one_after_another_give_the_same(fmus, in_host, log, unit):
    same = in_host(
        DRIVE
        + """
seen = []
for k in range(100):
    unit.fresh(parameters)
    seen.append(drive(0, 3))
    unit.free()
answer(all(one == seen[0] for one in seen))
""",
        fmus[unit],
        json.dumps(parameters(unit, log)),
    )
    assert same


@pytest.mark.parametrize("unit", SAVED)
def test_a_rollback_repeats_bit_for_bit_in_place_and_through_bytes_into_a_new_instance(fmus, in_host, log, unit):
    seen = in_host(
        DRIVE
        + """
unit.fresh(parameters)
drive(0, 60)
state = unit.slave.getFMUState()
raw = unit.slave.serializeFMUstate(state)
first = drive(60, 120)
unit.slave.setFMUState(state)
again = drive(60, 120)
unit.slave.freeFMUState(state)
unit.free()
unit.fresh(parameters)
other = unit.slave.deSerializeFMUstate(raw)
unit.slave.setFMUState(other)
through_bytes = drive(60, 120)
answer([first == again, first == through_bytes, first[0] != first[-1], unit.log])
""",
        fmus[unit],
        json.dumps(parameters(unit, log)),
    )
    assert seen == [True, True, True, []]


@pytest.mark.parametrize("unit", SAVED)
def test_reset_starts_anew_and_two_instances_do_not_disturb_each_other(fmus, in_host, log, unit):
    same = in_host(
        DRIVE
        + """
unit.fresh(parameters)
first = drive(0, 40)
unit.slave.reset()
unit.start(parameters)
after_reset = drive(0, 40)
alone = unit
other = Unit(sys.argv[1]).fresh(parameters)
alone.slave.reset()
alone.start(parameters)
interleaved = []
for k in range(40):
    unit = alone
    interleaved += drive(k, k + 1)
    unit = other
    drive(k, k + 1)
answer([first == after_reset, first == interleaved])
""",
        fmus[unit],
        json.dumps(parameters(unit, log)),
    )
    assert same == [True, True]


@pytest.mark.parametrize("unit", ["HelicopterPlant", "AdaptiveIdentifier"])
def test_a_nan_input_is_discarded_with_its_name_and_the_unit_lives_on(fmus, in_host, log, unit):
    statuses, texts = in_host(
        DRIVE
        + """
unit.fresh(parameters)
before = drive(0, 5)
unit.set(inputs[0], float("nan"))
bad = [unit.step(0.06, 0.01), unit.step(0.06, 0.01), unit.step(0.06, 0.01)]
same = unit.shown() == before[-1]
unit.set(inputs[0], 0.1)
good = unit.step(0.06, 0.01)
answer([[bad, same, good], [[s, c, m] for s, c, m in unit.log]])
""",
        fmus[unit],
        json.dumps(parameters(unit, log)),
    )
    assert statuses == [[2, 2, 2], True, 0]
    assert all(status == 2 and category == "logStatusDiscard" and "= nan" in text for status, category, text in texts)


def test_two_builds_of_the_plant_in_one_process_keep_their_own_parameters(fmus, in_host, tmp_path):
    other = build("HelicopterPlant", tmp_path, {"pitch.gain": 0.586})
    first, second = in_host(
        """
a, b = Unit(sys.argv[1]).fresh(), Unit(sys.argv[2]).fresh()
for unit in (a, b):
    unit.set("v_front", 1.0)
    unit.set("v_rear", 0.5)
    for k in range(10):
        unit.step(0.01 * k, 0.01)
answer([a.get("pitch_rate", "pitch.gain"), b.get("pitch_rate", "pitch.gain")])
""",
        fmus["HelicopterPlant"],
        other,
    )
    assert (first[1], second[1]) == (0.293, 0.586)
    # over .1 s from rest gravity's share is (a_th t^2/2 = .3 %) of the rotors': twice the gain is twice the rate
    assert second[0] == pytest.approx(2.0 * first[0], rel=0.01)


def test_all_units_run_side_by_side_in_one_process(fmus, in_host, log):
    statuses = in_host(
        """
import json
units = [Unit(path) for path in sys.argv[2:]]
given = {"log.path": sys.argv[1], "link.port": 0}
for unit in units:
    unit.fresh({name: value for name, value in given.items() if name in unit.variables})
answer([unit.step(0.01 * k, 0.01) for k in range(20) for unit in units])
""",
        log,
        *fmus.values(),
    )
    assert statuses == [0] * 20 * len(UNITS)


def digests(python, log, fmus, folder):
    """What every unit shows after each of 1000 steps in a bare interpreter, as a digest by its name."""
    script = Path(__file__).parent / "hosts" / "bare_host.py"
    done = subprocess.run(
        [str(python), "-I", str(script), "--steps", "1000", str(log), *map(str, fmus.values())],
        capture_output=True, text=True, timeout=300, cwd=folder, env={"PATH": os.environ["PATH"]}, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout.splitlines()


@pytest.fixture(scope="module")
def digests_here(fmus, log, tmp_path_factory):
    return digests(sys.executable, log, fmus, tmp_path_factory.mktemp("here"))


@pytest.mark.parametrize(
    "version",
    ["3.9", *(pytest.param(v, marks=pytest.mark.slow) for v in ("3.10", "3.11", "3.12")), "3.13"],
)
def test_the_units_show_the_same_bits_on_a_bare_interpreter_elsewhere(fmus, log, digests_here, tmp_path, version):
    """No site packages, another working directory: the vendored sources and the standard library are enough."""
    candidates = [
        *Path.home().glob(f".pyenv/versions/{version}.*/bin/python{version}"),
        Path(f"/usr/bin/python{version}"),
    ]
    python = next((path for path in candidates if path.is_file()), None)
    if python is None:
        pytest.skip(f"this machine has no Python {version}")
    assert digests(python, log, fmus, tmp_path) == digests_here


@pytest.mark.slow
def test_the_native_twins_show_the_bits_of_the_bare_interpreters(log, digests_here, tmp_path):
    needs_a_compiler()
    twins = {unit: build_native(unit, tmp_path) for unit in NATIVE_UNITS}
    assert digests(sys.executable, log, twins, tmp_path) == [
        line for line in digests_here if line.split()[0] in NATIVE_UNITS
    ]


@pytest.mark.parametrize("unit", ["HelicopterPlant", "AdaptiveIdentifier"])
def test_time_that_repeats_or_jumps_is_discarded_and_the_unit_lives_on(fmus, in_host, log, unit):
    bad, same, good, said = in_host(
        DRIVE
        + """
unit.fresh(parameters)
before = drive(0, 5)
bad = [unit.step(0.05, 0.01), unit.step(0.0, 0.01), unit.step(7.0, 0.01), unit.step(-1.0, 0.01)]
same = unit.shown() == before[-1]
good = unit.step(0.06, 0.01)
answer([bad, same, good, [m for s, c, m in unit.log]])
""",
        fmus[unit],
        json.dumps(parameters(unit, log)),
    )
    assert (bad, same, good) == ([2, 2, 2, 2], True, 0)
    assert all("time must neither repeat nor jump" in text for text in said)


@pytest.mark.parametrize("unit", ["HelicopterPlant", "AdaptiveIdentifier"])
def test_a_step_of_days_is_discarded_at_once(fmus, in_host, log, unit):
    bad, said = in_host(
        DRIVE
        + """
unit.fresh(parameters)
drive(0, 5)
bad = [unit.step(0.06, 1e6)]
if bad == [0]:  # the identifier takes its samples with the step after
    bad = [unit.step(0.06 + 1e6, 0.01)]
answer([bad, [m for s, c, m in unit.log]])
""",
        fmus[unit],
        json.dumps(parameters(unit, log)),
    )
    assert bad == [2]
    assert "at most 100000 are taken" in said[-1]
