"""The translator: what it knows gives CPython's bits, what it does not know is refused with file, line and reason."""

import ctypes
import math
import pickle
from math import atan2, ceil, copysign, floor, hypot, sqrt
from random import Random
from typing import NamedTuple

import pytest

from fmu_src.native import Untranslatable
from fmu_src.native.translator.program import Translation
from tests.units import library

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
    units = {f: translation.entry(f) for f in FUNCTIONS}
    made = library(tmp_path_factory.mktemp("c"), translation)

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


def uses_hypot(x: float) -> float:
    return hypot(x, 1.0)


def uses_sum(x: float) -> float:
    return sum([x, x])


def uses_power(x: float) -> float:
    return x**2.5


def reads_behind_a_loop(x: float) -> float:
    for i in range(floor(x)):
        x += i
    return i


def changes_a_tuple(x: float) -> float:
    p = Pair(x, x)
    p.a = 1.0
    return p.a


def decides_at_run_time(x: float) -> float:
    return [1.0, 2.0][floor(x) : floor(x) + 1][0] if f"{x}" else 0.0


def has_no_annotation(x):
    return x


@pytest.mark.parametrize(
    "function, reason",
    [
        (uses_hypot, "differs from that of C libraries in the last bit"),
        (uses_sum, "rounds differently from Python 3.12 on"),
        (uses_power, "write a product"),
        (reads_behind_a_loop, "name 'i' is not defined"),
        (decides_at_run_time, "a text that is made at run time"),
        (changes_a_tuple, "NamedTuples have _replace"),
        (has_no_annotation, "needs an annotation"),
    ],
)
def test_what_it_does_not_know_is_refused_with_file_line_and_reason(function, reason):
    with pytest.raises(Untranslatable) as refused:
        Translation().entry(function)
    problem = pickle.loads(pickle.dumps(refused.value))  # as it comes from the process that builds units
    first = function.__code__.co_firstlineno
    assert reason in problem.reason
    assert problem.file.endswith("test_native_translator.py") and first <= problem.line <= first + 4
    assert str(problem) == f"{problem.file}, line {problem.line}: {problem.reason}"
