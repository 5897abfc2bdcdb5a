"""More variations: streams and flights, texts for units, memory, and what a folder of results would replace."""

import os

from tests.faults.case import Fault
from tests.faults.material import TRAVEL, changed, configured, good, headed, nothing, parameters

FOLLOW = "heli follow -p parameters.json -o out"
PLAY = f"{FOLLOW} log.csv --speed 0"
LISTEN = f"{FOLLOW} --listen 127.0.0.1:0"
STREAM = "heli stream log.csv --to 127.0.0.1:9"
MANY = "- " * 10_000 + "time v_front v_rear pitch elevation travel"


def beside(make):
    """Give a function that makes what ``make`` makes in the folder ``out``, beside a log and a parameters.json."""

    def both(folder):
        parameters()(folder)
        (folder / "out").mkdir()
        make(folder / "out")

    return both


def inside(name):
    """Give a function that writes a log, and parameters, under a name in the folder ``out``."""

    def make(folder):
        parameters()(folder)
        (folder / "out").mkdir()
        (folder / ("parameters.json" if name.endswith("json") else "log.csv")).rename(folder / "out" / name)

    return make


def linked(folder):
    parameters()(folder)
    (folder / "out").symlink_to("out")


def far(folder):
    changed(lambda c: c[TRAVEL].fill(1e308))(folder)


STREAMED = (
    Fault("a stream to port 0", good, "heli stream log.csv --to 127.0.0.1:0", "must be HOST:PORT"),
    Fault("a port in digits of another script", good, "heli stream log.csv --to 127.0.0.1:٣٣", "must be HOST:PORT"),
    Fault("a stream to everybody", good, "heli stream log.csv --to 255.255.255.255:9", "nothing can be sent there"),
    Fault("a stream to a name that is none", good, "heli stream log.csv --to a..b:9", "it is no name of a host"),
    Fault("a stream at 1e-300 of its pace", good, f"{STREAM} --speed 1e-300", "--speed = 1e-300 times real time must lie in"),
    Fault("a stream at NaN times its pace", good, f"{STREAM} --speed nan", "--speed = nan times real time must lie in"),
    Fault("a layout of spaces", good, f"{STREAM} --layout ' '", "lacks v_front, v_rear, pitch, elevation, travel"),
    Fault("a layout of JSON and a double", good, f"{STREAM} --layout 'json time'", "'json' is unknown"),
    Fault("a layout of 10006 doubles", good, f"{STREAM} --layout '{MANY}'", "the layout has 10006 doubles, a datagram holds 8188 at most"),
    Fault("a stream that says so on a full disk", good, f"{STREAM} --speed 1000 >/dev/full", "standard output cannot be written: No space left on device", shell=True),
    Fault("a log that is a pipe", lambda f: os.mkfifo(f / "log.csv"), STREAM, "it is a pipe"),
)  # fmt: skip

