"""A pythonfmu unit and its native twin under the same random calls, allowed and not: the answers that differ.

Usage: lawless_lockstep.py PYTHON.fmu NATIVE.fmu ORDER.json; the order holds `parameters`, `inputs` (low and high of
each), `calls`, `seed` and `step` [s]. Steps are regular, repeated, early, late, of no or negative or endless length;
values are good, not finite or out of range; parameters are set late; states are kept and restored; units are reset.

A pythonfmu unit answers fmi2OK to every call but a step. What a native unit refuses there, it has to log, and the
values have to stay the same.
"""

import json
import random
import struct
import sys

from fmpy.fmi1 import FMICallException
from unit_host import Unit, answer

CALLS = ["step"] * 12 + ["set"] * 8 + ["bad value", "late parameter", "keep", "restore", "serialised", "reset",
                                       "initialise again"]  # fmt: skip


def status_of(call, *arguments):
    try:
        call(*arguments)
    except FMICallException as problem:
        return problem.status
    return 0


def step_of(draw, reached, h):
    """Begin and length of a step: mostly as they should be."""
    odd = draw.random()
    if odd < 0.7:
        return reached, draw.choice([h, h, 0.3 * h, 2.7 * h])
    begin = draw.choice([reached, reached - h, reached + 3.0 * h, 0.0, 1e5, float("nan"), reached + 1e-9])
    return begin, draw.choice([h, h, 0.0, -h, float("nan"), float("inf"), 1e12, 2e4])


def bits(values):
    return struct.pack(f"{len(values)}d", *values)


class Pair:
    def __init__(self, paths, order):
        self.order = order
        self.units = [Unit(path).instantiate(name) for name, path in zip(("python", "native"), paths, strict=True)]
        self.reached, self.kept = 0.0, None
        self.start()

    def start(self):
        for unit in self.units:
            unit.start(self.order["parameters"])
        self.reached = 0.0

    def drop(self):
        if self.kept is not None:
            for unit, state in zip(self.units, self.kept[0], strict=True):
                unit.slave.freeFMUstate(state)
        self.kept = None

    def call(self, draw):
        """One call of both units; returns what was called and the two statuses."""
        what, order = draw.choice(CALLS), self.order
        names = list(order["inputs"])
        if what == "step":
            begin, length = step_of(draw, self.reached, order["step"])
            statuses = [unit.step(begin, length) for unit in self.units]
            if statuses == [0, 0]:
                self.reached = begin + length
            return f"step {begin!r} {length!r}", statuses
        if what in ("set", "bad value") and names:
            name = draw.choice(names)
            low, high = order["inputs"][name]
            bad = draw.choice([float("nan"), float("inf"), -1e12])
            value = draw.uniform(low, high) if what == "set" else bad
            return f"set {name} {value!r}", [status_of(unit.set, name, value) for unit in self.units]
        if what == "late parameter":
            name = draw.choice(
                [n for n, v in self.units[0].variables.items() if v.causality in ("parameter", "output")]
            )
            kind = self.units[0].variables[name].type
            value = {"Real": 0.25, "Integer": 1, "Boolean": True, "String": "other"}[kind]
            return f"set {name}", [status_of(unit.set, name, value) for unit in self.units]
        if what == "keep":
            self.drop()
            self.kept = [unit.slave.getFMUstate() for unit in self.units], self.reached
        elif what == "restore" and self.kept is not None:
            for unit, state in zip(self.units, self.kept[0], strict=True):
                unit.slave.setFMUstate(state)
            self.reached = self.kept[1]
        elif what == "serialised" and self.kept is not None:
            states = []
            for unit, state in zip(self.units, self.kept[0], strict=True):
                data = unit.slave.serializeFMUstate(state)
                unit.slave.freeFMUstate(state)
                states.append(unit.slave.deSerializeFMUstate(data))
            self.kept = states, self.kept[1]
        elif what == "reset" and draw.random() < 0.2:
            for unit in self.units:
                unit.slave.reset()
            self.start()
        elif what == "initialise again":
            return what, [status_of(unit.slave.enterInitializationMode) for unit in self.units]
        return what, [0, 0]


def main(python, native, order):
    draw, pair, different, refused = random.Random(order["seed"]), Pair([python, native], order), [], 0
    for k in range(order["calls"]):
        for unit in pair.units:
            unit.log.clear()
        what, (theirs, ours) = pair.call(draw)
        said = [[text for _, _, text in unit.log] for unit in pair.units]
        shown = [unit.shown() for unit in pair.units]
        if what.startswith("step"):
            refused += ours == 2
            same = theirs == ours and said[0] == said[1]
        else:
            same = theirs == 0 and (ours > 0) == bool(said[0]) and said[0] == said[1]
        if not same or bits(shown[0]) != bits(shown[1]):
            different.append([k, what, theirs, ours, *said])
    return {"different": different[:5], "count": len(different), "refused": refused}


if __name__ == "__main__":
    answer(main(sys.argv[1], sys.argv[2], json.loads(open(sys.argv[3]).read())))
