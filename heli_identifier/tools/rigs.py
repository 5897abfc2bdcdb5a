"""Rigs with their logs, a folder for each.

A :class:`Source` is small: a campaign sends it to the worker, which loads the logs itself. A worker on another machine
must see the folder under the same path.
"""

import hashlib
import os
import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import ceil
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

from heli_identifier import records
from heli_identifier.errors import CONFIGURATION_NAME, IdentifierError, LogError, refuse
from heli_identifier.records import Log, RigConfiguration
from heli_identifier.results import Diagnosis, diagnose

ENDINGS = (".csv", ".mat")  # endings of logs, also with .gz behind them; other files in a rig's folder are ignored
HELD_OUT = "held"  # a log whose name starts with this is held out
TRAINING_SHARE = 2.0 / 3.0  # share of a single log that is fitted to; the rest is held out

SHORTEST_TO_SPLIT = 25.0
"""Length [s] from which a single log is split: its last third has the 8 s that a diagnosis needs."""


@dataclass(frozen=True)
class RigLogs:
    """The data set of one rig: training logs and held-out logs."""

    training: tuple[Log, ...]
    held_out: tuple[Log, ...]
    notes: tuple[str, ...] = ()
    """Why logs in its folder are not used, and what was held out if their names do not say so."""

    def diagnose(self, **options: Any) -> Diagnosis:
        """Diagnose it; the notes of the diagnosis begin with those of the rig."""
        diagnosis = diagnose(self.training, held_out=self.held_out, **options)
        return replace(diagnosis, notes=(*self.notes, *diagnosis.notes))


class Source(NamedTuple):
    """The unique name of a ``rig``, a function that loads its logs, and one that gives a digest of their content."""

    rig: str
    load: Callable[..., RigLogs]
    content: Callable[[], str]


def split_logs(training: Sequence[Log], held_out: Sequence[Log]) -> tuple[tuple[Log, ...], tuple[Log, ...], str]:
    """Return training logs, held-out logs, and a note on what was held out here.

    Without held-out logs the last log is held out, or the last third of a single log. LogError if a single log does
    not move or is too short.
    """
    *others, last = training
    if held_out:
        return tuple(training), tuple(held_out), ""
    if others:
        return tuple(others), (last,), f"held out: {last.path}, the last log"
    records.check_moving((last,))
    if last.duration < SHORTEST_TO_SPLIT:
        raise LogError(
            f"{last.path}: {last.duration:.3g} s are too short to be split into a training part and a held-out part, "
            f"{SHORTEST_TO_SPLIT:g} s are needed; give a second log, which is then held out."
        )
    count = ceil(TRAINING_SHARE * last.samples)
    part, rest = cut_log(last, 0, count), cut_log(last, count, last.samples)
    return (part,), (rest,), f"held out: the last third of {last.path}, from {rest.start:.4g} s on"


def cut_log(log: Log, first: int, stop: int) -> Log:
    """Return a passage of a log without its events, from the sample ``first`` to the one before ``stop``."""
    if (first, stop) == (0, log.samples):
        return log
    begin, end = (log.start + k * log.step for k in (first, stop - 1))
    return replace(
        log,
        name=f"{log.name} from {begin:.4g} s" if first else log.name,
        voltages=log.voltages[first:stop],
        angles=log.angles[first:stop],
        references={axis: values[first:stop] for axis, values in log.references.items()},
        start=begin,
        notes=(*log.notes, f"here {begin:g} s to {end:g} s of it ({stop - first} of {log.samples} rows)"),
        events=(),
    )


def rig_folders(
    folders: Sequence[str | PathLike[str]], configuration: str | PathLike[str] | None = None
) -> list[Source]:
    """Find the logs of the rigs of a fleet; each rig has a folder.

    ``configuration`` is the heli.toml for rigs that have none in their folder. ConfigurationError if there are fewer
    than two folders, or if a folder is given twice, is missing, or has no log to fit to.
    """
    paths = [Path(folder).resolve() for folder in folders]
    for folder, path in zip(folders, paths, strict=True):
        refuse(not path.is_dir(), f"{folder} is no folder; name a folder of logs for each rig.")
        refuse(paths.count(path) > 1, f"{folder} is given {paths.count(path)} times; name each rig once.")
    count, advice = len(paths), "`heli diagnose` is for the logs of one rig."
    refuse(count < 2, f"a fleet needs two rigs or more, {count} given; {advice}")
    counts = Counter(path.name for path in paths)
    names = [path.name if counts[path.name] == 1 else str(folder) for folder, path in zip(folders, paths, strict=True)]
    return [rig_folder(Path(folder), name, configuration) for folder, name in zip(folders, names, strict=True)]


