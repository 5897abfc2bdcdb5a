"""Several logs of one rig as one data set: some to fit, some held out; and the data sets that come with the package."""

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path

import numpy as np

from heli_identifier.errors import LogError
from heli_identifier.signatures import check_types

from .configuration import CONTRACT, LogFormat, RigConfiguration
from .log import Log
from .overlap import shared_flight
from .plausibility import SAME_VOLTAGE, STANDING_STILL, why_still
from .reading import read_log
from .units import ANGLES, VOLTAGES

LogSource = Log | str | PathLike[str]
"""A log, or the file of one with the contract's columns; `read_log` reads others."""

DEMO_RIGS = ("rig-a", "rig-b", "rig-c")
_CONSTANT_V = 1e-3  # a voltage that varies by less [V] moves no propeller
_STILL_SHARE = 0.1  # of the usual excitation, below which a log says a hundredth of what another one says


@check_types
def read_logs(
    logs: LogSource | Sequence[LogSource],
    format: LogFormat | RigConfiguration = CONTRACT,
    start: float | None = None,
    end: float | None = None,
) -> tuple[Log, ...]:
    """Give one log or several of one rig with unique names; a path is read as `read_log` does.

    A LogError says that a file cannot be read.
    """
    given = [logs] if isinstance(logs, Log | str | PathLike) else list(logs)
    return _name_apart([one if isinstance(one, Log) else read_log(one, format, start, end) for one in given])


@check_types
def read_data_set(
    training: Sequence[str | PathLike[str]],
    held_out: Sequence[str | PathLike[str]] = (),
    format: LogFormat | RigConfiguration = CONTRACT,
    start: float | None = None,
    end: float | None = None,
) -> tuple[tuple[Log, ...], tuple[Log, ...]]:
    """Read training logs and held-out logs as `read_log` does, with names that are unique among all of them."""
    logs = read_logs((*training, *held_out), format, start, end)
    return logs[: len(training)], logs[len(training) :]


@check_types
def demo_files(rig: str) -> tuple[tuple[Path, ...], tuple[Path, ...]]:
    """Give the files of the training logs and of the held-out logs of a demonstration rig, one of `DEMO_RIGS`."""
    if rig not in DEMO_RIGS:
        raise LogError(f"there is no demonstration rig {rig!r}; choose one of {', '.join(DEMO_RIGS)}.")
    folder = Path(__file__).resolve().parent.parent / "demo_logs" / rig
    training, held_out = (tuple(sorted(folder.glob(f"{use}*.csv"))) for use in ("train", "held"))
    return training, held_out


def demo_logs(rig: str) -> tuple[tuple[Log, ...], tuple[Log, ...]]:
    """Give the training logs and the held-out logs of a demonstration rig, with which the loop can be tried.

    ``rig`` is one of `DEMO_RIGS`; the README.md beside the files says what each holds.
    """
    return read_data_set(*demo_files(rig))


def _name_apart(logs: Sequence[Log]) -> tuple[Log, ...]:
    """Give the logs with unique names.

    A name that files in several folders share is preceded by the folders below the one that they share. Names that are
    still equal then, as of one file given twice or of computed logs, are numbered.
    """
    named, times_given = list[Log](), Counter[str]()
    folders = {log.path: Path(os.path.realpath(log.path)).parent.parts for log in logs if log.path}
    for log in logs:
        name, same = log.name, [folders[other.path] for other in logs if other.name == log.name and other.path]
        if log.path:
            name = "/".join((*folders[log.path][len(os.path.commonprefix(same)) :], name))
        times_given[name] += 1
        name = name if times_given[name] == 1 else f"{name} ({times_given[name]})"
        named.append(log if name == log.name else replace(log, name=name))  # a copy takes as much memory again
    return tuple(named)


