"""Variations of the faults: found by trying what the other tables do not hold."""

import json

import pyarrow
import pyarrow.parquet

from tests.faults.case import Fault
from tests.faults.material import (
    HEADER,
    HEADERS,
    PITCH,
    ROWS,
    columns,
    configured,
    document,
    good,
    nothing,
    parameters,
    text,
    write,
)
from tests.faults.outputs import END, LONG, MASTERS, WAIT

IDENTIFY = "heli identify log.csv -o out"
CHECK = "heli check log.csv -p parameters.json --factor 1000"
DESIGN = "heli design --show reverse_thrust_loss"


def cell(row, column, content):
    """Give a function that writes a log with another content in one cell."""
    rows = list(ROWS)
    cells = rows[row].split(",")
    cells[column] = content
    rows[row] = ",".join(cells)
    return write("\n".join([HEADER, *rows, ""]))


def lines(*found):
    return write("\n".join([*found, ""]))


def value(name, **fields):
    return parameters(lambda d: d["values"][name].update(fields))


def expected(change):
    return parameters(lambda d: change(d["expected"]))


def endless(folder):
    """Write a Parquet file of few bytes and fifty million rows."""
    zeros = pyarrow.array([0.0]).take(pyarrow.array([0] * 10_000_000, pyarrow.int32()))
    schema = pyarrow.schema([(header, pyarrow.float64()) for header in HEADERS])
    with pyarrow.parquet.ParquetWriter(folder / "log.parquet", schema) as out:
        batch = pyarrow.table([zeros] * 6, schema=schema)
        for _ in range(5):
            out.write_table(batch)


def controller(folder):
    good(folder)
    content = document()
    content["unit"] = "PidController"
    content["values"] = {"pitch.proportional": {"value": 6.0, "standard_error": None, "unit": "V/rad"}}
    (folder / "parameters.json").write_text(json.dumps(content))


LOGS = (
    Fault("digits with an underscore, 1_0, which are ten in Python only", cell(700, PITCH, "1_0"), IDENTIFY, "'1_0', which is not a finite number"),
    Fault("a number of 400 digits", cell(700, PITCH, "9" * 400), IDENTIFY, "...', which is not a finite number"),
    Fault("a quotation mark that is never closed", cell(700, PITCH, '"0.1'), IDENTIFY, "row 702: a quotation mark is opened and never closed"),
    Fault("a line separator (U+2028) within a comment", lines("# north\u2028lab", HEADER, *ROWS), IDENTIFY, "line 1 is no part of the table", 0, ("out",)),
    Fault("a form feed within a comment", lines("# north\x0clab", HEADER, *ROWS), IDENTIFY, "line 1 is no part of the table", 0, ("out",)),
    Fault("the header once more between the rows", lines(HEADER, *ROWS[:700], HEADER, *ROWS[700:]), IDENTIFY, "the cell holds 'time [s]'"),
    Fault("two logs in one file", lines(HEADER, *ROWS, *ROWS), IDENTIFY, "time runs back from 19.99 s to 0 s"),
    Fault("a comment between the rows", lines(HEADER, *ROWS[:700], "# pause", *ROWS[700:]), IDENTIFY, "the cell holds '# pause'"),
    Fault("a blank line between the rows", lines(HEADER, *ROWS[:700], "", *ROWS[700:]), IDENTIFY, "row 702, column 'time [s]': the cell is empty"),
    Fault("a last line that holds a sum", lines(HEADER, *ROWS, "Total,2000"), IDENTIFY, "the cell holds 'Total'"),
    Fault("zeros behind the text, as a crashed logger leaves them", write("\n".join([HEADER, *ROWS, ""]).encode() + bytes(4096)), IDENTIFY, "it holds binary data"),
    Fault("30000 headers over rows of one cell", lines(",".join(HEADERS + [f"c{i}" for i in range(30_000)]), *(["1"] * 20_000)), IDENTIFY, "have fewer cells than its 30006 headers"),
    Fault("a pitch in radians and one in degrees", lines(f"{HEADER},pitch [deg]", *(f"{row},0" for row in ROWS)), IDENTIFY, "pitch stands in 2 columns"),
    Fault("milliseconds since 1970 under [s]", write(text([1.7e12 + 1e3 * columns()[0], *columns()[1:]])), IDENTIFY, "the rate of 0.1 Hz is below 50 Hz"),
    Fault("radians that are called counts", configured('[log.units]\npitch = "counts"\n'), IDENTIFY, "counts are whole numbers"),
    Fault("a Parquet file of 50 million rows in few bytes", endless, "heli identify log.parquet -o out", "at most"),
    Fault("a file of /proc, which has no size", nothing, "heli identify /proc/self/maps -o out", "is empty"),
)  # fmt: skip

