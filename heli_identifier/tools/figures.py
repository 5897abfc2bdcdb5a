"""The figure of estimates over time."""

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import Estimate, ModelParameters
from heli_identifier.results import Axes, figure, meaning, side_by_side, unit_text
from heli_identifier.tracing import plausible_range
from heli_plant.parameters import BY_FIELD

NAMES = ModelParameters._fields
ROLES = ("after", "before", "third", "measured", "band")
"""Colours of the logs."""


class _History(Protocol):
    """Of one log: time (M,) [s], parameters and standard errors (M, 11) by :data:`NAMES`."""

    @property
    def name(self) -> str: ...
    @property
    def time(self) -> NDArray[np.float64]: ...
    @property
    def parameters(self) -> NDArray[np.float64]: ...
    @property
    def standard_errors(self) -> NDArray[np.float64]: ...


def history_figure(histories: Sequence[_History], together: Mapping[str, Estimate], voltage_limit: float) -> str:
    """Draw every parameter over time, one line per log with its 95 % band, and the value of all logs together.

    The ordinate ends where hardly any rig with this ``voltage_limit`` [V] has the parameter, unless the value of all
    logs lies beyond.
    """
    drawn = []
    for column, name in enumerate(NAMES):
        final = together[name].value
        limits = history_limits(histories, column, final, plausible_range(name, voltage_limit))
        panel = Axes(f"{name} [{unit_text(BY_FIELD[name].unit) or '1'}]", 130.0, limits)
        for number, history in enumerate(histories):
            value, half = history.parameters[:, column], 1.96 * history.standard_errors[:, column]
            role, label = ROLES[number % len(ROLES)], history.name if column == 0 else ""
            panel.band(history.time, value - half, value + half, role=role)
            panel.line(history.time, value, role, label, 1.1)
        panel.level(final, "ink", "together" if column == 0 else "")
        drawn.append(figure([panel], f"time [s]: {meaning(name)}", meaning(name), 320.0))
    return side_by_side(drawn, 3, (320.0, 194.0), "Estimates over time")


def history_limits(
    histories: Sequence[_History], column: int, final: float, plausible: tuple[float, float]
) -> tuple[float, float]:
    """Range of the ordinate: what is plausible of every history's second half and its band, with room around it."""
    low = high = final
    for history in histories:
        late = history.time >= 0.5 * history.time[-1]
        value, half = history.parameters[late, column], 1.96 * history.standard_errors[late, column]
        low, high = min(low, float(np.min(value - half))), max(high, float(np.max(value + half)))
    low, high = min(final, max(low, plausible[0])), max(final, min(high, plausible[1]))
    room = 0.25 * max(high - low, 1e-6)
    return low - room, high + room
