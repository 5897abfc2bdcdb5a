"""Files of the effects: the published law is the function, in any units, and the blind rigs have the same laws. Three
descriptions of a law are compared: the function that the plant runs, the text that reports and documentation print, and
the blind generator's own equations, which share no code with the plant. The new effect of the page, one function with
its declaration, is at once everywhere in a copy of the project."""

import math
import os
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmu_src.description import base_exponents
from heli_plant.effects import ACCELERATION, BENDING, CATALOGUE, THRUST, VOLTAGE
from heli_plant.effects.definition import VOCABULARY
from heli_plant.laws import motor_input, switched_on, thrust_voltage
from heli_plant.parameters import BY_FIELD, TABLE_2
from heli_plant.plant import accelerations
from tests.blind import plant as blind_plant
from tests.blind.coefficients import ON_AXES, Coefficients, Strange
from tests.commands import run_python

FAST = 30.0
"""Rates [rad/s] at which the smoothed sign of dry friction equals the sign to the last bit, also after rescaling."""

SEEDS = st.integers(0, 2**32 - 1)
"""Seeds of :func:`drawn`: values of the size of a flight, where a relative tolerance has a meaning."""


def unit_of(e, name):
    """Unit of an argument, as the catalogue or the list of parameters states it."""
    own = {"c": e.unit} | {shape.name: shape.unit for shape in e.shapes}
    return own.get(name) or (VOCABULARY[name][1] if name in VOCABULARY else BY_FIELD[name].unit)


def drawn(e, seed):
    """Draw values of a law's arguments, of the size of a fast flight and of either sign."""
    random = np.random.default_rng(seed)
    values = {}
    for name in e.arguments:
        shape = {shape.name: shape for shape in e.shapes}.get(name)
        if name == "c":
            low = max(e.lower, -0.9 * e.upper)
            values[name] = float(random.uniform(low, e.upper))
        elif shape is not None:
            values[name] = float(random.uniform(0.3, 1.0)) * shape.upper
        elif name in VOCABULARY and VOCABULARY[name][1] == "rad/s":
            values[name] = float(random.choice([-1.0, 1.0]) * random.uniform(0.5, 1.0) * FAST)
        else:
            values[name] = float(random.uniform(-1.5, 1.5))
    return values


OPERATORS = ("**", "<=", ">=", "<", ">", "+", "-", "*", "/", "(", ")", "=")
FUNCTIONS = {
    "sin": math.sin, "cos": math.cos, "tan": math.tan, "exp": math.exp, "abs": abs,
    "sign": lambda x: math.copysign(1.0, x),
}  # fmt: skip


def expression(text, values):
    """Value of a published expression. Factors stand side by side; symbols may contain primes and (0)."""
    words = sorted([*values, *FUNCTIONS, *OPERATORS], key=len, reverse=True)
    tokens = re.findall("|".join(map(re.escape, words)) + r"|\d+\.?\d*|\S", text)
    program, before = [], ""
    for token in tokens:
        starts = token in values or token in FUNCTIONS or token == "(" or token[0].isdigit()
        if before and starts and (before in values or before == ")" or before[0].isdigit()):
            program.append("*")
        program.append(repr(values[token]) if token in values else token)
        before = token
    return eval("".join(f"({p})" if p[:1] == "-" and p != "-" else p for p in program), dict(FUNCTIONS))


def published(law, values):
    """Value of a published law: ``condition: law, else law``, and ``x -> law``."""
    text = law.replace("^", "**")
    if ":" in text:
        condition, _, rest = text.partition(":")
        then, _, otherwise = rest.partition(", else ")
        if expression(condition, values):
            text = then
        elif otherwise:
            text = otherwise
        else:
            text = then.partition("->")[0] if "->" in then else "0.0"
    return expression(text.rpartition("->")[2], values)


def by_symbol(e, values):
    """Values under the symbols of the published law."""
    symbols = {"horizontal_offset": "eps_0"} | {shape.name: shape.symbol for shape in e.shapes}
    return {symbols.get(name) or VOCABULARY.get(name, (name,))[0]: value for name, value in values.items()}