CONFIGURATIONS = (
    Fault("a voltage limit of 1e-320 V", configured("[rig]\nvoltage_limit = 1e-320\n"), IDENTIFY, "must lie in [0.1, 30] V"),
    Fault("a largest file of infinite size", configured("[log]\nlargest_file = inf\n"), IDENTIFY, "written: out/parameters.json", 0, ("out",)),
    Fault("a sign of 0", configured("[log.signs]\npitch = 0\n"), IDENTIFY, "voltages and angles take 1 or -1"),
    Fault("a sign that is true", configured("[log.signs]\npitch = true\n"), IDENTIFY, "must be a whole number"),
    Fault("a column without a name", configured('[log.columns]\npitch = ""\n'), IDENTIFY, "column '' missing"),
    Fault("a sum of the voltages without their difference", configured('[log.columns]\nv_sum = "v_front"\n'), IDENTIFY, "column 'v_difference [V]' missing"),
    Fault("a date for a name", configured("[rig]\nname = 1979-05-27\n"), IDENTIFY, "must be a text in quotes"),
    Fault("a rest pitch of 9 rad", configured("[rig]\nrest_pitch = 9\n"), IDENTIFY, "must lie in [-1.6, 1.6] rad"),
    Fault("a table where a number belongs", configured("[rig]\nvoltage_limit = {}\n"), IDENTIFY, "must be a number"),
)  # fmt: skip

PARAMETERS = (
    Fault("an expected error below 0", expected(lambda e: e["pitch"]["prediction_1s_rad"].update(value=-1.0)), CHECK, "expected `float` >= 0.0"),
    Fault("no expected error of the pitch", expected(lambda e: e.pop("pitch")), CHECK, "state no expected error of pitch"),
    Fault("a number of 400 digits in parameters.json", value("pitch.gain", value=10**400), CHECK, "number out of range"),
    Fault("true for a number", value("pitch.gain", value=True), CHECK, "expected `float`, got `bool`"),
    Fault("a plant without a gain of the pitch", value("pitch.gain", value=0.0), "heli linearise parameters.json -o out", "no equilibrium"),
    Fault("a parameter's name with a line break", parameters(lambda d: d["values"].update({"a\nb": d["values"]["pitch.gain"]})), CHECK, "no parameter 'a\\nb'"),
    Fault("a mark of UTF-8 before the JSON", lambda f: (good(f), write(b"\xef\xbb\xbf{}", "parameters.json")(f)), CHECK, "Unexpected UTF-8 BOM"),
    Fault("parameters of a controller for a plant", controller, f"{DESIGN} -p parameters.json", "holds parameters of the PidController, those of the HelicopterPlant are needed"),
)  # fmt: skip

