"""How often wrong columns and signs are noticed: ``python -m benchmarks.suspicion LOG...``.

Every log is read as it stands, from 6 s on, and then with each mistake put into it. A log that is suspected as it
stands is counted with its pitch mirrored, which must clear it: it comes from a rig whose pitch counts the other way.
"""

import sys
from collections import Counter
from dataclasses import replace

import numpy as np

from heli_identifier.errors import LogError
from heli_identifier.records import Log, read_log, suspicions

MIRRORED = np.array([-1.0, 1.0, 1.0])
LOWERED = np.array([1.0, -1.0, 1.0])


def mistakes(log: Log) -> dict[str, Log]:
    """Give the log with each mistake."""
    return {
        "rotors exchanged": replace(log, voltages=log.voltages[:, ::-1]),
        "pitch mirrored": replace(log, angles=log.angles * MIRRORED),
        "elevation mirrored": replace(log, angles=log.angles * LOWERED),
        "voltages of another time": replace(log, voltages=np.roll(log.voltages, log.samples // 3, axis=0)),
    }


def main(paths: list[str]) -> None:
    """Count over all logs and print."""
    found: Counter[str] = Counter()
    for path in paths:
        try:
            log = read_log(path, start=6.0)
        except LogError as error:
            print(f"left out: {error}")
            continue
        found["logs"] += 1
        said = suspicions(log)
        if any("WRONG" in text for text in said):
            log = replace(log, angles=log.angles * MIRRORED)
            found["pitch of the other sign"] += not any("WRONG" in text for text in suspicions(log))
            found["suspected either way"] += any("WRONG" in text for text in suspicions(log))
        found["too calm to show it"] += any("too calm" in text for text in suspicions(log))
        for mistake, changed in mistakes(log).items():
            found[mistake] += bool(suspicions(changed))
    for what, count in found.items():
        print(f"{what:30s} {count}")


if __name__ == "__main__":
    main(sys.argv[1:])
