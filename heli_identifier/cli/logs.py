"""The logs that a command was given: their configuration, what was converted in them, which of them are held out."""

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from heli_identifier.cli.terminal import note, warn
from heli_identifier.errors import LogError
from heli_identifier.records import (
    CONFIGURATION_NAME,
    Log,
    RigConfiguration,
    read_configuration,
    read_log,
    read_logs,
    suspicions,
)

TRAINING_SHARE = 2.0 / 3.0
"""Share of a single log that is fitted to; the rest is held out."""

SHORTEST_TO_SPLIT = 15.0
"""Length [s] from which a single log is split."""


def configuration_here() -> Path | None:
    """Give heli.toml of this folder, whatever it is; None where nothing has that name."""
    return Path(CONFIGURATION_NAME) if os.path.lexists(CONFIGURATION_NAME) else None


def found_configuration(path: Path | None) -> RigConfiguration:
    """Read the rig's configuration: the file that was named, else heli.toml of this folder, else the defaults."""
    if path is None and (path := configuration_here()) is not None:
        note(f"configuration: {CONFIGURATION_NAME} of this folder")
    return RigConfiguration() if path is None else read_configuration(path)


def shared_configuration(path: Path | None) -> Path | None:
    """Give the configuration of rigs that have none of their own: the file that was named, else this folder's."""
    if path is None and (path := configuration_here()) is not None:
        note(f"configuration: {CONFIGURATION_NAME} of this folder, for rigs without one of their own")
    return path


def print_notes(logs: Sequence[Log]) -> None:
    """Print what was converted or repaired on reading, and what is probably wrong with columns and signs."""
    for log in logs:
        for text in log.notes:
            note(f"{log.path}: {text}")
    for log in logs:
        for text in suspicions(log):
            warn(f"{log.path}: {text}")


def split_logs(
    training: Sequence[Path],
    held_out: Sequence[Path],
    configuration: RigConfiguration,
    start: float | None,
    end: float | None,
) -> tuple[tuple[Log, ...], tuple[Log, ...]]:
    """Read the training logs and the held-out logs; without any of the latter hold some back, and print which.

    Raises
    ------
    LogError
        A log cannot be read, no training log is left, or a single log is too short to be split.
    """
    form = configuration.format
    if not training:
        raise LogError("no log is left to fit to: all that were named are held out by --validate.")
    if not held_out and len(training) > 1:
        note(f"held out: {training[-1]}, the last log (name others with --validate)")
        training, held_out = training[:-1], training[-1:]
    if held_out:
        logs = read_logs((*training, *held_out), form, start, end)
    else:
        logs = _parts(training[0], configuration, start, end)
    print_notes(logs)
    return logs[: len(training)], logs[len(training) :]


def _parts(path: Path, configuration: RigConfiguration, start: float | None, end: float | None) -> tuple[Log, Log]:
    """Split a single log in time: the first two thirds, and the last third."""
    whole = read_log(path, configuration.format, start, end)
    if whole.duration < SHORTEST_TO_SPLIT:
        raise LogError(
            f"{path}: {whole.duration:.3g} s are too short to be split into a training part and a held-out part, "
            f"{SHORTEST_TO_SPLIT:g} s are needed; name a second log with --validate."
        )
    cut = whole.start + TRAINING_SHARE * whole.duration
    last = whole.start + whole.duration - 0.5 * whole.step
    note(f"held out: the last third of {path}, from {cut:.4g} s on (name another log with --validate)")
    first = read_log(path, configuration.format, whole.start, cut - 0.5 * whole.step)
    rest = read_log(path, configuration.format, cut, last)
    return first, replace(rest, name=f"{rest.name} from {cut:.4g} s")
