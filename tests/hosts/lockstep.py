"""Two builds of one unit, stepped side by side in one process: the number of steps in which a value differs.

Usage: lockstep.py FIRST.fmu SECOND.fmu ORDERS.json. Each order holds `parameters`, `inputs` (low and high of each),
`steps`, `seed`, and `longest` and `shortest` communication step [s]. Every 97th step is undone and repeated from a
saved state, every 193rd from a serialised one. The second build may be of FMI 3.0.
"""

import json
import random
import struct
import sys

from unit_host import answer, opened


def bits(values):
    return struct.pack(f"{len(values)}d", *values)


def main(units, order):
    for unit in units:
        unit.fresh(order["parameters"])
    draw = random.Random(order["seed"])
    time, worst, status = 0.0, 0.0, [0, 0]
    different = int(bits(units[0].shown()) != bits(units[1].shown()))
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
        if status[0] != status[1] or bits(shown[0]) != bits(shown[1]):
            different += 1
            worst = max(worst, *(abs(a - b) for a, b in zip(*shown, strict=True)))
    log = [text for unit in units for _, _, text in unit.log]
    return {"steps": order["steps"], "different": different, "worst": worst, "status": status, "log": log[:3]}


if __name__ == "__main__":
    with open(sys.argv[3]) as file:
        orders = json.load(file)
    pair = [opened(path) for path in sys.argv[1:3]]
    answer([main(pair, order) for order in orders])
