"""Faults of logs: their values, columns and text, and what kind of file they are."""

import gzip
import os

import numpy as np
import pyarrow
import pyarrow.parquet
from scipy.io import savemat

from tests.faults.case import Fault
from tests.faults.material import HEADER, IDENTIFY, ROWS, as_struct, columns, configured, good, nothing, pipe, write

DIAGNOSE = "heli diagnose log.csv -o out"
RNG = np.random.default_rng(5)
HEADERS = HEADER.split(",")
TIME, FRONT, REAR, PITCH, ELEVATION, TRAVEL = range(6)


def text(values, headers=HEADERS, separator=","):
    rows = [separator.join(map(repr, row)) for row in np.transpose(values).tolist()]
    return "\n".join([separator.join(headers), *rows, ""])


def changed(change, headers=HEADERS):
    def make(folder):
        values = columns()
        change(values)
        (folder / "log.csv").write_text(text(values, headers))

    return make


def headed(**names):
    """Return a function that writes a log with other headers, by the old name."""
    return write(text(columns(), [names.get(header.split(" ")[0], header) for header in HEADERS]))


def matlab(**variables):
    return lambda folder: savemat(folder / "log.mat", variables)


def lines(*rows):
    return write("\n".join([*rows, ""]))


def at(column, rows, value):
    return changed(lambda values: values[column].__setitem__(rows, value))


def whole(column, value):
    return at(column, slice(None), value)


VALUES = (
    Fault("a sentinel of 999 among the pitch", at(PITCH, 700, 999.0), IDENTIFY, "row 702: pitch is 999 rad and was" ),
    Fault("a sentinel that lasts ten samples", at(TRAVEL, slice(700, 710), 999.0), IDENTIFY, "row 702: travel is 999 rad and was"),
    Fault("a lost sample written as 0", changed(lambda v: (v[ELEVATION].__iadd__(0.6), v[ELEVATION].__setitem__(900, 0.0))), IDENTIFY, "row 902: elevation is 0 rad and was"),
    Fault("a sample that is a whole turn off", at(PITCH, 500, 2.0 * np.pi), IDENTIFY, "row 502: pitch is 6.28319 rad and was"),
    Fault("NaN in a voltage", at(FRONT, 9, np.nan), IDENTIFY, "row 11, column 'v_front [V]'"),
    Fault("1e308 V", at(FRONT, 9, 1e308), IDENTIFY, "v_front reaches 1e+308 V when read in V (at most 30), which no rig can; state the unit, v_front = \"mV\", under [log.units] of heli.toml (written by `heli init`); if these are commands before the amplifiers' limit, set clip = true"),
    Fault("v_front equal to v_rear throughout", changed(lambda v: v[REAR].__setitem__(slice(None), v[FRONT])), IDENTIFY, "v_front - v_rear is constant in every log"),
    Fault("volts called millivolts", headed(v_front="v_front [mV]", v_rear="v_rear [mV]"), IDENTIFY, "no voltage exceeds 0.00"),
    Fault("a voltage that never changes", whole(FRONT, 1.0), IDENTIFY, "v_front is constant in every log"),
    Fault("a constant angle, to be diagnosed", whole(PITCH, 0.1), DIAGNOSE, "pitch never changes"),
    Fault("degrees called radians", changed(lambda v: v[PITCH].__imul__(57.3)), IDENTIFY, "pitch reaches"),
    Fault("time that stands still", at(TIME, 700, 6.99), IDENTIFY, "row 702: time stands still"),
    Fault("time that runs back", at(TIME, 700, 3.0), IDENTIFY, "row 702: time runs back"),
    Fault("a hole of .2 s", lambda f: (f / "log.csv").write_text("\n".join([HEADER, *ROWS[:700], *ROWS[720:], ""])), IDENTIFY, "no samples for 0.21 s"),
    Fault("a rate of 2500 Hz", changed(lambda v: v[TIME].__itruediv__(25.0)), IDENTIFY, "the rate of 2500 Hz is above 2000 Hz"),
    Fault("a stretch behind the log's end", good, f"{IDENTIFY} --from 30", "nothing is left with start = 30 s; the log lasts from 0 s to 19.99 s"),
    Fault("a stretch before the log's start", good, f"{IDENTIFY} --to -1", "nothing is left with end = -1 s"),
    Fault("a stretch that ends before it begins", good, f"{IDENTIFY} --from 8 --to 3", "nothing is left with start = 8 s and end = 3 s"),
    Fault("a stretch that never ends", good, f"{IDENTIFY} --to nan", "nothing is left with end = nan s"),
    Fault("degrees called radians, kept within half a turn", changed(lambda v: v[TRAVEL].__setitem__(slice(None), (57.3 * v[TRAVEL] + 359.0) % 360.0 - 180.0)), IDENTIFY, "rad in the row before when read in rad, which no rig can; correct the value (is it a mark of a missing one?), state its unit"),
    Fault("a log of 9 s, too short for an estimate", good, f"{IDENTIFY} --to 9", "log log has 9.01 s without an event; 15 s are needed to estimate parameters"),
    Fault("voltages beyond the limit", changed(lambda v: v[1:3].__imul__(4.0)), IDENTIFY, "beyond the limit of 5 V; the plant saturates at the highest voltage", 0, ("out",)),
    Fault("a log of 2 s", lambda f: (f / "log.csv").write_text("\n".join([HEADER, *ROWS[:200], ""])), IDENTIFY, "2 s of log are shorter than 5 s"),
)  # fmt: skip