FLOWN = (
    Fault("a group's address to listen on", parameters(), f"{FOLLOW} --listen 224.0.0.1:25000", "is a group's"),
    Fault("all networks, as an address of IPv6", parameters(), f"{FOLLOW} --listen [::ffff:0.0.0.0]:25000", "would hear every network"),
    Fault("a port with a sign and an underscore", parameters(), f"{FOLLOW} --listen 127.0.0.1:+5_0", "must be a numeric address and a port"),
    Fault("a sender without an address", parameters(), f"{LISTEN} --sender 0.0.0.0", "no datagram comes from there"),
    Fault("a sender at port 0", parameters(), f"{LISTEN} --sender 127.0.0.1:0", "no datagram comes from there"),
    Fault("a sender of another family", parameters(), f"{LISTEN} --sender [::1]:5", "cannot be listened on"),
    Fault("a rate of NaN", parameters(), f"{LISTEN} --rate nan", "the rig sends at nan Hz"),
    Fault("a layout that no datagram holds", parameters(), f"{LISTEN} --layout '{MANY}'", "a datagram holds 8188 at most"),
    Fault("a log played at 1e-300 of its pace", parameters(), f"{FOLLOW} log.csv --speed 1e-300", "--speed = 1e-300 times real time must lie in"),
    Fault("a log played backwards", parameters(), f"{FOLLOW} log.csv --speed -1", "--speed = -1.0 times real time must lie in"),
    Fault("a page for every network", parameters(), f"{PLAY} --serve --serve-at 0.0.0.0:0", "would show it to every network"),
    Fault("a page for every network, as an address of IPv6", parameters(), f"{PLAY} --serve --serve-at [::]:0", "would show it to every network"),
    Fault("a page at a port beyond 65535", parameters(), f"{PLAY} --serve --serve-at 127.0.0.1:70000", "must be HOST:PORT"),
    Fault("the place of a page that is not served", parameters(), f"{PLAY} --serve-at 127.0.0.1:8043", "--serve-at says where --serve shows the twin; add --serve."),
    Fault("the plant's parameters for the controller", parameters(), f"{PLAY} --controller parameters.json", "those of the PidController are needed"),
    Fault("the twin's parameters in the folder of the flight", inside("parameters.json"), "heli follow log.csv --speed 0 -p out/parameters.json -o out", "out/parameters.json lies in the folder of the flight"),
    Fault("a folder where the flight's events go", beside(lambda out: (out / "events.json").mkdir()), PLAY, "events.json: it is a folder"),
    Fault("a folder where the flight's predictions go", beside(lambda out: (out / "predictions.csv").mkdir()), PLAY, "out/predictions.csv is there already"),
    Fault("a link to nowhere where the recording goes", beside(lambda out: (out / "recorded.csv").symlink_to("/proc/none/x")), PLAY, "out/recorded.csv is there already"),
    Fault("a folder of the flight that is a link to itself", linked, PLAY, "out is a file, a folder is needed there"),
    Fault("a flight from behind the log's end", parameters(), f"{PLAY} --from 1e6", "lies after the log's end"),
    Fault(
        "a flight among datagrams that are garbage, too long, not finite, or nested JSON, and those of others",
        parameters(),
        f"set -m; {FOLLOW} --listen 127.0.0.1:0 >o.txt 2>&1 & p=$!; "
        "for _ in {1..6000}; do port=$(grep -o '127.0.0.1:[0-9]*$' o.txt | cut -d: -f2); [ -n \"$port\" ] && break; sleep .1; done; "
        "timeout 300 $PYTHON -m tests.faults.hostile $port out/recorded.csv; kill -INT $p; wait $p; echo exit $?, $(wc -l <out/recorded.csv) rows, $(grep -o '[0-9]* datagrams held no sample' out/events.json); rm o.txt",
        "exit 130, 401 rows, 113 datagrams held no sample",
        0,
        ("out",),
        True,
    ),
)  # fmt: skip

PLACED = (
    Fault("a log that has the name of a result, in the folder of the results", inside("history.csv"), "heli identify out/history.csv -o out", "out/history.csv is read by this command and not written over"),
    Fault("a disk that is full when the results come", good, "ulimit -f 4; heli identify log.csv -o out", "out/history.csv: File too large", shell=True),
    Fault("200 MB of address space", good, "ulimit -v 200000; heli identify log.csv -o out", "this process may use 205 MB of memory (ulimit -v), a command needs 1000 MB", shell=True),
    Fault("200 MB of data", parameters(), "ulimit -d 200000; heli linearise parameters.json -o out", "this process may use 205 MB of memory (ulimit -d), a command needs 1000 MB", shell=True),
    Fault("20 files that may be open", good, "ulimit -n 20; heli identify log.csv -o out >/dev/null; echo exit $?", "exit 0", 0, ("out",), True),
)  # fmt: skip

