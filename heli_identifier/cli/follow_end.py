"""The end of a flight: its recording is diagnosed, and the folder then holds what a diagnosis leaves."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from heli_identifier.live.session import Session
    from heli_identifier.records import RigConfiguration

LONGEST = 600.0
"""The end of a recording that is diagnosed [s]; more takes long and adds little."""

LEAST_AFTER_CHANGE = 30.0
"""Time after the last change from which on only that is diagnosed [s]: the rig before was another one."""


def conclude(session: "Session", folder: Path, configuration: "RigConfiguration") -> None:
    """Diagnose the recording; where it holds too little, leave the twin's parameters and unit."""
    from heli_identifier.cli.terminal import note, warn
    from heli_identifier.errors import IdentifierError
    from heli_identifier.live.session import IN_USE, RECORDED
    from heli_identifier.tools import SHORTEST_TO_SPLIT

    session.in_use().write(folder / IN_USE)
    path = folder / RECORDED
    begin, end, why = part(times_of(path), session.events)
    if end - begin < SHORTEST_TO_SPLIT:
        note(f"{end - begin:.3g} s without a gap are too short for a diagnosis")
        _leave_twin(session, folder)
        return
    note(f"diagnosed: {begin:.4g} s to {end:.4g} s of {path}{why}")
    try:
        _diagnose(path, folder, begin, end, configuration)
    except IdentifierError as error:
        warn(f"the recording cannot be diagnosed: {error}")
        _leave_twin(session, folder)


def _diagnose(path: Path, folder: Path, begin: float, end: float, configuration: "RigConfiguration") -> None:
    """Diagnose a part of the recording and print the result."""
    from heli_identifier.cli.diagnose import diagnosed
    from heli_identifier.cli.logs import split_logs
    from heli_identifier.cli.summary import print_diagnosis
    from heli_identifier.cli.terminal import note, progress_bar
    from heli_identifier.records import LogFormat
    from heli_identifier.results import RESULTS, whole_folder

    # The recording has the contract's columns, signs and units; what is left of the rig's own are its limits.
    own = configuration.format
    plain = LogFormat(voltage_limit=own.voltage_limit, encoder_counts=own.encoder_counts)
    rig = replace(configuration, format=plain)
    with whole_folder(folder) as draft:
        training, held_out = split_logs((path,), (), rig, begin, end)
        with progress_bar() as progress:
            diagnosis = diagnosed(training, held_out, rig, draft, progress)
    print_diagnosis(diagnosis)
    note(f"written: {', '.join(str(folder / name) for name in (*_flight(folder), *RESULTS))}")


def times_of(path: Path) -> Any:
    """Return the times of a recording [s], an array."""
    import numpy as np

    if path.read_bytes().count(b"\n", 0, 4096) < 2:
        return np.zeros(0)
    return np.loadtxt(path, delimiter=",", skiprows=1, usecols=0, ndmin=1)


def part(times: Any, events: Sequence[dict[str, Any]]) -> tuple[float, float, str]:
    """Return begin and end [s] of what is diagnosed, and the reason in words.

    It is the longest stretch without a gap, after the last change that was noticed if enough flight follows it.
    """
    import numpy as np

    from heli_identifier.records import GAP_STEPS

    if len(times) < 2:
        return 0.0, 0.0, ""
    changes = [event["since_s"] for event in events if event["what"] in ("alarm", "adopted", "rolled back")]
    last = changes[-1] if changes else times[0]
    after = times[-1] - last >= LEAST_AFTER_CHANGE
    first = max(last if after else times[0], times[-1] - LONGEST)
    why = f", after the last change at {last:.4g} s" if changes and after else ""
    if changes and not after:
        why = f"; the rig may have changed within it, at {last:.4g} s"
    kept = times[times >= first]
    steps = np.diff(kept)
    cuts = np.flatnonzero(steps > (GAP_STEPS + 0.5) * np.median(np.diff(times)))
    begins, ends = np.append(0, cuts + 1), np.append(cuts, len(kept) - 1)
    longest = int((kept[ends] - kept[begins]).argmax())
    return float(kept[begins[longest]]), float(kept[ends[longest]]), why


def _leave_twin(session: "Session", folder: Path) -> None:
    """Write the twin's parameters and its unit in place of a diagnosis'."""
    from heli_identifier.cli.terminal import note
    from heli_identifier.results import PLANT, build, whole_folder

    with whole_folder(folder) as draft:
        twin = session.in_use()
        twin.write(draft / "parameters.json")
        build(PLANT, draft, twin)
    names = (*_flight(folder), "parameters.json", f"{PLANT}.fmu")
    note(f"written, as the twin flew last: {', '.join(str(folder / name) for name in names)}")


def _flight(folder: Path) -> tuple[str, ...]:
    from heli_identifier.cli.follow_advice import ADVICE, GAINS
    from heli_identifier.live.session import EVENTS, IN_USE, PREDICTIONS, RECORDED

    return tuple(name for name in (EVENTS, RECORDED, PREDICTIONS, IN_USE, ADVICE, GAINS) if (folder / name).is_file())