STICK = '[log.references]\npitch = "stick"\n'
TWO = matlab(monday=as_struct(), tuesday=as_struct())
COLUMNS = (
    Fault("a .mat with two structs of six signals", TWO, "heli identify log.mat -o out", "'monday.time_s', 'tuesday.time_s'"),
    Fault("one column taken for two signals", configured('[log.columns]\nv_rear = "v_front [V]"\n'), IDENTIFY, "is taken for v_front and for v_rear"),
    Fault("a unit `Grad`", headed(pitch="pitch [Grad]"), IDENTIFY, "unit 'Grad' is unknown, rad, deg, counts, rev or mrad is needed"),
    Fault("a rate where an angle is wanted", headed(pitch="pitch [deg/s]"), IDENTIFY, "unit 'deg/s' is unknown"),
    Fault("a unit that is missing", headed(pitch="pitch"), IDENTIFY, "the unit is missing"),
    Fault("a unit `degrees`, which is plain", changed(lambda v: v[PITCH].__imul__(180.0 / np.pi), [h.replace("pitch [rad]", "pitch [degrees]") for h in HEADER.split(",")]), IDENTIFY, "pitch converted from deg to rad", 0, ("out",)),
    Fault("a missing column", headed(pitch="ptich [rad]"), IDENTIFY, "did you mean 'ptich [rad]'?"),
    Fault("a reference whose column is missing", configured(STICK), IDENTIFY, "column 'stick' missing, found"),
    Fault("a reference in a unit that is unknown", configured(STICK, lines(f"{HEADER},stick [gon]", *(f"{row},0.1" for row in ROWS))), IDENTIFY, "column 'stick [gon]': unit 'gon' is unknown"),
    Fault("a reference that nobody asked for, with an empty cell", lines(f"{HEADER},pitch_reference", *(f"{row}," for row in ROWS)), IDENTIFY, "pitch_reference is left out: log.csv, row 2, column 'pitch_reference': the cell is empty", 0, ("out",)),
    Fault("time stamps with the day before the year", lines(HEADER, *("01.03.2026 12:00:0" + row for row in ROWS)), IDENTIFY, "write time stamps like 2026-03-01T12:00:00.010 (ISO 8601)"),
    Fault("a .mat without a vector", matlab(gain=3.0, who="me"), "heli identify log.mat -o out", "holds no vector of numbers, found gain, who"),
    Fault("a .mat with a signal that is shorter", matlab(**as_struct() | {"pitch_rad": np.zeros(30)}), "heli identify log.mat -o out", "'pitch_rad' has 30 samples, 'time_s' has 2000"),
    Fault("a .mat with complex numbers", matlab(**as_struct() | {"pitch_rad": np.full(2000, 1j)}), "heli identify log.mat -o out", "row 1, column 'pitch_rad': the cell holds"),
    Fault("no header", lambda f: (f / "log.csv").write_text("\n".join(ROWS)), IDENTIFY, "missing, found 'column 1', 'column 2'"),
    Fault("a row of eight cells", lambda f: (f / "log.csv").write_text("\n".join([HEADER, *ROWS[:99], ROWS[99] + ",1,2", *ROWS[100:], ""])), IDENTIFY, "row 101: it has more cells than the 6 headers"),
    Fault("decimal commas", write(text(columns(), separator=";").replace(".", ",")), IDENTIFY, "written", 0, ("out",)),
)  # fmt: skip


