"""The logs as the likelihood reads them: at their controller's rate, with the samples that count."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from heli_identifier.records import Log

from .rig import Record, Rig
from .settings import MOVING_SHARE, REST_COUNTS, REST_TIME, SETTLING

Array = NDArray[np.float64]


def held_factor(log: Log) -> int:
    """Count the samples over which a log's voltages are held: the controller's period over the log's.

    A controller's rate is what the likelihood may go down to and no farther: averages over its steps contain its
    answer to the air.
    """
    changes = np.flatnonzero(np.diff(log.voltages, axis=0).any(1)) + 1
    if len(changes) < 2:
        return 1
    factor = int(np.gcd.reduce(np.diff(changes)))
    return factor if 1 < factor <= 0.02 * log.rate_hz else 1


def record_of(log: Log, rig: Rig, left_out: Sequence[tuple[float, float]] = ()) -> Record:
    """Prepare a log.

    Parameters
    ----------
    log : Log
    rig : Rig
    left_out : sequence of (start, end)
        Passages [s] that do not count: something other than the plant acts.
    """
    factor = held_factor(log)
    first = int(np.flatnonzero(np.diff(log.voltages, axis=0).any(1))[0] + 1) % factor if factor > 1 else 0
    voltages, angles = log.voltages[first::factor], log.angles[first::factor]
    step, count = factor / log.rate_hz, len(angles)
    time = np.arange(count) * step
    width = round(REST_TIME / step) | 1
    span = maximum_filter1d(angles, width, axis=0) - minimum_filter1d(angles, width, axis=0)
    weights = (span > REST_COUNTS * rig.resolution).astype(float)
    weights[time <= SETTLING] = 0.0
    for start, end in left_out:
        weights[(time >= start) & (time <= end + SETTLING)] = 0.0
    return Record(
        log.name, step, time, np.ascontiguousarray(voltages), np.ascontiguousarray(angles), weights,
        rig.begin(angles, voltages, step),
    )  # fmt: skip


def records_of(logs: Sequence[Log], rig: Rig, events: Mapping[str, Sequence[tuple[float, float]]]) -> tuple[Record, ...]:
    """Prepare the logs of a rig; an axis that rests in most of the samples counts nowhere."""
    records = [record_of(log, rig, events.get(log.name, ())) for log in logs]
    moving = sum(r.weights.sum(0) for r in records) / max(1.0, sum((r.time > SETTLING).sum() for r in records))
    for record in records:
        record.weights[:, moving < MOVING_SHARE] = 0.0
        record.weights.flags.writeable = False
    return tuple(records)
