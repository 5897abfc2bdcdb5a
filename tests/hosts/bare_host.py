"""An FMI host of the standard library alone: ctypes, zipfile, no fmpy. Prints what the units show after 50 steps.

Usage: bare_host.py [--steps N] LOG FMU...; with --steps it takes N steps and prints a digest of what the units show
after each. It leaves by os._exit, since pythonfmu's binary may abort at interpreter exit.
"""

import ctypes
import hashlib
import math
import os
import pathlib
import sys
import tempfile
import zipfile
from xml.etree import ElementTree

LOGGER = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)
said = []


class Callbacks(ctypes.Structure):
    _fields_ = [("logger", LOGGER), *((name, ctypes.c_void_p) for name in ("allocate", "free", "finished", "host"))]


@LOGGER
def logger(environment, name, status, category, message):
    said.append((name, status, message))


def fed_at(k, count):
    """Inputs at step k: ramps, then sines."""
    if k < 50:
        return (0.01 * k * (i + 1) for i in range(count))
    return (0.4 * math.sin(0.05 * k * (i + 1)) for i in range(count))


def run(path, log, steps):
    folder = pathlib.Path(tempfile.mkdtemp())
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder)
    root = ElementTree.parse(folder / "modelDescription.xml").getroot()
    name = root.find("CoSimulation").get("modelIdentifier")
    variables = {v.get("name"): v for v in root.iter("ScalarVariable")}
    fmu = ctypes.CDLL(str(folder / "binaries" / "linux64" / (name + ".so")))
    fmu.fmi2Instantiate.restype = ctypes.c_void_p
    callbacks = Callbacks(logger=logger)
    guid, resources = root.get("guid").encode(), (folder / "resources").as_uri().encode()
    made = fmu.fmi2Instantiate(name.encode(), 1, guid, resources, ctypes.byref(callbacks), 0, 1)
    component = ctypes.c_void_p(made)
    assert component.value, said
    double = ctypes.c_double

    def checked(status):
        assert status == 0, (path, status, said)

    path_of_log = ctypes.c_char_p(log.encode())
    given = {"log.path": (fmu.fmi2SetString, path_of_log), "link.port": (fmu.fmi2SetInteger, ctypes.c_int(0))}
    for parameter in given.keys() & variables.keys():  # port 0: any free one
        put, value = given[parameter]
        reference = ctypes.c_uint(int(variables[parameter].get("valueReference")))
        checked(put(component, ctypes.byref(reference), ctypes.c_size_t(1), ctypes.byref(value)))
    saves = root.find("CoSimulation").get("canGetAndSetFMUstate") == "true"
    checked(fmu.fmi2SetupExperiment(component, 0, double(0), double(0), 0, double(0)))
    checked(fmu.fmi2EnterInitializationMode(component))
    checked(fmu.fmi2ExitInitializationMode(component))
    # inputs whose range is narrow, or that say that a sample is there, keep their start values
    kept = ("correction.", "excitation.", "score.", "fresh", "measured.fresh")
    listed = [(v.get("causality"), v.get("name"), int(v.get("valueReference"))) for v in variables.values()]
    inputs = [number for kind, name_, number in listed if kind == "input" and not name_.startswith(kept)]
    outputs = [number for kind, name_, number in listed if kind == "output" and name_ != "port"]
    values = (double * len(outputs))()
    references = (ctypes.c_uint * len(outputs))(*outputs)
    digest = hashlib.sha256()
    for k in range(steps or 50):
        if k == 25 and saves:  # through a state and its bytes: the second half must be as if nothing had happened
            state, size = ctypes.c_void_p(), ctypes.c_size_t()
            checked(fmu.fmi2GetFMUstate(component, ctypes.byref(state)))
            checked(fmu.fmi2SerializedFMUstateSize(component, state, ctypes.byref(size)))
            raw, back = ctypes.create_string_buffer(size.value), ctypes.c_void_p()
            checked(fmu.fmi2SerializeFMUstate(component, state, raw, size))
            checked(fmu.fmi2DeSerializeFMUstate(component, raw, size, ctypes.byref(back)))
            checked(fmu.fmi2SetFMUstate(component, back))
        fed = (double * len(inputs))(*fed_at(k, len(inputs)))
        count = ctypes.c_size_t(len(inputs))
        checked(fmu.fmi2SetReal(component, (ctypes.c_uint * len(inputs))(*inputs), count, fed))
        checked(fmu.fmi2DoStep(component, double(0.01 * k), double(0.01), 1))
        if steps:
            checked(fmu.fmi2GetReal(component, references, ctypes.c_size_t(len(outputs)), values))
            digest.update(bytes(values))
    checked(fmu.fmi2GetReal(component, references, ctypes.c_size_t(len(outputs)), values))
    assert not said, said
    print(name, digest.hexdigest() if steps else [repr(value) for value in values])


arguments = sys.argv[1:]
wanted = int(arguments[1]) if arguments[0] == "--steps" else 0
arguments = arguments[2:] if wanted else arguments
for fmu_path in arguments[1:]:
    run(fmu_path, arguments[0], wanted)
sys.stdout.flush()
os._exit(0)
