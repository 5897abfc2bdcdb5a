"""Faults of configurations, of parameters.json, and of what a simulation is given."""

import json

from tests.faults.case import Fault
from tests.faults.material import configured, document, good, nothing, parameters, write

IDENTIFY = "heli identify log.csv -o out"

CONFIGURATIONS = (
    Fault("a key that is unknown", configured("[log]\nstrat = 6.0\n"), IDENTIFY, "did you mean 'start'?"),
    Fault("TOML that is none", configured("[log\n"), IDENTIFY, "is not TOML"),
    Fault("TOML nested 5000 deep", configured("a = " + "[" * 5000 + "]" * 5000), IDENTIFY, "nested too deeply"),
    Fault("a unit that is unknown", configured('[log.units]\npitch = "Grad"\n'), IDENTIFY, "log.units.pitch = 'Grad' is unknown"),
    Fault("a motor of 80 s", configured("[rig]\nmotor_time_constant = 80.0\n"), IDENTIFY, "must lie in [5e-05, 5] s"),
    Fault("a configuration that is missing", good, f"{IDENTIFY} --config none.toml", "none.toml does not exist"),
    Fault("a folder for a configuration", good, f"{IDENTIFY} --config .", "it is a folder"),
    Fault("/dev/zero for a configuration", good, f"{IDENTIFY} --config /dev/zero", "it is a device"),
    Fault("bytes that are no UTF-8", lambda f: (good(f), write(b"\xff\xfe\xff", "heli.toml")(f)), IDENTIFY, "is not UTF-8 text"),
)  # fmt: skip

SIMULATE = "heli simulate open_loop -d 1 -p parameters.json"


def value(**entry):
    return parameters(lambda d: d["values"]["pitch.damping"].update(entry))


def repeated(folder):
    text = json.dumps(document())
    one = json.dumps({"pitch.damping": document()["values"]["pitch.damping"]})[1:-1]
    good(folder)
    (folder / "parameters.json").write_text(text.replace('"values": {', '"values": {' + one + ", ", 1))


LOST = parameters(lambda d: d["values"].pop("travel.gain"))
OTHER = value(unit="deg/s")
LACK = "the plant's parameters lack travel.gain"
TWICE = "the key 'pitch.damping' stands there twice"
STATED = "pitch.damping is stated in 'deg/s'"
COMMANDS = {
    "build": "heli build HelicopterPlant -p parameters.json -o out",
    "simulate": SIMULATE,
    "ssp": "heli ssp open_loop -p parameters.json -o out.ssp",
    "linearise": "heli linearise parameters.json -o out",
    "check": "heli check log.csv -p parameters.json",
}
PARAMETERS = (
    *(Fault(f"`heli {name}` with a parameter missing", LOST, words, LACK) for name, words in COMMANDS.items()),
    *(Fault(f"`heli {name}` with a parameter there twice", repeated, words, TWICE) for name, words in COMMANDS.items()),
    *(
        Fault(f"`heli {name}` with a parameter in another unit", OTHER, words, STATED)
        for name, words in COMMANDS.items()
    ),
    Fault("a value that is NaN", value(value=float("nan")), SIMULATE, "a finite number is expected"),
    Fault("a value that is a word", value(value="much"), SIMULATE, "expected `float`, got `str`"),
    Fault("a value out of its range", value(value=11.0), SIMULATE, "pitch.damping = 11.0 1/s must lie in [-10, 10] 1/s" ),
    Fault("a standard error below 0", value(standard_error=-1.0), SIMULATE, "expected `float` >= 0.0"),
    Fault("a file of another schema", write('{"schema": "heli-diagnosis/1"}', "parameters.json"), SIMULATE, "must hold an object of schema"),
    Fault("brackets nested 100000 deep", write("[" * 100_000, "parameters.json"), SIMULATE, "is no JSON"),
    Fault("a file that is no JSON", write("{", "parameters.json"), SIMULATE, "is no JSON"),
    Fault("a folder", lambda f: (f / "parameters.json").mkdir(), SIMULATE, "is a folder"),
    Fault("/dev/zero", nothing, "heli simulate open_loop -d 1 -p /dev/zero", "it is a device"),
    Fault("a file that is missing", nothing, SIMULATE, "does not exist"),
)  # fmt: skip

SECTIONS = {"heli.toml": CONFIGURATIONS, "parameters.json": PARAMETERS}
