"""Native units: what the translator knows has CPython's bits; in hosts without Python, under sanitizers, Wine, qemu."""

import ctypes
import math
import os
import pickle
import shutil
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from math import atan2, ceil, copysign, floor, sin, sqrt
from pathlib import Path
from random import Random
from runpy import run_path
from typing import NamedTuple
from xml.etree import ElementTree

import pytest
from fmpy import extract

from fmu_src import build
from fmu_src.errors import Untranslatable
from fmu_src.native import NATIVE_UNITS
from fmu_src.native.toolchain import ARM_LINUX, WINDOWS, find_compiler
from fmu_src.native.translator.program import Translation
from tests.commands import run_program
from tests.hosts.unit_host import Unit
from tests.units import HOSTS, c_compiler, compile_c, describe_unit, load_library, read_archive, require_compiler

HOST = HOSTS / "native_host.c"
STEPS = 1000


@pytest.fixture(scope="module")
def opened(tmp_path_factory, twins):
    """Folders of the native units, unpacked."""
    folder = tmp_path_factory.mktemp("opened")
    return {unit: Path(extract(twins[unit], folder / unit)) for unit in NATIVE_UNITS}


def sources_of(folder):
    build = ElementTree.parse(folder / "sources/buildDescription.xml").getroot()
    return [folder / "sources" / node.get("name") for node in build.iter("SourceFile")]


def run(host, library, folder, log, **environment):
    guid, text, references = describe_unit(folder)
    environment = {"PATH": os.environ["PATH"], "HOME": os.environ.get("HOME", "/"), **environment}
    done = run_program([*host, library, guid, STEPS, text, log, *references], env=environment)
    return [float(line) for line in done.stdout.split()]


@pytest.fixture(scope="module")
def host(tmp_path_factory):
    target = tmp_path_factory.mktemp("host") / "native_host"
    return compile_c(c_compiler(own=True), [HOST], target, "-O1", "-Wall", "-Wextra", "-Werror")


SMALL = ("PidController", "LogPlayer")  # they compile quickly; one only calculates, one reads a file
SANITIZED = "-fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all -g -O1"


@pytest.mark.parametrize("level", [pytest.param("-O0", marks=pytest.mark.slow), "-O3 -march=native", SANITIZED])
@pytest.mark.parametrize("unit", [pytest.param(u, marks=[pytest.mark.slow] * (u not in SMALL)) for u in NATIVE_UNITS])
def test_every_optimisation_has_the_same_bits_and_sanitizers_find_nothing(opened, host, log, tmp_path, unit, level):
    """Without a warning, but for unused parameters: the laws of all effects share one list of arguments. Sanitizers see
    addresses, leaks, undefined behaviour, and floats that do not fit an integer."""
    flags = [*level.split(), "-Wall", "-Wextra", "-Wpedantic", "-Wno-unused-parameter", "-Werror"]
    own = compile_c(c_compiler(own=True), sources_of(opened[unit]), tmp_path / f"{unit}.so", *flags, "-shared", "-fPIC")
    program = compile_c(c_compiler(own=True), [HOST], tmp_path / "host", *level.split()) if level is SANITIZED else host
    delivered = opened[unit] / f"binaries/linux64/{unit}.so"
    expected = run([str(host)], delivered, opened[unit], log)
    assert run([str(program)], own, opened[unit], log, ASAN_OPTIONS="detect_leaks=1") == expected != []
    assert "python" not in run_program(["ldd", delivered]).stdout


