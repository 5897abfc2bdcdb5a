"""Read a file as a `Log`: find the columns, cut, check, convert and resample, and note every change."""

import gzip
import hashlib
import io
import os
import zlib
from collections.abc import Sequence
from os import PathLike
from pathlib import Path

import numpy as np

from heli_identifier.errors import LogError, printable
from heli_identifier.files import read_limited

from .binary import LARGEST_MB, READERS, read_binary
from .columns import Array, Column, Table, find_columns
from .configuration import CONTRACT, LogFormat, RigConfiguration
from .log import Log
from .plausibility import check_plausible, describe_values, unwrap_angle, whole_turns
from .text import read_text
from .timing import find_sampling, mean_of_held
from .units import ANGLES, COMBINED, REFERENCES, SI_UNIT, VOLTAGES

_Signals = dict[str, Array]


def read_log(
    path: str | PathLike[str],
    format: LogFormat | RigConfiguration = CONTRACT,
    start: float | None = None,
    end: float | None = None,
) -> Log:
    """Read one log: sampled uniformly, in SI units, with the project's signs; its notes list every change.

    The file at ``path`` is CSV or other text, or by its ending a MATLAB (``.mat``), Excel (``.xlsx``), Parquet, TDMS or
    MDF file; compressed if it ends in ``.gz``. ``format`` says how the rig writes its logs. ``start`` and ``end``, the
    first and last instant to read in the file's time [s], override those of ``format``. A LogError says that the file
    cannot be read or that the log cannot serve identification.
    """
    configuration = format if isinstance(format, RigConfiguration) else None
    format = format.format if isinstance(format, RigConfiguration) else format
    table, sha256 = open_table(Path(path))
    columns = find_columns(table, format)
    start, end = format.start if start is None else start, format.end if end is None else end
    rows, notes = _crop(table, columns[0], start, end)
    values, notes = _Signals(), [*table.notes, *notes]
    unasked = {name for axis, name in zip(ANGLES, REFERENCES, strict=True) if axis not in format.references}
    for column in columns:
        try:
            values[column.signal] = table.numbers(column, rows)
        except LogError as error:
            if column.signal not in unasked:
                raise
            notes.append(f"{column.signal} is left out: {str(error).rstrip('.')}")
    columns = [column for column in columns if column.signal in values]
    time = values.pop("time")
    file, row = table.file, table.first_row + rows.start
    del table  # it may be large, and its columns have been copied

    rate_hz, grid, resampled = find_sampling(time, file, row)
    notes += resampled
    for column, reference in zip(columns[3:6], REFERENCES, strict=True):
        angle, note = unwrap_angle(values[column.signal], column, file, row)
        if note and reference in values:  # of itself it may jump by any angle
            asked = np.unwrap(values[reference])
            values[reference] = asked - whole_turns(asked - angle)
            note.append(f"{reference} taken from the same turns")
        values[column.signal] = angle
        notes += note
    if time[0] != 0.0:
        notes.append(f"time counts from 0, which the file calls {time[0]:g} s")
    values, converted = _apply_signs(values, columns, format)
    notes += converted
    check_plausible(columns[1:6], values, rate_hz, file)
    if grid is not None:
        values = {
            signal: np.interp(grid, time, samples) if signal in ANGLES else mean_of_held(time, samples, grid)
            for signal, samples in values.items()
        }
    voltages, angles = (np.stack([values[signal] for signal in signals], axis=1) for signals in (VOLTAGES, ANGLES))
    return Log(
        name=printable(os.fsencode(Path(path).stem).decode("utf-8", "replace")),  # a figure needs valid UTF-8
        path=str(path),
        sha256=sha256,
        rate_hz=rate_hz,
        voltages=voltages,
        angles=angles,
        references={axis: values[name] for axis, name in zip(ANGLES, REFERENCES, strict=True) if name in values},
        notes=(*notes, *describe_values(voltages, angles, format.voltage_limit)),
        start=float(time[0]),
        configuration=configuration,
    )


def open_table(path: Path) -> tuple[Table, str]:
    """Read a log as a table, with the SHA-256 of its bytes; a LogError if it is no file, too large or no table."""
    data = read_limited(path, LARGEST_MB, LogError, "; check the path", "name the log files in it", "; cut it")
    digest, name = hashlib.sha256(data).hexdigest(), path.name.lower()
    if name.endswith(".gz"):
        data, name = _decompress(data, path), name.removesuffix(".gz")
    ending = Path(name).suffix
    return (read_binary(data, ending, str(path)) if ending in READERS else read_text(data, str(path))), digest


def _decompress(data: bytes, path: Path) -> bytes:
    """Return the content of a gzip file of at most :data:`.binary.LARGEST_MB`."""
    content = bytearray()
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(data)) as file:
            while len(content) <= 1e6 * LARGEST_MB and (piece := file.read(1 << 20)):
                content += piece
    except (OSError, EOFError, zlib.error) as error:
        raise LogError(f"{path} is not readable as gzip ({error}); pack it again.") from error
    if len(content) > 1e6 * LARGEST_MB:
        raise LogError(f"{path} cannot be read: it has more than {LARGEST_MB:g} MB unpacked; cut it.")
    return bytes(content)


def _crop(table: Table, column: Column, start: float | None, end: float | None) -> tuple[slice, list[str]]:
    """Find the rows from the first one at or after `start` to the last one before time exceeds `end`."""
    time = table.values(column)
    count, finite = len(time), time[np.isfinite(time)]
    if (start is None and end is None) or not len(finite):
        return slice(0, count), []  # a time column without numbers is reported when its cells are converted
    from_s, to_s = -np.inf if start is None else start, np.inf if end is None else end
    # A printed instant may differ from the given one by the last bit; that must not cost a sample.
    tolerance = max(1e-9, 8.0 * float(np.finfo(float).eps * np.abs(finite).max()))
    first = int(np.append(time >= from_s - tolerance, True).argmax())
    last = first + int(np.append(time[first:] > to_s + tolerance, True).argmax())
    if last == first or not from_s < to_s:  # one of them may be nan
        lasts = f"the log lasts from {finite.min():g} s to {finite.max():g} s"
        asked = (f"{name} = {end_s:g} s" for name, end_s in (("start", start), ("end", end)) if end_s is not None)
        raise LogError(f"{table.file}: nothing is left with {' and '.join(asked)}; {lasts}: choose within it.")
    stretch = f"{time[first]:g} s to {time[last - 1]:g} s"
    return slice(first, last), [f"kept {stretch} of the file ({last - first} of {count} rows)"]


def _apply_signs(values: _Signals, columns: Sequence[Column], format: LogFormat) -> tuple[_Signals, list[str]]:
    """Convert the signals to the project's signs, clip the voltages if configured, and note all conversions."""
    converted = [column for column in columns if column.unit != SI_UNIT[column.signal]]
    notes = [f"{column.signal} converted from {column.unit} to {SI_UNIT[column.signal]}" for column in converted]
    if flipped := ", ".join(signal for signal, sign in format.signs.items() if sign < 0):
        notes.append(f"sign of {flipped} flipped")
    if format.swap_rotors:
        notes.append("front and rear voltage swapped")
    if COMBINED[0] in values:
        notes.append("front and rear voltage taken from their sum and difference")
    values, limit = format.to_project_signs(values), format.voltage_limit
    for signal in VOLTAGES if format.clip else ():
        if count := int((np.abs(values[signal]) > limit).sum()):
            notes.append(f"{signal} clipped to ±{limit:g} V in {count} sample{'' if count == 1 else 's'}")
            values[signal] = np.clip(values[signal], -limit, limit)
    return values, notes