@pytest.mark.parametrize("e", [e for e in CATALOGUE if e.place != BENDING], ids=lambda e: e.field)
@given(seed=SEEDS)
def test_published_law_is_the_function(e, seed):
    values = drawn(e, seed)
    # both are sums of a few products: some roundings of the largest term, which is below 1e4
    assert published(e.law, by_symbol(e, values)) == pytest.approx(e.function(**values), rel=1e-12, abs=1e-10)


@given(seed=SEEDS)
def test_published_law_of_the_bending_mode_is_its_equation_of_motion(seed):
    (e,) = [e for e in CATALOGUE if e.place == BENDING]
    values = drawn(e, seed)
    symbols = by_symbol(e, values) | {"q''": e.function(**values), "w_b": 2.0 * math.pi * values["frequency"]}
    left, _, right = e.law.partition(", ")[2].replace("^", "**").partition("=")
    assert expression(left, symbols) == pytest.approx(expression(right, symbols), rel=1e-9)


def power(unit):
    """Power of 1000 by which a number grows in milliseconds and millivolts; a volt is 1 kg m^2 s^-3 A^-1."""
    exponents = base_exponents(unit)
    volts = exponents.get("kg", 0)
    return volts + exponents.get("s", 0) + 3 * volts


RESULT = {ACCELERATION: "rad/s^2", BENDING: "rad/s^2", VOLTAGE: "V", THRUST: "V", "lag": "s", "delay": "s"}


@pytest.mark.parametrize("e", CATALOGUE, ids=lambda e: e.field)
@given(seed=SEEDS)
def test_law_means_the_same_in_milliseconds_and_millivolts(e, seed):
    """Arguments are rescaled by their unit strings: a wrong unit of c or of a shape shows as a power of 1000."""
    values = drawn(e, seed)
    if "rate" in values:
        values["rate"] *= 10.0  # the smoothing is a constant in rad/s; the smoothed sign must be +-1 in rad/ms as well
    rescaled = {name: value * 1000.0 ** power(unit_of(e, name)) for name, value in values.items()}
    expected = e.function(**values) * 1000.0 ** power(RESULT[e.place])
    assert e.function(**rescaled) == pytest.approx(expected, rel=1e-9, abs=1e-300)


def blind_field(e):
    return f"{e.name}_{e.axis}" if e.name in ON_AXES else e.name


SMOOTH = [
    e
    for e in CATALOGUE
    if e.place == ACCELERATION and "friction" not in e.name and blind_field(e) in Coefficients._fields
]
"""Effects that the generator has too."""

angle, above, rate, volts = (st.floats(*ends) for ends in ((-0.8, 0.8), (-0.2, 0.8), (-2.0, 2.0), (-10.0, 10.0)))


@pytest.mark.parametrize("e", [*SMOOTH, None], ids=lambda e: e.field if e else "all of them")
@given(th=angle, ep=above, la=angle, w=rate, w_e=rate, w_l=rate, mu_s=volts, mu_d=volts, zero=st.floats(-0.3, 0.3))
def test_blind_generator_and_plant_accelerate_alike(e, th, ep, la, w, w_e, w_l, mu_s, mu_d, zero):
    """The arm is above the ground, and horizontal at another elevation than the encoder's zero. Friction, set-valued
    there, is left out."""
    # in the generator a moving mass also changes the large-angle gravity, and what an axis does to another by its
    # acceleration takes what every effect does to it, so these do not simply add
    apart = ("moving_mass_elevation", "product_of_inertia_travel", "inertial_coupling_pitch")
    on = [x for x in SMOOTH if x.field not in apart] if e is None else [e]
    shapes = {"ground_elevation": -0.2, "ground_height": 0.15, "moving_mass_time": 1.0}
    p = TABLE_2._replace(horizontal_offset=zero, **shapes, **{x.field: 0.3 * x.upper for x in on})
    blind = Coefficients(
        elevation_zero=zero, ground_angle=-0.2, ground_length=0.15, mass_time=1.0,
        **{blind_field(x): 0.3 * x.upper for x in on},
    )  # fmt: skip
    motion = np.array([th, ep, la]), np.array([w, w_e, w_l])
    expected = blind_plant.accelerations(2.0, *motion, mu_s, mu_d, blind, Strange(), np.zeros(3))
    found = accelerations(2.0, th, ep, la, w, w_e, w_l, mu_d, mu_s, 0.0, 0.0, switched_on(p), p)
    # sums of terms up to 1000 rad/s^2 in another order
    assert found == pytest.approx(expected, rel=1e-11, abs=1e-11)


