"""What the identifier remembers between two samples, and how it comes back from JSON.

The state is nested tuples of numbers. ``json.dumps`` writes it, and :func:`restored` makes of what ``json.loads``
reads the same state again, exact to the bit.
"""

from typing import Any, NamedTuple

from .axis import AxisState
from .moments import Moments
from .score import Score
from .signals import Signals
from .watch import WatchState


class IdentifierState(NamedTuple):
    """Everything remembered between two samples; ``samples`` counts those after sample 0."""

    samples: int
    signals: Signals
    watch: WatchState | None
    pitch: AxisState
    elevation: AxisState
    travel: AxisState


def restored(saved: Any) -> IdentifierState:
    """Return the state that ``json.dumps`` wrote and ``json.loads`` read as ``saved``."""
    samples, signals, watch, *axes = _tuples(saved)
    pitch, elevation, travel = (_axis(*axis) for axis in axes)
    return IdentifierState(
        samples, Signals(*signals), None if watch is None else WatchState(*watch), pitch, elevation, travel
    )


def _axis(factor, omega, sigma, sums, moments, errors, excitation, scores) -> AxisState:
    of_candidates = tuple(Score(*score) for score in scores)
    return AxisState(factor, omega, sigma, sums, Moments(*moments), errors, excitation, of_candidates)


def _tuples(value: Any) -> Any:
    """``value`` with every list in it, at any depth, made a tuple."""
    return tuple(map(_tuples, value)) if isinstance(value, list | tuple) else value
