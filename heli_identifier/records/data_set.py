"""Several logs of one rig as one data set: some to fit, some held out; and the data sets that come with the package."""

import os
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import combinations, count
from os import PathLike
from pathlib import Path

import numpy as np

from heli_identifier.errors import LogError
from heli_identifier.records.configuration import CONTRACT, LogFormat, RigConfiguration
from heli_identifier.records.log import Log
from heli_identifier.records.overlap import shared_flight
from heli_identifier.records.plausibility import SAME_VOLTAGE, STANDING_STILL, still
from heli_identifier.records.reading import read_log
from heli_identifier.records.units import ANGLES, VOLTAGES

LogSource = Log | str | PathLike[str]
"""A log, or the file of one with the contract's columns; `read_log` reads others."""

DEMO_RIGS = ("rig-a", "rig-b", "rig-c")
_DEMO_FOLDER = Path(__file__).resolve().parent.parent / "demo_logs"
CONSTANT_V = 1e-3
"""A voltage that varies by less than this moves no propeller [V]."""
STILL_SHARE = 0.1
"""Share of the usual excitation below which a log says a hundredth of what another one says."""


def read_logs(
    logs: LogSource | Sequence[LogSource],
    format: LogFormat | RigConfiguration = CONTRACT,
    start: float | None = None,
    end: float | None = None,
) -> tuple[Log, ...]:
    """Give one log or several of one rig with unique names; a path is read as `read_log` does.

    Raises
    ------
    LogError
        A file cannot be read, or something is neither a log nor a path.
    """
    given = [logs] if isinstance(logs, Log | str | PathLike) or not isinstance(logs, Iterable) else list(logs)
    for one in given:
        if not isinstance(one, Log | str | PathLike):
            raise LogError(f"a log is of type {type(one).__name__}; a Log, the path of one, or several are needed.")
    return _named_apart([one if isinstance(one, Log) else read_log(one, format, start, end) for one in given])


def read_data_set(
    training: Sequence[str | PathLike[str]],
    held_out: Sequence[str | PathLike[str]] = (),
    format: LogFormat | RigConfiguration = CONTRACT,
    start: float | None = None,
    end: float | None = None,
) -> tuple[tuple[Log, ...], tuple[Log, ...]]:
    """Read training logs and held-out logs, and check that they can serve a diagnosis.

    Returns
    -------
    tuple
        Training logs and held-out logs, each read as `read_log` does.

    Raises
    ------
    LogError
        As `read_log`; also if a voltage is constant in all training logs, an angle never changes in one of the logs,
        or two logs share samples.
    """
    logs = read_logs((*training, *held_out), format, start, end)
    fitted, kept_apart = logs[: len(training)], logs[len(training) :]
    check_excitation(fitted)
    check_apart(fitted, kept_apart)
    check_moving(logs)
    return fitted, kept_apart


def demo_logs(rig: str) -> tuple[tuple[Path, ...], tuple[Path, ...]]:
    """Give the files of a demonstration rig, with which the loop can be tried without a rig.

    Parameters
    ----------
    rig : str
        One of `DEMO_RIGS`; the README.md beside the files says what each holds.

    Returns
    -------
    tuple
        Paths of the training logs and of the held-out logs.
    """
    if rig not in DEMO_RIGS:
        raise LogError(f"there is no demonstration rig {rig!r}; choose one of {', '.join(DEMO_RIGS)}.")
    training = tuple(sorted((_DEMO_FOLDER / rig).glob("train*.csv")))
    held_out = tuple(sorted((_DEMO_FOLDER / rig).glob("held*.csv")))
    if not training or not held_out:
        raise LogError(f"the demonstration logs are missing from {_DEMO_FOLDER / rig}; install the package again.")
    return training, held_out


def _named_apart(logs: Sequence[Log]) -> tuple[Log, ...]:
    """Give the logs with unique names.

    A name that files in several folders share is preceded by as many folders as make it unique. Names that are still
    equal then, as of one file given twice or of computed logs, are numbered.
    """
    named, times_given = list[Log](), Counter[str]()
    for log in logs:
        above = {_folders(other) for other in logs if other.name == log.name}
        depth = next(d for d in count() if len({folders[:d] for folders in above}) == len(above))
        name = "/".join((*reversed(_folders(log)[:depth]), log.name))
        times_given[name] += 1
        name = name if times_given[name] == 1 else f"{name} ({times_given[name]})"
        named.append(log if name == log.name else replace(log, name=name))  # a copy takes as much memory again
    return tuple(named)


def common_configuration(logs: Sequence[Log]) -> RigConfiguration | None:
    """Give the configuration that all logs were read with; None if they were read with several, or one without."""
    found = [log.configuration for log in logs]
    return found[0] if found and all(own == found[0] for own in found) else None


