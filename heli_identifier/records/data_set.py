"""Several logs of one rig as one data set, for training or held out; and the data sets that come with the package."""

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path

import numpy as np

from heli_identifier.errors import HELI_TOML, LogError

from .configuration import CONTRACT, LOWEST_LIMIT, LogFormat, RigConfiguration
from .log import Log
from .overlap import find_shared_flight
from .plausibility import STANDING_STILL, why_still
from .reading import read_log
from .units import ANGLES

LogSource = Log | str | PathLike[str]
"""A log, or the file of one with the default columns; `read_log` reads others."""

DEMO_RIGS = ("rig-a", "rig-b", "rig-c")
_CONSTANT_V = 1e-3  # a voltage that varies by less [V] moves no propeller
_STILL_SHARE = 0.1  # of the training logs' excitation; below it a log holds a hundredth of their information


def read_logs(
    logs: LogSource | Sequence[LogSource],
    format: LogFormat | RigConfiguration = CONTRACT,
    start: float | None = None,
    end: float | None = None,
) -> tuple[Log, ...]:
    """Return one log or several logs of one rig with unique names; paths are read by `read_log`."""
    sources = [logs] if isinstance(logs, Log | str | PathLike) else list(logs)
    return _make_names_unique([log if isinstance(log, Log) else read_log(log, format, start, end) for log in sources])


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


def demo_files(rig: str) -> tuple[tuple[Path, ...], tuple[Path, ...]]:
    """Return the files of the training logs and of the held-out logs of a demonstration rig, one of `DEMO_RIGS`."""
    if rig not in DEMO_RIGS:
        raise LogError(f"there is no demonstration rig {rig!r}; choose one of {', '.join(DEMO_RIGS)}.")
    folder = Path(__file__).resolve().parent.parent / "demo_logs" / rig
    training, held_out = (tuple(sorted(folder.glob(f"{use}*.csv"))) for use in ("train", "held"))
    return training, held_out


def demo_logs(rig: str) -> tuple[tuple[Log, ...], tuple[Log, ...]]:
    """Read the training logs and the held-out logs of a demonstration rig, one of `DEMO_RIGS`."""
    return read_data_set(*demo_files(rig))


def _make_names_unique(logs: Sequence[Log]) -> tuple[Log, ...]:
    """Put folders before equal names of files in different folders, and number names that are still equal."""
    renamed, count = list[Log](), Counter[str]()
    folders = {log.path: Path(os.path.realpath(log.path)).parent.parts for log in logs if log.path}
    for log in logs:
        name, of_name = log.name, [folders[other.path] for other in logs if other.name == log.name and other.path]
        if log.path:
            name = "/".join((*folders[log.path][len(os.path.commonprefix(of_name)) :], name))
        count[name] += 1
        name = name if count[name] == 1 else f"{name} ({count[name]})"
        if name != log.name:  # a copy takes as much memory again
            log = replace(log, name=name, events=tuple(replace(event, log=name) for event in log.events))
        renamed.append(log)
    return tuple(renamed)


def common_configuration(logs: Sequence[Log]) -> RigConfiguration:
    """Return the configuration that all logs were read with; the defaults if some were read without one.

    A LogError says that logs were read with different ones: they cannot all be right about one rig.
    """
    first, *others = [log.configuration for log in logs] or [None]
    for log, other in zip(logs[1:], others, strict=True):
        if first and other and other != first:
            raise LogError(
                f"the logs {logs[0].name} and {log.name} were read with different configurations of their rig; read "
                f"both with one {HELI_TOML}."
            )
    return first if first and all(others) else RigConfiguration()


