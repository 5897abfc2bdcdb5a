"""The on-line identifier over one log: its estimates over time, as a table and as a figure."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from heli_identifier import online
from heli_identifier.online import Estimate, IdentifierSettings, IdentifierState, ModelParameters, Plan
from heli_identifier.records import Log
from heli_identifier.results import Axes, figure, labelled
from heli_identifier.tracing import plausible_range
from heli_plant.effects import AXES
from heli_plant.parameters import BY_FIELD

NAMES = ModelParameters._fields
"""The paper's symbols of the estimated parameters; fields of :class:`~heli_plant.parameters.PlantParameters`."""

ROLES = ("after", "before", "third", "measured")  # colours of the logs; of more logs all have the last one


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
        """The last estimates by symbol."""
        lag = online.output_of(self.state, self.plan).lag if self.plan.estimates_lag else None
        return estimates_of(self.parameters[-1].tolist(), self.standard_errors[-1].tolist(), lag)


def estimates_of(
    values: Sequence[float], errors: Sequence[float | None], lag: tuple[float, float] | None
) -> dict[str, Estimate]:
    """Return estimates by symbol, with the motors' lag ``T_m`` where it was estimated."""
    found: dict[str, tuple[float, float | None]] = dict(zip(NAMES, zip(values, errors, strict=True), strict=True))
    if lag is not None:
        found["T_m"] = lag
    return {name: Estimate(*own, BY_FIELD[name].unit) for name, own in found.items()}


def identify_log(log: Log, settings: IdentifierSettings) -> EstimateHistory:
    """Run the identifier over a log, with its references where it has any.

    The history has a row for every evaluation of the standard errors.
    """
    plan = online.prepare(settings)
    samples = list(map(tuple, np.column_stack((log.voltages, log.angles)).tolist()))
    rest = np.zeros(len(samples))
    asked = list(map(tuple, np.column_stack([log.references.get(axis, rest) for axis in AXES]).tolist()))
    state = online.start(plan, samples[0], asked[0])
    every, last = max(1, round(settings.report_interval / settings.sample_time)), len(samples) - 1
    rows = []
    for k in range(1, len(samples)):
        state, output = online.step(state, samples[k], plan, asked[k])
        if (k % every == 0 and output.adapting) or k == last:
            rows.append((k * settings.sample_time, *output.parameters, *output.standard_errors))
    time, parameters, errors = np.split(np.array(rows), (1, 1 + len(NAMES)), axis=1)
    return EstimateHistory(log.name, time[:, 0], parameters, errors, state, plan)


def history_text(histories: Sequence[EstimateHistory]) -> str:
    """Return histories as CSV: log, time, every parameter and every standard error."""
    columns = [f"{name} [{BY_FIELD[name].unit}]" for name in NAMES]
    heads = ["time [s]", *columns, *(f"standard_error.{column}" for column in columns)]
    rows = {
        one.name: pd.DataFrame(np.column_stack((one.time, one.parameters, one.standard_errors)), columns=heads)
        for one in histories
    }
    return pd.concat(rows, names=["log"]).droplevel(1).to_csv()


def history_figure(histories: Sequence[EstimateHistory], together: Mapping[str, Estimate], voltage_limit: float) -> str:
    """Draw every parameter over time, one line per log with its 95 % band, and the value of all logs together.

    The ordinate ends where hardly any rig with this ``voltage_limit`` [V] has the parameter, unless the value of all
    logs lies beyond.
    """
    panels, several = [], len(histories) > len(ROLES)
    for column, name in enumerate(NAMES):
        final, (low, high) = together[name].value, plausible_range(name, voltage_limit)
        panel, ends = Axes(labelled(name, BY_FIELD[name].unit), 130.0), [final]
        for history, role in zip(histories, ROLES[-1:] * len(histories) if several else ROLES, strict=False):
            value, half = history.parameters[:, column], 1.96 * history.standard_errors[:, column]
            panel.band(history.time, value - half, value + half, role=role)
            panel.line(history.time, value, role, f"each of {len(histories)} logs" if several else history.name, 1.1)
            late = history.time >= 0.5 * history.time[-1]
            ends += [*(value - half)[late], *(value + half)[late]]
        panel.level(final, "ink", "together")
        bottom, top = min(final, max(min(ends), low)), max(final, min(max(ends), high))
        room = 0.25 * max(top - bottom, 1e-6)
        panel.limits = (bottom - room, top + room)
        panels.append(panel)
    return figure(panels, "time [s]", "Estimates over time", 640.0)
