"""Growth of a host's memory over 1000 cycles of instantiate, initialise, step, free, for every unit.

Usage: python benchmarks/unit_memory.py [CYCLES]. Each unit runs in a process of its own. The first 100 cycles are
warm-up, for imports and the allocator's arenas. At most 5 MB are required.
"""

import json
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from fmu_src import build_all

HOSTS = Path(__file__).resolve().parent.parent / "tests" / "hosts"
WARM_UP = 100
CYCLES = """
import os, sys
sys.path.insert(0, sys.argv[1])
from unit_host import Unit, answer

def resident():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE")

unit = Unit(sys.argv[2])
given = {"log.path": sys.argv[3]} if "log.path" in unit.variables else {}
for k in range(int(sys.argv[4]) + int(sys.argv[5])):
    if k == int(sys.argv[4]):
        before = resident()
    unit.fresh(given)
    assert unit.step(0.0, 0.01) == 0
    unit.shown()
    unit.free()
answer(resident() - before)
"""


def main() -> None:
    cycles = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    with TemporaryDirectory() as folder:
        log = Path(folder) / "log.csv"
        header = "time [s],v_front [V],v_rear [V],pitch [rad],elevation [rad],travel [rad]\n"
        log.write_text(header + "".join(f"{0.01 * k:.2f},1,1,0,0,0\n" for k in range(9000)))
        print(f"{'unit':20s} growth over {cycles} cycles")
        for name, fmu in build_all(folder).items():
            command = [sys.executable, "-c", CYCLES, str(HOSTS), str(fmu), str(log), str(WARM_UP), str(cycles)]
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            print(f"{name:20s} {json.loads(done.stdout.splitlines()[-1]) / 1e6:6.2f} MB", flush=True)


if __name__ == "__main__":
    main()
