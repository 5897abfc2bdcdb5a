"""A native unit refuses the steps that its pythonfmu twin refuses, with the same words, and is the same afterwards."""

import pytest

from fmu_src.native import NATIVE_UNITS, build_native
from tests.c_hosts import written_log
from tests.native_builds import lockstep, needs_a_compiler

ANGLES = {"pitch": [-0.6, 0.6], "elevation": [-0.5, 0.5], "travel": [-1.0, 3.0]}
VOLTAGES = {"v_front": [-5.0, 6.0], "v_rear": [-5.0, 6.0]}
KEEPING = {
    "measured.pitch": [-0.6, 0.6],
    "measured.fresh": [0.0, 1.0],
    "observer.bandwidth": [-5.0, 10.0],
    "correction.pitch.gain": [-0.1, 0.1],
    "correction.effects.dry_friction.pitch": [-0.01, 0.1],  # below 0 a step is refused
    "correction.rotor.rear": [-0.4, 0.0],
}
ORDERS = {
    "HelicopterPlant": ({"effects.input_delay.rotors": 0.03, "solver.step": 0.005}, {**VOLTAGES, **KEEPING}),
    "AdaptiveIdentifier": ({"watch.pitch": "dry_friction", "report.interval": 0.05}, {**VOLTAGES, **ANGLES}),
    "PidController": ({"travel.enabled": True}, ANGLES),
    "Exciter": ({"excitation.experiment": 2}, {}),
    "LogPlayer": ({}, {}),
}
CALLS = 3000


@pytest.fixture(scope="module")
def twins(tmp_path_factory):
    needs_a_compiler()
    folder = tmp_path_factory.mktemp("native")
    return {unit: build_native(unit, folder) for unit in NATIVE_UNITS}


@pytest.mark.parametrize("unit", NATIVE_UNITS)
def test_random_calls_allowed_and_not_find_no_difference(tmp_path, fmus, twins, unit):
    parameters, inputs = ORDERS[unit]
    if unit == "LogPlayer":
        parameters = {"log.path": str(written_log(tmp_path))}
    run = lockstep(
        tmp_path, fmus[unit], twins[unit], program="lawless_lockstep.py", parameters=parameters, inputs=inputs,
        calls=CALLS, seed=8, step=0.01,
    )  # fmt: skip
    assert run["count"] == 0, run["different"]
    assert run["refused"] > 100