def check_excitation(logs: Sequence[Log]) -> None:
    """Raise a LogError without a log, or if in all logs a voltage or their difference is constant or no rotor turns."""
    if not logs:
        raise LogError("no log was given; name at least one file.")
    for what, weights in (("v_front", (1, 0)), ("v_rear", (0, 1)), ("v_front - v_rear", (1, -1))):
        if max(float(np.ptp(log.voltages @ weights)) for log in logs) < _CONSTANT_V:
            raise LogError(
                f"{', '.join(map(_path_or_name, logs))}: {what} is constant in every log, so there is nothing to "
                "identify; excite the rig, for instance with the Exciter's square and chirp, or correct the columns."
            )
    largest = max(float(np.abs(log.voltages).max()) for log in logs)
    if largest < LOWEST_LIMIT:
        raise LogError(
            f"{', '.join(map(_path_or_name, logs))}: no voltage exceeds {largest:.2g} V, and below {LOWEST_LIMIT:g} V "
            f"no rotor turns; state the unit of the voltages under [log.units] of {HELI_TOML}."
        )


def check_moving(logs: Sequence[Log]) -> None:
    """Raise a LogError for a log in which an axis stands still: it cannot judge a model of three free axes."""
    for log in logs:
        still = [f"{axis} {why}" for axis, angle in zip(ANGLES, log.angles.T, strict=True) if (why := why_still(angle))]
        if still:
            needed = f"{STANDING_STILL}, and a diagnosis needs all three axes to move; leave the log out"
            raise LogError(f"{_path_or_name(log)}: {' and '.join(still)}: {needed}.")


def check_held_out_is_new(training: Sequence[Log], held_out: Sequence[Log]) -> None:
    """Raise a LogError for a held-out log that shares flight with another log: it must be new to the model."""
    for index, log in enumerate(held_out):
        for other in (*training, *held_out[:index]):
            if flight := find_shared_flight(other, log):
                where = f"{flight[2]:.0f} s from {flight[1]:.0f} s on, there from {flight[0]:.0f} s on"
                raise LogError(
                    f"{_path_or_name(log)} is held out for validation but shares samples with {_path_or_name(other)} "
                    f"({where}); give a log, or a stretch of it, that has no other use."
                )


def drop_excerpts(logs: Sequence[Log]) -> tuple[tuple[Log, ...], tuple[str, ...]]:
    """Leave out logs that share flight with a longer one, such as its excerpts; return a note for each."""
    kept, notes = list[Log](), list[str]()
    for log in sorted(logs, key=lambda log: -log.duration):
        for longer in kept:
            if flight := find_shared_flight(longer, log):
                notes.append(
                    f"{_path_or_name(log)} is left out: {flight[2]:.0f} s of it are the same flight as "
                    f"{_path_or_name(longer)}, and what is counted twice seems twice as certain"
                )
                break
        else:
            kept.append(log)
    return tuple(log for log in logs if log in kept), tuple(notes)


def excitation_notes(training: Sequence[Log], held_out: Sequence[Log]) -> tuple[str, ...]:
    """Describe the held-out logs whose voltages vary far less than those of the training logs."""
    notes = []
    for what, axes, weights in (("sum", "the elevation", (1, 1)), ("difference", "pitch and travel", (1, -1))):
        usual = float(np.median([(log.voltages @ weights).std() for log in training]))
        for log in held_out:
            deviation = float((log.voltages @ weights).std())
            if deviation < _STILL_SHARE * usual:
                notes.append(
                    f"{_path_or_name(log)} is held out and hardly excited: the {what} of its voltages has a standard "
                    f"deviation of {deviation:.2g} V, that of the training logs {usual:.2g} V. It says little on {axes}"
                )
    return tuple(notes)


def highest_voltage(logs: Sequence[Log], limit: float) -> tuple[float, tuple[str, ...]]:
    """Return the rig's ``limit`` [V], or the highest voltage of its logs if this is larger, and a note if it is."""
    highest = max(float(np.abs(log.voltages).max()) for log in logs)
    beyond = f"voltages reach {highest:.2f} V, beyond the limit of {limit:g} V"
    remedy = "the plant saturates at the highest voltage of the training logs. Set the rig's limit in its configuration"
    return (highest, (f"{beyond}; {remedy}",)) if highest > limit else (limit, ())


def _path_or_name(log: Log) -> str:
    return log.path or log.name