OPTIONS = (
    Fault("an empty word, as of a variable that is not set", parameters(), 'heli identify log.csv -o ""', "an argument is empty"),
    Fault("an empty value behind =", parameters(), "heli identify log.csv --output=", "an argument is empty"),
    Fault("the log as the file to write", parameters(), f"{CHECK} --junit log.csv", "log.csv is read by this command and not written over"),
    Fault("the parameters as the file to write", parameters(), f"{CHECK} --junit ./parameters.json", "parameters.json is read by this command and not written over"),
    Fault("the played log as the file to write", parameters(), "heli simulate measured_data --log log.csv -o log.csv", "is read by this command and not written over"),
    Fault("the log as the configuration to write", good, "heli init log.csv -o log.csv", "is read by this command and not written over"),
    Fault("a parameter given twice", nothing, "heli simulate open_loop -d 1 -s plant.pitch.damping=1 -s plant.pitch.damping=2", "--set plant.pitch.damping is given twice"),
    Fault("--to minus infinity", parameters(), f"{CHECK} --to -inf", "end = -inf s must be finite"),
    Fault("--from NaN", parameters(), f"{CHECK} --from nan", "start = nan s must be finite"),
    Fault("--from far before the log, and --to", parameters(), f"{CHECK} --from -1e12 --to 10", "kept 0 s to 10 s of the file (1001 of 2000 rows)", 0),
    Fault("a factor of NaN", parameters(), f"{CHECK} --factor nan", "factor = nan"),
    Fault("a filter of 1e-300 rad/s", good, f"{IDENTIFY} --filter-frequency 1e-300", "must lie in [0.001, 20] rad/s"),
    Fault("an endless SSP", nothing, "heli ssp open_loop --duration inf -o a.ssp", "duration = inf s must be positive and finite"),
    Fault("an SSP of no length", nothing, "heli ssp open_loop --duration 0 -o a.ssp", "duration = 0 s must be positive and finite"),
    Fault("an endless experiment", nothing, f"{DESIGN} --duration inf", "duration = inf s must lie in [20, 3600] s"),
    Fault("an experiment within no angle", nothing, f"{DESIGN} --pitch-limit 0", "pitch limit = 0.0 rad must lie in [0.01, 100] rad"),
    Fault("an experiment without a limit of the voltage", nothing, f"{DESIGN} --voltage-limit inf", "voltage limit = inf V must lie in [0.1, 100] V"),
    Fault("a hover at NaN", nothing, "heli design --closed-loop --hover nan", "hover = nan rad must lie in [-1.5, 1.5] rad"),
    Fault("an operating point on the rig's back", parameters(), "heli linearise parameters.json --pitch 9 -o out", "pitch = 9.0 rad must lie in [-1.5, 1.5] rad"),
    Fault("an operating point at NaN", parameters(), "heli linearise parameters.json --elevation nan -o out", "elevation = nan rad must lie in [-1.5, 1.5] rad"),
    Fault("a fleet of one rig by two names", lambda f: ((f / "a").mkdir(), good(f / "a"), (f / "b").symlink_to("a")), "heli fleet a b -o out", "a is given 2 times"),
    Fault("a generator that is no function", nothing, "heli campaign --generator os:nothing --rigs 1 -o out", "module os has no function nothing"),
    Fault("a port beyond 65535 to listen on", parameters(), "heli follow -p parameters.json -o out --listen 127.0.0.1:99999", "must be a numeric address and a port"),
)  # fmt: skip

GONE = "mkdir d; cd d; rmdir ../d;"
SURROUNDINGS = (
    Fault("the folder of the command is gone: `heli build`", nothing, f"{GONE} heli build Exciter", "the folder in which this command runs is gone", shell=True),
    Fault("the folder of the command is gone: `heli simulate`", nothing, f"{GONE} heli simulate open_loop -d 1", "the folder in which this command runs is gone", shell=True),
    Fault("a backend of matplotlib that there is not", good, f"MPLBACKEND=nonsense {IDENTIFY} >/dev/null; echo exit $?", "exit 0", 0, ("out",), True),
    Fault("a terminal of one column", parameters(), f"COLUMNS=1 {CHECK} >/dev/null; echo exit $?", "exit 0", 0, shell=True),
    Fault("Python without its assertions and docstrings", parameters(), f"PYTHONOPTIMIZE=2 {CHECK} >/dev/null; echo exit $?", "exit 0", 0, shell=True),
    Fault("the output is a link to itself", nothing, "ln -s a a; heli simulate open_loop -d 1 -o a; code=$?; rm a; exit $code", "a: Too many levels of symbolic links", shell=True),
    Fault("an output's name of 300 characters", nothing, "heli simulate open_loop -d 1 -o $(printf 'a%.0s' {1..300}).csv", "File name too long", shell=True),
    Fault("SIGTERM while the process of the units stands still", nothing, f"set -m; {LONG}; {WAIT}; kill -STOP $({MASTERS}); kill -TERM $p; wait $p 2>/dev/null; {END}", "exit 143, 0 running", 0, shell=True),
)  # fmt: skip

SECTIONS = {
    "Logs: variations": LOGS,
    "heli.toml: variations": CONFIGURATIONS,
    "parameters.json: variations": PARAMETERS,
    "Options": OPTIONS,
    "Surroundings: variations": SURROUNDINGS,
}
