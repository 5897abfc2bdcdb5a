"""A flight flown again from its references: plant and controller in the loop, held against what was measured.

Every :data:`AHEAD` s the plant starts from the measured motion, and the controller from the state to which the measured
angles have brought it. From there both run by themselves from the references, and the error is the root mean square of
simulated less measured angles. Feedback cannot flatter it: the simulated voltages answer the simulated angles.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from heli_identifier.errors import ConfigurationError
from heli_identifier.records import Log, LogSource, read_logs
from heli_identifier.results import PlantSource, Table, Tabular, plain, plant_of, significant
from heli_identifier.tools.loop import Memory, Settings, answered, begun, fly, read_controller
from heli_identifier.tracing import record_start
from heli_plant.effects import AXES
from heli_plant.laws import motor_time_constant
from heli_plant.motor import kept
from heli_plant.parameters import PlantParameters
from heli_plant.state import PlantState

AHEAD = 3.0  # length [s] of the stretches that are flown again
Array = NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class ClosedLoopErrors(Tabular):
    """Closed-loop errors over 3 s, by log and axis [rad]; up to ``limit`` they pass on the ``followed`` axes.

    ``voltages`` are by log what the controller asks for along the measured angles less what was logged [V], root mean
    square.
    """

    errors: dict[str, dict[str, float]]
    voltages: dict[str, float]
    followed: tuple[str, ...]
    limit: float = inf

    @property
    def table(self) -> Table:
        """Log, axis, error, and how far the controller is from the one that flew."""
        rows = [
            (log, axis, significant(1e3 * error), significant(self.voltages[log], 2))
            for log, of_axes in self.errors.items()
            for axis, error in of_axes.items()
        ]
        columns = ("log", "axis", "error [mrad]", "voltages differ by [V]")
        return Table(f"Error of the closed loop over {AHEAD:g} s", columns, rows)

    @property
    def largest(self) -> float:
        """Largest error of a followed axis [rad]."""
        return max(of_axes[axis] for of_axes in self.errors.values() for axis in self.followed)

    @property
    def passed(self) -> bool:
        """Whether the limit is kept."""
        return self.largest <= self.limit

    def to_dict(self) -> dict[str, Any]:
        """Give the figures as a JSON file has them."""
        errors = {"closed_loop_3s_rad": self.errors, "voltages_V": self.voltages}
        return plain({**errors, "limit_rad": self.limit, "passed": self.passed})


def closed_loop_errors(
    logs: LogSource | Sequence[LogSource],
    parameters: PlantSource,
    controller: str | PathLike[str] | Settings,
    limit: float = inf,
) -> ClosedLoopErrors:
    """Fly logs again from their references, under the controller that flew: its controller.json, or its settings.

    Errors up to ``limit`` [rad] pass. ConfigurationError if the file is no controller's, or a log has no reference of
    an axis that the controller follows.
    """
    plant = plant_of(parameters)
    settings = read_controller(controller, plant.v_max) if isinstance(controller, str | PathLike) else controller
    followed, errors, voltages = ("elevation", "travel" if settings.travel_enabled else "pitch"), {}, {}
    for log in read_logs(logs):
        if missing := [axis for axis in followed if axis not in log.references]:
            raise ConfigurationError(
                f"log {log.name} has no reference of the {' and the '.join(missing)}, which this controller follows; "
                "name the column in [log.references] of heli.toml."
            )
        own, voltages[log.name] = _flown_again(log, plant, settings)
        errors[log.name] = dict(zip(AXES, own.tolist(), strict=True))
    return ClosedLoopErrors(errors, voltages, followed, limit)


def _flown_again(log: Log, plant: PlantParameters, settings: Settings) -> tuple[Array, float]:
    """Root mean square errors (3,) [rad] over all stretches of a log, and of the controller's voltages [V]."""
    zero = np.zeros(len(log.angles))
    references = np.column_stack([log.references.get(axis, zero) for axis in AXES])
    share, first = kept(log.step, motor_time_constant(plant)), log.voltages[0]
    lagged = lfilter([0.0, 1.0 - share], [1.0, -share], log.voltages - first, axis=0) + first
    length, asked, memories = round(AHEAD / log.step), np.empty_like(log.voltages), list[Memory]()
    memory = begun(settings, *log.angles[0].tolist())
    for k, (own, wanted) in enumerate(zip(log.angles.tolist(), references.tolist(), strict=True)):
        memories.append(memory)
        memory, asked[k] = answered(settings, memory, own, wanted, log.step)
    squares = []
    for k in range(length, len(log.angles) - length, length):
        part = slice(k, k + length)
        state = PlantState(*map(float, record_start(log.angles[part], log.voltages[part], log.step)))
        state = state._replace(nu_front=float(lagged[k, 0]), nu_rear=float(lagged[k, 1]))
        held = float(log.voltages[k, 0]), float(log.voltages[k, 1])
        angles, _ = fly(plant, settings, references[part], state, held, log.step, memories[k])
        squares.append((angles - log.angles[part]) ** 2)
    if not squares:
        raise ConfigurationError(
            f"log {log.name} lasts {log.duration:.3g} s; to be flown again it needs {3 * AHEAD:g} s."
        )
    return np.sqrt(np.mean(squares, axis=(0, 1))), float(np.sqrt(np.mean((asked[:-1] - log.voltages[1:]) ** 2)))
