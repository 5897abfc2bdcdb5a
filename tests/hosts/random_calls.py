"""Random calls of FMI 2.0, allowed and not, on one unit; what was refused must have had no effect. Usage:
random_calls.py UNIT.fmu ORDER.json; the order holds `parameters`, `runs`, `calls` a run and `seed`. After every run a
second instance gets the accepted calls alone: its outputs must have the same bits. A call is refused if its status is
worse than a warning, or if the unit logs a refusal: pythonfmu's binary answers fmi2OK to all but a step. Numbers that
are read without a complaint must be finite, no step may be accepted while a value stands refused, and no refusal may be
an exception that nobody expected. The answer has a digest of what was accepted, said and shown: another build of the
unit under the same order has to give the same."""

import hashlib
import json
import random
import struct
import sys
from math import inf, isfinite, nan

from fmpy.fmi1 import FMICallException
from unit_host import Unit, answer

DISCARD = 2
UNKNOWN = (2_000_000_000, 99_999)
CALLS = {
    "step": 14, "set": 10, "odd_step": 6, "odd_set": 6, "get": 3, "odd_get": 2, "keep": 1, "restore": 2,
    "through_bytes": 1, "odd_bytes": 1, "again": 1, "phase": 5,
}  # fmt: skip
"""Methods of a run that make a call, and how often they are drawn."""


