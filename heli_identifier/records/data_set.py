"""Several logs of one rig as one data set: some to fit, some held out to judge by."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations, count
from os import PathLike
from pathlib import Path

import numpy as np

from heli_identifier.errors import LogError
from heli_identifier.records.configuration import RigConfiguration
from heli_identifier.records.format import CONTRACT, LogFormat
from heli_identifier.records.log import Log
from heli_identifier.records.reading import read_log
from heli_identifier.records.units import ANGLES, VOLTAGES

CONSTANT_V = 1e-3  # a voltage that moves by less than this moves no propeller


def read_logs(
    paths: Sequence[str | PathLike[str]],
    format: LogFormat | RigConfiguration = CONTRACT,
    start: float | None = None,
    end: float | None = None,
) -> tuple[Log, ...]:
    """Read several logs of one rig; names that two files share get what tells them apart, as :func:`named_apart` does.

    Parameters
    ----------
    paths : Sequence
        Files, each as for `read_log`.
    format, start, end
        As for `read_log`, the same for each file.

    Raises
    ------
    LogError
        As `read_log`.
    """
    return named_apart([read_log(path, format, start, end) for path in paths])


def read_data_set(
    training: Sequence[str | PathLike[str]],
    held_out: Sequence[str | PathLike[str]] = (),
    format: LogFormat | RigConfiguration = CONTRACT,
    start: float | None = None,
    end: float | None = None,
) -> tuple[tuple[Log, ...], tuple[Log, ...]]:
    """Read the logs to fit and the logs to judge by, and check that they can serve.

    Parameters
    ----------
    training, held_out : Sequence
        Files, each as for `read_log`.
    format, start, end
        As for `read_log`, the same for each file.

    Returns
    -------
    tuple
        Training logs and held-out logs.

    Raises
    ------
    LogError
        As `read_log`; also if no voltage moves in any training log, an angle never changes in one of the logs, or two
        logs share samples.
    """
    logs = read_logs((*training, *held_out), format, start, end)
    seen, judges = logs[: len(training)], logs[len(training) :]
    check_excitation(seen)
    check_apart(seen, judges)
    check_moving(logs)
    return seen, judges


def named_apart(logs: Sequence[Log]) -> tuple[Log, ...]:
    """Give the logs with names of which no two are alike.

    A name that files in several folders share gets as many folders before it as tell them apart; what is then still
    alike, as the same file twice or logs that were computed, is numbered.
    """
    names = [log.name for log in logs]
    for name in {name for name, times in Counter(names).items() if times > 1}:
        shared = [index for index, log in enumerate(logs) if log.name == name]
        folders = {logs[index].path: _folders(logs[index]) for index in shared}
        depth = next(d for d in count() if len({way[:d] for way in folders.values()}) == len(set(folders.values())))
        for index in shared:
            names[index] = "/".join((*reversed(folders[logs[index].path][:depth]), name))
    seen: Counter[str] = Counter()
    for index, name in enumerate(names):
        seen[name] += 1
        names[index] = name if seen[name] == 1 else f"{name} ({seen[name]})"
    return tuple(replace(log, name=name) if log.name != name else log for log, name in zip(logs, names, strict=True))


def check_excitation(logs: Sequence[Log]) -> None:
    """Refuse a data set that cannot identify anything since no voltage ever moves.

    Raises
    ------
    LogError
        If there is no log, or one of the voltages is constant within a millivolt in each log.
    """
    if not logs:
        raise LogError("no log was given; name at least one file.")
    for index, name in enumerate(VOLTAGES):
        if all(np.ptp(log.voltages[:, index]) < CONSTANT_V for log in logs):
            raise LogError(
                f"{', '.join(log.path or log.name for log in logs)}: {name} is constant in every log, so "
                "there is nothing to identify; excite the rig, for instance with the Exciter's square and chirp."
            )


def check_moving(logs: Sequence[Log]) -> None:
    """Refuse a log in which an axis stands still: a model of three free axes cannot be judged by it.

    Raises
    ------
    LogError
        If an angle is constant throughout one of the logs.
    """
    for log in logs:
        still = [name for name, angle in zip(ANGLES, log.angles.T, strict=True) if np.ptp(angle) == 0.0]
        if still:
            stand = f"{' and '.join(still)} never change{'s' if len(still) == 1 else ''}"
            raise LogError(
                f"{log.path or log.name}: {stand}: a clamped axis or a dead encoder tells "
                "nothing about itself, and a diagnosis needs all three axes to move; leave the log out."
            )


def check_apart(training: Sequence[Log], held_out: Sequence[Log] = ()) -> None:
    """Refuse logs that share samples: one given twice counts double, one fitted and held out judges itself.

    Raises
    ------
    LogError
        If two logs are cut from the same bytes and their stretches overlap.
    """
    for (first, one), (second, other) in combinations(enumerate((*training, *held_out)), 2):
        if not _share_samples(one, other):
            continue
        if first < len(training) <= second:
            raise LogError(
                f"{other.path} is held out for validation but shares samples with training log {one.path}; "
                "give a log, or a stretch of it, that the fit has not seen."
            )
        kind = "training" if second < len(training) else "held-out"
        raise LogError(f"{other.path} holds the same samples as {one.path}; give each {kind} log once.")


def _share_samples(one: Log, other: Log) -> bool:
    margin = 0.5 * one.step  # stretches that follow each other share no sample, whatever rounding says
    overlap = one.start + margin < other.start + other.duration and other.start + margin < one.start + one.duration
    return overlap and one.sha256 == other.sha256 != ""


def _folders(log: Log) -> tuple[str, ...]:
    """Names of the folders that a log's file lies in, the nearest first; none if it was computed."""
    return tuple(folder.name for folder in Path(log.path).resolve().parents) if log.path else ()
