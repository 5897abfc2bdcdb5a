"""Helpers for the tests of units: access by names, compilers, translated functions, hosts in other processes."""

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
from fmu_src.native.translator.program import functions, header
from tests.commands import run_program

HOSTS = Path(__file__).parent / "hosts"
LIBRARY = ("-std=c99", "-O2", "-Wall", "-Werror", "-ffp-contract=off", "-shared", "-fPIC")
RUNTIME = files("fmu_src.native").joinpath("c")


def c_compiler(own=False):
    """Return the command of a C compiler, only that of the machine if ``own``; skip the test if there is none."""
    path = shutil.which("gcc") or shutil.which("cc")
    command = [path] if path else None if own else find_compiler(LINUX)
    if command is None:
        pytest.skip("this machine has no C compiler (extra 'native')")
    return command


def require_compiler(target=LINUX):
    if find_compiler(target) is None:
        pytest.skip(f"this machine has no C compiler for {target.fmi2} (extra 'native')")


def load_library(folder, translation):
    """Compile translated functions and load them."""
    (folder / "model.h").write_text(header(translation))
    (folder / "model.c").write_text(f'#include "model.h"\n{functions(translation)}')
    sources, flags = (folder / "model.c", RUNTIME / "memory.c"), (*LIBRARY, "-Wextra", "-Wno-unused-parameter")
    return ctypes.CDLL(str(compile_c(c_compiler(), sources, folder / "model.so", *flags, f"-I{RUNTIME}")))


def run_host(program, *arguments):
    """Return the answer of a host in a process of its own: a ``program`` of the folder ``hosts``, or its text."""
    text = ["-c", "import sys\nfrom unit_host import Unit, answer\n" + dedent(program)]
    command = [sys.executable, *([HOSTS / program] if program.endswith(".py") else text), *arguments]
    result = run_program(command, env={**os.environ, "PYTHONPATH": str(HOSTS)})
    return json.loads(result.stdout.strip().splitlines()[-1])


def read_archive(archive):
    """Contents of an archive, by name."""
    with zipfile.ZipFile(archive) as opened:
        return {name: opened.read(name) for name in opened.namelist()}


def write_orders(folder, orders):
    """Write the orders of a host; return the path of the file."""
    path = folder / "order.json"
    path.write_text(json.dumps(orders))
    return path


class Twins(dict):
    """Native units by (name, version of FMI), each built when it is first used; "X" is that of Model Exchange."""

    def __init__(self, folder):
        super().__init__()
        self.folder = folder

    def __missing__(self, key):
        unit, fmi, *exchange = key if isinstance(key, tuple) else (key, 2)
        require_compiler()
        folder = self.folder / "".join(map(str, key))
        self[key] = build(unit, folder, native=True, fmi=fmi, model_exchange=bool(exchange))
        return self[key]


def compile_c(command, sources, target, *flags):
    """Compile a program or library; return its path."""
    libraries = [] if target.suffix == ".exe" else ["-ldl", "-lm"]
    run_program([*command, "-std=gnu11", *flags, *sources, "-o", target, *libraries])
    return target


def describe_unit(unit):
    """Return GUID, reference of the log's path or -1, number and references of the inputs and of the outputs."""
    description = read_model_description(str(unit))
    left_out = {"input": ("correction.", "excitation.", "score.", "fresh", "measured.fresh"), "output": ("port",)}

    def count_and_references(causality):
        variables = [v for v in description.modelVariables if v.causality == causality]
        references = [v.valueReference for v in variables if not v.name.startswith(left_out[causality])]
        return [len(references), *references]

    text = next((v.valueReference for v in description.modelVariables if v.name == "log.path"), -1)
    return description.guid, text, [*count_and_references("input"), *count_and_references("output")]


def initialise(kind, parameters=None):
    """Return a unit after its initialisation, whether it succeeded or not."""
    unit = kind(instance_name="unit", resources="")
    for name, value in (parameters or {}).items():
        set_value(unit, name, value)
    unit.setup_experiment(0.0)
    unit.enter_initialization_mode()
    unit.exit_initialization_mode()
    return unit


def set_value(unit, name, value):
    reference = unit.references[name]
    getattr(unit, f"set_{unit.variables[reference].type.lower()}")([reference], [value])


def get_values(unit, *names):
    return unit.get_real([unit.references[name] for name in names])
