"""Faults of configurations and of parameters.json."""

from tests.faults.case import Fault
from tests.faults.material import CHECK, DESIGN, IDENTIFY, configured, good, nothing, parameters, pipe, write


def friction(value):
    return configured(f"[rig.effects]\ndry_friction_pitch = {value}\n")


CONFIGURATIONS = (
    Fault("a key that is unknown", configured("[log]\nstrat = 6.0\n"), IDENTIFY, "did you mean 'start'?"),
    Fault("TOML that is none", configured("[log\n"), IDENTIFY, "is not TOML"),
    Fault("TOML nested 5000 deep", configured("a = " + "[" * 5000 + "]" * 5000), IDENTIFY, "nested too deeply"),
    Fault("a unit that is unknown", configured('[log.units]\npitch = "Grad"\n'), IDENTIFY, "log.units.pitch = 'Grad' is unknown"),
    Fault("a motor of 80 s", configured("[rig]\nmotor_time_constant = 80.0\n"), IDENTIFY, "must lie in [5e-05, 5] s"),
    Fault("a configuration that is missing", good, f"{IDENTIFY} --config none.toml", "none.toml does not exist"),
    Fault("a folder for a configuration", good, f"{IDENTIFY} --config .", "it is a folder, a pipe or a device"),
    Fault("a sign of 0", configured("[log.signs]\npitch = 0\n"), IDENTIFY, "voltages and angles take 1 or -1"),
    Fault("a column without a name", configured('[log.columns]\npitch = ""\n'), IDENTIFY, "column '' missing"),
    Fault("effects as a list", configured("[rig]\neffects = ['dry_friction']\n"), IDENTIFY, "must be a section that begins with [rig.effects]"),
    Fault("an effect without its deviation", friction("0.02"), IDENTIFY, "must be the coefficient and its standard deviation"),
    Fault("a friction that drives", friction("[-0.02, 0.01]"), IDENTIFY, "dry_friction_pitch = -0.02 rad/s^2 must lie in"),
    Fault("an effect that is known exactly", friction("[0.02, 0.0]"), IDENTIFY, "the standard deviation of effects.dry_friction_pitch = 0.0"),
    Fault("an effect by the name of its law and its axis", configured('[rig.effects]\n"dry_friction.pitch" = [0.02, 0.01]\n'), IDENTIFY, "did you mean 'dry_friction_pitch'?"),
    Fault("a column of an axis that there is not", configured("[log.columns]\nyaw = 'psi'\n"), IDENTIFY, "log.columns.yaw is unknown; choose one of time, v_front"),
    Fault("an effect that is given as not there", friction("[0.0, 0.1]"), IDENTIFY, "coefficient 0: what is not there need not be given"),
    Fault("1 for true", configured("[log]\nswap_rotors = 1\n"), IDENTIFY, "log.swap_rotors = 1 must be true or false"),
    Fault("counts with a fraction", configured("[rig.encoder_counts]\npitch = 4096.0\n"), IDENTIFY, "rig.encoder_counts.pitch = 4096.0 must be a whole number"),
    Fault("a word for the air", configured("[controller]\nair = ['a', 0.1, 0.1]\n"), IDENTIFY, "controller.air = 'a' must be a number"),
    Fault("a gain of the PID out of its range", configured("[controller.pid]\ntravel = [0.25, 2e3, 1.0]\n"), IDENTIFY, "controller.pid.travel, integral = 2000.0 1/s must lie in [0, 1000] 1/s"),
    Fault("a weight of 0", configured("[controller.weights]\nvoltage = 0\n"), IDENTIFY, "controller.weights.voltage = 0.0 must lie in [1e-09, 1e+09]"),
    Fault("a heli.toml that is a pipe", lambda f: (good(f), pipe(f / "heli.toml")), IDENTIFY, "heli.toml cannot be read: it is a folder, a pipe or a device"),
    Fault("an encoder of 1e300 counts", configured(f"[rig.encoder_counts]\npitch = 1{'0' * 300}\n"), IDENTIFY, "must be counts per turn in [1, 4294967296]"),
)  # fmt: skip

SIMULATE = "heli simulate open_loop -d 1 -p parameters.json"


def value(name, **fields):
    return parameters(lambda d: d["values"][name].update(fields))


def expected(change):
    return parameters(lambda d: change(d["expected"]))


GAIN = {"pitch.proportional": {"value": 6.0, "standard_error": None, "unit": "V/rad"}}
CONTROLLER = parameters(lambda d: d.update(unit="PidController", values=GAIN))


PARAMETERS = (
    Fault("`heli build` with a parameter missing", parameters(lambda d: d["values"].pop("travel.gain")), "heli build HelicopterPlant -p parameters.json -o out", "the plant's parameters lack travel.gain"),
    Fault("a parameter in another unit", value("pitch.damping", unit="deg/s"), SIMULATE, "pitch.damping is stated in 'deg/s'"),
    Fault("a value that is NaN", value("pitch.damping", value=float("nan")), SIMULATE, "a finite number is expected"),
    Fault("a value that is a word", value("pitch.damping", value="much"), SIMULATE, "expected `float`, got `str`"),
    Fault("a value out of its range", value("pitch.damping", value=11.0), SIMULATE, "pitch.damping = 11.0 1/s must lie in [-10, 10] 1/s" ),
    Fault("a file of another schema", write('{"schema": "heli-diagnosis/1"}', "parameters.json"), SIMULATE, "must hold an object of schema"),
    Fault("brackets nested 100000 deep", write("[" * 100_000, "parameters.json"), SIMULATE, "is no JSON"),
    Fault("a folder", lambda f: (f / "parameters.json").mkdir(), SIMULATE, "is a folder"),
    Fault("/dev/zero", nothing, "heli simulate open_loop -d 1 -p /dev/zero", "it is a folder, a pipe or a device"),
    Fault("a file that is missing", nothing, SIMULATE, "does not exist"),
    Fault("an expected error below 0", expected(lambda e: e["pitch"]["prediction_1s_rad"].update(value=-1.0)), CHECK, "expected `float` >= 0.0"),
    Fault("no expected error of the pitch", expected(lambda e: e.pop("pitch")), CHECK, "state no expected error of pitch"),
    Fault("a number of 400 digits in parameters.json", value("pitch.gain", value=10**400), CHECK, "number out of range"),
    Fault("a plant without a gain of the pitch", value("pitch.gain", value=0.0), "heli linearise parameters.json -o out", "no equilibrium"),
    Fault("a parameter's name with a line break", parameters(lambda d: d["values"].update({"a\nb": d["values"]["pitch.gain"]})), CHECK, "no parameter 'a\\nb'"),
    Fault("parameters of a controller for a plant", CONTROLLER, f"{DESIGN} -p parameters.json", "holds parameters of the PidController, those of the HelicopterPlant are needed"),
)  # fmt: skip

SECTIONS = {"heli.toml": CONFIGURATIONS, "parameters.json": PARAMETERS}
