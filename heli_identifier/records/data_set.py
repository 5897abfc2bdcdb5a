"""Several logs of one rig as one data set: some to fit, some held out to judge by."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path

import numpy as np

from heli_identifier.errors import LogError
from heli_identifier.records.format import CONTRACT, LogFormat
from heli_identifier.records.log import Log
from heli_identifier.records.reading import read_log
from heli_identifier.records.units import VOLTAGES

CONSTANT_V = 1e-3  # a voltage that moves by less than this moves no propeller


def read_logs(
    paths: Sequence[str | PathLike[str]],
    format: LogFormat = CONTRACT,
    start: float | None = None,
    end: float | None = None,
) -> tuple[Log, ...]:
    """Read several logs of one rig; a name that two files share gets its folder's name before it.

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
    logs = [read_log(path, format, start, end) for path in paths]
    shared = Counter(log.name for log in logs)
    return tuple(replace(log, name=_with_folder(log)) if shared[log.name] > 1 else log for log in logs)


def read_data_set(
    training: Sequence[str | PathLike[str]],
    held_out: Sequence[str | PathLike[str]] = (),
    format: LogFormat = CONTRACT,
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
        As `read_log`; also if no voltage moves in any training log, or a held-out log was seen in training.
    """
    seen = read_logs(training, format, start, end)
    check_excitation(seen)
    judges = read_logs(held_out, format, start, end)
    check_apart(seen, judges)
    return seen, judges


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


def check_apart(training: Sequence[Log], held_out: Sequence[Log]) -> None:
    """Refuse a held-out log that shares samples with a training log: it would judge itself.

    Raises
    ------
    LogError
        If two logs are cut from the same bytes and their stretches overlap.
    """
    for held in held_out:
        for seen in training:
            overlap = seen.start < held.start + held.duration and held.start < seen.start + seen.duration
            if held.sha256 and held.sha256 == seen.sha256 and overlap:
                raise LogError(
                    f"{held.path} is held out for validation but shares samples with training log "
                    f"{seen.path}; give a log, or a stretch of it, that the fit has not seen."
                )


def _with_folder(log: Log) -> str:
    return f"{Path(log.path).resolve().parent.name}/{log.name}"
