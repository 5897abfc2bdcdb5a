"""Several logs of one rig as one data set, for training or held out; and the data sets that come with the package."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from os import PathLike
from pathlib import Path

import numpy as np

from heli_identifier.errors import LogError

from .configuration import CONTRACT, LogFormat, RigConfiguration
from .log import Log
from .overlap import share_flight
from .reading import read_log
from .units import ANGLES

LogSource = Log | str | PathLike[str]
"""A log, or the file of one with the default columns; `read_log` reads others."""

DEMO_RIGS = ("rig-a", "rig-b", "rig-c")
LEAST_MOTION = 4e-3
"""Least range of an angle that moves [rad]: an encoder of 4096 counts at rest flickers over two counts of 1.5e-3 rad,
and a rig that hovers quietly moves further."""

_CONSTANT_V = 1e-3  # a voltage that varies by less [V] moves no propeller


def read_logs(
    logs: LogSource | Sequence[LogSource],
    format: LogFormat | RigConfiguration = CONTRACT,
    start: float | None = None,
    end: float | None = None,
) -> tuple[Log, ...]:
    """Return one log or several logs of one rig with unique names; paths are read by `read_log`."""
    sources = [logs] if isinstance(logs, Log | str | PathLike) else list(logs)
    return _make_names_unique([log if isinstance(log, Log) else read_log(log, format, start, end) for log in sources])


def demo_files(rig: str) -> tuple[tuple[Path, ...], tuple[Path, ...]]:
    """Return the files of the training logs and of the held-out logs of a demonstration rig, one of `DEMO_RIGS`."""
    if rig not in DEMO_RIGS:
        raise LogError(f"there is no demonstration rig {rig!r}; choose one of {', '.join(DEMO_RIGS)}.")
    folder = Path(__file__).resolve().parent.parent / "demo_logs" / rig
    training, held_out = (tuple(sorted(folder.glob(f"{use}*.csv"))) for use in ("train", "held"))
    return training, held_out


def demo_logs(rig: str) -> tuple[tuple[Log, ...], tuple[Log, ...]]:
    """Read the training logs and the held-out logs of a demonstration rig, one of `DEMO_RIGS`."""
    training, held_out = demo_files(rig)
    logs = read_logs((*training, *held_out))
    return logs[: len(training)], logs[len(training) :]


def _make_names_unique(logs: Sequence[Log]) -> tuple[Log, ...]:
    """Append a number to a name that an earlier log has."""
    renamed, count = list[Log](), Counter[str]()
    for log in logs:
        count[log.name] += 1
        if (number := count[log.name]) > 1:  # a copy takes as much memory again
            name = f"{log.name} ({number})"
            log = replace(log, name=name, events=tuple(replace(event, log=name) for event in log.events))
        renamed.append(log)
    return tuple(renamed)


def common_configuration(logs: Sequence[Log]) -> RigConfiguration | None:
    """Return the configuration that all logs were read with; None if there is none, or not the same for all."""
    first, *others = [log.configuration for log in logs] or [None]
    return first if all(other == first for other in others) else None


def check_excitation(logs: Sequence[Log]) -> None:
    """Raise a LogError if a voltage or the difference of both is constant in all logs, or there is no log."""
    if not logs:
        raise LogError("no log was given; name at least one file.")
    for what, weights in (("v_front", (1, 0)), ("v_rear", (0, 1)), ("v_front - v_rear", (1, -1))):
        if max(float(np.ptp(log.voltages @ weights)) for log in logs) < _CONSTANT_V:
            raise LogError(
                f"{', '.join(log.path or log.name for log in logs)}: {what} is constant in every log, so there is "
                "nothing to identify; excite the rig, for instance with the Exciter's square and chirp, or correct the "
                "columns."
            )


def check_moving(logs: Sequence[Log]) -> None:
    """Raise a LogError for a log in which an axis stands still: it cannot judge a model of three free axes."""
    for log in logs:
        for axis, extent in zip(ANGLES, np.ptp(log.angles, axis=0), strict=True):
            if extent < LEAST_MOTION:
                moves = f"moves by {extent:.2g} rad in all, no more than an encoder flickers"
                raise LogError(
                    f"{log.path or log.name}: {axis} {moves if extent else 'never changes'}: a clamped axis or a dead "
                    "encoder tells nothing about itself, and a diagnosis needs all three axes to move; leave the log "
                    "out."
                )


def check_flights_differ(logs: Sequence[Log]) -> None:
    """Raise a LogError for a log that shares flight with another one: it would count twice, or judge what it taught."""
    for one, other in combinations(logs, 2):
        if share_flight(one, other):
            raise LogError(
                f"{other.path or other.name} shares a flight with {one.path or one.name}, which would count twice or "
                "judge what was fitted to it; leave one out, or give a stretch of it that has no other use."
            )


def highest_voltage(logs: Sequence[Log], limit: float) -> tuple[float, tuple[str, ...]]:
    """Return the rig's ``limit`` [V], or the highest voltage of its logs if this is larger, and a note if it is."""
    highest = max(float(np.abs(log.voltages).max()) for log in logs)
    beyond = f"voltages reach {highest:.2f} V, beyond the limit of {limit:g} V"
    remedy = "the plant saturates at the highest voltage of the training logs. Set the rig's limit in its configuration"
    return (highest, (f"{beyond}; {remedy}",)) if highest > limit else (limit, ())
