"""Compiled code is found again on disk by its whole content."""

import os
from math import inf

import pytest

from heli_plant.compiled import compile_function
from heli_plant.errors import PlantError
from heli_plant.laws import next_step_time
from heli_plant.parameters import TABLE_2
from tests.commands import run_python


def run(script, cache):
    return run_python(script, timeout=300, env={**os.environ, "HELI_CACHE_DIR": str(cache)}).stdout.split()


def outer_of_a_test(folder, body, constant):
    """Compile and call, in a new process, a function that calls one and reads a constant of other files."""
    modules = folder / "modules"
    modules.mkdir(exist_ok=True)
    (modules / "constants_of_a_test.py").write_text(f"FACTOR = {constant}\n")
    (modules / "inner_of_a_test.py").write_text(f"def inner(x):\n    return {body}\n")
    (modules / "outer_of_a_test.py").write_text(
        "from .constants_of_a_test import FACTOR\nfrom .inner_of_a_test import inner\n\n\n"
        "def outer(x):\n    return FACTOR * inner(x)\n"
    )
    script = f"""
        import sys
        sys.dont_write_bytecode = True  # Python would take bytecode of the same second for the changed source
        import heli_plant
        heli_plant.__path__.append({str(modules)!r})
        from heli_plant.compiled import compile_function
        from heli_plant.outer_of_a_test import outer
        print(compile_function(outer)(3.0), sum(compile_function(outer).stats.cache_hits.values()))
    """
    return run(script, folder / "cache")


def test_machine_code_on_disk_serves_until_a_called_function_or_a_constant_elsewhere_changes(tmp_path):
    assert outer_of_a_test(tmp_path, "x + 1.0", 2.0) == ["8.0", "0"]
    assert outer_of_a_test(tmp_path, "x + 1.0", 2.0) == ["8.0", "1"]
    assert outer_of_a_test(tmp_path, "x + 2.0", 2.0) == ["10.0", "0"]
    assert outer_of_a_test(tmp_path, "x + 2.0", 5.0) == ["25.0", "0"]


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="Windows does not say whose a folder is")
def test_a_folder_of_others_is_not_read_and_named_with_the_remedy(monkeypatch, tmp_path):
    """What numba unpickles can run code: the folder has to be the user's own."""
    tmp_path.chmod(0o777)
    monkeypatch.setenv("HELI_CACHE_DIR", str(tmp_path))
    with pytest.raises(PlantError, match=rf"{tmp_path}: others can write to it.*set HELI_CACHE_DIR"):
        compile_function(lambda x: x)


COUNTED = """
    from heli_plant.compiled import compile_function
    from heli_plant.motor import saturate
    print(compile_function(saturate)(9.0, 5.0), sum(compile_function(saturate).stats.cache_hits.values()))
"""
"""Compiles a function, and says whether its machine code was found on disk."""


@pytest.mark.parametrize("ending", [pytest.param(".nbi", marks=pytest.mark.slow), ".nbc"])
def test_a_damaged_cache_is_dropped_and_filled_again(tmp_path, ending):
    assert run(COUNTED, tmp_path) == ["5.0", "0"]
    (file,) = tmp_path.rglob(f"*{ending}")
    whole = file.read_bytes()
    for damaged in (whole[: len(whole) // 2], b"", bytes(len(whole))):
        file.write_bytes(damaged)
        assert run(COUNTED, tmp_path) == ["5.0", "0"]
        (file,) = tmp_path.rglob(f"*{ending}")
    assert run(COUNTED, tmp_path) == ["5.0", "1"]


def test_the_next_step_of_a_law_is_told():
    on = TABLE_2._replace(moving_mass_elevation=0.1, moving_mass_time=5.0)
    assert next_step_time(0.0, on) == 5.0 and next_step_time(5.0, on) == inf
    assert next_step_time(0.0, TABLE_2) == inf
