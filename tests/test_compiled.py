"""Compiled code is found again on disk by its whole content; dual numbers of the same source keep its bits."""

import os
from math import inf
from random import Random

import numpy as np
import pytest

from heli_plant.compiled import compile_function
from heli_plant.dual import Dual, seed_duals, slopes, with_duals
from heli_plant.effects import CATALOGUE
from heli_plant.errors import PlantError
from heli_plant.laws import next_step_time
from heli_plant.parameters import TABLE_2
from heli_plant.plant import rates_of_change, step
from heli_plant.state import PlantState
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


DRAWN = ((6, (-0.8, 0.8)), (2, (0.5, 5.0)), (2, (0.5, 4.8)))
"""Angles with their rates, motors and voltages: how many of them, and their range."""


def check_slopes(function, given, by, h, tolerance):
    """Values of a function keep their bits; slopes by the arguments at the places ``by`` are central differences."""
    duals = list(given)
    for place, number in zip(by, seed_duals([given[place] for place in by]), strict=True):
        duals[place] = number
    after = with_duals(function)(*duals)
    assert [x.value if isinstance(x, Dual) else x for x in after] == list(function(*given))
    found = slopes(after, len(by))
    for column, place in enumerate(by):
        up, down = list(given), list(given)
        up[place] += h
        down[place] -= h
        expected = (np.array(function(*up)) - np.array(function(*down))) / (2.0 * h)
        scale = max(1.0, np.abs(expected).max())
        np.testing.assert_allclose(found[:, column], expected, rtol=0.0, atol=tolerance * scale)
    return found


EVERY = TABLE_2._replace(**{e.field: min(0.02, e.upper) for e in CATALOGUE if e.field != "input_delay_rotors"})
SETS = {
    "plain": TABLE_2,
    "general model": TABLE_2._replace(general_model=1.0),
    "every effect": EVERY,
    "every effect, general model": EVERY._replace(general_model=1.0),
    "no lag": TABLE_2._replace(T_m=0.0),
}


def stepped(*row):
    return step(PlantState(*row[:12]), row[12], row[13], 0.0, 0.0, 0.01, TABLE_2)


@pytest.mark.parametrize("p", SETS.values(), ids=SETS)
def test_the_jacobian_is_that_of_central_differences(p):
    """Differences of h = 1e-5: truncation h^2/6 f''', 2e-7 where friction is smoothed; rounding eps f/h, 1e-9."""
    draw = Random(3)
    for _ in range(50):
        motion, motors, held = ([draw.uniform(*span) for _ in range(n)] for n, span in DRAWN)
        given = [draw.uniform(0.0, 50.0), *motion, *motors, 0.01, -0.02, *held, draw.uniform(-0.1, 0.1), 0.3, p]
        check_slopes(rates_of_change, given, range(1, 14), 1e-5, 2e-6)  # by states and inputs


def test_a_mass_at_rest_in_its_middle_and_a_whole_step_have_slopes_and_the_next_step_of_a_law_is_told():
    """The law of the moving mass is skipped at x = 0, but not for a dual number with a slope."""
    given = [0.0, *[0.1] * 10, 1.0, 1.0, 0.0, 0.0, TABLE_2]
    found = check_slopes(rates_of_change, given, (13,), 1e-5, 1e-8)
    assert found[4, 0] == -(TABLE_2.ado_offset + TABLE_2.ado_stiffness * 0.1) != 0.0
    # halves of differences of 1e-4: truncation 1e-9, rounding 1e-12
    row = [0.1, -0.2, 0.3, 0.4, -0.1, 0.2, 2.0, 2.5, 0.0, 0.0, 0.0, 0.0, 3.0, 2.0]
    check_slopes(stepped, row, range(len(row)), 1e-4, 1e-8)
    on = TABLE_2._replace(moving_mass_elevation=0.1, moving_mass_time=5.0)
    assert next_step_time(0.0, on) == 5.0 and next_step_time(5.0, on) == inf
    assert next_step_time(0.0, TABLE_2) == inf
