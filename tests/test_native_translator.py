"""The translator: what it knows gives CPython's values, what it does not know is refused with file, line and reason."""

import ctypes
import math
from functools import reduce
from math import atan2, ceil, copysign, floor, hypot, sin, sqrt
from operator import add, mul
from random import Random
from typing import NamedTuple

import pytest

from fmu_src.native import Untranslatable
from fmu_src.native.translator import Translation
from tests.native_builds import library

FEW = [0.0, -0.0, 0.1, -0.1, 0.5, 1.0, -1.0, 1.5, 2.5, -2.5, 3.7, -3.7, 1e-300, 1e300, math.inf, -math.inf]


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


def both_ways(x: float, y: float) -> float:
    return x or y if x > y and not (x == 0.5 or y == 0.5) else -y


def chained(x: float, y: float) -> int:
    return (1 if 0.0 < x <= y < 2.0 else 0) + (10 if x in (0.5, 1.5) else 0)


def polynomial(n: int, x: float) -> float:
    coefficients = [1.0 / (i + 1) for i in range(n)]
    total = 0.0
    for c in reversed(coefficients):
        total = total * x + c
    return total


def gram(n: int, x: float) -> float:
    rows = [[sin(x * (i + 1) * (j + 2)) for j in range(n)] for i in range(n)]
    columns = list(zip(*rows))  # noqa: B905
    products = [reduce(add, map(mul, a, b), 0.0) for a in rows for b in columns]
    shifted = [*products[1:], 1.0, *products[:1]]
    for k, value in enumerate(shifted):
        if k % 2 == 0:
            shifted[k] = -value
    return reduce(add, shifted, 0.0) + max(abs(p) for p in products[::2])


def grown(n: int, x: float) -> float:
    found: list[float] = []
    k = 0
    while len(found) < n:
        k += 1
        value = sin(k * x)
        if value < 0.0:
            continue
        found.append(value)
        if k > 1000:
            break
    tail = found[-1] if found else 0.0
    return tail + (len(found) if len(found) > 3 else 0.5)


def turned(x: float, y: float) -> float:
    p = Pair(x, y)
    a, b = p
    a, b = b, a
    q = p._replace(a=a + b)
    return atan2(q.a, q.b) + sqrt(abs(a)) * copysign(1.0, b)


def changed_behind_a_slice(x: float) -> float:
    first = [x, 2.0 * x, 3.0 * x]
    part = first[:2]
    first[0] = 7.0
    a = part[0]
    return a + first[0]


def sliced_copy(x: float) -> float:
    first = [x, 2.0 * x, 3.0 * x]
    part = first[:2]
    part[0] = 7.0
    return first[0] + part[0]


NUMBERS = [remainder, extremes, ordered_sums, both_ways, turned]
KINDS = {float: ctypes.c_double, int: ctypes.c_int64}


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    functions = [*NUMBERS, whole, rounded, chained, polynomial, gram, grown, sliced_copy, changed_behind_a_slice]
    translation = Translation()
    units = {f: translation.entry(f) for f in functions}
    made = library(
        tmp_path_factory.mktemp("c"), functions, "Space *make_space(void) { return calloc(1, sizeof(Space)); }",
        translation=translation,
    )  # fmt: skip
    made.make_space.restype = ctypes.c_void_p
    space = ctypes.c_void_p(made.make_space())

    def call(function, *arguments):
        unit = units[function]
        c = getattr(made, unit.name)
        kinds = [KINDS[function.__annotations__[name]] for name, _ in unit.parameters]
        c.argtypes = [ctypes.c_void_p, *kinds] if unit.needs_space else kinds
        c.restype = KINDS[function.__annotations__["return"]]
        return c(space, *arguments) if unit.needs_space else c(*arguments)

    return call


def same(a, b):
    return (a == b and math.copysign(1.0, a) == math.copysign(1.0, b)) or (math.isnan(a) and math.isnan(b))


@pytest.mark.parametrize("function", NUMBERS, ids=lambda f: f.__name__)
def test_numbers_have_the_bits_of_python(built, function):
    draw = Random(1)
    pairs = [(x, y) for x in FEW for y in FEW] + [(draw.uniform(-9, 9), draw.uniform(-9, 9)) for _ in range(2000)]
    tried = 0
    for x, y in pairs:
        try:
            expected = function(x, y)
        except (ZeroDivisionError, ValueError, OverflowError):
            continue  # Python raises where C has infinities; the units check their states
        tried += 1
        assert same(built(function, x, y), expected), (x, y)
    assert tried > 2000


def test_whole_numbers_divide_as_in_python(built):
    for i in range(-20, 21):
        for j in (-7, -3, -1, 1, 2, 5):
            assert built(whole, i, j) == whole(i, j)


def test_rounding_is_that_of_python(built):
    for x in [k / 8.0 for k in range(-80, 81)]:
        assert same(built(rounded, x), rounded(x)), x


@pytest.mark.parametrize("function", [chained, both_ways])
def test_conditions_stop_where_python_stops(built, function):
    for x in FEW:
        for y in FEW:
            assert built(function, x, y) == function(x, y)


@pytest.mark.parametrize("function", [polynomial, gram, grown], ids=lambda f: f.__name__)
def test_lists_and_loops_have_the_bits_of_python(built, function):
    for n in (1, 2, 3, 5, 9, 40):
        for x in (0.3, -1.7, 2.9):
            assert same(built(function, n, x), function(n, x)), (n, x)


def test_a_part_of_a_list_that_is_changed_is_a_list_of_its_own(built):
    assert built(sliced_copy, 0.25) == sliced_copy(0.25) == 7.25
    assert built(changed_behind_a_slice, 0.25) == changed_behind_a_slice(0.25) == 7.25


def uses_a_dict(x: float) -> float:
    return {"a": x}["a"]


def uses_hypot(x: float) -> float:
    return hypot(x, 1.0)


def uses_sum(x: float) -> float:
    return sum([x, x])


def uses_power(x: float) -> float:
    return x**2.5


def uses_with(x: float) -> float:
    with open("file"):
        return x


def unknown_name(x: float) -> float:
    return x + nowhere  # noqa: F821


def two_kinds(x: float) -> float:
    y = Pair(x, x)
    y = x
    return y + 1.0


def changes_a_tuple(x: float) -> float:
    p = Pair(x, x)
    p.a = 1.0
    return p.a


def has_no_annotation(x):
    return x


@pytest.mark.parametrize(
    "function, reason",
    [
        (uses_a_dict, "Dict has no translation"),
        (uses_hypot, "differs from that of C libraries in the last bit"),
        (uses_sum, "rounds differently from Python 3.12 on"),
        (uses_power, "write a product"),
        (uses_with, "statement With"),
        (unknown_name, "nowhere"),
        (two_kinds, "once Pair and once float"),
        (changes_a_tuple, "NamedTuples have _replace"),
        (has_no_annotation, "needs an annotation"),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_what_it_does_not_know_is_refused_with_file_line_and_reason(function, reason):
    with pytest.raises(Untranslatable) as refused:
        Translation().entry(function)
    problem = refused.value
    first = function.__code__.co_firstlineno
    assert reason in problem.reason
    assert problem.file.endswith("test_native_translator.py")
    assert first <= problem.line <= first + 3
    assert str(problem) == f"{problem.file}, line {problem.line}: {problem.reason}"
