"""A host without Python: a C program, built here, with the interpreter's library preloaded."""

import ast
import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import pytest

from fmu_src import UNITS

HOSTS = Path(__file__).parent / "hosts"


@pytest.fixture(scope="module")
def host(tmp_path_factory):
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("this machine has no C compiler")
    program = tmp_path_factory.mktemp("host") / "c_host"
    source = HOSTS / "c_host.c"
    command = [
        compiler,
        "-std=gnu11",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-O1",
        str(source),
        "-o",
        str(program),
        "-ldl",
        "-lm",
    ]
    subprocess.run(command, check=True)
    return program


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "log.csv"
    header = "time [s],v_front [V],v_rear [V],pitch [rad],elevation [rad],travel [rad]\n"
    path.write_text(header + "".join(f"{0.01 * k:.2f},{k},{-k},.1,.2,.3\n" for k in range(100)))
    return path


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
    root = ElementTree.parse(tmp_path / "modelDescription.xml").getroot()
    variables = {v.get("name"): v for v in root.iter("ScalarVariable")}

    def listed(causality):
        # as in bare_host.py: inputs whose range is narrow keep their start values
        found = [
            v.get("valueReference")
            for name, v in variables.items()
            if v.get("causality") == causality and not name.startswith(("correction.", "measured.fresh"))
        ]
        return [str(len(found)), *found]

    text = variables["log.path"].get("valueReference") if "log.path" in variables else "-1"
    done = subprocess.run(
        [
            str(host),
            str(tmp_path / f"binaries/linux64/{unit}.so"),
            (tmp_path / "resources").as_uri(),
            root.get("guid"),
            text,
            str(log),
            *listed("input"),
            *listed("output"),
        ],
        capture_output=True,
        text=True,
        timeout=60,
        env={"PATH": os.environ["PATH"], "LD_PRELOAD": str(libpython()), "PYTHONHOME": sys.base_prefix},
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    bare = subprocess.run(
        [sys.executable, "-I", str(HOSTS / "bare_host.py"), str(log), str(fmus[unit])],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    expected = [float(number) for number in ast.literal_eval(bare.stdout.partition(" ")[2])]
    assert [float(line) for line in done.stdout.split()] == expected
