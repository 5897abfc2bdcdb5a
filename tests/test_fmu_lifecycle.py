"""Every unit under real hosts, each in a process of its own: fmpy, a bare interpreter, C, and other importers. Other
importers agree with the master on a four-unit loop with encoders, dry friction, a reference step and the paper's
excitation. The units are deterministic; what differs between importers is how they form the time k H (integer
nanoseconds, a running sum, a product). A running sum of 10 000 steps is off by up to 1e-10 s; the exciter's chirp moves
by 2.5 V/s."""

import os
import shutil
import socket
import sys
import sysconfig
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from fmpy import extract, read_model_description

from fmu_src import CLOSED_LOOP, OPEN_LOOP, UNITS, build
from fmu_src.master import run_apart
from fmu_src.native import NATIVE_UNITS
from fmu_src.ssp import write_ssp
from heli_plant.parameters import TABLE_2
from heli_plant.simulation import simulate
from heli_plant.state import rest_state
from tests.commands import run_program
from tests.units import HOSTS, c_compiler, compile_c, describe_unit, read_archive, run_host, write_orders


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
        "AdaptiveIdentifier": {"method": "prediction_error", "adaptation.hold_time": 0.2, "report.interval": 0.1},
        "PidController": {"reference.step_pitch": 0.2, "reference.step_time": 0.5, "travel.enabled": True},
        "StateFeedback": {"sample.time": 0.03, "gain.front.pitch": 3.0, "integral.rear.elevation": 2.0},
        "Exciter": {"excitation.experiment": 3},
        "LogPlayer": {"log.path": str(log)},
        "RigLink": {"link.port": free_port()},  # a given one: with 0 every instance shows another
        "Corrector": {"false_alarm.time": 3600.0, "keeping.bandwidth": 7.0},
    }[unit]  # fmt: skip


@pytest.mark.parametrize("unit", UNITS)
def test_what_a_unit_refuses_among_random_calls_has_no_effect_and_its_native_twin_answers_alike(
    fmus, twins, log, tmp_path, unit
):
    """Calls of FMI, allowed and not: no crash, and a second instance gets the accepted calls alone."""
    told = {"parameters": parameters(unit, log), "runs": 25, "calls": 80, "seed": 16}
    order = write_orders(tmp_path, told)
    found = run_host("random_calls.py", fmus[unit], order)
    assert found["wrong"] == []
    assert found["refused"] > 125 and found["accepted"] > 200
    if unit in NATIVE_UNITS:
        assert run_host("random_calls.py", twins[unit], order)["digest"] == found["digest"]


@pytest.fixture(scope="module")
def c_host(tmp_path_factory):
    target = tmp_path_factory.mktemp("host") / "c_host"
    return compile_c(c_compiler(), [HOSTS / "c_host.c"], target, "-O1", "-Wall", "-Wextra", "-Werror")


def embedded(c_host, library, home, fmu, log, folder):
    """What a unit shows after each of 1000 steps in a C program that has an interpreter's library preloaded."""
    extract(fmu, folder)
    log = shutil.copy(log, folder / "läg.csv")  # the interpreter of a C program may take names for ASCII
    binary, resources = folder / f"binaries/linux64/{fmu.stem}.so", (folder / "resources").as_uri()
    guid, text, references = describe_unit(fmu)
    rig = fmu.stem == "RigLink"  # what a rig sent cannot be sent again
    port = next((v.valueReference for v in read_model_description(fmu).modelVariables if v.name == "link.port"), -1)
    environment = {"PATH": os.environ["PATH"], "LD_PRELOAD": str(library), "PYTHONHOME": str(home)}
    words = [c_host, binary, resources, guid, 1000, int(not rig), text, log, port, *references]
    return [float(line) for line in run_program(words, env=environment, cwd=folder).stdout.split()]


@pytest.fixture(scope="module")
def shown_here(c_host, fmus, log, tmp_path_factory):
    """What every unit shows in the C program, by this interpreter."""
    library = Path(sysconfig.get_config_var("LIBDIR") or "", sysconfig.get_config_var("INSTSONAME") or "")
    if not library.is_file() or library.suffix == ".a":
        pytest.skip("this Python has no shared library")
    folder = tmp_path_factory.mktemp("here")
    return {unit: embedded(c_host, library, sys.base_prefix, fmu, log, folder / unit) for unit, fmu in fmus.items()}


@pytest.mark.parametrize(
    "version", ["3.9", *(pytest.param(v, marks=pytest.mark.slow) for v in ("3.10", "3.11", "3.12")), "3.13"]
)
def test_the_units_show_the_same_bits_on_a_bare_interpreter_elsewhere(c_host, fmus, log, shown_here, tmp_path, version):
    """Another working folder, no packages: the vendored sources and the standard library are enough."""
    library = next(Path.home().glob(f".pyenv/versions/{version}.*/lib/libpython{version}.so.1.0"), None)
    if library is None:
        pytest.skip(f"this machine has no Python {version} with a shared library")
    for unit, fmu in fmus.items():
        assert embedded(c_host, library, library.parent.parent, fmu, log, tmp_path / unit) == shown_here[unit], unit