TEXTS = (
    Fault("a travel of 1e308 rad throughout", far, "heli identify log.csv -o out", "travel reaches 1e+308 rad when read in rad (at most 1e+04), which no rig can"),
    Fault("`heli init` on a travel of 1e308 rad", far, "heli init log.csv", "with these guesses the log is refused", 0, ("heli.toml",)),
    Fault("a header with a control character: what `heli init` writes", headed(pitch="theta\x7f"), "heli init log.csv >/dev/null && heli identify log.csv -o out >/dev/null; echo exit $?", "exit 0", 0, ("heli.toml", "out"), True),
    Fault("a text of a unit that XML cannot hold", nothing, "heli build LogPlayer -s log.path=a\x01b -o out", "holds a character that is no text in XML"),
    Fault("a text of a unit that is no UTF-8", nothing, "heli build LogPlayer -s log.path=$'a\\xffb' -o out", "holds a character that is no text in XML", shell=True),
    Fault("the same in an SSP", nothing, "heli ssp measured_data -s player.log.path=$'a\\xffb' -o a.ssp", "holds a character that is no text in XML", shell=True),
)  # fmt: skip

IDENTIFY = "heli identify log.csv -o out"
CAMPAIGN = "heli campaign rigs -o out"


def here(make):
    """Give a function that makes something called heli.toml beside a log."""
    return lambda folder: (good(folder), make(folder / "heli.toml"))


def campaigned(folder):
    (folder / "rigs" / "a").mkdir(parents=True)
    for name in ("train1.csv", "held1.csv"):
        good(folder / "rigs" / "a")
        (folder / "rigs" / "a" / "log.csv").rename(folder / "rigs" / "a" / name)


def fleet(folder):
    for name in ("a", "b"):
        (folder / name).mkdir()
        good(folder / name)
    os.mkfifo(folder / "a" / "heli.toml")


FOUND = (
    Fault("a heli.toml that is a folder", here(lambda p: p.mkdir()), IDENTIFY, "heli.toml cannot be read: it is a folder"),
    Fault("a heli.toml that is a pipe", here(os.mkfifo), IDENTIFY, "heli.toml cannot be read: it is a pipe"),
    Fault("a heli.toml that is a link to nowhere", here(lambda p: p.symlink_to("none")), IDENTIFY, "heli.toml does not exist"),
    Fault("a heli.toml that is a link to itself", here(lambda p: p.symlink_to("heli.toml")), IDENTIFY, "Too many levels of symbolic links"),
    Fault("a number of 5000 digits in heli.toml", configured(f"[rig]\nvoltage_limit = {'9' * 5000}\n"), IDENTIFY, "is not TOML: Exceeds the limit"),
    Fault("an encoder of 1e300 counts", configured(f"[rig.encoder_counts]\npitch = 1{'0' * 300}\n"), IDENTIFY, "must be counts per turn in [1, 4294967296]"),
    Fault("a heli.toml of a rig of a fleet that is a pipe", fleet, "heli fleet a b -o out", "heli.toml cannot be read: it is a pipe"),
)  # fmt: skip

CAMPAIGNS = (
    Fault("a campaign of no workers", campaigned, f"{CAMPAIGN} --workers 0", "workers = 0 must lie in [1, 1000]"),
    Fault("a campaign of a billion workers", campaigned, f"{CAMPAIGN} --workers 1000000000", "workers = 1000000000 must lie in [1, 1000]"),
    Fault("a scheduler that is none", campaigned, f"{CAMPAIGN} --scheduler nonsense", "no Dask scheduler answers at nonsense"),
    Fault("rigs in a folder that is a link to itself", lambda f: (f / "rigs").symlink_to("rigs"), CAMPAIGN, "rigs is no folder"),
    Fault("results in a folder that is a link to itself", lambda f: (campaigned(f), (f / "out").symlink_to("out")), CAMPAIGN, "out cannot hold results"),
)  # fmt: skip

SECTIONS = {
    "Streams of a rig: variations": STREAMED,
    "Flights: variations": FLOWN,
    "Results and memory: variations": PLACED,
    "Texts and values: variations": TEXTS,
    "heli.toml: what stands in its place": FOUND,
    "Campaigns": CAMPAIGNS,
}
