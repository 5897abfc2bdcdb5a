"""A host without Python: a C program, built here, with the interpreter's library preloaded."""

import ast
import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

from fmu_src import UNITS
from tests.c_hosts import HOSTS, compiled, described, written_log


@pytest.fixture(scope="module")
def host(tmp_path_factory):
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("this machine has no C compiler")
    target = tmp_path_factory.mktemp("host") / "c_host"
    return compiled([compiler], [HOSTS / "c_host.c"], target, "-O1", "-Wall", "-Wextra", "-Werror")


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return written_log(tmp_path_factory.mktemp("log"))


def libpython():
    folder, name = sysconfig.get_config_var("LIBDIR"), sysconfig.get_config_var("INSTSONAME")
    path = Path(folder or "", name or "")
    if not path.is_file() or path.suffix == ".a":
        pytest.skip("this Python has no shared library")
    return path


@pytest.mark.parametrize("unit", [unit for unit in UNITS if unit not in ("RigLink", "Corrector")])
def test_a_c_host_sees_what_a_python_host_sees_and_survives_a_nan(fmus, host, log, tmp_path, unit):
    with zipfile.ZipFile(fmus[unit]) as archive:
        archive.extractall(tmp_path)
    guid, text, references = described(tmp_path)
    done = subprocess.run(
        [
            str(host),
            str(tmp_path / f"binaries/linux64/{unit}.so"),
            (tmp_path / "resources").as_uri(),
            guid,
            text,
            str(log),
            *references,
        ],
        capture_output=True,
        text=True,
        timeout=300,
        env={"PATH": os.environ["PATH"], "LD_PRELOAD": str(libpython()), "PYTHONHOME": sys.base_prefix},
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    bare = subprocess.run(
        [sys.executable, "-I", str(HOSTS / "bare_host.py"), str(log), str(fmus[unit])],
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
    )
    expected = [float(number) for number in ast.literal_eval(bare.stdout.partition(" ")[2])]
    assert [float(line) for line in done.stdout.split()] == expected
