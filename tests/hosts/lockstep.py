"""Two builds of one unit, stepped side by side in one process: the number of steps in which a value differs.

Usage: lockstep.py FIRST.fmu SECOND.fmu ORDER.json; the order holds `parameters`, `inputs` (low and high of each),
`steps`, `seed`, and `longest` and `shortest` communication step [s]. Every 97th step is undone and
repeated from a saved state, every 193rd from a serialised one.
"""

import json
import random
import struct
import sys

from unit_host import Unit, answer


def bits(values):
    return struct.pack(f"{len(values)}d", *values)


def main(first, second, order):
    units = [Unit(path).fresh(order["parameters"]) for path in (first, second)]
    draw = random.Random(order["seed"])
    time, different, worst = 0.0, 0, 0.0
    different += bits(units[0].shown()) != bits(units[1].shown())
    for k in range(order["steps"]):
        fed = {name: draw.uniform(*span) for name, span in order["inputs"].items()}
        h = draw.choice([order["longest"], order["longest"], draw.uniform(order["shortest"], order["longest"])])
        for unit in units:
            for name, value in fed.items():
                unit.set(name, value)
        if k % 97 == 0 or k % 193 == 0:
            for unit in units:
                undone(unit, time, h, k % 193 == 0)
        status = [unit.step(time, h) for unit in units]
        time += h
        shown = [unit.shown() for unit in units]
        if status[0] != status[1] or bits(shown[0]) != bits(shown[1]):
            different += 1
            worst = max(worst, *(abs(a - b) for a, b in zip(*shown, strict=True)))
    return {"steps": order["steps"], "different": different, "worst": worst, "status": status, "last": shown[1]}


def undone(unit, time, h, serialised):
    slave = unit.slave
    state = slave.getFMUstate()
    if serialised:
        data = slave.serializeFMUstate(state)
        slave.freeFMUstate(state)
        state = slave.deSerializeFMUstate(data)
    unit.step(time, h)
    unit.step(time + h, h)
    slave.setFMUstate(state)
    slave.freeFMUstate(state)


if __name__ == "__main__":
    answer(main(sys.argv[1], sys.argv[2], json.loads(open(sys.argv[3]).read())))
