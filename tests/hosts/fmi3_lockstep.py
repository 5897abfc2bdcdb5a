"""A native unit of FMI 2.0 and its twin of FMI 3.0, stepped side by side.

Usage: fmi3_lockstep.py FMI2.fmu FMI3.fmu ORDER.json; the order holds `parameters`, `inputs` (low and high of each),
`steps` and `seed`.
"""

import json
import random
import sys

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave
from lockstep import bits
from unit_host import Unit, answer

SETTERS = {"Float64": "setFloat64", "Int32": "setInt32", "Boolean": "setBoolean", "String": "setString"}


class Unit3:
    """The twin of FMI 3.0, by names."""

    def __init__(self, path):
        self.description = fmpy.read_model_description(path)
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.outputs = [v.name for v in self.description.modelVariables if v.causality == "output"]
        self.slave = FMU3Slave(
            guid=self.description.guid, unzipDirectory=fmpy.extract(path),
            modelIdentifier=self.description.coSimulation.modelIdentifier, instanceName="unit",
        )  # fmt: skip
        self.log = []
        self.slave.instantiate(loggingOn=True, logMessage=lambda _, s, c, m: self.log.append((s, m.decode())))

    def start(self, parameters):
        for name, value in parameters.items():
            self.set(name, value)
        self.slave.enterInitializationMode(startTime=0.0)
        self.slave.exitInitializationMode()

    def set(self, name, value):
        variable = self.variables[name]
        getattr(self.slave, SETTERS[variable.type])([variable.valueReference], [value])

    def shown(self):
        return list(self.slave.getFloat64([self.variables[name].valueReference for name in self.outputs]))

    def refused(self, name, value):
        """Status with which a value is refused."""
        try:
            self.set(name, value)
        except FMICallException as problem:
            return problem.status
        return 0


def main(first, second, order):
    old, new = Unit(first).fresh(order["parameters"]), Unit3(second)
    new.start(order["parameters"])
    draw, different, time = random.Random(order["seed"]), 0, 0.0
    for k in range(order["steps"]):
        for name, span in order["inputs"].items():
            value = draw.uniform(*span)
            old.set(name, value)
            new.set(name, value)
        if k % 50 == 25:
            state = new.slave.getFMUState()
            data = new.slave.serializeFMUState(state)
            new.slave.doStep(time, 0.01)
            new.slave.freeFMUState(state)
            state = new.slave.deserializeFMUState(data)
            new.slave.setFMUState(state)
            new.slave.freeFMUState(state)
        old.step(time, 0.01)
        new.slave.doStep(time, 0.01)
        time += 0.01
        different += bits(old.shown()) != bits(new.shown())
    shown_time = new.slave.getFloat64([new.variables["time"].valueReference])[0]
    statuses = [new.refused(name, float("nan")) for name in order["inputs"]]
    return {"different": different, "time": shown_time - time, "statuses": statuses, "log": new.log}


if __name__ == "__main__":
    answer(main(sys.argv[1], sys.argv[2], json.loads(open(sys.argv[3]).read())))
