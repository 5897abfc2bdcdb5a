"""Every unit under real hosts, each in a process of its own: one with fmpy, a bare interpreter, a program in C."""

import ast
import os
import socket
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

from fmu_src import UNITS, build
from fmu_src.native import NATIVE_UNITS
from tests.units import HOSTS, c_compiler, compiled, described, host, written_orders


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def parameters(unit, log):
    """Parameters under which a unit has hidden state to lose: delay, bending, multisine, a reference step."""
    return {
        "HelicopterPlant": {
            "effects.input_delay.rotors": 0.034, "effects.arm_bending.elevation": 0.02,
            "effects.dry_friction.pitch": 0.02, "encoder.enabled": True, "solver.step": 0.004,
        },
        "FollowingPlant": {"effects.input_delay.rotors": 0.034},
        "AdaptiveIdentifier": {
            "method": "prediction_error", "adaptation.hold_time": 0.2, "report.interval": 0.1,
        },
        "PidController": {"reference.step_pitch": 0.2, "reference.step_time": 0.5, "travel.enabled": True},
        "StateFeedback": {"sample.time": 0.03, "gain.front.pitch": 3.0, "integral.rear.elevation": 2.0},
        "Exciter": {"excitation.experiment": 3},
        "LogPlayer": {"log.path": str(log)},
        "RigLink": {"link.port": free_port()},  # a given one: with 0 every instance shows another
        "Corrector": {"window": 4.0, "keeping.bandwidth": 7.0},
    }[unit]  # fmt: skip


def test_two_builds_of_the_plant_in_one_process_keep_their_own_parameters(fmus, tmp_path):
    other = build("HelicopterPlant", tmp_path, {"pitch.gain": 0.586})
    first, second = host(
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


@pytest.mark.parametrize("unit", UNITS)
def test_what_a_unit_refuses_among_random_calls_has_no_effect_and_its_native_twin_answers_alike(
    fmus, twins, log, tmp_path, unit
):
    """Calls of FMI, allowed and not: no crash, and a second instance gets the accepted calls alone."""
    told = {"parameters": parameters(unit, log), "runs": 25, "calls": 80, "seed": 16}
    order = written_orders(tmp_path, told)
    found = host("random_calls.py", fmus[unit], order)
    assert found["wrong"] == []
    assert found["refused"] > 125
    assert found["accepted"] > 200
    if unit in NATIVE_UNITS:
        assert host("random_calls.py", twins[unit], order)["digest"] == found["digest"]


def bare(python, log, fmus, folder, *options):
    """What units show in an interpreter without site packages, a line each."""
    done = subprocess.run(
        [str(python), "-I", str(HOSTS / "bare_host.py"), *options, str(log), *map(str, fmus)],
        capture_output=True, text=True, timeout=300, cwd=folder, env={"PATH": os.environ["PATH"]}, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout.splitlines()


@pytest.fixture(scope="module")
def digests_here(fmus, log, tmp_path_factory):
    """What every unit shows after each of 1000 steps, as a digest behind its name."""
    return bare(sys.executable, log, fmus.values(), tmp_path_factory.mktemp("here"), "--steps", "1000")


@pytest.mark.parametrize(
    "version",
    ["3.9", *(pytest.param(v, marks=pytest.mark.slow) for v in ("3.10", "3.11", "3.12")), "3.13"],
)
def test_the_units_show_the_same_bits_on_a_bare_interpreter_elsewhere(fmus, log, digests_here, tmp_path, version):
    """No site packages, another working directory: the vendored sources and the standard library are enough."""
    here = Path.home().glob(f".pyenv/versions/{version}.*/bin/python{version}")
    candidates = [*here, Path(f"/usr/bin/python{version}")]
    python = next((path for path in candidates if path.is_file()), None)
    if python is None:
        pytest.skip(f"this machine has no Python {version}")
    assert bare(python, log, fmus.values(), tmp_path, "--steps", "1000") == digests_here


@pytest.fixture(scope="module")
def c_host(tmp_path_factory):
    target = tmp_path_factory.mktemp("host") / "c_host"
    return compiled(c_compiler(), [HOSTS / "c_host.c"], target, "-O1", "-Wall", "-Wextra", "-Werror")


@pytest.mark.parametrize("unit", [unit for unit in UNITS if unit not in ("RigLink", "Corrector")])
def test_a_c_host_sees_what_a_python_host_sees_and_survives_a_nan(fmus, c_host, log, tmp_path, unit):
    """Without Python but for the interpreter's library, which is preloaded."""
    library = Path(sysconfig.get_config_var("LIBDIR") or "", sysconfig.get_config_var("INSTSONAME") or "")
    if not library.is_file() or library.suffix == ".a":
        pytest.skip("this Python has no shared library")
    with zipfile.ZipFile(fmus[unit]) as archive:
        archive.extractall(tmp_path)
    guid, text, references = described(tmp_path)
    binary, resources = tmp_path / f"binaries/linux64/{unit}.so", (tmp_path / "resources").as_uri()
    done = subprocess.run(
        [str(c_host), str(binary), resources, guid, text, str(log), *references],
        capture_output=True, text=True, timeout=300, check=False,
        env={"PATH": os.environ["PATH"], "LD_PRELOAD": str(library), "PYTHONHOME": sys.base_prefix},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    (shown,) = bare(sys.executable, log, [fmus[unit]], tmp_path)
    expected = [float(number) for number in ast.literal_eval(shown.partition(" ")[2])]
    assert [float(line) for line in done.stdout.split()] == expected
