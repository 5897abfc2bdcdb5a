"""Faults of `heli follow` and `heli stream`: addresses, and folders that hold an earlier flight."""

from tests.faults.case import Fault
from tests.faults.material import good, parameters
from tests.faults.outputs import beside

FOLLOW = "heli follow -p parameters.json"
INTO = f"{FOLLOW} -o out"
PLAY = f"{INTO} log.csv"

FLIGHTS = (
    Fault("neither a log nor a rig", parameters(), FOLLOW, "one of the two"),
    Fault("a folder with an earlier flight", beside(lambda out: (out / "recorded.csv").write_text("time [s]\n")), f"{FOLLOW} log.csv -o out", "out/recorded.csv is there already and is not replaced"),
    Fault("a folder with an earlier diagnosis", beside(lambda out: (out / "diagnosis.json").write_text("kept")), f"{FOLLOW} log.csv -o out", "out/diagnosis.json is there already and is not replaced"),
    Fault("a diagnosis into the folder of a flight", beside(lambda out: (out / "recorded.csv").write_text("kept")), "heli diagnose log.csv -o out", "out holds a flight, recorded.csv, and a diagnosis would replace files of it; name another folder."),
    Fault("a folder of a flight where a file stands", parameters(), f"{FOLLOW} log.csv -o parameters.json", "parameters.json is read by this command and not written over; name another."),
    Fault("an address of another machine to listen on", parameters(), f"{FOLLOW} --listen 192.0.2.1:25000", "192.0.2.1:25000 cannot be listened on"),
    Fault("all networks to listen on", parameters(), f"{FOLLOW} --listen 0.0.0.0:25000", "stands for many machines or networks"),
    Fault("a name to listen on", parameters(), f"{FOLLOW} --listen lab:25000", "must be a numeric address"),
    Fault("a page where nothing can be served", parameters(), f"{FOLLOW} log.csv --serve 192.0.2.1:8042", "192.0.2.1:8042 cannot be served"),
    Fault("a rate out of range", parameters(), f"{FOLLOW} --listen 127.0.0.1:0 --rate 10", "50 to 2000 Hz are"),
    Fault("a folder where the flight's events go", beside(lambda out: (out / "events.json").mkdir()), PLAY, "events.json: Is a directory"),
    Fault("a link to nowhere where the recording goes", beside(lambda out: (out / "recorded.csv").symlink_to("/proc/none/x")), PLAY, "out/recorded.csv is there already"),
    Fault("a flight from behind the log's end", parameters(), f"{PLAY} --from 1e6", "nothing is left with start = 1e+06 s; the log"),
)  # fmt: skip

STREAMS = (
    Fault("a stream to everybody", good, "heli stream log.csv --address 255.255.255.255:9", "stands for many machines or networks"),
    Fault("a stream that says so on a full disk", good, "heli stream log.csv --address 127.0.0.1:9 --speed 1000 >/dev/full", "standard output cannot be written: No space left on device", shell=True),
)  # fmt: skip

SECTIONS = {"Flights": FLIGHTS, "Streams of a rig": STREAMS}
