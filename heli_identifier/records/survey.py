"""A text gone through once, before it is read: its first and last lines, its end, its encoding.

A logger that is stopped, or a full disk, may cut the last line anywhere. A line that ends in a line break is whole. A
last line without one may be whole as well, since many programs omit the last line break. Its cells decide:

* It has fewer cells than the line before, its last cell is not a number, or its last cell has fewer decimals than all
  other cells of the column, which have equally many: the line was cut and is left out.
* Its last cell has as many decimals as all others of the column: the line is whole.
* Otherwise nobody can know: the line is kept and a note says so.
"""

from codecs import BOM_UTF8, getincrementaldecoder
from dataclasses import dataclass, replace

from heli_identifier.errors import LogError
from heli_identifier.records.layout import HEAD, cells_of, is_number
from heli_identifier.records.stream import PIECE, Pieces, recoded

_NOTHING = BOM_UTF8 + b" \t\n\r\v\f"
"""Bytes of which a file without text consists."""

_COMPARED = 100
"""Number of lines before the last whose last cells are compared with it."""

_MARKS = (b"\n", b"\r")


@dataclass(frozen=True)
class Survey:
    """What one pass through a text tells of it.

    Attributes
    ----------
    pieces : Pieces
        The text in UTF-8.
    head, tail : bytes
        Its beginning, and its last megabyte up to `end`.
    end : int
        Where the last line ends that is not blank [bytes].
    ended : bool
        Whether the text ends in a line break.
    line_break : bytes
        What separates its lines.
    breaks : int
        Number of line breaks before `end`.
    """

    pieces: Pieces
    head: bytes
    tail: bytes
    end: int
    ended: bool
    line_break: bytes
    breaks: int


def surveyed(pieces: Pieces, file: str) -> Survey:
    """Go through a text in UTF-8, UTF-16 with its mark, or the encoding of western Windows.

    Raises
    ------
    LogError
        The bytes are no text, or none at all.
    """
    if next(pieces(), b"")[:2] in (b"\xff\xfe", b"\xfe\xff"):
        pieces = recoded(pieces, "utf-16", "strict")
        try:
            return _through(pieces, file)
        except UnicodeError as error:
            raise LogError(f"{file} begins like UTF-16 text but is none; save it as UTF-8.") from error
    try:
        return _through(pieces, file)
    except UnicodeError:
        return _through(recoded(pieces, "cp1252", "replace"), file)


def _through(pieces: Pieces, file: str) -> Survey:
    decoder = getincrementaldecoder("utf-8")()
    head, tail, gap, last = b"", b"", b"", b""  # gap: blanks behind the end
    size = end = 0
    before = [0, 0]  # line feeds and carriage returns before the end, and behind it
    behind = [0, 0]
    text = False
    for piece in pieces():
        if b"\0" in piece:
            raise LogError(
                f"{file} is not a table: it holds binary data; give a text file with a header and one row per sample, "
                "or one of the formats that are known by their ending (.mat, .xlsx, .parquet, .tdms, .mf4)."
            )
        decoder.decode(piece)
        head = (head + piece)[: HEAD + 1] if len(head) <= HEAD else head
        content = piece.rstrip()
        blank = piece[len(content) :]
        text = text or bool(piece.strip(_NOTHING))
        if content:
            before = [
                count + more + content.count(mark) for count, more, mark in zip(before, behind, _MARKS, strict=True)
            ]
            behind = [0, 0]
            tail = tail[-PIECE:] + gap + content if len(gap) <= PIECE else content
            gap, end = b"", size + len(content)
        behind = [count + blank.count(mark) for count, mark in zip(behind, _MARKS, strict=True)]
        gap = gap + blank if len(gap) <= PIECE else gap
        size += len(piece)
        last = piece[-1:] or last
    decoder.decode(b"", final=True)
    if not text:
        raise LogError(f"{file} is empty; give a CSV file with a header and one row per sample.")
    line_break, breaks = (b"\n", before[0]) if before[0] else (b"\r", before[1])
    return Survey(pieces, head, tail, end, last in _MARKS, line_break, breaks)


def whole_lines(survey: Survey, separator: str, decimal: str) -> tuple[Survey, tuple[str, ...]]:
    """Leave out a last line that was cut; give the rest, and a note if there is one."""
    lines = [line.decode("utf-8", "replace") for line in survey.tail.rsplit(survey.line_break, _COMPARED + 1)]
    others, last = [cells_of(line, separator) for line in lines[1:-1]], cells_of(lines[-1], separator)
    whole = True if survey.ended or not others else _is_whole(last, others, decimal)
    if whole:
        return survey, ()
    if whole is None:
        note = f"the file ends without a line break: whether its last cell, {last[-1]!r}, is whole cannot be known"
        return survey, (note,)
    note = f"row {survey.breaks + 1} is left out: the file ends within it, after {lines[-1][-40:]!r}"
    rest = survey.tail[: survey.tail.rindex(survey.line_break)].rstrip()
    return replace(survey, end=survey.end - len(survey.tail) + len(rest)), (note,)


def _is_whole(last: list[str], others: list[list[str]], decimal: str) -> bool | None:
    """Whether a line has all its cells and all of the last one; None if that cannot be known."""
    if len(last) != len(others[-1]):
        return len(last) > len(others[-1])
    if not last or not all(cells and is_number(cells[-1], decimal) for cells in others):
        return True  # a column of texts, or the empty cells behind a separator at the line's end: not a signal
    if not is_number(last[-1], decimal):
        return False
    decimals = {len(cells[-1].strip().partition(decimal)[2]) for cells in others}
    if len(decimals) > 1 or decimals == {0}:
        return None
    return len(last[-1].strip().partition(decimal)[2]) >= decimals.pop()
