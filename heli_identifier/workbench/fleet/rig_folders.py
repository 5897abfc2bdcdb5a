"""The folders of a fleet: one for each rig, with its logs and, where the rig needs one, its heli.toml."""

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from heli_identifier.errors import ConfigurationError
from heli_identifier.records import CONFIGURATION_NAME

ENDINGS = (".csv", ".mat")
"""Endings of logs; other files in a rig's folder are left alone."""

HELD_OUT = "held"
"""A log whose name begins so is held out."""


@dataclass(frozen=True)
class RigFolder:
    """One rig of a fleet.

    Attributes
    ----------
    rig : str
        Name of the folder, or its path where two folders have one name.
    training : tuple of Path
        Logs to fit and to search, in the order of their names.
    held_out : tuple of Path
        Logs whose names begin with "held"; empty if none does, and the last log is then to be held out.
    configuration : Path or None
        heli.toml of the folder, else the one that all rigs share.
    """

    rig: str
    training: tuple[Path, ...]
    held_out: tuple[Path, ...]
    configuration: Path | None


def rig_folders(
    folders: Sequence[str | PathLike[str]], configuration: str | PathLike[str] | None = None
) -> tuple[RigFolder, ...]:
    """Find the logs of every rig.

    Parameters
    ----------
    folders : sequence of path
        At least two.
    configuration : path, optional
        heli.toml of the rigs that have none beside their logs.

    Raises
    ------
    ConfigurationError
        Fewer than two folders, a folder given twice, one that is missing, or one without a log to fit to.
    """
    paths = [Path(folder) for folder in folders]
    for path in paths:
        if not path.is_dir():
            raise ConfigurationError(f"{path} is no folder; name a folder of logs for each rig.")
    times = Counter(path.resolve() for path in paths)
    twice = [path for path in paths if times[path.resolve()] > 1]
    if twice:
        raise ConfigurationError(f"{twice[0]} is given {times[twice[0].resolve()]} times; name each rig once.")
    if len(paths) < 2:
        raise ConfigurationError(
            f"a fleet needs two rigs or more, {len(paths)} given; `heli diagnose` is for the logs of one rig."
        )
    names = Counter(path.resolve().name for path in paths)
    shared = Path(configuration) if configuration else None
    return tuple(
        rig_folder(path, path.resolve().name if names[path.resolve().name] == 1 else str(path), shared)
        for path in paths
    )


def rig_folder(folder: Path, name: str, shared: Path | None = None) -> RigFolder:
    """Find the logs of one rig.

    Raises
    ------
    ConfigurationError
        The folder holds no log to fit to.
    """
    logs = sorted(path for path in folder.iterdir() if path.suffix.lower() in ENDINGS and path.is_file())
    held_out = tuple(path for path in logs if path.name.startswith(HELD_OUT))
    training = tuple(path for path in logs if path not in held_out)
    if not training:
        found = f"only {held_out[0].name}, which is held out" if held_out else "no log"
        raise ConfigurationError(
            f"{folder} holds {found}; put the rig's logs there ({' or '.join(ENDINGS)}), one of them to fit to."
        )
    own = folder / CONFIGURATION_NAME
    return RigFolder(name, training, held_out, own if os.path.lexists(own) else shared)
