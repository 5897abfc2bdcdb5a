"""The scatter of twelve runs of one experiment: from encoders alone, or from a random torque.

The runs of the units have encoders, different starts, and no disturbance; their ranges are far narrower than the
paper's. Here the standard deviation of a random torque of given correlation time is scaled until the geometric mean of
the six ratios, found range to printed range, is one. A range is proportional to a weak torque, so that few rounds are
enough.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from heli_identifier.workbench.paper.pitch_experiment import DURATION, STEP, identify_pitch, random_torque
from heli_identifier.workbench.paper.published import EXPERIMENTS, PITCH
from heli_identifier.workbench.paper.runs import KNOWN, Run
from heli_identifier.workbench.paper.spread import COLUMNS, HALF_WIDTHS
from heli_identifier.workbench.paper.tables import Cell, found_range, write_table
from heli_plant.parameters import TABLE_2

CORRELATION_TIMES = (0.1, 1.0, 10.0)
"""Of the random torque [s]: from a rotor's wash to a draught in the room."""

RUNS = 12
_ROUNDS = 4
_FIRST_DEVIATION = 0.01
"""Of the torque in the first round [rad/s^2]."""


@dataclass(frozen=True, eq=False)
class TorqueSpread:
    """Estimates under a random torque.

    Attributes
    ----------
    correlation_time, deviation : float
        Of the torque [s], [rad/s^2].
    estimates : ndarray, shape (2, 12, 3)
        By experiment, run and parameter (a_wx, a_th, k_x).
    """

    correlation_time: float
    deviation: float
    estimates: NDArray[np.float64]

    @property
    def means(self) -> NDArray[np.float64]:
        """Mean by experiment and parameter, shape (2, 3)."""
        return self.estimates.mean(axis=1)

    @property
    def widths(self) -> NDArray[np.float64]:
        """Width of the range by experiment and parameter, shape (2, 3)."""
        return np.ptp(self.estimates, axis=1)


def under_torque(
    correlation_time: float, deviation: float, runs: int = RUNS, duration: float = DURATION
) -> TorqueSpread:
    """Identify the pitch of Table 2 in ``runs`` runs of both experiments, each with a torque of its own."""
    count = round(duration / STEP)
    estimates = [
        [
            identify_pitch(
                TABLE_2,
                experiment,
                duration=duration,
                torque=random_torque(deviation, correlation_time, count, STEP, seed=1000 * experiment + run),
            )
            for run in range(runs)
        ]
        for experiment in EXPERIMENTS
    ]
    return TorqueSpread(correlation_time, deviation, np.array(estimates))


def matched_torque(correlation_time: float, runs: int = RUNS, duration: float = DURATION) -> TorqueSpread:
    """Return the spread under the torque whose ranges are as wide as the paper's, in geometric mean."""
    deviation = _FIRST_DEVIATION
    for _ in range(_ROUNDS - 1):
        widths = under_torque(correlation_time, deviation, runs, duration).widths
        deviation *= exp(-float(np.mean(np.log(widths / (2.0 * HALF_WIDTHS)))))
    return under_torque(correlation_time, deviation, runs, duration)


def write_within(runs: Sequence[Run], spreads: Sequence[TorqueSpread], path: Path) -> None:
    """Write the widths of the ranges: the paper's, those of the units with encoders alone, those under torques."""
    of_units = [found_range(runs, experiment, name, KNOWN) for experiment in EXPERIMENTS for name in PITCH]
    rows: list[tuple[Cell, ...]] = [
        ("the paper", "", "", *(2.0 * HALF_WIDTHS).ravel().tolist()),
        ("units: encoders and starts alone", "", "", *(found.highest - found.lowest for found in of_units)),
    ]
    for spread in spreads:
        torque = (spread.correlation_time, spread.deviation)
        rows.append(("random torque: width", *torque, *map(float, spread.widths.ravel())))
        rows.append(("random torque: mean", *torque, *map(float, spread.means.ravel())))
    write_table(path, ("what", "correlation time [s]", "standard deviation [rad/s^2]", *COLUMNS), rows)