def cell(row, column, content):
    cells = ROWS[row].split(",")
    cells[column] = content
    return lines(HEADER, *ROWS[:row], ",".join(cells), *ROWS[row + 1 :])


def endless(folder):
    """Write a Parquet file of few bytes and fifty million rows."""
    zeros = pyarrow.array([0.0]).take(pyarrow.array([0] * 10_000_000, pyarrow.int32()))
    schema = pyarrow.schema([(header, pyarrow.float64()) for header in HEADERS])
    with pyarrow.parquet.ParquetWriter(folder / "log.parquet", schema) as out:
        batch = pyarrow.table([zeros] * 6, schema=schema)
        for _ in range(5):
            out.write_table(batch)


TEXTS = (
    Fault("a word among decimal commas", lines(*(row.replace(",", ";").replace(".", ",") for row in (HEADER, *ROWS[:700], "7.00,Err", *ROWS[701:]))), IDENTIFY, "row 702, column 'v_front [V]': the cell holds 'Err', which is not a finite number; correct the cell"),
    Fault("digits with an underscore, 1_0, which are ten in Python only", cell(700, PITCH, "1_0"), IDENTIFY, "'1_0', which is not a finite number"),
    Fault("a row that is cut short, behind the begin of the stretch", lines(HEADER, *ROWS[:516], "5.16,1,1", *ROWS[517:]), f"{IDENTIFY} --from 2", "row 518, column 'pitch [rad]': the cell is empty"),
    Fault("a header alone", lines(HEADER), IDENTIFY, "holds a header but no rows"),
    Fault("a header and one row", lines(HEADER, ROWS[0]), IDENTIFY, "1 sample"),
    Fault("a quotation mark that is never closed", cell(700, PITCH, '"0.1'), IDENTIFY, "row 702: a quotation mark is not closed"),
    Fault("a line separator (U+2028) within a comment", lines("# north\u2028lab", HEADER, *ROWS), IDENTIFY, "line 1 is no part of the table", 0, ("out",)),
    Fault("the header once more between the rows", lines(HEADER, *ROWS[:700], HEADER, *ROWS[700:]), IDENTIFY, "the cell holds 'time [s]'"),
    Fault("a last line that holds a sum", lines(HEADER, *ROWS, "Total,2000"), IDENTIFY, "the cell holds 'Total'"),
    Fault("zeros behind the text, as a crashed logger leaves them", write("\n".join([HEADER, *ROWS, ""]).encode() + bytes(4096)), IDENTIFY, "it holds binary data"),
    Fault("30000 headers over rows of one cell", lines(",".join(HEADERS + [f"c{i}" for i in range(30_000)]), *(["1"] * 20_000)), IDENTIFY, "have fewer cells than its 30006 headers"),
    Fault("a pitch in radians and one in degrees", lines(f"{HEADER},pitch [deg]", *(f"{row},0" for row in ROWS)), IDENTIFY, "pitch stands in 2 columns"),
    Fault("two columns with one header", lines(f"{HEADER},pitch [rad]", *(f"{row},0" for row in ROWS)), IDENTIFY, "keep one, or give it a header of its own and name it"),
    Fault("names of the columns that are abbreviated", lines(HEADER.replace("v_front", "Vf").replace("v_rear", "Vb"), *ROWS), IDENTIFY, "`heli init log.csv` looks into the log"),
    Fault("milliseconds since 1970 under [s]", write(text([1.7e12 + 1e3 * columns()[0], *columns()[1:]])), IDENTIFY, "the rate of 0.1 Hz is below 50 Hz"),
    Fault("a Parquet file of 50 million rows in few bytes", endless, "heli identify log.parquet -o out", "more than 1000 MB"),
    Fault("a file of /proc, which has no size", nothing, "heli identify /proc/self/maps -o out", "is empty"),
    Fault("commas of another script", write("\n".join([HEADER, *ROWS, ""]).replace(",", "\uff0c")), IDENTIFY, "log.csv is not a table"),
    Fault("a last line of 10 MB", lambda f: write("\n".join([HEADER, *ROWS, "1" * 10_000_000]))(f), IDENTIFY, "row 2002 is left out: the file ends within it", 0, ("out",)),
    Fault("2000 columns of zeros", lambda f: (f / "log.csv").write_text(",".join(f"c{k}" for k in range(2000)) + ("\n" + ",".join(["0"] * 2000)) * 50), "heli init log.csv", "no column increases from row to row"),
    Fault("a travel of 1e308 rad throughout", whole(TRAVEL, 1e308), "heli identify log.csv -o out", "angles, sample 0: not finite, or beyond 10000 rad; give them in rad"),
    Fault("a header with a control character: what `heli init` writes", headed(pitch="theta\x7f"), "heli init log.csv >/dev/null && heli identify log.csv -o out >/dev/null; echo exit $?", "exit 0", 0, ("heli.toml", "out"), True),
)  # fmt: skip

