"""Hover without excitation: what the identifier calls determined there, and how often it is wrong.

Usage: python -m benchmarks.closed_loop_quiet [--tuning]      the half of the rigs that constants were chosen on

Twelve generated rigs (:mod:`benchmarks.closed_loop_rigs`), five logs of 240 s each, prediction errors in the native
unit with the motors' lag estimated, with and without a random torque: nobody moves the joystick at all, or nobody does
after the first 60 s. Counted are the seconds from 20 s on, or from 90 s on, in which a parameter is called determined;
of these, those in which the 95 % interval misses and in which the estimate is off by more than a tenth.
"""

import argparse

import numpy as np

from benchmarks.closed_loop import JUDGED, REPORTED, TUNING
from benchmarks.closed_loop_rigs import ClosedLoopRig, closed_loop_rigs
from benchmarks.native_identifier import Units, built_units
from benchmarks.tables import table
from heli_identifier.online import PREDICTION_ERROR

DURATION = 240.0
CASES = (("never", -6.0, 20), ("for 60 s", 60.0, 90))
"""Who moves the joystick; until when in the log [s] (it begins 6 s after the flight); first second that counts."""
OUTPUTS = (*JUDGED, *(f"standard_error.{name}" for name in JUDGED), *(f"determined.{name}" for name in JUDGED))


def counted(units: Units, rigs: list[ClosedLoopRig], first: int, forgetting: float) -> tuple[int, int, int, int]:
    """Return numbers of values, of determined ones, and of these those that miss and that are off by a tenth."""
    found = np.zeros(4, dtype=int)
    for rig in rigs:
        truth = np.array([getattr(rig.truth, name) for name in JUDGED])
        for log in rig.logs:
            given = {"method": PREDICTION_ERROR, "report__interval": 0.5, "adaptation__forgetting": forgetting}
            with units.unit(log.step, OUTPUTS, **given) as unit:
                record = unit.take(np.column_stack((log.voltages, log.angles)), round(log.rate_hz))[first:]
            value, error, determined = np.split(record, 3, axis=1)
            sure, off = determined == 1.0, np.abs(value - truth)
            found += [
                sure.size,
                sure.sum(),
                (sure & (off > 1.96 * error)).sum(),
                (sure & (off > 0.1 * abs(truth))).sum(),
            ]
    return tuple(found.tolist())


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.closed_loop_quiet")
    parser.add_argument("--tuning", action="store_true", help="the other half of the rigs")
    seed = TUNING if parser.parse_args().tuning else REPORTED
    rows = []
    with built_units() as units:
        for noise in (1.0, 0.0):
            for title, quiet_from, first in CASES:
                rigs = closed_loop_rigs(seed, durations=(DURATION, DURATION), quiet_from=quiet_from, noise=noise)
                for forgetting in (0.001, 0.3):
                    whole, sure, missed, off = counted(units, rigs, first, forgetting)
                    shares = [f"{100.0 * part / max(sure, 1):.1f} %" if sure else "-" for part in (missed, off)]
                    rows.append((title, f"{noise:g}", f"{forgetting:g}", f"{100.0 * sure / whole:.2f} %", *shares))
    head = (
        "excited",
        "torque, times .012 rad/s^2",
        "forgetting [1/s]",
        "determined",
        "of these missed",
        "off by a tenth",
    )
    print(table(head, rows))


if __name__ == "__main__":
    main()
