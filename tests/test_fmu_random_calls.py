"""Random calls of FMI, allowed and not, on every pythonfmu unit: no crash, and what was refused has no effect."""

import json
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from fmu_src import UNITS
from tests.faults.material import good

HOSTS = Path(__file__).parent / "hosts"
PARAMETERS = {
    "HelicopterPlant": {
        "effects.input_delay.rotors": 0.03,
        "effects.dry_friction.pitch": 0.02,
        "encoder.enabled": True,
    },
    "FollowingPlant": {"effects.input_delay.rotors": 0.03},
    "AdaptiveIdentifier": {"method": "prediction_error", "watch.pitch": "dry_friction", "report.interval": 0.05},
    "PidController": {"travel.enabled": True},
    "StateFeedback": {"travel.enabled": True, "gain.front.pitch": 3.0, "integral.rear.elevation": 2.0},
    "Exciter": {"excitation.experiment": 3},
    "LogPlayer": {"log.path": "log.csv"},
    "RigLink": {},
    "Corrector": {"keeping.bandwidth": 6.6},
}


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


@pytest.mark.parametrize("unit", UNITS)
def test_what_a_unit_refuses_among_random_calls_has_no_effect(tmp_path, fmus, unit):
    good(tmp_path)
    parameters = PARAMETERS[unit]
    if unit == "RigLink":
        parameters = {"link.port": free_port()}  # a given one: with 0 every instance shows another
    order = {"parameters": parameters, "runs": 25, "calls": 80, "seed": 16}
    (tmp_path / "order.json").write_text(json.dumps(order))
    done = subprocess.run(
        [sys.executable, str(HOSTS / "random_calls.py"), str(fmus[unit]), "order.json"],
        cwd=tmp_path, capture_output=True, text=True, timeout=600, check=False,
        env={**os.environ, "PYTHONPATH": str(HOSTS)},
    )  # fmt: skip
    assert done.returncode == 0, f"the host ended with {done.returncode}: {done.stderr[-2000:]}"
    found = json.loads(done.stdout.strip().splitlines()[-1])
    assert found["wrong"] == []
    assert found["refused"] > 125
    assert found["accepted"] > 200
