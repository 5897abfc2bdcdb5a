"""The logs as the likelihood reads them: means over 10 ms where they are faster, and the samples that count.

An encoder that turns slower than a count per sample repeats its value: its error is no white noise, and a likelihood
that takes it for white takes the counts for air. Means over :data:`.settings.RECORD_STEP` err almost like white noise
and lose nothing: the voltages that act between the middles of two blocks are averaged exactly over that time, and what
a controller answers within a block moves the rig by less than a thousandth of a count through its motors' lag.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from heli_identifier.records import Log

from .helicopter import Rig
from .rig import Array, Record
from .settings import RECORD_STEP, REST_COUNTS, REST_TIME, SETTLING

LeftOut = Mapping[str, Sequence[tuple[float, float]]]
"""By log the passages (start, end) [s] in which something other than the plant acts."""

NOTHING: LeftOut = {}


def block_samples(log: Log) -> int:
    """Count the samples of a log that are averaged to one: those of :data:`.settings.RECORD_STEP`."""
    return max(1, round(RECORD_STEP * log.rate_hz))


def averaged(log: Log, held: Array) -> Array:
    """Average what is held over a sample (N, k), voltages or references, from the middle of one block to the next."""
    if (n := block_samples(log)) == 1:
        return held
    count = (log.samples - n // 2) // n
    middles = [held[first : first + count * n].reshape(count, n, -1).mean(1) for first in ((n - 1) // 2, n // 2)]
    return np.asarray(0.5 * (middles[0] + middles[1]))


def record_of(log: Log, rig: Rig, left_out: LeftOut = NOTHING) -> Record:
    """Prepare a log; the passages ``left_out`` do not count."""
    n, voltages = block_samples(log), averaged(log, log.voltages)
    step, count = n / log.rate_hz, len(voltages)
    angles = log.angles if n == 1 else log.angles[: count * n].reshape(count, n, -1).mean(1)
    time = np.arange(count, dtype=np.float64) * step
    width = round(REST_TIME / step) | 1
    span = maximum_filter1d(angles, width, axis=0) - minimum_filter1d(angles, width, axis=0)
    weights = (span > REST_COUNTS * rig.resolution).astype(float)
    weights[time <= SETTLING] = 0.0
    for start, end in left_out.get(log.name, ()):
        weights[(time >= start) & (time <= end + SETTLING)] = 0.0
    return Record(
        log.name, step, time, np.ascontiguousarray(voltages), np.ascontiguousarray(angles), weights,
        rig.begin(angles, voltages, step),
    )  # fmt: skip


def records_of(logs: Sequence[Log], rig: Rig, left_out: LeftOut) -> tuple[Record, ...]:
    """Prepare the logs of a rig; an axis that rests in most of the samples counts nowhere, it is left to its priors."""
    records = [record_of(log, rig, left_out) for log in logs]
    moving = sum(r.weights.sum(0) for r in records) / max(1.0, sum((r.time > SETTLING).sum() for r in records))
    for record in records:
        record.weights[:, moving < 0.5] = 0.0
        record.weights.flags.writeable = False
    return tuple(records)