@given(v=st.floats(-5.0, 5.0), t=st.floats(0.0, 100.0))
def test_blind_generator_and_plant_pull_alike(v, t):
    on = {"quadratic_thrust": 0.1, "reverse_thrust_loss": 0.4, "thrust_fade": 0.001, "dead_zone": 0.2}
    p, blind = TABLE_2._replace(**{f"{name}_rotors": c for name, c in on.items()}), Coefficients(**on)
    assert motor_input(v, p) == pytest.approx(blind_plant.beyond_dead_zone(v, 0.2), abs=1e-15)
    assert thrust_voltage(v, t, p) == pytest.approx(blind_plant.thrust(v, t, blind), rel=1e-14)


ROOT = Path(__file__).parent.parent

PAGE = (ROOT / "docs" / "reference" / "effects.md").read_text(encoding="utf-8")
LAW = "\n\n" + PAGE.partition("```python\n")[2].partition("```")[0]

SCRIPT = """
    import numpy as np
    from pathlib import Path

    from heli_identifier.results import diagnose
    from heli_identifier.records import DiagnosisSettings
    from heli_identifier.results.report import report_page
    from heli_plant.compiled import compile_function, parameter_record
    from heli_plant.laws import added_travel
    from heli_plant.parameters import from_names
    from fmu_src.builder import build
    from fmpy import read_model_description
    from tests.simulated import drive, noisy_log

    tilted = from_names({"effects.table_tilt.travel": 0.15})
    motion = [0.0, 0.1, 0.2, 0.7, 0.3, 0.1, 0.2, 1.0, 0.5, 0.0]
    interpreted = added_travel(*motion, tilted)
    assert interpreted == 0.15 * np.sin(0.7) == compile_function(added_travel)(*motion, parameter_record(tilted))
    print("compiled")

    one, other, held = (noisy_log(tilted, drive(60.0, seed) + 0.8, seed, name=f"run{seed}") for seed in (1, 2, 3))
    diagnosis = diagnose([one, other], held_out=held)
    found = diagnosis.effects[0]
    assert (found.name, found.axis) == ("table_tilt", "travel"), diagnosis.effects
    assert abs(found.coefficient.value - 0.15) < 0.01
    print("traced")
    page = report_page(diagnosis, "rig")
    assert "Table tilt on the travel" in page and "c sin(λ)" in page
    print("reported")
    unit = build("HelicopterPlant", Path("units"), {"effects.table_tilt.travel": 0.15})
    names = {variable.name for variable in read_model_description(unit).modelVariables}
    assert "effects.table_tilt.travel" in names
    print("in the unit")
"""


@pytest.mark.slow
def test_new_effect_is_compiled_traced_reported_documented_and_in_the_unit(tmp_path):
    for package in ("heli_plant", "heli_identifier", "fmu_src", "tests", "docs"):
        ignored = shutil.ignore_patterns("__pycache__", "demo_logs", "figures")
        shutil.copytree(ROOT / package, tmp_path / package, ignore=ignored if package != "heli_identifier" else None)
    file = tmp_path / "heli_plant" / "effects" / "arm.py"
    file.write_text(file.read_text() + LAW)
    there = {"cwd": tmp_path, "timeout": 300}
    there["env"] = {**os.environ, "PYTHONPATH": str(tmp_path), "HELI_CACHE_DIR": str(tmp_path / "cache")}
    assert run_python(SCRIPT, **there).stdout.splitlines() == ["compiled", "traced", "reported", "in the unit"]
    documented = "from docs.hooks.effects import on_page_markdown as page; print(page('<!-- effects -->'))"
    assert "| `table_tilt` | travel |" in run_python(documented, **there).stdout