def test_the_binary_for_arm_gives_the_bits_of_that_for_x86(host, log, tmp_path):
    """Under qemu, with the C library for ARM of this system."""
    emulator, root = shutil.which("qemu-aarch64"), Path("/usr/aarch64-linux-gnu")
    if emulator is None or not root.is_dir():
        pytest.skip("this machine has no qemu-aarch64 with libc6-arm64-cross")
    require_compiler(ARM_LINUX)
    found = " ".join(read_archive(build("HelicopterPlant", tmp_path, all_platforms=True, fmi=3, native=True)))
    assert "binaries/aarch64-linux/" in found and "binaries/aarch64-darwin/" in found
    extract(build("HelicopterPlant", tmp_path, native=True), tmp_path / "fmi2")
    own = sources_of(tmp_path / "fmi2")
    compiler = find_compiler(ARM_LINUX)
    there = compile_c(compiler, own, tmp_path / "arm.so", "-O2", "-ffp-contract=off", "-shared", "-fPIC")
    program = compile_c(compiler, [HOST], tmp_path / "arm", "-O1", "-ffp-contract=off")
    native = tmp_path / "fmi2/binaries/linux64/HelicopterPlant.so"
    assert run([emulator, "-L", str(root), str(program)], there, tmp_path / "fmi2", log) == run(
        [str(host)], native, tmp_path / "fmi2", log
    )


CLOSE = dict.fromkeys(NATIVE_UNITS, 1e-12) | {"HelicopterPlant": 1e-11, "AdaptiveIdentifier": 1e-9, "LogPlayer": 0.0}
"""Largest difference under Wine, as a share of the largest value: sine and exponential there are another library's and
may differ in the last bit (2e-16). The controllers damp that; the identifier divides by its excitation. An observer of
the plant has the gain l_3, a sum of terms near 1 that leaves (omega_o h)^3, over h^2 = 1e-4 s^2: an error of 4e-16 in
the sum is 4e-12 rad/s^2 per radian of innovation."""


@pytest.mark.parametrize("unit", NATIVE_UNITS)
def test_the_windows_binary_runs_under_wine(opened, host, log, tmp_path, unit):
    wine = shutil.which("wine")
    if wine is None:
        pytest.skip("this machine has no Wine")
    require_compiler(WINDOWS)
    program = compile_c(find_compiler(WINDOWS), [HOST], tmp_path / "host.exe", "-O1")
    there = run(
        [wine, str(program)], opened[unit] / f"binaries/win64/{unit}.dll", opened[unit], f"Z:{log}", WINEDEBUG="-all",
        WINEPREFIX=os.environ.get("WINEPREFIX", str(Path.home() / ".wine")),
    )  # fmt: skip
    here = run([str(host)], opened[unit] / f"binaries/linux64/{unit}.so", opened[unit], log)
    scale = max(map(abs, here))
    worst = max(abs(a - b) for a, b in zip(there, here, strict=True))
    print(f"{unit}: largest difference under Wine {worst / scale:.1e} of the largest value")
    assert worst <= CLOSE[unit] * scale


def test_instances_in_threads_show_what_they_show_alone(twins):
    """The calls run outside of the interpreter's lock, so that steps of several instances overlap."""
    unit = Unit(twins["AdaptiveIdentifier"])

    def shown(seed):
        one, rows = copy(unit).fresh(), []
        for k in range(1500):
            one.slave.setReal(range(5), [0.3 * sin(0.01 * k * (i + 1) + seed) for i in range(5)])
            one.step(0.01 * k, 0.01)
            rows += [one.shown()] if k % 100 == 0 else []
        one.slave.component = None  # the library stays loaded for the other threads
        return rows

    alone = [shown(seed) for seed in range(6)]
    with ThreadPoolExecutor(6) as pool:
        assert list(pool.map(shown, range(6))) == alone
    assert len({tuple(map(tuple, rows)) for rows in alone}) == 6


FEW = [0.0, -0.0, 0.1, -0.1, 0.5, 1.0, -1.0, 1.5, 2.5, -2.5, 3.7, -3.7, 1e-300, 1e300, math.inf, -math.inf]
EIGHTHS = [k / 8.0 for k in range(-80, 81)]
WHOLE = range(-20, 21)


class Pair(NamedTuple):
    """Two numbers."""

    a: float
    b: float


def remainder(x: float, y: float) -> float:
    return x % y


