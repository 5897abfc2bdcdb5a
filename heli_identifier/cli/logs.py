"""The logs that a command was given: their configuration, what was converted in them, which of them are held out."""

import os
from collections.abc import Sequence
from pathlib import Path

from heli_identifier.cli.terminal import note, warn
from heli_identifier.errors import LogError
from heli_identifier.records import (
    CONFIGURATION_NAME,
    Log,
    RigConfiguration,
    read_configuration,
    suspicions,
)
from heli_identifier.tools import read_split


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
    if not training:
        raise LogError("no log is left to fit to: all that were named are held out by --validate.")
    fitted, judged, held_back = read_split(training, held_out, configuration.format, start, end)
    if held_back:
        note(f"{held_back} (name another log with --validate)")
    print_notes((*fitted, *judged))
    return fitted, judged
