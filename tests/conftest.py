"""Fixtures that several test files share: built units, compiled once, and signals that reach commands."""

import os
import signal
from hashlib import sha256

import pytest

from heli_identifier.files import write_atomically

# Matrices here are small, and logs are simulated on all cores already: threads of the linear algebra would only slow
# each other down, fivefold on two cores. NumPy reads the variables when it is loaded, which no line above does.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")


def pytest_configure(config):
    from hypothesis import HealthCheck, settings

    # a busy machine must not fail a test: examples have no deadline, and may be made slowly; `make test` tries half
    count = 50 if config.option.markexpr == "not slow" else 100
    patient = {"deadline": None, "suppress_health_check": [HealthCheck.too_slow]}
    settings.register_profile("patient", max_examples=count, **patient)
    settings.load_profile("patient")


@pytest.fixture
def interruptible():
    """Let commands receive SIGINT and SIGHUP, which they would ignore in the background and under nohup."""
    before = {signal.SIGINT: signal.signal(signal.SIGINT, signal.default_int_handler)}
    if hasattr(signal, "SIGHUP"):
        before[signal.SIGHUP] = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture(scope="session")
def fmus(tmp_path_factory):
    """Every unit, built once with its default parameters: a dict of paths by unit name."""
    from fmu_src import build_all

    return build_all(tmp_path_factory.mktemp("fmus"))


@pytest.fixture(scope="session")
def twins(tmp_path_factory):
    """Native units by name, or by name and version of FMI, built when they are first used."""
    from tests.units import Twins

    return Twins(tmp_path_factory.mktemp("native"))


@pytest.fixture(scope="session")
def log(tmp_path_factory):
    """A log of 1 s for the LogPlayer, in which every voltage moves."""
    path = tmp_path_factory.mktemp("log") / "log.csv"
    header = "time [s],v_front [V],v_rear [V],pitch [rad],elevation [rad],travel [rad]\n"
    path.write_text(header + "".join(f"{0.01 * k:.2f},{k},{-k},.1,.2,.3\n" for k in range(100)))
    return path


@pytest.fixture(scope="session", autouse=True)
def compiled_once(tmp_path_factory):
    """Compile a native library once for all workers: the tests build the same units over and over."""
    from fmu_src.native import toolchain

    folder = tmp_path_factory.getbasetemp()
    folder = (folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder) / "compiled"
    folder.mkdir(exist_ok=True)
    compile_library = toolchain.compile_library

    def compile_once(sources, target, library):
        path = folder / sha256(repr((sorted(sources.items()), target, library)).encode()).hexdigest()
        if not path.exists():
            write_atomically(path, compile_library(sources, target, library))
        return path.read_bytes()

    toolchain.compile_library = compile_once
    yield
    toolchain.compile_library = compile_library
