"""What the tests of units share: a class driven by names, compilers, translated functions, lockstep, hosts in C."""

import ctypes
import json
import os
import shutil
import sys
import zipfile
from importlib.resources import files
from pathlib import Path
from textwrap import dedent

import pytest
from fmpy import read_model_description

from fmu_src import build
from fmu_src.native.toolchain import LINUX, find_compiler
from fmu_src.native.translator.program import header, source
from tests.commands import ran

HOSTS = Path(__file__).parent / "hosts"
LIBRARY = ("-std=c99", "-O2", "-Wall", "-Werror", "-ffp-contract=off", "-shared", "-fPIC")
RUNTIME = files("fmu_src.native").joinpath("c")


def c_compiler(own=False):
    """The command of a C compiler for this machine, its ``own`` or any one, or the test is skipped."""
    command = shutil.which("gcc") or shutil.which("cc")
    found = [command] if command else None if own else find_compiler(LINUX)
    if found is None:
        pytest.skip("this machine has no C compiler (extra 'native')")
    return found


def needs_a_compiler(target=LINUX):
    if find_compiler(target) is None:
        pytest.skip(f"this machine has no C compiler for {target.fmi2} (extra 'native')")


def library(folder, translation):
    """Translated functions, compiled and loaded."""
    (folder / "model.h").write_text(header(translation))
    (folder / "model.c").write_text(source(translation))
    sources, flags = (folder / "model.c", RUNTIME / "memory.c"), (*LIBRARY, "-Wextra", "-Wno-unused-parameter")
    return ctypes.CDLL(str(compiled(c_compiler(), sources, folder / "model.so", *flags, f"-I{RUNTIME}")))


def host(program, *arguments):
    """Give the answer of a host, a process of its own: a program of the folder ``hosts``, or the text of one."""
    text = ["-c", "import sys\nfrom unit_host import Unit, answer\n" + dedent(program)]
    command = [sys.executable, *([HOSTS / program] if program.endswith(".py") else text), *arguments]
    done = ran(command, env={**os.environ, "PYTHONPATH": str(HOSTS)})
    return json.loads(done.stdout.strip().splitlines()[-1])


def entries(archive):
    """Contents of an archive, by name."""
    with zipfile.ZipFile(archive) as opened:
        return {name: opened.read(name) for name in opened.namelist()}


def written_orders(folder, orders):
    """Write what a host is ordered to do."""
    (folder / "order.json").write_text(json.dumps(orders))
    return folder / "order.json"


class Twins(dict):
    """Native units by (name, version of FMI), each built when it is first asked for; "X" is that of Model Exchange."""

    def __init__(self, folder):
        super().__init__()
        self.folder = folder

    def __missing__(self, key):
        unit, fmi, *exchange = key if isinstance(key, tuple) else (key, 2)
        needs_a_compiler()
        folder = self.folder / "".join(map(str, key))
        self[key] = build(unit, folder, native=True, fmi=fmi, model_exchange=bool(exchange))
        return self[key]


def compiled(command, sources, target, *flags):
    """Compile a program or library; warnings count if the flags say so."""
    libraries = [] if target.suffix == ".exe" else ["-ldl", "-lm"]
    ran([*command, "-std=gnu11", *flags, *sources, "-o", target, *libraries])
    return target


def described(unit):
    """GUID, reference of the log's path or -1, and the references of inputs and outputs behind their number.

    Inputs whose range is narrow, or that say that a sample is there, keep their start values; a port is never the same.
    """
    description = read_model_description(str(unit))
    kept = {"input": ("correction.", "excitation.", "score.", "fresh", "measured.fresh"), "output": ("port",)}

    def listed(causality):
        found = [v for v in description.modelVariables if v.causality == causality]
        found = [v.valueReference for v in found if not v.name.startswith(kept[causality])]
        return [len(found), *found]

    text = next((v.valueReference for v in description.modelVariables if v.name == "log.path"), -1)
    return description.guid, text, [*listed("input"), *listed("output")]


def initialised(kind, parameters=None):
    """A unit behind its initialisation, whether that went well or not."""
    unit = kind(instance_name="unit", resources="")
    for name, value in (parameters or {}).items():
        put(unit, name, value)
    unit.setup_experiment(0.0)
    unit.enter_initialization_mode()
    unit.exit_initialization_mode()
    return unit


def put(unit, name, value):
    reference = unit.references[name]
    getattr(unit, f"set_{unit.variables[reference].type.lower()}")([reference], [value])


def got(unit, *names):
    return unit.get_real([unit.references[name] for name in names])
