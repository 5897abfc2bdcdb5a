"""Faults of where the output goes, of the place a command runs in, and of signals."""

import os

from tests.faults.case import Fault
from tests.faults.material import CHECK, good, nothing, parameters

SIMULATE = "heli simulate open_loop -d 1"


def beside(make):
    def both(folder):
        parameters()(folder)
        (folder / "out").mkdir()
        make(folder / "out")

    return both


def inside(name):
    """Return a function that writes a log, and parameters, one of them under a name in the folder ``out``."""
    moved = "parameters.json" if name.endswith("json") else "log.csv"
    return beside(lambda out: (out.parent / moved).rename(out / name))


def linked(folder):
    (folder / "real.csv").write_text("old")
    (folder / "link.csv").symlink_to("real.csv")


FILES = (
    Fault("`-o` to a device", nothing, f"{SIMULATE} -o /dev/null && [ -c /dev/null ] && echo still a device", "still a device", 0, shell=True),
    Fault("`-o` to standard output", nothing, f"{SIMULATE} -o /dev/stdout | grep -c '^0.01,'", "1", 0, shell=True),
    Fault("`-o` to a pipe", nothing, f"mkfifo p; grep -c '^0.01,' p & {SIMULATE} -o p >/dev/null; wait; [ -p p ] && echo still a pipe; rm p", "still a pipe", 0, shell=True),
    Fault("`-o` to a link", linked, f"{SIMULATE} -o link.csv >/dev/null && [ -L link.csv ] && head -c 8 real.csv", "time [s]", 0, shell=True),
    Fault("`-o` to a folder", lambda f: (f / "run.csv").mkdir(), f"{SIMULATE} -o run.csv", "run.csv: Is a directory"),
    Fault("`-o` to a full disk", nothing, f"{SIMULATE} -o /dev/full", "/dev/full: No space left on device", shell=True),
    Fault("a folder of results where a file stands", lambda f: (good(f), (f / "out").write_text("mine")), "heli identify log.csv -o out", "is a file, a folder is needed there"),
    Fault("a folder of the user's where a file of results goes", lambda f: (good(f), (f / "out" / "history.csv").mkdir(parents=True)), "heli identify log.csv -o out", "is a folder and is not replaced"),
    Fault("a figure of an unknown kind", nothing, f"{SIMULATE} --plot run.docx", "must end in .svg"),
    Fault("units built over the parameters", parameters(), "heli build HelicopterPlant -p parameters.json -o parameters.json", "parameters.json is read by this command and not written over"),
    Fault("`heli init` on a full disk", good, "heli init log.csv -o /dev/full", "/dev/full: No space left on device"),
    Fault("`heli init` on a folder", lambda f: (f / "d").mkdir(), "heli init d", "d is a folder; name the log files in it"),
    Fault("a log that has the name of a result, in the folder of the results", inside("history.csv"), "heli identify out/history.csv -o out", "out/history.csv is read by this command and not written over"),
    Fault("a disk that is full when the results come", good, "ulimit -f 4; heli identify log.csv -o out", "out: File too large", shell=True),
)  # fmt: skip

STREAMS = (
    Fault("a reader that leaves (`heli check | head -1`)", parameters(), f"{CHECK} --junit x.xml | head -1 >/dev/null; echo exit ${{PIPESTATUS[0]}}, $(ls x.xml)", "exit 0, x.xml", 0, ("x.xml",), True),
    Fault("all streams closed", parameters(), f"{CHECK} <&- >&- 2>&-; echo exit $?", "exit 0", 0, shell=True),
    Fault("standard output on a full disk", parameters(), f"{CHECK} >/dev/full", "standard output cannot be written: No space left on device", shell=True),
    Fault("an encoding without the characters", parameters(), f"PYTHONIOENCODING=ascii LC_ALL=C PYTHONUTF8=0 {CHECK} >/dev/null; echo exit $?", "exit 0", 0, shell=True),
    Fault("a failed check whose reader leaves", parameters(), "heli check log.csv -p parameters.json --factor 1e-9 2>/dev/null | true; echo exit ${PIPESTATUS[0]}", "exit 1", 0, shell=True),
)  # fmt: skip

