"""Faults of FMU files and of runs."""

import zipfile

from fmu_src import build
from tests.faults.case import Fault
from tests.faults.material import nothing, write
from tests.units import read_archive

RUN = "heli simulate open_loop -d 1 --fmu plant=it.fmu"


def archive(**contents):
    """Return a function that writes a zip, each time the same."""

    def make(folder):
        with zipfile.ZipFile(folder / "it.fmu", "w") as file:
            for name, content in contents.items():
                file.writestr(zipfile.ZipInfo(name), content)

    return make


def rewritten(change):
    def make(folder):
        path = build("HelicopterPlant", folder)
        entries = read_archive(path)
        path.unlink()
        change(entries)
        archive(**entries)(folder)

    return make


def described(old, new):
    name = "modelDescription.xml"
    return rewritten(lambda entries: entries.update({name: entries[name].replace(old.encode(), new.encode())}))


def scripted(code):
    def change(entries):
        script = entries["resources/slavemodule.txt"].decode()
        entries[f"resources/{script}.py"] = code.encode() + b"\n" + entries[f"resources/{script}.py"]

    return rewritten(change)


def without_binary(entries):
    for name in [name for name in entries if name.startswith("binaries/")]:
        del entries[name]


def claiming(size):
    """Return a function that writes a zip whose directory claims that its entry has this size [bytes]."""

    def make(folder):
        with zipfile.ZipFile(folder / "it.fmu", "w") as file:
            file.writestr("zeros", bytes(1000))
            file.filelist[0].file_size = size

    return make


ENTITY = '<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b SYSTEM "modelDescription.xml">]><a>&b;</a>'

FILES = (
    Fault("no zip", write("no", "it.fmu"), RUN, "it is no zip archive"),
    Fault("an FMU that is missing", nothing, RUN, "the FMU of plant is missing"),
    Fault("a folder for an FMU", lambda f: (f / "it.fmu").mkdir(), RUN, "the FMU of plant is no file"),
    Fault("a zip without a model description", archive(a="b"), RUN, "it holds no modelDescription.xml"),
    Fault("a model description that is no XML", archive(**{"modelDescription.xml": "<"}), RUN, "cannot be used"),
    Fault("an entry that leads out of its folder", archive(**{"../../escaped": "x"}), RUN, "lies outside of the archive" ),
    Fault("an archive of 3 GB", claiming(3_000_000_000), RUN, "at most 2 GB are unpacked"),
    Fault("an entity in the model description", archive(**{"modelDescription.xml": ENTITY.encode("utf-16")}), RUN, "has a document type"),
    Fault("an FMU for FMI 1.0", described('fmiVersion="2.0"', 'fmiVersion="1.0"'), RUN, "cannot be used"),
    Fault("no binary for this system", rewritten(without_binary), RUN, "plant.load"),
    Fault("another unit's FMU", lambda f: build("Exciter", f).rename(f / "it.fmu"), RUN, "has no output 'plant.elevation'" ),
    Fault("a unit that crashes", scripted("import os; os.kill(os.getpid(), 11)"), RUN, "ended by signal 11"),
    Fault("a unit that ends the process", scripted("import os; os._exit(0)"), RUN, "ended with code 0 and no result"),
    Fault("a unit that raises an error", scripted("raise RuntimeError('no')"), RUN, "plant"),
)  # fmt: skip

RUNS = (
    Fault("a run of 1e12 s", nothing, "heli simulate open_loop -d 1e12", "at most 2e+07 are run"),
    Fault("a duration of NaN", nothing, "heli simulate open_loop -d nan", "0 < step <= duration is needed"),
    Fault("a step of a week", nothing, "heli simulate open_loop -d 1e6 --step 1e6", "at most 10000 are taken"),
    Fault("a scenario that there is not", nothing, "heli simulate close_loop", "no scenario is called 'close_loop'; did you mean 'closed_loop'"),
    Fault("a parameter of a unit that there is not", nothing, "heli simulate open_loop -s plnt.pitch.gain=1", "no unit of scenario open_loop is called 'plnt'; did you mean 'plant'"),
    Fault("a parameter that does not fit the sampling", nothing, "heli simulate open_loop -s identifier.filter.frequency=90", "filter.frequency = 90.0 rad/s must lie in [0.001, 20] rad/s"),
    Fault("a duration between two steps", nothing, "heli simulate open_loop -d 1.003", "duration = 1.003 s is no whole number of steps of 0.01 s"),
    Fault("a plant that diverges", nothing, "heli simulate open_loop -d 5 -s plant.pitch.damping=-10 -s plant.pitch.stiffness=-100", "s answered discard: setReal: pitch = "),
    Fault("an FMU for a unit that there is not", nothing, "heli simulate open_loop --fmu pilot=Exciter.fmu", "no unit of scenario open_loop is called 'pilot'"),
    Fault("a parameter out of its range", nothing, "heli simulate open_loop -s plant.pitch.damping=11", "must lie in [-10, 10] 1/s"),
    Fault("a text of a unit that XML cannot hold", nothing, "heli build LogPlayer -s log.path=a\x01b -o out", "holds a character that is no text in XML"),
    Fault("a text of a unit that is no UTF-8", nothing, "heli build LogPlayer -s log.path=$'a\\xffb' -o out", "holds a character that is no text in XML", shell=True),
)  # fmt: skip

SECTIONS = {"FMU files": FILES, "Runs": RUNS}
