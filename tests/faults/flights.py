"""Faults of `heli follow` and `heli stream`: addresses, layouts, and folders that hold an earlier flight."""

from tests.faults.case import Fault
from tests.faults.material import good, nothing, parameters

FOLLOW = "heli follow -p parameters.json"


def flown(folder):
    parameters()(folder)
    (folder / "out").mkdir()
    (folder / "out" / "recorded.csv").write_text("time [s]\n")


def without(name):
    """Give a function that writes a parameters.json without a parameter, and a log."""
    return parameters(lambda d: d["values"].pop(name))


FLIGHTS = (
    Fault("neither a log nor a rig", parameters(), FOLLOW, "one of the two"),
    Fault("a log and a rig", parameters(), f"{FOLLOW} log.csv --listen 127.0.0.1:0", "one of the two"),
    Fault("a folder with an earlier flight", flown, f"{FOLLOW} log.csv -o out", "out/recorded.csv is there already and is not replaced"),
    Fault("a folder of a flight where a file stands", parameters(), f"{FOLLOW} log.csv -o parameters.json", "parameters.json is read by this command and not written over; name another."),
    Fault("a twin with a parameter missing", without("travel.gain"), f"{FOLLOW} log.csv -o out", "the plant's parameters lack travel.gain"),
    Fault("an address of another machine to listen on", parameters(), f"{FOLLOW} --listen 192.0.2.1:25000", "192.0.2.1:25000 cannot be listened on"),
    Fault("all networks to listen on", parameters(), f"{FOLLOW} --listen 0.0.0.0:25000", "would hear every network" ),
    Fault("a name to listen on", parameters(), f"{FOLLOW} --listen lab:25000", "must be a numeric address"),
    Fault("no port to listen on", parameters(), f"{FOLLOW} --listen 127.0.0.1", "names no port"),
    Fault("a layout without a signal", parameters(), f"{FOLLOW} --listen 127.0.0.1:0 --layout 'time pitch elevation travel'", "lacks v_front, v_rear"),
    Fault("a layout without time and no rate", parameters(), f"{FOLLOW} --listen 127.0.0.1:0 --layout 'v_front v_rear pitch elevation travel'", "give the rig's sampling rate with --rate"),
    Fault("a page where nothing can be served", parameters(), f"{FOLLOW} log.csv --serve --serve-at 192.0.2.1:8042", "192.0.2.1:8042 cannot be served"),
    Fault("a rate out of range", parameters(), f"{FOLLOW} --listen 127.0.0.1:0 --rate 10", "50 to 2000 Hz are"),
    Fault("a stream to nowhere", good, "heli stream log.csv --to nowhere", "must be HOST:PORT"),
    Fault("a stream at no speed", good, "heli stream log.csv --to 127.0.0.1:9 --speed 0", "must lie in"),
    Fault("a stream of a log that is missing", nothing, "heli stream log.csv --to 127.0.0.1:9", "does not exist"),
)  # fmt: skip

SECTIONS = {"Flights": FLIGHTS}
