"""A text of nothing but numbers, as nearly all logs are: read by numpy, which is there already.

pandas reads every text, but takes a third of a second to import. Here a text is read only if each line has as many
numbers as there are columns; the result is then that of pandas to the bit.
"""

import io

import numpy as np
from numpy.typing import NDArray

_PLAIN = b"0123456789+-.eE \n"
"""Bytes of plain numbers, beside the separator."""

_CHUNK = 1 << 20


def plain_numbers(data: bytes, separator: str, above: int, columns: int) -> NDArray[np.float64] | None:
    """Read the numbers below the first lines of a text.

    Parameters
    ----------
    data : bytes
        The text, without blank lines at its end.
    separator : str
        Between numbers; a blank stands for any number of blanks.
    above : int
        Lines above the numbers.
    columns : int
        Numbers in a line.

    Returns
    -------
    NDArray, shape (N, columns), or None
        None if a line holds anything else, a quote stands above, or a carriage return ends a line alone.
    """
    returns = data.count(b"\r")
    if returns and returns != data.count(b"\r\n"):
        return None
    begin = 0
    for _ in range(above):
        begin = data.find(b"\n", begin) + 1
        if not begin:  # no line is left
            return None
    if begin == len(data):
        return None
    allowed = _PLAIN + b"\r" + separator.encode()
    pieces = (data[first : first + _CHUNK] for first in range(begin, len(data), _CHUNK))
    if b'"' in data[:begin] or any(piece.translate(None, allowed) for piece in pieces):
        return None
    text = io.BytesIO(data)  # shares the memory of ``data``
    text.seek(begin)
    delimiter = None if separator == " " else separator
    try:
        values = np.loadtxt(text, delimiter=delimiter, comments=None, ndmin=2, encoding="ascii")
    except ValueError:
        return None
    lines = data.count(b"\n", begin) + 1
    return values if values.shape == (lines, columns) else None  # numpy passes over blank lines
