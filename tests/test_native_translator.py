"""The translator: what it knows gives CPython's bits, what it does not know is refused with file, line and reason."""

import ctypes
import math
import pickle
from functools import reduce
from math import atan2, ceil, copysign, floor, hypot, sin, sqrt
from operator import add, mul
from random import Random
from typing import NamedTuple

import pytest

from fmu_src.native import Untranslatable
from fmu_src.native.translator.program import Translation
from tests.units import library

FEW = [0.0, -0.0, 0.1, -0.1, 0.5, 1.0, -1.0, 1.5, 2.5, -2.5, 3.7, -3.7, 1e-300, 1e300, math.inf, -math.inf]
EIGHTHS = [k / 8.0 for k in range(-80, 81)]
WHOLE = range(-20, 21)
COUNTS = [1, 2, 3, 5, 9, 40]


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


def gram(n: int, x: float) -> float:
    rows = [[sin(x * (i + 1) * (j + 2)) for j in range(n)] for i in range(n)]
    columns = [[row[k] for row in rows] for k in range(n)]
    products = [reduce(add, map(mul, a, b), 0.0) for a in rows for b in columns if len(b) > 1]
    shifted = [*products[1:], 1.0, *products[:1]]
    for k, value in enumerate(shifted):
        if k % 2 == 0:
            shifted[k] = -value
    return reduce(add, shifted, 0.0) + max(abs(p) for p in [1.0, *products[::2]])


def grown(n: int, x: float) -> float:
    found: list[float] = []
    k = 0
    while len(found) < n:
        k += 1
        value = sin(k * x)
        if value < 0.0:
            continue
        found.append(value)
    tail = found[-1] if found else 0.0
    return tail + (len(found) if len(found) > 3 else 0.5)


def parts_are_lists_of_their_own(n: int, x: float) -> float:
    first = [x, 2.0 * x, 3.0 * x] + [float(n)] * 2
    part = first[:2]
    first[0] = 7.0
    part[1] = 8.0
    a, b = part
    return a + 10.0 * b + 100.0 * first[0] + 1000.0 * first[1] + first[-1]


def _doubled(xs: list[float]) -> float:
    for k in range(len(xs)):
        xs[k] *= 2.0
    return xs[0]


def effects_and_carried_values(n: int, x: float) -> float:
    xs, a, b, sign = [x + k for k in range(n)], 0.0, 1.0, "+"
    _doubled(xs)
    for k, value in enumerate(xs):
        a, b = b, a + value
        if k % 3 == 2:
            continue
        sign = "-" if sign == "+" else "+"
    flags = [value > 0.0 for value in xs[::2]]
    return (a - 3.0 * b if sign == "+" else b) + (1.0 if flags[0] else 0.0)


NUMBERS = [remainder, extremes, ordered_sums, decided]
LISTS = [gram, grown, parts_are_lists_of_their_own, effects_and_carried_values]
KINDS = {float: ctypes.c_double, int: ctypes.c_int64}


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    functions = [*NUMBERS, *LISTS, whole, rounded]
    translation = Translation()
    units = {f: translation.entry(f) for f in functions}
    space = "Space *make_space(void) { return calloc(1, sizeof(Space)); }"
    made = library(tmp_path_factory.mktemp("c"), translation, space)
    made.make_space.restype = ctypes.c_void_p
    space = ctypes.c_void_p(made.make_space())

    def call(function, *arguments):
        unit = units[function]
        c = getattr(made, unit.name)
        kinds = [KINDS[function.__annotations__[name]] for name in unit.parameters]
        c.argtypes = [ctypes.c_void_p, *kinds] if unit.needs_space else kinds
        c.restype = KINDS[function.__annotations__["return"]]
        return c(space, *arguments) if unit.needs_space else c(*arguments)

    return call


def same(a, b):
    return (a == b and math.copysign(1.0, a) == math.copysign(1.0, b)) or (math.isnan(a) and math.isnan(b))


@pytest.mark.parametrize("function", [*NUMBERS, *LISTS, whole, rounded], ids=lambda f: f.__name__)
def test_a_function_in_c_has_the_bits_of_python(built, function):
    draw = Random(1)
    if function in NUMBERS:
        cases = [(x, y) for x in FEW for y in FEW] + [(draw.uniform(-9, 9), draw.uniform(-9, 9)) for _ in range(2000)]
    elif function in LISTS:
        cases = [(n, x) for n in COUNTS for x in (0.3, -1.7, 2.9)]
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
