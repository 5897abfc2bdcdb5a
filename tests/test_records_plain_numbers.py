"""Texts of nothing but numbers: read as pandas reads them, and left to pandas where anything else stands."""

import io

import numpy as np
import pandas
import pytest

from heli_identifier.records.plain_numbers import plain_numbers

HEADER = b"time,pitch\n"


def test_numbers_are_those_nearest_to_the_text_as_pandas_and_python_read_them():
    random = np.random.default_rng(1)
    digits = [f"{random.standard_normal() * 10.0 ** int(random.integers(-30, 30)):.17g}" for _ in range(2000)]
    text = "\n".join(f"{a},{b}" for a, b in zip(digits[::2], digits[1::2], strict=True)).encode()
    read = plain_numbers(HEADER + text, ",", 1, 2)
    by_pandas = pandas.read_csv(io.BytesIO(text), header=None, float_precision="round_trip").to_numpy()
    np.testing.assert_array_equal(read, by_pandas)
    np.testing.assert_array_equal(read, np.array([float(d) for d in digits]).reshape(-1, 2))


@pytest.mark.parametrize("line_break", [b"\n", b"\r\n"])
@pytest.mark.parametrize("separator", [",", ";", "\t", " "])
def test_every_separator_and_line_break_is_read(separator, line_break):
    rows = line_break.join(separator.join(row).encode() for row in (("0", "-1.5"), ("1e-2", " +2."), ("2", ".5")))
    read = plain_numbers(b"a preamble" + line_break + b"t x" + line_break + rows, separator, 2, 2)
    np.testing.assert_array_equal(read, [[0.0, -1.5], [0.01, 2.0], [2.0, 0.5]])


@pytest.mark.parametrize(
    "body",
    [b"", b"0,1\n\n1,2", b"0,1\n1", b"0,1\n1,2,3", b"0,1,2\n1,2,3", b"0,nan\n1,2", b"0,\n1,2", b'0,"1"\n1,2',
     b"0,1\r1,2", b"0,1e\n1,2", b"0,12:00\n1,2"],
)  # fmt: skip
def test_anything_else_is_left_to_pandas(body):
    assert plain_numbers(HEADER + body, ",", 1, 2) is None


def test_a_quoted_header_may_hold_line_breaks_and_is_left_to_pandas():
    assert plain_numbers(b'"time\n[s]",pitch\n0,1\n', ",", 2, 2) is None
