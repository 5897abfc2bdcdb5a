"""Contenders timed in turn: each runs once per round, so that a busy moment of the machine affects all of them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import median
from time import perf_counter

Work = Callable[[], object]


@dataclass(frozen=True)
class Times:
    """Seconds of each round of one contender.

    Raises
    ------
    ValueError
        If there is no round.
    """

    seconds: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.seconds:
            raise ValueError("times of no round: at least one is needed.")

    @property
    def median(self) -> float:
        """Median of the rounds [s]."""
        return median(self.seconds)

    @property
    def least(self) -> float:
        """Fastest round [s]."""
        return min(self.seconds)

    @property
    def rounds(self) -> int:
        """How many rounds there were."""
        return len(self.seconds)

    def scaled(self, factor: float) -> "Times":
        """Give the times of ``factor`` times the work, where the work is known to be linear."""
        return Times(tuple(factor * s for s in self.seconds))


def in_turn(contenders: Mapping[str, Work], rounds: int, warm_up: bool = True) -> dict[str, Times]:
    """Time every contender once a round, in their order.

    Parameters
    ----------
    warm_up : bool
        Run each once before, not timed: imports, compiled code from the disk cache.
    """
    if warm_up:
        for work in contenders.values():
            work()
    seen: dict[str, list[float]] = {name: [] for name in contenders}
    for _ in range(rounds):
        for name, work in contenders.items():
            seen[name].append(seconds_of(work))
    return {name: Times(tuple(seconds)) for name, seconds in seen.items()}


def seconds_of(work: Work) -> float:
    """Wall seconds of one run."""
    began = perf_counter()
    work()
    return perf_counter() - began


def ratio(other: Times, own: Times) -> float:
    """How many times as long another takes, by the medians."""
    return other.median / own.median