def common_configuration(logs: Sequence[Log]) -> RigConfiguration | None:
    """Give the configuration that all logs were read with; None if they were read with several, or one without."""
    first, *others = [log.configuration for log in logs] or [None]
    return first if all(own == first for own in others) else None


def check_excitation(logs: Sequence[Log]) -> None:
    """Refuse, with a LogError, a data set in which a voltage never moves or never differs from the other."""
    if not logs:
        raise LogError("no log was given; name at least one file.")
    called = ", ".join(map(_name_of, logs))
    extents = np.max([np.ptp(log.voltages, axis=0) for log in logs], axis=0)
    if extents.min() < _CONSTANT_V:
        raise LogError(
            f"{called}: {VOLTAGES[extents.argmin()]} is constant in every log, so there is nothing to identify; excite "
            "the rig, for instance with the Exciter's square and chirp."
        )
    if all(np.abs(log.voltages[:, 0] - log.voltages[:, 1]).max() < SAME_VOLTAGE for log in logs):
        raise LogError(
            f"{called}: v_front equals v_rear in every sample, so nothing drives the pitch; check whether one column "
            "was taken for both, or add a log in which they differ."
        )


def check_moving(logs: Sequence[Log]) -> None:
    """Refuse, with a LogError, a log in which an axis stands still: it cannot judge a model of three free axes."""
    for log in logs:
        said = [f"{name} {why}" for name, angle in zip(ANGLES, log.angles.T, strict=True) if (why := why_still(angle))]
        if said:
            needed = f"{STANDING_STILL}, and a diagnosis needs all three axes to move; leave the log out"
            raise LogError(f"{_name_of(log)}: {' and '.join(said)}: {needed}.")


def check_apart(training: Sequence[Log], held_out: Sequence[Log]) -> None:
    """Refuse held-out logs that share flight with another log: a model may not be judged by its own data."""
    for index, log in enumerate(held_out):
        for own in (*training, *held_out[:index]):
            if (flight := shared_flight(own, log)) is None:
                continue
            where = f" ({flight[2]:.0f} s from {flight[1]:.0f} s on, there from {flight[0]:.0f} s on)"
            if own not in training:
                raise LogError(f"{_name_of(log)} holds the same samples as {_name_of(own)}{where}; give each log once.")
            raise LogError(
                f"{_name_of(log)} is held out for validation but shares samples with training log {_name_of(own)}"
                f"{where}; give a log, or a stretch of it, that the fit has not seen."
            )


def count_once(training: Sequence[Log]) -> tuple[tuple[Log, ...], tuple[str, ...]]:
    """Leave out training logs that share flight with a longer one, such as a log that was cut; a note for each."""
    kept, notes = list[Log](), list[str]()
    for log in sorted(training, key=lambda log: -log.duration):
        shared = ((own, flight) for own in kept if (flight := shared_flight(own, log)))
        if found := next(shared, None):
            notes.append(
                f"{_name_of(log)} is left out: {found[1][2]:.0f} s of it are the same flight as {_name_of(found[0])}, "
                "and what is counted twice seems twice as certain"
            )
        else:
            kept.append(log)
    return tuple(log for log in training if log in kept), tuple(notes)


def excitation_notes(training: Sequence[Log], held_out: Sequence[Log]) -> tuple[str, ...]:
    """Name the held-out logs whose voltages move far less than those of the training logs."""
    notes = []
    for what, axes, weights in (("sum", "the elevation", (1, 1)), ("difference", "pitch and travel", (1, -1))):
        usual = float(np.median([(log.voltages @ weights).std() for log in training]))
        for log in held_out:
            own = float((log.voltages @ weights).std())
            if own < _STILL_SHARE * usual:
                notes.append(
                    f"{_name_of(log)} is held out and hardly excited: the {what} of its voltages has a standard "
                    f"deviation of {own:.2g} V, that of the training logs {usual:.2g} V. It says little on {axes}"
                )
    return tuple(notes)


def _name_of(log: Log) -> str:
    return log.path or log.name
