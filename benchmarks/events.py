"""Events: how many touches of generated rigs are found, how close to their start, and how many false ones there are.

Usage: python -m benchmarks.events [--open N] [--flown N] [--single N]      rigs of each case

Every rig's logs are searched together, those of a flown rig half by half. The figures go into docs/results.md.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from benchmarks.page import PAGE, write_section
from heli_identifier.records import Log
from heli_identifier.tracing import find_events
from tests.blind.battery import BATTERY
from tests.blind.field.battery import FIELD_BATTERY
from tests.blind.field.truth import Touch

VOLTAGE_LIMIT = 5.0

Logs = list[tuple[Log, tuple[Touch, ...]]]
"""Logs that are searched together, with the touches that are in them."""


@dataclass
class Tally:
    """What was found on the rigs of one kind."""

    logs: int = 0
    minutes: float = 0.0
    false: int = 0
    touches: int = 0
    errors: list[float] = field(default_factory=list)

    def row(self, title: str) -> str:
        """One line of the table; errors are those of the start."""
        errors = [abs(error) for error in self.errors]
        found = f"{len(errors)} of {self.touches}" if self.touches else ""
        close = f"{sum(error <= 0.2 for error in errors)}" if self.touches else ""
        largest = f"{max(errors):.3f}" if errors else ""
        rate = f"{self.false / self.minutes:.4f}"
        return f"| {title} | {self.logs} | {self.minutes:.0f} | {self.false} | {rate} | {found} | {close} | {largest} |"


HEAD = (
    "| logs | number | minutes | false events | per minute | touches found | start within .2 s | largest error [s] |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- |"
)


def main(arguments: Sequence[str]) -> None:
    asked = _parsed(arguments)
    tallies: dict[str, Tally] = {}
    for title, logs in _cases(asked):
        score(tallies.setdefault(title, Tally()), logs)
    rows = [tally.row(title) for title, tally in tallies.items()]
    command = " ".join(["python -m benchmarks.events", *arguments])
    write_section(PAGE, "events", f"### Events\n\n`{command}`\n\n{EXPLANATION}\n\n{HEAD}\n" + "\n".join(rows))
    print("\n".join((HEAD, *rows)))


EXPLANATION = (
    "Touches by a hand that the generator puts into a log, found on their axis; every other event is false. The rigs "
    "are drawn as those of the batteries and follow behind them: the threshold was not chosen on them."
)


def score(tally: Tally, logs: Logs) -> None:
    """Search logs and count what was found."""
    events = list(find_events([log for log, _ in logs], VOLTAGE_LIMIT))
    tally.logs += len(logs)
    tally.minutes += sum(log.duration for log, _ in logs) / 60.0
    for log, touches in logs:
        for touch in touches:
            tally.touches += 1
            own = [
                event
                for event in events
                if (event.log, event.axis) == (log.name, touch.axis)
                and event.start < touch.end + 0.3
                and event.end > touch.start - 0.3
            ]
            if own:
                tally.errors.append(min((event.start - touch.start for event in own), key=abs))
                events = [event for event in events if event not in own]
    tally.false += len(events)


def _cases(asked: argparse.Namespace) -> Iterator[tuple[str, Logs]]:
    for case in FIELD_BATTERY:
        open_loop = case.group == "open"
        count = asked.open if open_loop else asked.single if case.group == "single" else asked.flown
        for rig in map(case.rig, range(case.count, case.count + count)):
            dealt = [[], []] if not open_loop else [[]]
            for number, half in enumerate(rig.halves):
                for log, samples in zip(half.numbers, (*half.train, *half.held), strict=True):
                    made = Log(f"log{log:02d}", rig.truth.rate, samples[:, 1:3], samples[:, 3:])
                    dealt[number % len(dealt)].append((made, rig.truth.logs[log].touches))
            title = case.kind if open_loop else {"single": "flown, one effect", "touched": "flown, touched"}.get(
                case.group, f"flown, {case.kind}"
            )  # fmt: skip
            yield from ((title, [*logs]) for logs in dealt)
    for battery_case in BATTERY:
        if battery_case.group != "weak":
            for blind in map(battery_case.rig, range(battery_case.count, battery_case.count + asked.single)):
                logs = [
                    (Log(f"log{i}", 100.0, samples[:, 1:3], samples[:, 3:]), ())
                    for i, samples in enumerate((*blind.train, blind.held))
                ]
                yield f"open-loop battery, {battery_case.group}", logs


def _parsed(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.events", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--open", type=int, default=9, metavar="N", help="rigs of six logs in open loop")
    parser.add_argument("--flown", type=int, default=16, metavar="N", help="rigs flown in closed loop, of each kind")
    parser.add_argument("--single", type=int, default=2, metavar="N", help="rigs of each single effect")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    main(sys.argv[1:])