def check_excitation(logs: Sequence[Log]) -> None:
    """Refuse, with a LogError, a data set in which a voltage never moves or never differs from the other."""
    if not logs:
        raise LogError("no log was given; name at least one file.")
    given = ", ".join(log.path or log.name for log in logs)
    for index, name in enumerate(VOLTAGES):
        if all(np.ptp(log.voltages[:, index]) < CONSTANT_V for log in logs):
            raise LogError(
                f"{given}: {name} is constant in every log, so there is nothing to identify; excite the rig, for "
                "instance with the Exciter's square and chirp."
            )
    if all(np.abs(log.voltages[:, 0] - log.voltages[:, 1]).max() < SAME_VOLTAGE for log in logs):
        raise LogError(
            f"{given}: v_front equals v_rear in every sample, so nothing drives the pitch; check whether one column "
            "was taken for both, or add a log in which they differ."
        )


def check_moving(logs: Sequence[Log]) -> None:
    """Refuse, with a LogError, a log in which an axis stands still: it cannot judge a model of three free axes."""
    for log in logs:
        said = [f"{name} {why}" for name, angle in zip(ANGLES, log.angles.T, strict=True) if (why := still(angle))]
        if said:
            raise LogError(
                f"{log.path or log.name}: {' and '.join(said)}: {STANDING_STILL}, and a diagnosis needs all three axes "
                "to move; leave the log out."
            )


def check_apart(training: Sequence[Log], held_out: Sequence[Log] = ()) -> None:
    """Refuse logs that share samples: a log given twice counts double, and a model may not be judged by its own data.

    Raises
    ------
    LogError
        If two logs come from files with the same bytes and their stretches overlap, or if a held-out log shares flight
        with another log by its samples, see :func:`.overlap.shared_flight`.
    """
    for (first, one), (second, other) in combinations(enumerate((*training, *held_out)), 2):
        margin = 0.5 * one.step  # stretches that follow each other share no sample, whatever rounding says
        overlap = one.start + margin < other.start + other.duration and other.start + margin < one.start + one.duration
        same = overlap and one.sha256 == other.sha256 != ""
        flight = None if same or second < len(training) else shared_flight(one, other)
        if not same and flight is None:
            continue
        where = f" ({flight[2]:.0f} s from {flight[1]:.0f} s on, there from {flight[0]:.0f} s on)" if flight else ""
        if first < len(training) <= second:
            raise LogError(
                f"{_called(other)} is held out for validation but shares samples with training log {_called(one)}"
                f"{where}; give a log, or a stretch of it, that the fit has not seen."
            )
        kind = "training" if second < len(training) else "held-out"
        raise LogError(f"{_called(other)} holds the same samples as {_called(one)}{where}; give each {kind} log once.")


def counted_once(training: Sequence[Log]) -> tuple[tuple[Log, ...], tuple[str, ...]]:
    """Leave out training logs that share flight with a longer one, such as a log that was resampled or cut.

    Returns
    -------
    logs : tuple of Log
        In the order given.
    notes : tuple of str
        A sentence for each log that is left out.
    """
    kept, notes = list[Log](), list[str]()
    for log in sorted(training, key=lambda log: -log.duration):
        shared = ((own, flight) for own in kept if (flight := shared_flight(own, log)))
        if found := next(shared, None):
            notes.append(
                f"{_called(log)} is left out: {found[1][2]:.0f} s of it are the same flight as {_called(found[0])}, "
                "and what is counted twice seems twice as certain"
            )
        else:
            kept.append(log)
    return tuple(log for log in training if log in kept), tuple(notes)


def excitation_notes(training: Sequence[Log], held_out: Sequence[Log]) -> tuple[str, ...]:
    """Name the held-out logs whose voltages move far less than those of the training logs."""
    notes = []
    for what, axes, weights in (
        ("sum", "the elevation", (1.0, 1.0)), ("difference", "pitch and travel", (1.0, -1.0)),
    ):  # fmt: skip
        usual = float(np.median([(log.voltages @ weights).std() for log in training]))
        for log in held_out:
            own = float((log.voltages @ weights).std())
            if own < STILL_SHARE * usual:
                notes.append(
                    f"{_called(log)} is held out and hardly excited: the {what} of its voltages has a standard "
                    f"deviation of {own:.2g} V, that of the training logs {usual:.2g} V. It says little on {axes}"
                )
    return tuple(notes)


def _called(log: Log) -> str:
    return log.path or log.name


def _folders(log: Log) -> tuple[str, ...]:
    """Names of the folders above a log's file, the closest first; none if the log was computed."""
    return tuple(folder.name for folder in Path(os.path.realpath(log.path)).parents) if log.path else ()