def find_rigs(
    folder: str | PathLike[str], configuration: str | PathLike[str] | None = None
) -> tuple[list[Source], list[str]]:
    """Find the rigs of a campaign: every sub-folder that holds a log; return them, and the names of other sub-folders.

    ConfigurationError if the folder is missing, no sub-folder holds a log, or one holds none to fit to.
    """
    refuse(not Path(folder).is_dir(), f"{folder} is no folder; name one with a sub-folder for each rig.")
    paths = [path for path in sorted(Path(folder).resolve().iterdir()) if path.is_dir()]  # workers run in another one
    shared = Path(configuration).resolve() if configuration else None
    rigs = [rig_folder(path, path.name, shared) for path in paths if _list_logs(path)]
    endings = " or ".join(ENDINGS)
    refuse(not rigs, f"no sub-folder of {folder} holds a log ({endings}); each rig needs one with its logs.")
    return rigs, [path.name for path in paths if not _list_logs(path)]


def rig_folder(folder: Path, name: str, shared: str | PathLike[str] | None = None) -> Source:
    """Find the logs of one rig; names say which are held out. ConfigurationError if no log is left to fit to."""
    logs, own_configuration = _list_logs(folder), folder / CONFIGURATION_NAME
    held_out = [path for path in logs if path.name.startswith(HELD_OUT)]
    training = [path for path in logs if path not in held_out]
    found = f"only {held_out[0].name}, which is held out" if held_out else "no log"
    advice = f"put the rig's logs there ({' or '.join(ENDINGS)}), one of them to fit to."
    refuse(not training, f"{folder} holds {found}; {advice}")
    configuration = own_configuration if os.path.lexists(own_configuration) else Path(shared) if shared else None
    files = (*training, *held_out, *([configuration] if configuration else ()))
    return Source(name, partial(_read_rig, training, held_out, configuration), partial(digest_files, files))


def _list_logs(folder: Path) -> list[Path]:
    files = sorted(path for path in folder.iterdir() if path.is_file())
    return [path for path in files if path.name.lower().removesuffix(".gz").endswith(ENDINGS)]


def _read_rig(training: Sequence[Path], held_out: Sequence[Path], file: Path | None) -> RigLogs:
    """Read the usable logs of a rig; LogError if no log is left to fit to."""
    configuration = records.read_configuration(file) if file else RigConfiguration()
    usable, errors = dict[Path, Log](), dict[Path, LogError]()
    for path in (*training, *held_out):
        try:
            records.check_moving([log := records.read_log(path, configuration)])
            usable[path] = log
        except LogError as error:
            errors[path] = error
    to_fit, to_hold_out = ([usable[path] for path in paths if path in usable] for paths in (training, held_out))
    if not to_fit:
        raise errors[training[0]]
    logs = records.read_logs((*to_fit, *to_hold_out))
    training_logs, held_out_logs, note = split_logs(logs[: len(to_fit)], logs[len(to_fit) :])
    notes = [*(f"{path.name} is left out: {error}" for path, error in errors.items()), *([note] if note else [])]
    return RigLogs(training_logs, held_out_logs, tuple(notes))


def digest_files(files: Iterable[Path]) -> str:
    """Return a digest of the names and bytes of files."""
    digest = hashlib.sha256()
    for path in files:
        digest.update(path.name.encode() + hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def error_text(error: Exception) -> str:
    """Return an error's text, with its place in the code if this software did not raise it on purpose."""
    if isinstance(error, IdentifierError):
        return str(error)
    place = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} (in {place.name}, {os.path.basename(place.filename)} line {place.lineno})"
