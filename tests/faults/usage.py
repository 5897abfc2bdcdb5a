"""Faults of usage: words that do not belong together, misspelt names, values out of their range; of campaigns and fleets."""

from tests.faults.case import Fault
from tests.faults.material import CHECK, configured, good, nothing, parameters

CONTROL = "heli design-controller parameters.json --plants 20 -o out"
FOLLOW = "heli follow -p parameters.json -o out"

OPTIONS = (
    Fault("a unit by half of its name", nothing, "heli build Helicopter -o out", "did you mean 'HelicopterPlant'"),
    Fault("a parameter with a letter missing", nothing, "heli build HelicopterPlant -o out -s effects.dry_friction.pich=.02", "did you mean 'effects.dry_friction.pitch'"),
    Fault("a parameter without a value", nothing, "heli build HelicopterPlant -o out -s pitch.damping", "must read NAME=VALUE"),
    Fault("a parameter without a unit", nothing, "heli build -o out -s pitch.damping=1", "--set belongs to one unit"),
    Fault("a unit without a parameter", nothing, "heli simulate open_loop -s plant=3", "--set plant=3 must name unit and parameter"),
    Fault("a word for a number, to build", nothing, "heli build HelicopterPlant -o out -s pitch.damping=abc", "pitch.damping = 'abc' must be a number in [-10, 10] 1/s."),
    Fault("a scenario without the log that it plays", nothing, "heli simulate measured_data", "name it with --log"),
    Fault("a log for a scenario that plays none", good, "heli simulate open_loop --log log.csv", "plays no log"),
    Fault("an FMU file without the unit's name", nothing, "heli simulate open_loop --fmu plant", "must read UNIT=FILE"),
    Fault("an option without its value", good, "heli check log.csv -p", "requires an argument; see heli --help"),
    Fault("--validate without a log", good, "heli diagnose log.csv --validate --output out", "--validate names no log"),
    Fault("a limit of the closed loop without its controller", parameters(), "heli check log.csv -p parameters.json --limit 30", "--limit needs --controller FILE, or [controller.pid] of heli.toml"),
    Fault("a controller without a limit", parameters(), f"{CHECK} --controller c.json", "--controller has an effect only with --limit."),
    Fault("an effect with two letters exchanged", nothing, "heli design dry_frictoin", "did you mean 'dry_friction'?"),
    Fault("an effect of three axes without one", nothing, "heli design dry_friction", "choose one of dry_friction:pitch"),
    Fault("a hover without a flight", nothing, "heli design motor_lag --hover .2", "--hover has an effect only with --closed-loop."),
    Fault("a factor beside a limit", parameters(), f"{CHECK} --limit 30", "--factor has no effect with --limit."),
    Fault("a seed without draws", nothing, "heli simulate open_loop --seed 3", "--seed has an effect only with --runs."),
    Fault("a start for no log", nothing, "heli compare a b --from 3", "--from has an effect only with --log."),
    Fault("a start for a scenario without a log", nothing, "heli simulate open_loop --from 3", "--from has an effect only with --log."),
    Fault("FMI 3.0 of units in Python", nothing, "heli build -o out --fmi 3", "--fmi has an effect only with --native."),
    Fault("many runs without parameters", nothing, "heli simulate open_loop --runs 5", "--runs has an effect only with --parameters."),
    Fault("many runs without a standard error", parameters(), "heli simulate open_loop --runs 5 -p parameters.json", "states no standard error"),
    Fault("a rate for a log", parameters(), f"{FOLLOW} log.csv --rate 100", "--rate has an effect only with --listen."),
    Fault("a page at an address that is none", parameters(), f"{FOLLOW} log.csv --serve here", "--serve = 'here'"),
    Fault("an empty word, as of a variable that is not set", parameters(), 'heli identify log.csv -o ""', "an argument is empty"),
    Fault("the log as the file to write", parameters(), f"{CHECK} --junit log.csv", "log.csv is read by this command and not written over"),
    Fault("a heli.toml of this folder, which nobody named", parameters(more=configured("")), CHECK, "configuration: heli.toml of this folder", 0),
    Fault("the FMU that is simulated as the file to write", good, "heli simulate open_loop --fmu plant=log.csv -o log.csv", "log.csv is read by this command and not written over"),
    Fault("the heli.toml of this folder as the file to write", configured(""), "heli simulate measured_data --log log.csv -o heli.toml", "heli.toml is read by this command and not written over"),
    Fault("the log as the configuration to write", good, "heli init log.csv -o log.csv", "is read by this command and not written over"),
    Fault("a configuration by another name, without a log", nothing, "heli init -o lab.toml", "written: lab.toml", 0, ("lab.toml",)),
    Fault("a parameter given twice", nothing, "heli simulate open_loop -d 1 -s plant.pitch.damping=1 -s plant.pitch.damping=2", "--set plant.pitch.damping is given twice"),
    Fault("--from far before the log, and --to", parameters(), f"{CHECK} --from -1e12 --to 10", "kept 0 s to 10 s of the file (1001 of 2000 rows)", 0),
    Fault("an operating point on the rig's back", parameters(), "heli linearise parameters.json --pitch 9 -o out", "pitch = 9.0 rad must lie in [-1.5, 1.5] rad"),
    Fault("too few plants for a design", parameters(), "heli design-controller parameters.json --plants 5 -o out", "'--plants': Input should be greater than or equal to 20, not '5'"),
    Fault("a controller slower than the motors", parameters(more=configured("[controller]\nperiod = 0.2\n")), CONTROL, "longer than the motors' lag"),
    Fault("an elevation that no voltage holds", parameters(), f"{CONTROL} --elevation 1.4", "the motors take 5 V"),
    Fault("a kind of controller that there is not", parameters(), f"{CONTROL} --kind lqg", "'lqg' is not one of 'pid', 'lqr', 'lqi'"),
    Fault("a command that there is not", good, "heli diagnos log.csv", "No such command 'diagnos'. Did you mean 'diagnose'"),
    Fault("an option that there is not", good, "heli diagnose log.csv --outputs out", "No such option: --outputs"),
    Fault("a fleet of one rig by two names", lambda f: ((f / "a").mkdir(), good(f / "a"), (f / "b").symlink_to("a")), "heli fleet a b -o out", "a is given 2 times"),
)  # fmt: skip

