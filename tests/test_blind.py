"""The blind rigs: independent of the code that they test, the same as when their batteries ran, and right physics."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.blind import judge_row
from heli_plant.parameters import TABLE_2
from heli_plant.simulation import simulate
from heli_plant.state import start_state
from tests.blind.coefficients import Coefficients
from tests.blind.generator import make_rig
from tests.blind.plant import STEP, fly
from tests.blind.signals import SAMPLE, square_and_chirp
from tests.blind.windy import windy_rig
from tests.commands import run_python

HERE = Path(__file__).parent
DEMO = HERE.parent / "heli_identifier" / "demo_logs"


def test_generator_imports_nothing_of_the_code_that_it_tests():
    modules = ", ".join(f"tests.blind.{path.stem}" for path in (HERE / "blind").glob("[a-z]*.py"))
    program = f"import sys, {modules}; print(sorted({{name.partition('.')[0] for name in sys.modules}}))"
    printed = run_python(program, cwd=HERE.parent).stdout
    assert "numba" in printed
    assert not any(package in printed for package in ("heli_plant", "heli_identifier", "fmu_src"))


def made(seed, *kind):
    rig = make_rig(seed, *kind)
    return np.vstack((*rig.train, rig.held))[:, 1:]


def windy(colour):
    log = windy_rig(5, colour, counts={"a": 1}).logs["a1"]
    return np.hstack((log.voltages, log.angles))


RIGS = {
    "of the model": (lambda: made(5), (1.183960, 1.203480, 0.277274, 0.243974, 11.468840)),
    "with two effects": (lambda: made(7, "dry_friction:pitch+quadratic_drag:travel"),
                         (1.183960, 1.203480, 0.235084, 0.180235, 12.111438)),
    "with an unknown torque": (lambda: made(8, "unknown:periodic"),
                               (1.183960, 1.203480, 0.477965, 0.189504, 12.729044)),
    "in gusts": (lambda: windy("ou"), (1.789204, 1.385503, 0.0952132, 0.253930, 0.507739)),
    "in swirls": (lambda: windy("swirl"), (1.804359, 1.345420, 0.0962934, 0.254417, 0.196911)),
}  # fmt: skip
"""Rigs, and the root mean squares of their voltages [V] and angles [rad] when the published batteries ran."""


@pytest.mark.parametrize("rig", RIGS)
def test_rigs_are_those_of_the_published_batteries(rig):
    """A count of an encoder may round otherwise on another machine: 1.5e-3 rad in some of 9000 samples."""
    make, expected = RIGS[rig]
    assert np.sqrt(np.mean(make() ** 2, axis=0)) == pytest.approx(expected, rel=1e-4)


def test_base_model_agrees_with_the_plant_on_the_training_signal_which_is_that_of_the_measured_logs():
    """To a hundredth of a count, which is negligible beside the encoder; test_plant.py holds the plant to scipy."""
    for name, slowness in (("train1", 1.0), ("train2", 2.0)):
        measured = np.loadtxt(DEMO / "rig-c" / f"{name}.csv", delimiter=",", skiprows=1)
        assert np.array_equal(measured[:, 1:3], square_and_chirp(90.0, slowness))
    voltages = square_and_chirp(20.0, 1.0)
    start = (TABLE_2.theta0 + 0.02, 0.2, 0.0)
    still = np.zeros((round(len(voltages) * SAMPLE / STEP), 3))
    angles = fly(voltages, np.array(start), Coefficients(), still, np.zeros((len(voltages), 3)))[1]
    expected = simulate(voltages, SAMPLE, start_state(*start, *voltages[0]), TABLE_2)[1]
    assert np.abs(angles - expected).max() < 2 * np.pi / 8192 / 100


FRICTION = {"a_wx": 0.060, "dry_friction pitch": 0.02}
AIRSPEED = {"airspeed_thrust_loss pitch": 0.03, "airspeed_thrust_loss elevation": 0.03}
DETENT = {"unknown pitch": None}


def judged(truth, *entries, **parameters):
    effects = [{"name": name, "axis": axis, "coefficient": estimate} for name, axis, estimate in entries]
    return judge_row({"effects": effects, "parameters_after": parameters}, truth)


@pytest.mark.parametrize("truth, effects, every, false", [
    (FRICTION, [("dry_friction", "travel")], False, ["dry_friction travel"]),
    (FRICTION, [("motor_lag", "rotors"), ("dry_friction", "pitch")], True, ["motor_lag rotors"]),
    # an effect that acts on two axes is true on both and named by either
    (AIRSPEED, [("airspeed_thrust_loss", "pitch")], True, []),
    # an unknown effect is an accusation on a rig without one, and true on its own axis alone
    ({}, [("unknown", "pitch")], True, ["unknown pitch"]),
    (DETENT, [("unknown", "pitch")], True, []),
    (DETENT, [("unknown", "travel")], False, ["unknown travel"]),
])  # fmt: skip
def test_entries_are_judged_against_the_truth(truth, effects, every, false):
    own = judged(truth, *((*entry, None) for entry in effects))
    assert (own["named"], own["false"]) == (every, false)


def test_intervals_of_1_96_standard_errors_are_counted_where_the_truth_is_known():
    near, far = ({"value": v, "standard_error": 1e-3, "unit": "1"} for v in (0.02 + 1.9e-3, 0.060 + 2.0e-3))
    found = judged(FRICTION, ("dry_friction", "pitch", near), a_wx=far)
    assert found["covered"] == {"dry_friction pitch": True, "a_wx": False}
    assert judged({"ground_effect elevation": None}, ("ground_effect", "elevation", near), a_wx=far)["covered"] == {}
