"""The on-line identifier over one log: its estimates over time, as a table and as a figure."""

import csv
import io
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import (
    Estimate,
    IdentifierSettings,
    IdentifierState,
    ModelParameters,
    Plan,
    output_of,
    prepare,
    start,
    step,
)
from heli_identifier.records import Log
from heli_identifier.results import Axes, figure, meaning, side_by_side, unit_text
from heli_identifier.tracing import plausible_range
from heli_plant.effects import AXES
from heli_plant.parameters import BY_FIELD

NAMES = ModelParameters._fields
"""The paper's symbols of the estimated parameters; fields of :class:`~heli_plant.parameters.PlantParameters`."""

ROLES = ("after", "before", "third", "measured", "band")
"""Colours of the logs."""


class EstimateHistory(NamedTuple):
    """Estimates of one log over time.

    ``time`` [s], shape (M,); ``parameters`` and ``standard_errors`` by :data:`NAMES`, shape (M, 11), in the units of
    the plant; ``state`` of the identifier at the end, standard errors evaluated there, and its ``plan``.
    """

    name: str
    time: NDArray[np.float64]
    parameters: NDArray[np.float64]
    standard_errors: NDArray[np.float64]
    state: IdentifierState
    plan: Plan

    @property
    def last(self) -> dict[str, Estimate]:
        """The last estimates by symbol, with the motors' lag ``T_m`` where it was estimated."""
        found = {
            name: Estimate(float(value), float(error), BY_FIELD[name].unit)
            for name, value, error in zip(NAMES, self.parameters[-1], self.standard_errors[-1], strict=True)
        }
        if self.plan.estimates_lag:
            found["T_m"] = Estimate(*output_of(self.state, self.plan).lag, BY_FIELD["T_m"].unit)
        return found


def identify_log(log: Log, settings: IdentifierSettings) -> EstimateHistory:
    """Run the identifier over a log, with its references where it has any.

    The history has a row for every evaluation of the standard errors.
    """
    plan = prepare(settings)
    samples = list(zip(*np.column_stack((log.voltages, log.angles)).T.tolist(), strict=True))
    rest = np.zeros(len(samples))
    asked = list(zip(*(log.references.get(axis, rest).tolist() for axis in AXES), strict=True))
    state = start(plan, samples[0], asked[0])
    every = max(1, round(settings.report_interval / settings.sample_time))
    time, parameters, errors = [], [], []
    output = output_of(state, plan)
    for k, now in enumerate(samples[1:], start=1):
        state, output = step(state, now, plan, asked[k])
        if (k % every == 0 and output.adapting) or k == len(samples) - 1:
            time.append(k * settings.sample_time)
            parameters.append(tuple(output.parameters))
            errors.append(tuple(output.standard_errors))
    return EstimateHistory(log.name, np.array(time), np.array(parameters), np.array(errors), state, plan)


def history_text(histories: Sequence[EstimateHistory]) -> str:
    """Return histories as CSV: log, time, every parameter and every standard error."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    columns = [f"{name} [{BY_FIELD[name].unit}]" for name in NAMES]
    rows.writerow(["log", "time [s]", *columns, *(f"standard_error.{column}" for column in columns)])
    for history in histories:
        table = np.column_stack((history.time, history.parameters, history.standard_errors))
        rows.writerows([history.name, *row] for row in table.tolist())
    return text.getvalue()


def history_figure(histories: Sequence[EstimateHistory], together: Mapping[str, Estimate], voltage_limit: float) -> str:
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
    histories: Sequence[EstimateHistory], column: int, final: float, plausible: tuple[float, float]
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
