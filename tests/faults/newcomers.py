"""Faults of those who begin: the newest keys of heli.toml, results written twice, generators, logs cut and pasted."""

from tests.faults.case import Fault
from tests.faults.material import configured, good, nothing, parameters

IDENTIFY = "heli identify log.csv -o out"
GENERATE = "heli campaign --generator gen:make --rigs 2 -o out"
STREAM = "heli stream log.csv --to 127.0.0.1:9"
FOLLOW = "heli follow log.csv --speed 0 -p parameters.json -o out"


def friction(value):
    """Give a function that makes a log and a heli.toml with this expectation of a friction."""
    return configured(f"[rig.effects]\ndry_friction_pitch = {value}\n")


def generator(text):
    """Give a function that makes a generator of rigs."""
    return lambda folder: (folder / "gen.py").write_text(text)


def rewritten(change):
    """Give a function that makes a log whose text is changed."""

    def make(folder):
        good(folder)
        file = folder / "log.csv"
        file.write_text(change(file.read_text()))

    return make


KEYS = (
    Fault("a horizontal of NaN", configured("[rig]\nhorizontal = nan\n"), IDENTIFY, "rig.horizontal = nan rad must lie in"),
    Fault("effects as a list", configured("[rig]\neffects = ['dry_friction']\n"), IDENTIFY, "must be a section that begins with [rig.effects]"),
    Fault("an effect without its deviation", friction("0.02"), IDENTIFY, "must be the coefficient and its standard deviation"),
    Fault("an effect of NaN", friction("[nan, 0.01]"), IDENTIFY, "the coefficient of rig.effects.dry_friction_pitch = nan rad/s^2 must lie in"),
    Fault("a friction that drives", friction("[-0.02, 0.01]"), IDENTIFY, "dry_friction_pitch = -0.02 rad/s^2 must lie in"),
    Fault("an effect that is known exactly", friction("[0.02, 0.0]"), IDENTIFY, "the standard deviation of rig.effects.dry_friction_pitch = 0.0"),
    Fault("an effect by the name of its law and its axis", configured('[rig.effects]\n"dry_friction.pitch" = [0.02, 0.01]\n'), IDENTIFY, "did you mean 'dry_friction_pitch'?"),
    Fault("the rig as a list of tables", configured("[[rig]]\nname = 'a'\n"), IDENTIFY, "must be a section that begins with [rig]"),
    Fault("a sign of an axis that there is not, in flight", parameters(more=configured("[log.signs]\nyaw = -1\n")), FOLLOW, "key log.signs.yaw is unknown"),
    Fault("parameters.json as the configuration", parameters(), f"{IDENTIFY} --config parameters.json", "parameters.json is not TOML"),
)  # fmt: skip

RESULTS = (
    Fault("a table and its figure in one file", nothing, "heli simulate open_loop -d 1 -o x.svg --plot ./x.svg", "two results are to be written to x.svg; name one file for each."),
    Fault("two files for one unit", nothing, "heli simulate open_loop --fmu plant=a.fmu --fmu plant=b.fmu", "--fmu plant is given twice; keep one."),
    Fault("units built over the parameters", parameters(), "heli build HelicopterPlant -p parameters.json -o parameters.json", "parameters.json is read by this command and not written over"),
    Fault("a demonstration into a file", good, "heli demo -o log.csv", "is a file, a folder is needed there", shell=True),
    Fault("`heli init` on a full disk", good, "heli init log.csv -o /dev/full", "/dev/full cannot be written: No space left on device"),
    Fault("`heli init` on a folder", lambda f: (f / "d").mkdir(), "heli init d", "d is a folder; name the log files in it"),
    Fault("`heli init` on columns that stand still", lambda f: (f / "log.csv").write_text("a,b,c,d,e,f\n" + "1,1,1,1,1,1\n" * 500), "heli init log.csv", "no column increases from row to row"),
    Fault("a flight that is played from its own recording", lambda f: (parameters()(f), (f / "out").mkdir(), (f / "log.csv").rename(f / "out" / "recorded.csv")), "heli follow out/recorded.csv --speed 0 -p parameters.json -o out", "out/recorded.csv is there already and is not replaced"),
    Fault("a layout with a name twice", good, f"{STREAM} --layout 'time time v_front v_rear pitch elevation travel'", "'time' stands there twice"),
    Fault("a layout in a unit that is not known", good, f"{STREAM} --layout 'time v_front v_rear pitch[grad] elevation travel'", "'pitch[grad]' is unknown"),
    Fault("a fleet of files", good, "heli fleet log.csv log.csv -o out", "log.csv is no folder; name a folder of logs for each rig."),
)  # fmt: skip

GENERATORS = (
    Fault("a generator with a mistake in its file", generator("def make(:\n"), GENERATE, "module gen cannot be imported: SyntaxError", shell=True),
    Fault("a generator whose file ends the process", generator("import sys\nsys.exit(0)\n"), GENERATE, "module gen cannot be imported: SystemExit", shell=True),
    Fault("a generator whose file divides by zero", generator("1 / 0\n"), GENERATE, "module gen cannot be imported: ZeroDivisionError", shell=True),
)  # fmt: skip

TEXTS = (
    Fault("commas of another script", rewritten(lambda text: text.replace(",", "\uff0c")), IDENTIFY, "log.csv is not a table"),
    Fault("digits of another script", rewritten(lambda text: text.translate({48 + k: 0x660 + k for k in range(10)})), f"{IDENTIFY} >/dev/null; echo exit $?", "exit 0", 0, ("out",), True),
    Fault("a quotation mark that is never closed", rewritten(lambda text: '"' + text), IDENTIFY, "log.csv is not a table"),
    Fault("a last line of 10 MB", rewritten(lambda text: text + "1" * 10_000_000), IDENTIFY, "row 2002 is left out: the file ends within it", 0, ("out",)),
    Fault("2000 columns of zeros", lambda f: (f / "log.csv").write_text(",".join(f"c{k}" for k in range(2000)) + ("\n" + ",".join(["0"] * 2000)) * 50), "heli init log.csv", "no column increases from row to row"),
)  # fmt: skip

SECTIONS = {
    "heli.toml: the newest keys": KEYS,
    "Results: variations": RESULTS,
    "Generators": GENERATORS,
    "Logs: cut and pasted": TEXTS,
}