CAMPAIGN = "heli campaign rigs -o out"
FLEET = "heli fleet a b -o out"


def campaigned(folder):
    (folder / "rigs" / "a").mkdir(parents=True)
    for name in ("train1.csv", "held1.csv"):
        good(folder / "rigs" / "a")
        (folder / "rigs" / "a" / "log.csv").rename(folder / "rigs" / "a" / name)


def rigs(change=nothing):
    def make(folder):
        for name in "ab":
            (folder / name).mkdir()
            good(folder / name)
        change(folder)

    return make


CAMPAIGNS = (
    Fault("a campaign of a billion workers", campaigned, f"{CAMPAIGN} --workers 1000000000", "'--workers': Input should be less than or equal to 1000, not '1000000000'"),
    Fault("a scheduler that is none", campaigned, f"{CAMPAIGN} --scheduler nonsense", "no Dask scheduler answers at nonsense"),
    Fault("rigs in a folder that is a link to itself", lambda f: (f / "rigs").symlink_to("rigs"), CAMPAIGN, "rigs is no folder"),
    Fault("a fleet of files", good, "heli fleet log.csv log.csv -o out", "log.csv is no folder; name a folder of logs for each rig."),
    Fault("a fleet of one rig", rigs(), "heli fleet a -o out", "a fleet needs two rigs or more, 1 given"),
    Fault("a rig without a log", rigs(lambda f: (f / "b" / "log.csv").unlink()), FLEET, "holds no log"),
    Fault("a rig whose only log is held out", rigs(lambda f: (f / "b" / "log.csv").rename(f / "b" / "held.csv")), FLEET, "only held.csv"),
    Fault("a fleet of which one rig is left", rigs(lambda f: (f / "a" / "log.csv").write_text("a,b\n1,2\n")), FLEET, "rig a: "),
    Fault("a rig whose heli.toml has a key misspelt", rigs(lambda f: (f / "b" / "heli.toml").write_text("[rig]\nnmae = 'x'\n")), FLEET, "nmae"),
    Fault(
        "SIGTERM in the middle of a campaign of four rigs", campaigned,
        f"set -m; for rig in b c d; do cp -r rigs/a rigs/$rig; done; {CAMPAIGN} --workers 2 >/dev/null 2>&1 & p=$!; "
        'until [ "$(ls $TMPDIR/.heli-draft*/order 2>/dev/null | wc -l)" = 2 ] || ! kill -0 $p; do sleep .05; done; '
        "kill -TERM $p; wait $p 2>/dev/null; echo exit $?, $(ls -A $TMPDIR | wc -l) left",
        "exit 143, 0 left", 0, shell=True,
    ),
    Fault("a campaign of nothing", nothing, "heli campaign", "Missing argument 'FOLDER'"),
    Fault("a campaign in a folder that is missing", nothing, "heli campaign nowhere", "nowhere is no folder"),
)  # fmt: skip

SECTIONS = {"Campaigns and fleets": CAMPAIGNS, "Options": OPTIONS}