KINDS = (
    Fault("/dev/zero", nothing, "heli identify /dev/zero -o out", "it is a folder, a pipe or a device"),
    Fault("a pipe without a writer", lambda f: pipe(f / "log.csv"), IDENTIFY, "it is a folder, a pipe or a device"),
    Fault("a folder", lambda f: (f / "log.csv").mkdir(), IDENTIFY, "is a folder; name the log files in it"),
    Fault("a file of 2 GB", lambda f: ((f / "log.csv").touch(), os.truncate(f / "log.csv", 2_000_000_000)), IDENTIFY, "it has 2000 MB, more than 1000 MB"),
    Fault("a file that is missing", nothing, IDENTIFY, "does not exist"),
    Fault("a file that is empty", write(b""), IDENTIFY, "is empty"),
    Fault("a picture", write(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"), IDENTIFY, "it holds binary data"),
    Fault("prose", write("It flew well today\nuntil it did not\n"), IDENTIFY, "is not a table"),
    Fault("a .mat that is cut short", lambda f: (matlab(**as_struct())(f), (f / "log.mat").write_bytes((f / "log.mat").read_bytes()[:900])), "heli identify log.mat -o out", "is not readable as a MATLAB file"),
    Fault("a .mat that is none", write("no", "log.mat"), "heli identify log.mat -o out", "is not readable as a MATLAB file" ),
    Fault("a .parquet that is none", write("no", "log.parquet"), "heli identify log.parquet -o out", "is not readable as a Parquet file"),
    Fault("an .mf4 that is none", write("no", "log.mf4"), "heli identify log.mf4 -o out", "is not readable as an MDF file" ),
    Fault("a .csv.gz that is none", write("no", "log.csv.gz"), "heli identify log.csv.gz -o out", "is not readable as gzip"),
    Fault("a .csv.gz that holds 200 MB of zeros", lambda f: (f / "log.csv.gz").write_bytes(gzip.compress(b"0" * 200_000_000, 1)), "heli identify log.csv.gz -o out", "is not a table"),
    Fault("a link to itself", lambda f: (f / "log.csv").symlink_to("log.csv"), IDENTIFY, "Too many levels of symbolic links"),
)  # fmt: skip

SECTIONS = {
    "Values in a log": VALUES,
    "Columns and units of a log": COLUMNS,
    "The text of a log": TEXTS,
    "Files that are no log": KINDS,
}