def whole(i: int, j: int) -> int:
    return (i // j) * 1000 + i % j


def extremes(x: float, y: float) -> float:
    return max(x, y) + 2.0 * min(x, y, 0.5)


def rounded(x: float) -> float:
    return float(round(x)) + floor(x) * 0.25 + ceil(x) * 0.5


def ordered_sums(x: float, y: float) -> float:
    return x - y + x * y / (1.0 + x) - (x - (y - x)) + -x * y


def decided(x: float, y: float) -> float:
    p = Pair(x, y)
    a, b = p
    a, b = b, a
    q = p._replace(a=a + b)
    chained = (1 if 0.0 < x <= y < 2.0 else 0) + (10 if x in (0.5, 1.5) else 0)
    side = x if x > y and not (x == 0.5 or y == 0.5) else -y
    return atan2(q.a, q.b) + sqrt(abs(a)) * copysign(1.0, b) + chained + side


NUMBERS = [remainder, extremes, ordered_sums, decided]
FUNCTIONS = [*NUMBERS, whole, rounded]
KINDS = {float: ctypes.c_double, int: ctypes.c_int64}


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    translation = Translation()
    units = {f: translation.translate_entry(f) for f in FUNCTIONS}
    made = load_library(tmp_path_factory.mktemp("c"), translation)

    def call(function, *arguments):
        c, kinds = getattr(made, units[function].name), function.__annotations__
        c.argtypes, c.restype = [KINDS[kinds[name]] for name in units[function].parameters], KINDS[kinds["return"]]
        return c(*arguments)

    return call


def same(a, b):
    return (a == b and math.copysign(1.0, a) == math.copysign(1.0, b)) or (math.isnan(a) and math.isnan(b))


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda f: f.__name__)
def test_a_function_in_c_has_the_bits_of_python(built, function):
    """Of numbers, at the edges that no flight reaches; lists and loops are those of the units, step by step."""
    draw = Random(1)
    if function in NUMBERS:
        cases = [(x, y) for x in FEW for y in FEW] + [(draw.uniform(-9, 9), draw.uniform(-9, 9)) for _ in range(2000)]
    else:
        cases = [(i, j) for i in WHOLE for j in (-7, -3, -1, 1, 2, 5)] if function is whole else [(x,) for x in EIGHTHS]
    tried = 0
    for arguments in cases:
        try:
            expected = function(*arguments)
        except (ZeroDivisionError, ValueError, OverflowError):
            continue  # Python raises where C has infinities; the units check their states
        tried += 1
        assert same(built(function, *arguments), expected), arguments
    assert tried > 0.8 * len(cases)


FLOATS = "(x: float) -> float:\n    "


@pytest.mark.parametrize("function, reason", [
    (FLOATS + "return hypot(x, 1.0)", "differs from that of C libraries in the last bit"),
    (FLOATS + "return sum([x, x])", "rounds differently from Python 3.12 on"),
    (FLOATS + "return x**2.5", "write a product"),
    (FLOATS + "for i in range(floor(x)):\n        x += i\n    return i", "name 'i' is not defined"),
    (FLOATS + "return [1.0, 2.0][floor(x)] if f'{x}' else 0.0", "a text that is made at run time"),
    (FLOATS + "p = Rotors(x, x)\n    p.front = 1.0\n    return p.front", "NamedTuples have _replace"),
    ("(x): return x", "needs an annotation"),
    (FLOATS + "return Rotors.__annotations__.get(x, 0.0)", "Rotors.__annotations__.get has no translation to C"),
    (FLOATS + "return max(x, 1.0, *[x for i in range(floor(x))])", "has no translation to C: how many values it holds"),
])  # fmt: skip
def test_what_it_does_not_know_is_refused_with_file_line_and_reason(tmp_path, function, reason):
    file, imported = tmp_path / "refused.py", "from math import *\nfrom heli_plant.state_feedback import Rotors"
    file.write_text(f"{imported}\ndef refused{function}\n")
    with pytest.raises(Untranslatable) as refused:
        Translation().translate_entry(run_path(str(file))["refused"])
    problem = pickle.loads(pickle.dumps(refused.value))  # as it comes from the process that builds units
    place, _, said = str(problem).partition(": ")
    name, line = place.split(", line ")
    assert reason in said and name.endswith("/refused.py") and 3 <= int(line) <= 3 + function.count("\n")
