"""A small FMI host for the tests: names instead of references, statuses instead of exceptions, the log kept. It runs in
a process of its own, which ends by ``answer``: pythonfmu's binary may abort at interpreter exit."""

import json
import os
import sys

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.simulation import instantiate_fmu


class Unit:
    """One FMU of either version, extracted once; it can be instantiated again and again."""

    def __init__(self, path, kind="CoSimulation"):
        self.description, self.kind = fmpy.read_model_description(path), kind
        self.is_third = self.description.fmiVersion == "3.0"
        self.folder = fmpy.extract(path)
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.outputs = [v.name for v in self.description.modelVariables if v.causality == "output"]
        self.log = []

    def instantiate(self):
        """Make an instance; messages of all units of a process come to the one that was made last."""

        def logger(*arguments):  # status, category and message come last in both versions of FMI
            self.log.append((arguments[-3], arguments[-2], arguments[-1].decode()))

        self.slave = instantiate_fmu(self.folder, self.description, self.kind, debug_logging=True, logger=logger)
        return self

    def start(self, parameters=None, begin=0.0):
        if not self.is_third:
            self.slave.setupExperiment(startTime=begin)
        for name, value in (parameters or {}).items():
            self.set(name, value)
        self.slave.enterInitializationMode(**{"startTime": begin} if self.is_third else {})
        self.slave.exitInitializationMode()
        return self

    def fresh(self, parameters=None, begin=0.0):
        return self.instantiate().start(parameters, begin)

    def set(self, name, value):
        variable = self.variables[name]
        getattr(self.slave, f"set{variable.type}")([variable.valueReference], [value])

    def get(self, *names):
        read = self.slave.getFloat64 if self.is_third else self.slave.getReal
        return list(read([self.variables[name].valueReference for name in names]))

    def shown(self):
        return self.get(*self.outputs)

    def step(self, time, h):
        """Status of a step: 0 ok, 2 discard."""
        try:
            self.slave.doStep(time, h)
        except FMICallException as problem:
            return problem.status
        return 0

    def saved(self, through_bytes=False):
        """The state, or what is left of it after its way through bytes."""
        state = self.slave.getFMUState()
        if through_bytes:
            data = self.slave.serializeFMUState(state)
            self.slave.freeFMUState(state)
            state = self.slave.deserializeFMUState(data)
        return state

    def restore(self, state):
        """Take a state back, and free it."""
        self.slave.setFMUState(state)
        self.slave.freeFMUState(state)

    def free(self):
        self.slave.terminate()
        self.slave.freeInstance()


def answer(value):
    """Print the test's answer and leave."""
    print(json.dumps(value))
    sys.stdout.flush()
    os._exit(0)
