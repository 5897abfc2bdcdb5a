"""A sheet of an Excel workbook (.xlsx) as a table: the first sheet that holds one.

Its rows are laid out like the lines of a text file, so they are read as such: cells become a text with the digits that
make the same number again, separated by tabs.
"""

import csv
import io
from datetime import date, datetime, time
from pathlib import Path
from typing import Any

from heli_identifier.archives import ArchiveError, check_zip
from heli_identifier.errors import LogError
from heli_identifier.records.stream import in_memory
from heli_identifier.records.table import Table, needed
from heli_identifier.records.text import read_text_table


def read_spreadsheet(path: Path, file: str, mapped: frozenset[str]) -> Table:
    """Read a workbook.

    Raises
    ------
    LogError
        It is none, holds no table, or openpyxl is not installed.
    """
    openpyxl = needed("openpyxl", "openpyxl", "formats", file, "an Excel workbook")
    try:
        check_zip(path)
        with path.open("rb") as stream:
            book = openpyxl.load_workbook(stream, read_only=True, data_only=True, keep_links=False)
            found = next(
                ((sheet.title, text) for sheet in book.worksheets if (text := _text(sheet)).count("\n") > 2), None
            )
            titles = [sheet.title for sheet in book.worksheets]
    except ArchiveError as error:
        raise LogError(f"{file} is not a readable Excel workbook: {error}.") from error
    except Exception as error:  # the reader raises whatever its parsers do on a damaged workbook
        said = str(error).strip().splitlines() or [type(error).__name__]
        raise LogError(f"{file} is not a readable Excel workbook ({said[0][:200]}); save it again.") from error
    if found is None:
        raise LogError(f"{file} holds no table in any of its sheets ({', '.join(map(repr, titles))}).")
    title, text = found
    source = in_memory(text.encode())
    del found, text
    return read_text_table(source, file if len(titles) == 1 else f"{file}, sheet {title!r}", ".", mapped)


def _text(sheet: Any) -> str:
    out = io.StringIO()
    rows = csv.writer(out, delimiter="\t", lineterminator="\n")
    for row in sheet.iter_rows(values_only=True):
        rows.writerow([_cell(value) for value in row])
    return out.getvalue().rstrip() + "\n"


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, date | datetime | time):
        return value.isoformat()
    return repr(value) if isinstance(value, float) else str(value)