class Run:
    """A unit under random calls, the calls that it accepted, and what is wrong with its answers."""

    def __init__(self, unit, order, seed, digest):
        self.unit, self.order, self.draw, self.digest = unit, order, random.Random(seed), digest
        self.variables = unit.description.modelVariables
        self.reals = [v.valueReference for v in self.variables if v.type == "Real"]
        self.inputs = [v for v in self.variables if v.causality == "input"]
        self.refused, self.wrong, self.saved, self.standing = 0, [], None, set()
        self.begin()

    def begin(self):
        """Instantiate and initialise; sometimes only part of the way, so that calls come too early."""
        self.unit.instantiate()
        self.accepted, self.time = [], 0.0
        start = [("setupExperiment", (None, self.draw.choice([0.0, 0.0, 3.0])))]
        start += [("set", (name, value)) for name, value in self.order["parameters"].items()]
        start += [("enterInitializationMode", ()), ("exitInitializationMode", ())]
        for name, arguments in start[: len(start) if self.draw.random() < 0.9 else self.draw.randrange(len(start))]:
            self.call(name, arguments)
            if name == "setupExperiment":
                self.time = arguments[1]

    def apply(self, name, arguments):
        """Make one call; give its status."""
        slave = self.unit.slave
        try:
            if name == "set":
                self.unit.set(*arguments)
            elif name == "setupExperiment":
                slave.setupExperiment(startTime=arguments[1])
            else:
                getattr(slave, name)(*arguments)
        except FMICallException as problem:
            return problem.status
        return 0

    def complains(self):
        return any(level >= DISCARD for level, _, _ in self.unit.log)

    def call(self, name, arguments):
        """Make one call; keep it if it is accepted; tell whether it is."""
        self.unit.log.clear()
        status = self.apply(name, arguments)
        good = status < DISCARD and not self.complains()
        if any("Traceback" in text for _, _, text in self.unit.log):
            self.wrong.append([name, repr(arguments)[:80], self.unit.log[-1][2][-300:]])
        self.refused += not good
        messages = [text[:500] for _, _, text in self.unit.log]  # a native unit cuts longer ones
        self.digest.update(repr((name, good, messages)).encode())
        if good:
            self.accepted.append((name, arguments))
        if good and name == "doStep":
            self.digest.update(self.shown())
        return good

    def step(self, begin=None, length=None):
        begin = self.time if begin is None else begin
        length = self.draw.choice([0.01, 0.01, 0.003, 0.02]) if length is None else length
        if self.call("doStep", (begin, length)):
            self.time = begin + length
            if self.standing:
                self.wrong.append(["doStep accepted while refused", sorted(self.standing), self.time])

    def odd_step(self):
        begin = self.draw.choice([self.time, self.time - 0.01, self.time + 1.0, nan, -inf, 1e300, 0.0])
        self.step(begin, self.draw.choice([0.01, 0.0, -0.01, nan, inf, 1e-300, 1e8, 1e300]))

    def set(self):
        if self.inputs:
            variable = self.draw.choice(self.inputs)
            if self.call("set", (variable.name, self.draw.uniform(-1.0, 1.0))):
                self.standing.discard(variable.name)

    def odd_set(self):
        """Set one variable of any causality, maybe to what it cannot take, or one that does not exist."""
        draw = self.draw
        if draw.random() < 0.2:
            self.call(f"set{draw.choice(['Real', 'Integer', 'Boolean'])}", ([draw.choice(UNKNOWN)], [1]))
            return
        variable = draw.choice(self.variables)
        values = {
            "Real": [nan, inf, -inf, 1e308, 0.25, -1.0],
            "Integer": [-(2**31), 2**31 - 1, 1, 0],
            "Boolean": [True, False],
            "String": ["", "adaptation", "x" * 5000, "%s%n", "dry_friction,dry_friction", "\u03b8"],
        }
        if self.call("set", (variable.name, draw.choice(values[variable.type]))):
            self.standing.discard(variable.name)
        elif variable.causality == "input":
            self.standing.add(variable.name)

    def get(self):
        """Read Reals; what comes without a complaint is finite."""
        values = self.read(self.reals)
        if not all(map(isfinite, values)):
            self.wrong.append(["getReal", values[:5]])

    def read(self, references):
        """Give values that the unit shows; none where it complains, as it does if parameters do not fit together."""
        self.unit.log.clear()
        try:
            values = self.unit.slave.getReal(references)
        except FMICallException:  # of a native unit; pythonfmu's binary answers fmi2OK
            return []
        return [] if self.unit.log else values

    def odd_get(self):
        reference = self.draw.choice([*UNKNOWN, self.draw.choice(self.variables).valueReference])
        self.apply(f"get{self.draw.choice(['Real', 'Integer', 'Boolean', 'String'])}", ([reference],))

    def drop(self):
        if self.saved is not None:
            self.apply("freeFMUstate", (self.saved[0],))
        self.saved = None

    def keep(self):
        self.drop()
        self.unit.log.clear()
        state = self.unit.slave.getFMUstate()
        if not self.complains():
            self.saved = state, list(self.accepted), self.time, set(self.standing)

    def restore(self):
        self.unit.log.clear()
        if self.saved is not None and self.apply("setFMUstate", (self.saved[0],)) == 0 and not self.complains():
            self.accepted, self.time, self.standing = list(self.saved[1]), self.saved[2], set(self.saved[3])

    def through_bytes(self):
        if self.saved is not None:
            data = self.unit.slave.serializeFMUstate(self.saved[0])
            self.apply("freeFMUstate", (self.saved[0],))
            self.saved = (self.unit.slave.deSerializeFMUstate(bytes(data)), *self.saved[1:])

    def odd_bytes(self):
        """Restore a state that was cut; it has to be refused."""
        if self.saved is not None:
            self.unit.log.clear()
            data = bytes(self.unit.slave.serializeFMUstate(self.saved[0]))
            cut = self.unit.slave.deSerializeFMUstate(data[: self.draw.choice([1, len(data) // 2, len(data) - 1])])
            self.apply("setFMUstate", (cut,))
            self.apply("freeFMUstate", (cut,))
            if not self.complains():
                self.wrong.append(["a state that was cut is restored", len(data), self.time])

    def again(self):
        """Reset the unit, or free it and begin with another instance."""
        if self.draw.random() < 0.5:
            self.drop()
            if self.draw.random() < 0.5 and self.apply("reset", ()) == 0:
                self.accepted, self.time = [], 0.0
            else:
                self.unit.slave.freeInstance()
                self.begin()
            self.standing.clear()

    def phase(self):
        """Call for a change of the phase, most often at a wrong time."""
        name = self.draw.choice(["setupExperiment", "enterInitializationMode", "exitInitializationMode", "terminate"])
        arguments = (None, self.draw.choice([0.0, -5.0, nan, inf, 1e9])) if name == "setupExperiment" else ()
        if name != "terminate" or (self.draw.random() < 0.2 and ("exitInitializationMode", ()) in self.accepted):
            self.call(name, arguments)
        self.apply("cancelStep", ())

    def shown(self):
        """Give the bits of all outputs."""
        values = self.read([self.unit.variables[name].valueReference for name in self.unit.outputs])
        return struct.pack(f"{len(values)}d", *values)


def main(path, order):
    unit, wrong, refused, accepted, digest = Unit(path), [], 0, 0, hashlib.sha256()
    for number in range(order["runs"]):
        run = Run(unit, order, order["seed"] + number, digest)
        for call in run.draw.choices(list(CALLS), CALLS.values(), k=order["calls"]):
            getattr(run, call)()
        refused, accepted = refused + run.refused, accepted + len(run.accepted)
        run.drop()
        shown = run.shown()
        unit.slave.freeInstance()
        unit.instantiate()
        for name, arguments in run.accepted:
            run.apply(name, arguments)
        if shown != run.shown():
            run.wrong.append(["outputs differ", repr(run.accepted[-6:])])
        unit.slave.freeInstance()
        wrong += [[number, *entry] for entry in run.wrong]
    return {"wrong": wrong[:6], "refused": refused, "accepted": accepted, "digest": digest.hexdigest()}


if __name__ == "__main__":
    answer(main(sys.argv[1], json.loads(open(sys.argv[2]).read())))
