"""Compiled code is found again on disk by its whole content; tests/test_effects.py compares what it computes."""

import os
import subprocess
import sys
from textwrap import dedent

import pytest

from heli_plant.compiled import cache_folder, compiled
from heli_plant.errors import PlantError


def run(script, cache):
    done = subprocess.run(
        [sys.executable, "-c", dedent(script)], capture_output=True, text=True, timeout=300,
        env={**os.environ, "HELI_CACHE_DIR": str(cache)}, check=True,
    )  # fmt: skip
    return done.stdout.split()


def outer_of_a_test(folder, body, constant):
    """Compile and call, in a new process, a function that calls one and reads a constant of other files.

    Returns what the function gives at 3, and how often machine code was found on disk.
    """
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
        from heli_plant.compiled import compiled
        from heli_plant.outer_of_a_test import outer
        print(compiled(outer)(3.0), sum(compiled(outer).stats.cache_hits.values()))
    """
    return run(script, folder / "cache")


def test_machine_code_on_disk_serves_until_a_called_function_or_a_constant_elsewhere_changes(tmp_path):
    assert outer_of_a_test(tmp_path, "x + 1.0", 2.0) == ["8.0", "0"]
    assert outer_of_a_test(tmp_path, "x + 1.0", 2.0) == ["8.0", "1"]
    assert outer_of_a_test(tmp_path, "x + 2.0", 2.0) == ["10.0", "0"]
    assert outer_of_a_test(tmp_path, "x + 2.0", 5.0) == ["25.0", "0"]


def test_folder_that_cannot_be_written_is_named_with_the_remedy(monkeypatch, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("HELI_CACHE_DIR", str(blocked))
    with pytest.raises(PlantError, match=rf"{blocked}.*set HELI_CACHE_DIR"):
        compiled(lambda x: x)


def test_package_imports_no_numba_before_something_is_compiled():
    """The plant's modules serve inside an FMU, whose host may have neither numba nor numpy."""
    script = """
        import sys, heli_plant.plant, heli_plant.control, heli_plant.communication, heli_plant.parameters
        print("numba" in sys.modules, "numpy" in sys.modules)
    """
    assert run(script, "") == ["False", "False"]


COUNTED = """
    from heli_plant.compiled import compiled
    from heli_plant.motor import saturate
    print(compiled(saturate)(9.0, 5.0), sum(compiled(saturate).stats.cache_hits.values()))
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


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="folders have no mode here")
def test_a_folder_that_others_can_write_to_is_not_read(tmp_path, monkeypatch):
    """What numba unpickles can run code: it has to be the user's own."""
    tmp_path.chmod(0o777)
    monkeypatch.setenv("HELI_CACHE_DIR", str(tmp_path))
    with pytest.raises(PlantError, match="others can write to it"):
        cache_folder()
