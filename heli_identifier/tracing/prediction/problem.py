"""The prediction-error problem of one data set: parameters in, reduced innovations and their sensitivities out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import Estimate
from heli_identifier.records import Log
from heli_identifier.tracing.prediction.observer import innovations, observe, observer_start
from heli_identifier.tracing.prediction.whitening import ORDER
from heli_identifier.tracing.prediction.workers import parallel
from heli_plant.parameters import PlantParameters
from heli_plant.state import PlantState

TARGET_RATE = 100.0
"""Rate [Hz] that faster logs are reduced to: ten times the fastest motion that the search resolves."""

Residuals = list[NDArray[np.float64]]
"""Per record the reduced innovations, shape (n_i, 3) [rad/s^2]."""

REDUCED_RATE = 25.0
"""Rate [Hz] of the innovations after block averaging: above the fastest bending mode that logs resolve."""

MEMORY = ORDER / REDUCED_RATE
"""Memory [s] of the autoregressions that whiten the innovations."""

SETTLING = 10.0
"""The first SETTLING / omega_f seconds of a record still carry its unknown start and are left out."""


def reduce_log(log: Log, rate: float = TARGET_RATE) -> Log:
    """Reduce a log to about ``rate`` [Hz] by a whole factor; a slower log keeps its rate.

    A voltage held over several samples acts through the motor's lag as its mean does, so voltages are averaged over
    the longer step; an angle is taken at the step's start.
    """
    factor = max(1, int(log.rate_hz / rate + 0.5))
    count = log.samples // factor
    voltages = log.voltages[: count * factor].reshape(count, factor, 2).mean(axis=1)
    angles = log.angles[: count * factor : factor]
    return replace(log, rate_hz=log.rate_hz / factor, voltages=voltages, angles=angles, extra={}, references={})


@dataclass(frozen=True, eq=False)
class Problem:
    """Records of one rig under one observer.

    Attributes
    ----------
    records : tuple of Log
    bandwidth : float
        omega_f of the observer [rad/s].
    expected : mapping of str to Estimate
        Effects that every model of the rig has, by the field of their coefficient, which is known that well before.
    horizontal_given : bool
        Whether it is given, and not to be estimated, where the arm is horizontal.
    reduced_rate : float
        Rate [Hz] of the innovations after block averaging.
    """

    records: tuple[Log, ...]
    bandwidth: float = 4.0
    expected: Mapping[str, Estimate] = field(default_factory=dict)
    horizontal_given: bool = False
    reduced_rate: float = REDUCED_RATE
    starts: tuple[PlantState, ...] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "starts", tuple(observer_start(record) for record in self.records))

    def factor(self, record: Log) -> int:
        """Count the samples of a record that are averaged into one."""
        return max(1, round(1.0 / (record.step * self.reduced_rate)))

    @property
    def order(self) -> int:
        """Order of the autoregressions of the innovations, whose memory is the same at every rate."""
        return round(self.reduced_rate * MEMORY)

    def reduce(self, record: Log, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Average blocks of a record's signal (N, ...) down to the reduced rate and drop the settling time."""
        factor = self.factor(record)
        count = len(values) // factor
        blocks = values[: count * factor : factor] / factor
        for offset in range(1, factor):
            blocks += values[offset : count * factor : factor] / factor
        return blocks[round(SETTLING / self.bandwidth / (record.step * factor)) :]

    @cached_property
    def lengths(self) -> tuple[int, ...]:
        """Reduced samples n_i of each record."""
        return tuple(len(self.reduce(record, record.angles)) for record in self.records)

    def _reduced_innovations(self, index: int, parameters: PlantParameters) -> NDArray[np.float64]:
        record = self.records[index]
        return self.reduce(record, innovations(record, parameters, self.bandwidth, self.starts[index]))

    def motion(self, parameters: PlantParameters) -> list[NDArray[np.float64]]:
        """Predicted motion of every record on its own grid, (N_i, 8) as :func:`observe` gives it."""
        return [
            observe(record, parameters, self.bandwidth, start)[1]
            for record, start in zip(self.records, self.starts, strict=True)
        ]

    def residuals(self, parameters: PlantParameters) -> Residuals:
        """Reduced innovations of every record under ``parameters``."""
        return self.residuals_of([parameters])[0]

    def residuals_of(self, sets: Sequence[PlantParameters]) -> list[Residuals]:
        """:meth:`residuals` of many parameter sets, on all cores."""
        count = len(self.records)
        jobs = [(index, parameters) for parameters in sets for index in range(count)]
        results = parallel(lambda job: self._reduced_innovations(*job), jobs)
        return [results[i * count : (i + 1) * count] for i in range(len(sets))]

    def responses(
        self, parameters: PlantParameters, moves: Sequence[Mapping[str, float]], at: Residuals, sizes: Sequence[float]
    ) -> Residuals:
        """Secants (r(p moved) - r(p)) / size of many moves.

        Parameters
        ----------
        moves : sequence of mapping
            Fields and the values they take.
        at : Residuals
            ``residuals(parameters)``.
        sizes : sequence of float
            Length of each move in its coefficient.

        Returns
        -------
        list of NDArray, shape (n_i, 3, len(moves))
        """
        if not moves:
            return [np.empty((length, 3, 0)) for length in self.lengths]
        moved = self.residuals_of([parameters._replace(**move) for move in moves])
        return [
            np.stack([(residuals[i] - at[i]) / size for residuals, size in zip(moved, sizes, strict=True)], axis=-1)
            for i in range(len(self.records))
        ]