@pytest.mark.parametrize("unit", UNITS)
def test_a_c_host_sees_what_a_python_host_sees_and_survives_a_nan(fmus, shown_here, log, unit):
    """Without Python but for the interpreter's library."""
    program = """
    from math import sin
    count, *references = map(int, sys.argv[3:])
    inputs, outputs = references[:count], references[count + 1 :]
    given = {"log.path": sys.argv[2], "link.port": 0}
    unit, shown = Unit(sys.argv[1]), []
    unit.fresh({name: value for name, value in given.items() if name in unit.variables})
    for k in range(1000):
        fed = [0.01 * k * (i + 1) if k < 50 else 0.4 * sin(0.05 * k * (i + 1)) for i in range(count)]
        unit.slave.setReal(inputs, fed)
        assert unit.step(0.01 * k, 0.01) == 0
        shown += unit.slave.getReal(outputs)
    answer(shown)
    """
    assert run_host(program, fmus[unit], log, *describe_unit(fmus[unit])[2]) == shown_here[unit]


STEPS, STEP = 10_000, 0.01
"""Steps of the comparison and their length [s]."""
PARAMETERS = {
    "plant.encoder.enabled": True,
    "plant.effects.dry_friction.pitch": 0.02,
    "controller.reference.step_pitch": 0.2,
    "exciter.excitation.experiment": 2,
    "identifier.method": "adaptation",  # prediction errors amplify differences of the time to 3e-8
}
AGREEMENT = 1e-9
IMPORTERS = [
    ("libcosimpy", "libcosimpy", "ssp"),
    ("ecos", "ecospy", "ssp"),
    ("fmucontainer", "fmu_manipulation_toolbox", "json"),
    ("fmpy_simulate_fmu", "fmpy", "json"),
]
"""Host, the package that it needs, and what it reads."""


def files_of(wiring, units):
    return {name: str(units[kind]) for name, kind in wiring.units}


@pytest.fixture(scope="module")
def units(request, fmus, twins):
    return {"python": fmus, "native": twins}[request.param]


@pytest.fixture(scope="module")
def ours(units):
    """The master's result."""
    return run_apart(CLOSED_LOOP, STEPS * STEP, STEP, PARAMETERS, files_of(CLOSED_LOOP, units))


@pytest.fixture(scope="module")
def orders(units, ours, tmp_path_factory):
    """The .ssp, and the same system as JSON for those who build it by an API."""
    folder, files = tmp_path_factory.mktemp("order"), files_of(CLOSED_LOOP, units)
    by_unit = CLOSED_LOOP.parameters_by_unit(PARAMETERS)
    np.save(folder / "record.npy", ours.values)
    order = {
        "fmus": files,
        "parameters": {f"{unit}.{name}": value for unit, given in by_unit.items() for name, value in given.items()},
        "connections": [[*out.split(".", 1), *fed.split(".", 1)] for fed, out in CLOSED_LOOP.connections.items()],
        "record": str(folder / "record.npy"),
    }
    ssp = write_ssp(CLOSED_LOOP, folder / "closed_loop.ssp", PARAMETERS, files)
    return {"json": write_orders(folder, order), "ssp": ssp}


def imported(host, order, steps, names, out):
    """Rows 1 .. steps of ``names`` as the importer shows them, shape (steps, len(names))."""
    libraries = os.pathsep.join([str(Path(sys.prefix) / "lib"), os.environ.get("LD_LIBRARY_PATH", "")])
    command = [sys.executable, HOSTS / "importer.py", host, order, steps, STEP, out, *names]
    run_program(command, env={**os.environ, "LD_LIBRARY_PATH": libraries})
    return np.load(out)


@pytest.mark.parametrize(("units", "host", "package", "order"), [
    pytest.param(kind, *one, marks=[pytest.mark.slow] * (kind == "python" or one[0] in ("ecos", "fmucontainer")))
    for kind in ("python", "native") for one in IMPORTERS
], indirect=["units"])  # fmt: skip
def test_an_importer_agrees_with_the_master_over_10000_steps(units, host, package, order, ours, orders, tmp_path):
    if find_spec(package) is None:
        pytest.skip(f"{package} is not installed (extra 'importers')")
    theirs = imported(host, orders[order], STEPS, ours.names, tmp_path / "rows.npy")
    largest = np.abs(theirs - ours.values[1:]).max()
    print(f"{host}: largest difference {largest:.1e} (docs/toolchains.md)")
    assert largest < AGREEMENT


def test_fmpy_ssp_reads_the_file_and_runs_it_but_for_its_first_step(fmus, tmp_path):
    """fmpy.ssp feeds zeros over the first step; apart from that its plant is ours under the same voltages."""
    ssp = write_ssp(OPEN_LOOP, tmp_path / "open_loop.ssp", {"plant.pitch.gain": 0.25}, files_of(OPEN_LOOP, fmus))
    names = ["exciter.v_front", "exciter.v_rear", "plant.pitch", "plant.elevation", "plant.travel"]
    rows = imported("fmpy_ssp", ssp, 1000, names, tmp_path / "rows.npy")
    held = np.vstack([np.zeros(2), rows[:, :2]])
    _, angles = simulate(held, STEP, rest_state(TABLE_2), TABLE_2._replace(k_x=0.25))
    # fmpy.ssp sums up its steps: H/h is 1 to 1e-13, and so is each inner step
    assert np.abs(rows[:, 2:] - angles[1:]).max() < AGREEMENT


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
def test_fmpy_compiles_a_unit_from_its_sources(tmp_path, fmi):
    if shutil.which("cmake") is None:
        pytest.skip("this machine has no cmake, which fmpy compiles with")
    path = build("HelicopterPlant", tmp_path, fmi=fmi, native=True)
    run_program([sys.executable, "-m", "fmpy", "compile", path])
    assert any(name.endswith("HelicopterPlant.so") for name in read_archive(path))
