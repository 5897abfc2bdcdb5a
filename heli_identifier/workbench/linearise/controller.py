"""The sampled PID as a linear system: z_{k+1} = A z_k + B y_k + E r_k, u_k = C z_k + D y_k + H r_k.

z are its integrals and filtered angles, y the measured angles and r their references [rad], u the voltages [V]. The law
is linear within its limits, so differences of the unit's own step give the matrices exactly.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from heli_plant.control import PidSettings, PidState, pid_step

UNLIMITED = 1e9
"""Limit [V] and [rad] that nothing reaches."""


class Controller(NamedTuple):
    """Matrices of the controller, shapes (6, 6), (6, 3), (2, 6), (2, 3), and (6, 3), (2, 3) of the references."""

    A: NDArray[np.float64]
    B: NDArray[np.float64]
    C: NDArray[np.float64]
    D: NDArray[np.float64]
    E: NDArray[np.float64]
    H: NDArray[np.float64]


def controller(settings: PidSettings, period: float) -> Controller:
    """Give the linear system of a PID that is called every ``period`` [s]."""
    free = settings._replace(voltage_limit=UNLIMITED, pitch_limit=UNLIMITED)

    def moved(row: list[float]) -> NDArray[np.float64]:
        """State and voltages after a period, from state, angles and references in one row."""
        pitch, elevation, travel = row[6:9]
        references = (row[9], row[10], row[11])
        after, voltages = pid_step(PidState(*row[:6]), pitch, elevation, travel, references, period, free)
        return np.array([*after, *voltages])

    base = moved([0.0] * 12)
    matrix = np.column_stack([moved(row) - base for row in np.eye(12).tolist()])
    return Controller(
        matrix[:6, :6], matrix[:6, 6:9], matrix[6:, :6], matrix[6:, 6:9], matrix[:6, 9:], matrix[6:, 9:]
    )  # fmt: skip
