"""A log played to the twin as if the rig were flying."""

from collections.abc import Callable, Iterator
from time import monotonic, sleep

from heli_identifier.following import Sample
from heli_identifier.records import Log

_WAIT = 0.05  # [s] the longest that a caller waits for the next instant or for None


def played(log: Log, speed: float, keep: Callable[[float, tuple[float, ...]], None]) -> Iterator[Sample | None]:
    """Give the samples of a log at their instants; None while none is due.

    Parameters
    ----------
    log : Log
    speed : float
        How many times faster than the rig was; 0 as fast as it goes.
    keep : callable
        Called with the time [s] and the signals of every sample.
    """
    began = monotonic()
    rows = zip(log.time.tolist(), log.voltages.tolist(), log.angles.tolist(), strict=True)
    for time, voltages, angles in rows:
        while speed > 0.0 and (ahead := began + time / speed - monotonic()) > 0.0:
            yield None
            sleep(min(ahead, _WAIT))
        signals = (*voltages, *angles)
        keep(time, signals)
        yield Sample(*signals)
