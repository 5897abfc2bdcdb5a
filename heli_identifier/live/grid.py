"""From samples as they come in to the uniform instants that the twin steps by.

Instant k lies at k h. A sample's number, or else its time, says which instant it belongs to. While nothing comes in,
the instants go on by the clock of this computer, without samples; a rig whose own clock stood meanwhile, or that
started anew, then continues at the next instant.
"""

from typing import NamedTuple

from heli_identifier.live.order import JUMP, Timed

_SHORTEST = 1e-300  # [s] a shorter step has no finite rate


class Grid(NamedTuple):
    """Where the instants lie.

    ``sample_time`` is h [s]; ``first`` is the sample that the others are counted from, at the instant ``base``;
    ``tick`` is the last instant passed, and ``silent`` says whether the clock brought it, without a sample.
    """

    sample_time: float
    first: Timed
    base: int = 0
    tick: int = -1
    silent: bool = False

    def time_of(self, sample: Timed) -> float:
        """Return a sample's time since the first instant [s]."""
        return self.base * self.sample_time + sample.time - self.first.time


def place(grid: Grid, sample: Timed) -> tuple[Grid, int]:
    """Return the grid after a sample, and the sample's instant; -1 for the second one of an instant."""
    by_time = (sample.time - grid.first.time) / grid.sample_time
    step = round(by_time)
    if sample.number >= 0 and grid.first.number >= 0:
        counted = sample.number - grid.first.number
        # A number that does not go with its time is damaged.
        if abs(counted - by_time) * grid.sample_time <= JUMP:
            step = counted
    tick = grid.base + step
    if tick <= grid.tick:
        if not grid.silent:
            return grid, -1
        return continued(grid, sample, 1)
    return grid._replace(tick=tick, silent=False), tick


def continued(grid: Grid, sample: Timed, pause: int) -> tuple[Grid, int]:
    """Return the grid of a rig that goes on with ``sample``, ``pause`` instants after the last one, and its instant."""
    tick = grid.tick + pause
    return grid._replace(first=sample, base=tick, tick=tick, silent=False), tick


def passed(grid: Grid, tick: int) -> Grid:
    """Return the grid after the clock has brought instants up to ``tick`` without samples."""
    return grid._replace(tick=tick, silent=True)


def rate_of(samples: list[Timed]) -> float:
    """Return the rate [Hz] at which samples were taken, a whole number within half a percent of one.

    Parameters
    ----------
    samples : list of Timed
        At least two, in order.
    """
    steps = sorted(after.time - before.time for before, after in zip(samples, samples[1:], strict=False))
    rate = 1.0 / max(steps[len(steps) // 2], _SHORTEST)
    return float(round(rate)) if rate >= 1.0 and abs(rate - round(rate)) <= 0.005 * rate else rate
