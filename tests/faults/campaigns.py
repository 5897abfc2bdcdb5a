"""Faults of campaigns, of the generators of their rigs, and of fleets."""

from tests.faults.case import Fault
from tests.faults.material import good

CAMPAIGN = "heli campaign rigs -o out"
GENERATE = "heli campaign --generator gen:make --rigs 2 -o out"


def campaigned(folder):
    (folder / "rigs" / "a").mkdir(parents=True)
    for name in ("train1.csv", "held1.csv"):
        good(folder / "rigs" / "a")
        (folder / "rigs" / "a" / "log.csv").rename(folder / "rigs" / "a" / name)


def generator(text):
    """Give a function that makes a generator of rigs."""
    return lambda folder: (folder / "gen.py").write_text(text)


CAMPAIGNS = (
    Fault("a campaign of no workers", campaigned, f"{CAMPAIGN} --workers 0", "workers = 0 must lie in [1, 1000]"),
    Fault("a campaign of a billion workers", campaigned, f"{CAMPAIGN} --workers 1000000000", "workers = 1000000000 must lie in [1, 1000]"),
    Fault("a scheduler that is none", campaigned, f"{CAMPAIGN} --scheduler nonsense", "no Dask scheduler answers at nonsense"),
    Fault("rigs in a folder that is a link to itself", lambda f: (f / "rigs").symlink_to("rigs"), CAMPAIGN, "rigs is no folder"),
    Fault("results in a folder that is a link to itself", lambda f: (campaigned(f), (f / "out").symlink_to("out")), CAMPAIGN, "out cannot hold results"),
    Fault("a generator with a mistake in its file", generator("def make(:\n"), GENERATE, "module gen cannot be imported: SyntaxError", shell=True),
    Fault("a generator whose file ends the process", generator("import sys\nsys.exit(0)\n"), GENERATE, "module gen cannot be imported: SystemExit", shell=True),
    Fault("a generator whose file divides by zero", generator("1 / 0\n"), GENERATE, "module gen cannot be imported: ZeroDivisionError", shell=True),
    Fault("a fleet of files", good, "heli fleet log.csv log.csv -o out", "log.csv is no folder; name a folder of logs for each rig."),
)  # fmt: skip

SECTIONS = {"Campaigns and fleets": CAMPAIGNS}
