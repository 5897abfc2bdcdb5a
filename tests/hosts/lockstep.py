"""Builds of one unit, stepped side by side in one process: the number of steps in which a value differs. Usage:
lockstep.py UNIT.fmu... ORDERS.json. Each order holds `parameters`, `inputs` (low and high of each), `steps`, `seed`,
and `longest` and `shortest` communication step [s]. Every 97th step is undone and repeated from a saved state, every
193rd from a serialised one. A build may be of FMI 3.0."""

import json
import random
import struct
import sys

from unit_host import Unit, answer


def bits(values):
    return struct.pack(f"{len(values)}d", *values)


def main(units, order):
    for unit in units:
        unit.fresh(order["parameters"])
    draw = random.Random(order["seed"])
    time, worst, status = 0.0, 0.0, []
    different = int(len({bits(unit.shown()) for unit in units}) > 1)
    for k in range(order["steps"]):
        fed = {name: draw.uniform(*span) for name, span in order["inputs"].items()}
        h = draw.choice([order["longest"], order["longest"], draw.uniform(order["shortest"], order["longest"])])
        for unit in units:
            for name, value in fed.items():
                unit.set(name, value)
            if k % 97 == 0 or k % 193 == 0:
                state = unit.saved(through_bytes=k % 193 == 0)
                unit.step(time, h)
                unit.step(time + h, h)
                unit.restore(state)
        status = [unit.step(time, h) for unit in units]
        time += h
        shown = [unit.shown() for unit in units]
        if len({*status}) > 1 or len({*map(bits, shown)}) > 1:
            different += 1
            worst = max(worst, *(max(values) - min(values) for values in zip(*shown, strict=True)))
    log = [text for unit in units for _, _, text in unit.log]
    return {"steps": order["steps"], "different": different, "worst": worst, "status": status, "log": log[:3]}


if __name__ == "__main__":
    *paths, orders = sys.argv[1:]
    builds = [Unit(path) for path in paths]
    with open(orders) as file:
        answer([main(builds, order) for order in json.load(file)])