LOST = "mkdir d; cd d; rmdir ../d;"
PLACES = (
    Fault("a home that cannot be written", parameters(), f"HOME=/proc/none {CHECK} >/dev/null; echo exit $?", "exit 0", 0, shell=True),
    Fault("a folder for compiled code that cannot be made", parameters(), f"HELI_CACHE_DIR=/proc/none {CHECK}", "set HELI_CACHE_DIR to a folder that can be written", shell=True),
    Fault("a cache that was damaged", parameters(), f"export HELI_CACHE_DIR=$PWD/cache; {CHECK} >/dev/null; for f in cache/*/*.nb*; do truncate -s 100 $f; done; {CHECK} >/dev/null; echo exit $?", "exit 0", 0, ("cache",), True),
    Fault("a folder for temporary files that is missing", nothing, f"TMPDIR=/proc/none TEMP= TMP= {SIMULATE} >/dev/null; echo exit $?", "exit 0", 0, shell=True),
    Fault("no room for temporary files", nothing, f"ulimit -f 8; {SIMULATE}", "File too large", shell=True),
    Fault("a name that is no UTF-8", lambda f: (good(f), os.rename(f / "log.csv", os.fsencode(f) + b"/log\xff.csv")), "heli identify log*.csv -o out >/dev/null; echo exit $?", "exit 0", 0, ("out",), True),
    Fault("the folder of the command is gone: `heli build`", nothing, f"{LOST} heli build Exciter", "the folder in which this command runs is gone", shell=True),
    Fault("a terminal of one column", parameters(), f"COLUMNS=1 {CHECK} >/dev/null; echo exit $?", "exit 0", 0, shell=True),
    Fault("Python without its assertions and docstrings", parameters(), f"PYTHONOPTIMIZE=2 {CHECK} >/dev/null; echo exit $?", "exit 0", 0, shell=True),
    Fault("the output is a link to itself", nothing, "ln -s a a; heli simulate open_loop -d 1 -o a; code=$?; rm a; exit $code", "a: Too many levels of symbolic links", shell=True),
    Fault("an output's name of 300 characters", nothing, "heli simulate open_loop -d 1 -o $(printf 'a%.0s' {1..300}).csv", "File name too long", shell=True),
    Fault("20 files that may be open", good, "ulimit -n 20; heli identify log.csv -o out >/dev/null; echo exit $?", "exit 0", 0, ("out",), True),
)  # fmt: skip

# a loop that waits for a sign of the run ends with the run, too
WAIT = 'while [ -z "$(ls -A $TMPDIR)" ] && kill -0 $p; do sleep .05; done; sleep .3'
LONG = "heli simulate closed_loop -d 100000 >/dev/null 2>&1 & p=$!"
MASTERS = "pgrep -f 'heli_identifier.processes .*'$TMPDIR"
# on a loaded machine a process that has been told to end may need seconds to be gone
# Until the interpreter has started, Ctrl-C ends it with its own words. It ignores SIGPIPE from its beginning on, and
# `heli` gives SIGINT back to the system until a command catches SIGTERM as well; a loaded machine takes its time to it.
BEGUN = (
    'until read -r ignored caught <<<"$(awk \'/^Sig(Ign|Cgt)/ {printf "%s ", $2}\' /proc/$p/status)" && '
    "(( 0x0$ignored & 0x1000 && ( ! (0x0$caught & 2) || 0x0$caught & 0x4000 ) )) || ! kill -0 $p; do sleep .01; done"
)
GONE = "for _ in {1..600}; do %s >/dev/null || break; sleep .1; done"
END = f"code=$?; {GONE % MASTERS}; echo exit $code, $({MASTERS} | wc -l) running"


def ended(name, code):
    command = f"set -m; {LONG}; {WAIT}; kill -{name} $p; wait $p 2>/dev/null; {END}"
    return Fault(f"SIG{name} in the middle of a simulation", nothing, command, f"exit {code}, 0 running", 0, shell=True)


SIGNALS = (
    ended("TERM", 143),
    ended("HUP", 129),
    ended("INT", 130),
    Fault("SIGKILL in the middle of a simulation", nothing, f"{LONG}; {WAIT}; kill -KILL $p; wait $p 2>/dev/null; {END}; rm -rf $TMPDIR/.heli-draft*; echo $({MASTERS} | wc -l) running", "0 running", 0, shell=True),
    Fault("SIGTERM while the process of the units stands still", nothing, f"set -m; {LONG}; {WAIT}; kill -STOP $({MASTERS}); kill -TERM $p; wait $p 2>/dev/null; {END}", "exit 143, 0 running", 0, shell=True),
    *(
        Fault(
            f"SIG{name} in the middle of the demonstration", nothing,
            f"set -m; heli demo -o out >/dev/null 2>&1 & p=$!; until [ -n \"$(find . -name '.heli-draft*')\" ] || ! kill -0 $p; do sleep .05; done; sleep 1; "
            f"kill -{name} $p; wait $p 2>/dev/null; code=$?; {GONE % MASTERS}; "
            f"echo exit $code, $({MASTERS} | wc -l) running, $(find . -name '.heli-draft*' | wc -l) left; rm -rf out",
            f"exit {code}, 0 running, 0 left", 0, shell=True,
        )
        for name, code in (("INT", 130), ("TERM", 143))
    ),
    Fault("Ctrl-C in the first half second", nothing, f'set -m; for t in 0 .05 .1 .2 .3; do heli simulate closed_loop -d 100000 >out.txt 2>&1 & p=$!; {BEGUN}; sleep $t; kill -INT $p; wait $p 2>/dev/null; echo -n "$? "; cat out.txt; done; rm out.txt', "130 130 130 130 130", 0, shell=True),
)  # fmt: skip

SECTIONS = {"Where output goes": FILES, "Streams": STREAMS, "The place of a command": PLACES, "Signals": SIGNALS}
