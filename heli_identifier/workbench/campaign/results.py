"""The folder of a campaign's results: ``rows/<key>.parquet``, one row each, and ``campaign.parquet`` of them all.

A file appears whole or not at all, and a rig has the same file name however often it is diagnosed. A killed worker or a
killed campaign therefore leaves neither half a row nor two rows of one rig.
"""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from heli_identifier.errors import ConfigurationError
from heli_identifier.files import write_atomically
from heli_identifier.workbench.campaign.row import BASE, STAGES, Row, error_column
from heli_plant.effects import AXES

if TYPE_CHECKING:
    import pyarrow

CONSOLIDATED = "campaign.parquet"


@dataclass(frozen=True)
class Results:
    """Results of one campaign in ``folder``, which is made if it is missing."""

    folder: Path

    def __post_init__(self) -> None:
        try:
            self.rows.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigurationError(
                f"{self.folder} cannot hold results: {error.strerror}; name another output folder."
            ) from error

    @property
    def rows(self) -> Path:
        """Folder of the single rows."""
        return self.folder / "rows"

    def write(self, row: Row) -> Path:
        """Write one row; it replaces an older one of the same key."""
        return write_table(table([row]), self.rows / f"{row['key']}.parquet")

    def read(self, key: str) -> Row | None:
        """Return the row of a key, None if there is none."""
        path = self.rows / f"{key}.parquet"
        rows = read_rows(path) if path.exists() else []
        return rows[0] if rows else None

    def consolidate(self, rows: Sequence[Row]) -> Path:
        """Write all rows of a campaign into one file."""
        return write_table(table(rows), self.folder / CONSOLIDATED)


def schema() -> "pyarrow.Schema":
    """Return the columns and their types."""
    import pyarrow as pa

    text, number = pa.string(), pa.float64()
    effect = {
        "name": text, "axis": text, "coefficient": number, "standard_error": number, "score": number, "verdict": text,
        "alternatives": pa.list_(text), "variable": text, "frequency_hz": number,
    }  # fmt: skip
    columns: dict[str, pa.DataType] = {
        "rig": text,
        "key": text,
        "error": text,
        "verdict": text,
        "effects": pa.list_(_struct(effect)),
        "possible": pa.list_(_struct({"name": text, "axis": text, "score": number, "in_plant": pa.bool_()})),
        "closed_loop": pa.bool_(),
        "held_out_nats": number,
        **{f"{axis}_use": text for axis in AXES},
        **{column: number for symbol in BASE for column in (symbol, f"{symbol}_se")},
        **{error_column(axis, stage): number for axis in AXES for stage in STAGES},
        "seconds": number,
        "measures": pa.map_(text, number),
        "true_kind": text,
        "true_effects": pa.list_(_struct({"name": text, "axis": text, "coefficient": number})),
        "true_unknown": _struct({"axis": text, "variable": text}),
        **{f"true_{symbol}": number for symbol in BASE},
    }
    return pa.schema(list(columns.items()))


def complete(row: Row) -> Row:
    """Return a row with every column, None in those that it lacks."""
    return dict.fromkeys(schema().names) | row


def table(rows: Sequence[Row]) -> "pyarrow.Table":
    """Return rows as a table; missing columns are null."""
    import pyarrow as pa

    return pa.Table.from_pylist([complete(row) for row in rows], schema=schema())


def read_rows(path: Path) -> list[Row]:
    """Read rows as :func:`write_table` wrote them.

    Raises
    ------
    ConfigurationError
        The file is not a result of a campaign.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return pq.read_table(path, schema=schema()).to_pylist(maps_as_pydicts="strict")
    except (pa.ArrowException, OSError) as error:
        raise ConfigurationError(f"{path} is not a result of a campaign: {error}; move it away.") from error


def write_table(content: "pyarrow.Table", path: Path) -> Path:
    """Write a Parquet file so that no reader ever sees half of it.

    Raises
    ------
    ConfigurationError
        The folder cannot be written to.
    """
    import pyarrow.parquet as pq

    buffer = io.BytesIO()
    pq.write_table(content, buffer, compression="zstd")
    try:
        return write_atomically(path, buffer.getvalue())
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be written: {error}.") from error


def _struct(fields: dict) -> "pyarrow.DataType":
    import pyarrow as pa

    return pa.struct(list(fields.items()))
