"""Random calls of FMI 2.0, allowed and not, on one unit; what was refused must have had no effect.

Usage: random_calls.py UNIT.fmu ORDER.json; the order holds `parameters`, `runs`, `calls` a run and `seed`. After every
run a second instance gets the accepted calls alone: its outputs must have the same bits. A call is refused if its
status is worse than a warning, or if the unit logs a refusal: pythonfmu's binary answers fmi2OK to all but a step.
Numbers that are read without a complaint must be finite, no step may be accepted while a value stands refused, and no
refusal may be an exception that nobody expected.
"""

import json
import random
import struct
import sys
from math import inf, isfinite, nan

from fmpy.fmi1 import FMICallException
from unit_host import Unit, answer

DISCARD = 2
UNKNOWN = (4_000_000_000, 99_999)
CALLS = (
    ["step"] * 14 + ["set"] * 10 + ["odd step"] * 6 + ["odd set"] * 6 + ["get"] * 3 + ["odd get"] * 2
    + ["keep", "restore", "restore", "bytes", "odd bytes", "again", "setup", "enter", "exit", "terminate", "unknown"]
)  # fmt: skip


class Run:
    """A unit under random calls, the calls that it accepted, and what is wrong with its answers."""

    def __init__(self, unit, order, seed):
        self.unit, self.order, self.draw = unit, order, random.Random(seed)
        self.by_kind = {}
        for variable in unit.description.modelVariables:
            self.by_kind.setdefault(variable.type, []).append(variable)
        self.inputs = [v for v in unit.description.modelVariables if v.causality == "input"]
        self.refused, self.wrong, self.kept, self.standing = 0, [], None, set()
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

    def call(self, name, arguments):
        """Make one call; keep it if it is accepted; tell whether it is."""
        self.unit.log.clear()
        status = self.apply(name, arguments)
        good = status < DISCARD and not any(level >= DISCARD for level, _, _ in self.unit.log)
        if any("Traceback" in text for _, _, text in self.unit.log):
            self.wrong.append([name, repr(arguments)[:80], self.unit.log[-1][2][-300:]])
        self.refused += not good
        if good:
            self.accepted.append((name, arguments))
        return good

    def numbers(self, references):
        """Read Reals; what comes without a complaint is finite."""
        self.unit.log.clear()
        try:
            values = self.unit.slave.getReal(references)
        except FMICallException:
            return
        if not self.unit.log and not all(map(isfinite, values)):
            self.wrong.append(["getReal", references[:5], values[:5]])

    def random_call(self):
        draw, what = self.draw, self.draw.choice(CALLS)
        if what == "step":
            self.step(self.time, draw.choice([0.01, 0.01, 0.003, 0.02]))
        elif what == "odd step":
            begin = draw.choice([self.time, self.time - 0.01, self.time + 1.0, nan, -inf, 1e300, 0.0])
            self.step(begin, draw.choice([0.01, 0.0, -0.01, nan, inf, 1e-300, 1e8, 1e300]))
        elif what == "set" and self.inputs:
            variable = draw.choice(self.inputs)
            if self.call("set", (variable.name, draw.uniform(-1.0, 1.0))):
                self.standing.discard(variable.name)
        elif what == "odd set":
            self.odd_set()
        elif what == "get":
            self.numbers([v.valueReference for v in self.by_kind["Real"]])
        elif what == "odd get":
            kind = draw.choice(["Real", "Integer", "Boolean", "String"])
            reference = draw.choice([*UNKNOWN, draw.choice(self.unit.description.modelVariables).valueReference])
            self.apply(f"get{kind}", ([reference],))
        elif what == "again" and draw.random() < 0.5:
            self.drop()
            if draw.random() < 0.5 and self.apply("reset", ()) == 0:
                self.accepted, self.time = [], 0.0
            else:
                self.unit.slave.freeInstance()
                self.begin()
            self.standing.clear()
        elif what in ("keep", "restore", "bytes", "odd bytes"):
            self.state(what)
        elif what == "setup":
            self.call("setupExperiment", (None, draw.choice([0.0, -5.0, nan, inf, 1e9])))
        elif what in ("enter", "exit"):
            self.call(f"{what}InitializationMode", ())
        elif what == "terminate" and draw.random() < 0.2 and ("exitInitializationMode", ()) in self.accepted:
            self.call("terminate", ())
        elif what == "unknown":
            self.apply(draw.choice(["cancelStep"]), ())

    def step(self, begin, length):
        if self.call("doStep", (begin, length)):
            self.time = begin + length
            if self.standing:
                self.wrong.append(["doStep accepted while refused", sorted(self.standing), self.time])

    def odd_set(self):
        """Set one variable of any causality, maybe to what it cannot take, or one that does not exist."""
        draw = self.draw
        variable = draw.choice(self.unit.description.modelVariables)
        value = {
            "Real": draw.choice([nan, inf, -inf, 1e308, 0.25, -1.0]),
            "Integer": draw.choice([-(2**31), 2**31 - 1, 1, 0]),
            "Boolean": draw.choice([True, False]),
            "String": draw.choice(["", "adaptation", "x" * 5000, "%s%n", "dry_friction,dry_friction", "\u03b8"]),
        }[variable.type]
        if draw.random() < 0.2:
            kind = draw.choice(["Real", "Integer", "Boolean"])
            self.call(f"set{kind}", ([draw.choice(UNKNOWN)], [1]))
            return
        good = self.call("set", (variable.name, value))
        if good:
            self.standing.discard(variable.name)
        elif variable.causality == "input":
            self.standing.add(variable.name)

    def drop(self):
        if self.kept is not None:
            self.apply("freeFMUstate", (self.kept[0],))
        self.kept = None

    def state(self, what):
        """Keep the state, restore it, or send it through bytes, which may be damaged."""
        slave = self.unit.slave
        self.unit.log.clear()
        if what == "keep":
            self.drop()
            self.kept = slave.getFMUstate(), list(self.accepted), self.time, set(self.standing)
        elif self.kept is None:
            return
        elif what == "restore":
            slave.setFMUstate(self.kept[0])
            if not any(level >= DISCARD for level, _, _ in self.unit.log):
                self.accepted, self.time, self.standing = list(self.kept[1]), self.kept[2], set(self.kept[3])
        else:
            data = slave.serializeFMUstate(self.kept[0])
            if what == "odd bytes":
                cut = slave.deSerializeFMUstate(bytes(data)[: self.draw.choice([1, len(data) // 2, len(data) - 1])])
                self.apply("setFMUstate", (cut,))
                self.apply("freeFMUstate", (cut,))
                if not any(level >= DISCARD for level, _, _ in self.unit.log):
                    self.wrong.append(["a state that was cut is restored", len(data), self.time])
                return
            state = slave.deSerializeFMUstate(bytes(data))
            self.apply("freeFMUstate", (self.kept[0],))
            self.kept = (state, *self.kept[1:])

    def shown(self):
        """Give all outputs; None where the unit complains, as it does if its parameters do not fit together."""
        self.unit.log.clear()
        values = self.unit.slave.getReal([v.valueReference for v in self.by_kind["Real"] if v.causality == "output"])
        return None if self.unit.log else values


def bits(values):
    return struct.pack(f"{len(values)}d", *values)


def replayed(run):
    """Outputs of a new instance after the accepted calls alone."""
    run.unit.instantiate()
    for name, arguments in run.accepted:
        run.apply(name, arguments)
    return run.shown()


def main(path, order):
    unit, wrong, refused, accepted = Unit(path), [], 0, 0
    for number in range(order["runs"]):
        run = Run(unit, order, order["seed"] + number)
        for _ in range(order["calls"]):
            run.random_call()
        refused, accepted = refused + run.refused, accepted + len(run.accepted)
        run.drop()
        shown = run.shown()
        unit.slave.freeInstance()
        other = replayed(run)
        unit.slave.freeInstance()
        if (shown is None) != (other is None) or (shown is not None and bits(shown) != bits(other)):
            wrong.append([number, "outputs differ", (shown or [])[:6], (other or [])[:6], repr(run.accepted[-6:])])
        wrong += [[number, *entry] for entry in run.wrong]
    return {"wrong": wrong[:6], "count": len(wrong), "refused": refused, "accepted": accepted}


if __name__ == "__main__":
    answer(main(sys.argv[1], json.loads(open(sys.argv[2]).read())))
