"""Faults of campaigns, of the generators of their rigs, and of fleets."""

from tests.faults.case import Fault
from tests.faults.material import good, nothing

CAMPAIGN = "heli campaign rigs -o out"
FLEET = "heli fleet a b -o out"
GENERATE = "heli campaign --generator gen:make --rigs 2 -o out"


def campaigned(folder):
    (folder / "rigs" / "a").mkdir(parents=True)
    for name in ("train1.csv", "held1.csv"):
        good(folder / "rigs" / "a")
        (folder / "rigs" / "a" / "log.csv").rename(folder / "rigs" / "a" / name)


def generator(text):
    """Give a function that makes a generator of rigs."""
    return lambda folder: (folder / "gen.py").write_text(text)


def rigs(change=nothing):
    """Give a function that makes two rigs of a fleet with a log each, and then changes something."""

    def make(folder):
        for name in "ab":
            (folder / name).mkdir()
            good(folder / name)
        change(folder)

    return make


CAMPAIGNS = (
    Fault("a campaign of no workers", campaigned, f"{CAMPAIGN} --workers 0", "workers = 0 must lie in [1, 1000]"),
    Fault("a campaign of a billion workers", campaigned, f"{CAMPAIGN} --workers 1000000000", "workers = 1000000000 must lie in [1, 1000]"),
    Fault("a scheduler that is none", campaigned, f"{CAMPAIGN} --scheduler nonsense", "no Dask scheduler answers at nonsense"),
    Fault("rigs in a folder that is a link to itself", lambda f: (f / "rigs").symlink_to("rigs"), CAMPAIGN, "rigs is no folder"),
    Fault("results in a folder that is a link to itself", lambda f: (campaigned(f), (f / "out").symlink_to("out")), CAMPAIGN, "out is a file, a folder is needed there"),
    Fault("a generator with a mistake in its file", generator("def make(:\n"), GENERATE, "module gen cannot be imported: SyntaxError", shell=True),
    Fault("a generator whose file ends the process", generator("import sys\nsys.exit(0)\n"), GENERATE, "module gen cannot be imported: SystemExit", shell=True),
    Fault("a generator whose file divides by zero", generator("1 / 0\n"), GENERATE, "module gen cannot be imported: ZeroDivisionError", shell=True),
    Fault("a fleet of files", good, "heli fleet log.csv log.csv -o out", "log.csv is no folder; name a folder of logs for each rig."),
    Fault("a fleet of one rig", rigs(), "heli fleet a -o out", "a fleet needs two rigs or more, 1 given"),
    Fault("a rig without a log", rigs(lambda f: (f / "b" / "log.csv").unlink()), FLEET, "holds no log"),
    Fault("a rig whose only log is held out", rigs(lambda f: (f / "b" / "log.csv").rename(f / "b" / "held.csv")), FLEET, "only held.csv"),
    Fault("a fleet of which one rig is left", rigs(lambda f: (f / "a" / "log.csv").write_text("a,b\n1,2\n")), FLEET, "rig a: "),
    Fault("a rig whose heli.toml has a key misspelt", rigs(lambda f: (f / "b" / "heli.toml").write_text("[rig]\nnmae = 'x'\n")), FLEET, "nmae"),
    Fault("a campaign of nothing", nothing, "heli campaign", "either a folder of rigs or a --generator"),
    Fault("a campaign in a folder that is missing", nothing, "heli campaign nowhere", "nowhere is no folder"),
    Fault("a number of rigs for a folder", nothing, "heli campaign rigs --rigs 3", "--rigs 3 is for a --generator"),
    Fault("a seed for a folder", nothing, "heli campaign rigs --first-seed 5", "--first-seed 5 is for a --generator"),
    Fault("a generator without a number of rigs", nothing, "heli campaign --generator json:loads", "--rigs is missing"),
)  # fmt: skip

SECTIONS = {"Campaigns and fleets": CAMPAIGNS}
