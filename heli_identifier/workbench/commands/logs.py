"""The logs that a command was given: configuration found, logs read, what was done to them said, some held out."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from heli_identifier.errors import LogError
from heli_identifier.records import (
    CONFIGURATION_NAME,
    Log,
    RigConfiguration,
    check_apart,
    check_excitation,
    read_configuration,
    read_data_set,
    read_log,
    read_logs,
)
from heli_identifier.workbench.commands.terminal import note

TRAINING_SHARE = 2.0 / 3.0
"""Share of a single log that is fitted to; the rest is held out."""

SHORTEST_TO_SPLIT = 15.0
"""Length [s] from which a third of a log is long enough to judge by."""


def found_configuration(path: Path | None) -> RigConfiguration:
    """Read the rig's configuration: the file that was named, else heli.toml of this folder, else the defaults."""
    if path is None and Path(CONFIGURATION_NAME).is_file():
        note(f"configuration: {CONFIGURATION_NAME} of this folder")
        path = Path(CONFIGURATION_NAME)
    return RigConfiguration() if path is None else read_configuration(path)


def say_notes(logs: Sequence[Log]) -> None:
    """Say what was converted or repaired on reading."""
    for log in logs:
        for text in log.notes:
            note(f"{log.path}: {text}")


def training_logs(
    paths: Sequence[Path], configuration: RigConfiguration, start: float | None, end: float | None
) -> tuple[Log, ...]:
    """Read logs to fit to.

    Raises
    ------
    LogError
        A log cannot be read, nothing is excited, or a log is given twice.
    """
    logs = read_logs(paths, configuration.format, start, end)
    check_excitation(logs)
    check_apart(logs)
    say_notes(logs)
    return logs


def split_logs(
    training: Sequence[Path],
    validation: Sequence[Path],
    configuration: RigConfiguration,
    start: float | None,
    end: float | None,
) -> tuple[tuple[Log, ...], tuple[Log, ...]]:
    """Read logs to fit to and logs to judge by; without any of the latter hold some back, and say so.

    Raises
    ------
    LogError
        A log cannot be read, nothing is excited, an axis stands still, or a single log is too short to be split.
    """
    form = configuration.format
    if not training:
        raise LogError("no log is left to fit to: all that were named are held out by --validate.")
    if not validation and len(training) > 1:
        note(f"held out to judge by: {training[-1]}, the last log (name others with --validate)")
        training, validation = training[:-1], training[-1:]
    if validation:
        seen, held = read_data_set(training, validation, form, start, end)
    else:
        seen, held = _split(training[0], configuration, start, end)
    say_notes((*seen, *held))
    return seen, held


def _split(
    path: Path, configuration: RigConfiguration, start: float | None, end: float | None
) -> tuple[tuple[Log, ...], tuple[Log, ...]]:
    """Split a single log in time."""
    whole = read_log(path, configuration.format, start, end)
    if whole.duration < SHORTEST_TO_SPLIT:
        raise LogError(
            f"{path}: {whole.duration:.3g} s are too short to fit to one part and judge by the other, "
            f"{SHORTEST_TO_SPLIT:g} s are needed; name a second log with --validate."
        )
    cut = whole.start + TRAINING_SHARE * whole.duration
    last = whole.start + whole.duration - 0.5 * whole.step
    note(f"held out to judge by: the last third of {path}, from {cut:.4g} s on (name another log with --validate)")
    first, rest = read_data_set([path], [], configuration.format, whole.start, cut - 0.5 * whole.step)
    held = read_log(path, configuration.format, cut, last)
    return first, (*rest, replace(held, name=f"{held.name} from {cut:.4g} s"))
