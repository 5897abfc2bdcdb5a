"""Compilation: the same function as the interpreter's, found again on disk, and by its whole content."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from textwrap import dedent
from time import sleep

import numba
import numpy as np
import pytest

from heli_plant import compiled as module
from heli_plant.compiled import PARAMETER_DTYPE, compiled, parameter_record
from heli_plant.effects import CATALOGUE
from heli_plant.errors import PlantError
from heli_plant.laws import added_pitch, thrust_voltages
from heli_plant.motor import lagged
from heli_plant.parameters import TABLE_2, PlantParameters

ALL_ON = TABLE_2._replace(**{e.field: 0.01 for e in CATALOGUE})


def test_record_has_the_fields_of_a_parameter_set_in_its_order():
    record = parameter_record(TABLE_2)
    assert PARAMETER_DTYPE.names == PlantParameters._fields
    assert tuple(record) == tuple(TABLE_2)


def test_compiled_function_gives_what_the_interpreted_one_gives():
    rng = np.random.default_rng(0)
    for _ in range(200):
        nu, v, h, T = rng.uniform(0.001, 3, 4)
        assert compiled(lagged)(nu, v, h, T) == pytest.approx(lagged(nu, v, h, T), rel=1e-15)
        motion = rng.uniform(-1, 1, 10).tolist()
        # tanh and exp may come from another mathematical library: a few units in the last place
        expected = added_pitch(*motion, ALL_ON)
        assert compiled(added_pitch)(*motion, parameter_record(ALL_ON)) == pytest.approx(expected, abs=1e-14)


def test_compiled_function_reads_a_parameter_record_as_the_interpreted_one_reads_a_set():
    p = TABLE_2._replace(quadratic_thrust_rotors=0.1, reverse_thrust_loss_rotors=0.4)
    fast = compiled(thrust_voltages)(1.0, -2.0, 3.0, parameter_record(p))
    assert fast == pytest.approx(thrust_voltages(1.0, -2.0, 3.0, p), rel=1e-15)


def test_function_is_compiled_once():
    assert compiled(lagged) is compiled(lagged)


def test_threads_that_compile_at_once_leave_numbas_setting_as_it_was(monkeypatch, tmp_path):
    """numba's cache folder is one setting for the whole process."""
    monkeypatch.setenv("HELI_CACHE_DIR", str(tmp_path / "cache"))
    before, jit = numba.config.CACHE_DIR, module._jit

    def slow(*arguments, **options):
        sleep(0.02)  # all threads are at it before the first is done
        return jit(*arguments, **options)

    monkeypatch.setattr(module, "_jit", slow)

    def fresh(k):
        code = f"def f{k}(x):\n    return x + {k}.0\n"
        file = tmp_path / f"f{k}.py"
        file.write_text(code)
        names = {"__name__": f"heli_plant.f{k}", "__file__": str(file)}
        exec(compile(code, str(file), "exec"), names)
        return compiled(names[f"f{k}"])

    with ThreadPoolExecutor(4) as pool:
        functions = list(pool.map(fresh, range(8)))
    assert [f(1.0) for f in functions] == [1.0 + k for k in range(8)]
    assert numba.config.CACHE_DIR == before
    assert len(list((tmp_path / "cache").glob("numba-*/**/*.nbi"))) == 8


def run(script, cache):
    done = subprocess.run(
        [sys.executable, "-c", dedent(script)],
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, "HELI_CACHE_DIR": str(cache)},
        check=True,
    )
    return done.stdout.split()


def test_second_process_finds_the_machine_code_on_disk(tmp_path):
    script = """
        from heli_plant.compiled import compiled
        from heli_plant.motor import lagged
        compiled(lagged)(1.0, 2.0, 0.01, 0.08)
        print(sum(compiled(lagged).stats.cache_hits.values()))
    """
    assert run(script, tmp_path) == ["0"]
    assert run(script, tmp_path) == ["1"]


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A function ``outer`` that calls one and reads a constant of other files, in a package of the project's name."""

    def write(body="x + 1.0", constant=2.0):
        for name in [name for name in sys.modules if name.startswith("heli_plant_of_a_test")]:
            del sys.modules[name]
        package = tmp_path / "heli_plant_of_a_test"
        package.mkdir(exist_ok=True)
        (package / "__init__.py").write_text("")
        (package / "constants.py").write_text(f"FACTOR = {constant}\n")
        (package / "inner.py").write_text(f"def inner(x):\n    return {body}\n")
        (package / "outer.py").write_text(
            "from .constants import FACTOR\nfrom .inner import inner\n\n\ndef outer(x):\n    return FACTOR * inner(x)\n"
        )
        sys.dont_write_bytecode, kept = True, sys.dont_write_bytecode  # a second's old bytecode would pass for new
        try:
            return __import__("heli_plant_of_a_test.outer", fromlist=["outer"]).outer
        finally:
            sys.dont_write_bytecode = kept

    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(module, "_ROOTS", (*module._ROOTS, "heli_plant_of_a_test"))
    monkeypatch.setenv("HELI_CACHE_DIR", str(tmp_path / "cache"))
    return write


def test_change_in_a_function_that_is_called_makes_new_code(project):
    assert compiled(project("x + 1.0"))(3.0) == 8.0
    assert compiled(project("x + 2.0"))(3.0) == 10.0


def test_change_of_a_constant_elsewhere_makes_new_code(project):
    assert compiled(project(constant=2.0))(3.0) == 8.0
    assert compiled(project(constant=5.0))(3.0) == 20.0


def test_folder_that_cannot_be_written_is_named_with_the_remedy(monkeypatch, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("HELI_CACHE_DIR", str(blocked))

    def never_compiled(x):
        return x

    with pytest.raises(PlantError, match=rf"{blocked}.*set HELI_CACHE_DIR"):
        compiled(never_compiled)


def test_package_imports_no_numba_before_something_is_compiled():
    """The plant's modules serve inside an FMU, whose host may have neither numba nor numpy."""
    script = """
        import sys, heli_plant.plant, heli_plant.control, heli_plant.delay, heli_plant.encoders, heli_plant.parameters
        print("numba" in sys.modules, "numpy" in sys.modules)
    """
    done = subprocess.run([sys.executable, "-c", dedent(script)], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]
