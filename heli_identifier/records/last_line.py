"""Whether the last line of a text file is whole: a logger that is stopped, or a full disk, may cut it anywhere.

A line that ends in a line break is whole. Without one it may still be, as many programs leave the last break away;
the cells tell three cases apart:

* fewer cells than in the line before, a last cell that is no number, or fewer characters behind its decimal mark than
  all others of its column have alike: the line was cut, and is left out;
* as many characters behind the decimal mark as all others have alike: it is whole;
* any other: it cannot be known, and that is said.
"""

import csv

COMPARED = 100
"""Lines before the last whose last cells are compared."""


def whole_lines(data: bytes, separator: str, decimal: str) -> tuple[bytes, tuple[str, ...]]:
    """Leave out a last line that was cut, and blank lines at the end.

    Parameters
    ----------
    data : bytes
        The file, its header line included.
    separator, decimal : str
        What stands between cells, and in a number.

    Returns
    -------
    data : bytes
        Lines that are whole, or may be.
    notes : tuple of str
        What was left out or cannot be known.
    """
    ended = data.endswith((b"\n", b"\r"))
    data = data.rstrip()
    line_break = b"\n" if b"\n" in data else b"\r"
    lines = data.rsplit(line_break, COMPARED + 1)
    others, last = [_cells(line, separator) for line in lines[1:-1]], _cells(lines[-1], separator)
    if ended or not others:
        return data, ()
    whole = _is_whole(last, others, decimal)
    if whole is None:
        note = f"the file ends without a line break: whether its last cell, {last[-1]!r}, is whole cannot be known"
        return data, (note,)
    if whole:
        return data, ()
    row = data.count(line_break) + 1
    note = f"row {row} is left out: the file ends within it, after {lines[-1].decode('utf-8', 'replace')[-40:]!r}"
    return data[: len(data) - len(lines[-1])].rstrip(), (note,)


def _cells(line: bytes, separator: str) -> list[str]:
    return next(csv.reader([line.decode("utf-8", "replace")], delimiter=separator), [])


def _is_whole(last: list[str], others: list[list[str]], decimal: str) -> bool | None:
    """Whether a line has all its cells and all of the last one; None if that cannot be known."""
    if len(last) != len(others[-1]):
        return len(last) > len(others[-1])
    if not all(_is_number(cells[-1], decimal) for cells in others):
        return True  # a column of texts, or the nothing behind a separator at the end: no signal is at stake
    if not _is_number(last[-1], decimal):
        return False
    lengths = {len(cells[-1].strip().partition(decimal)[2]) for cells in others}
    if len(lengths) > 1 or lengths == {0}:
        return None
    return len(last[-1].strip().partition(decimal)[2]) >= lengths.pop()


def _is_number(text: str, decimal: str) -> bool:
    try:
        float(text.replace(decimal, "."))
    except ValueError:
        return False
    return True
