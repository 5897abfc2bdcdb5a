"""The sampled PID as a linear system, and the closed loop that it makes with the plant.

The PID is z_{k+1} = A z_k + B y_k + E r_k, u_k = C z_k + D y_k + H r_k with z its integrals and filtered angles, y the
measured angles and r their references [rad], u the voltages [V]. The law is linear within its limits, so differences of
the unit's own step give the matrices exactly. The closed loop joins plant, PID, one period of computing delay and the
plant's input delay.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from heli_identifier.workbench.linearise.linear_model import LinearModel
from heli_plant.control import PidSettings, PidState, pid_step

TO_ROTORS = np.array([[0.5, 0.5], [-0.5, 0.5]])
"""(v_front, v_rear) from difference and sum of the voltages."""

UNLIMITED = 1e9
"""Limit [V] and [rad] that is never reached."""

_NOTHING = 1e-12
"""Entry of a sampled matrix below which it is rounding."""


class Controller(NamedTuple):
    """Matrices of the controller, shapes (6, 6), (6, 3), (2, 6), (2, 3), and (6, 3), (2, 3) of the references."""

    A: NDArray[np.float64]
    B: NDArray[np.float64]
    C: NDArray[np.float64]
    D: NDArray[np.float64]
    E: NDArray[np.float64]
    H: NDArray[np.float64]


def controller(settings: PidSettings, period: float) -> Controller:
    """Return the linear system of a PID that is called every ``period`` [s]."""
    free = settings._replace(voltage_limit=UNLIMITED, pitch_limit=UNLIMITED)

    def moved(row: list[float]) -> NDArray[np.float64]:
        """Return state and voltages after a period, from state, angles and references in one row."""
        pitch, elevation, travel = row[6:9]
        references = (row[9], row[10], row[11])
        after, voltages = pid_step(PidState(*row[:6]), pitch, elevation, travel, references, period, free)
        return np.array([*after, *voltages])

    base = moved([0.0] * 12)
    matrix = np.column_stack([moved(row) - base for row in np.eye(12).tolist()])
    return Controller(
        matrix[:6, :6], matrix[:6, 6:9], matrix[6:, :6], matrix[6:, 6:9], matrix[:6, 9:], matrix[6:, 9:]
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """w_{k+1} = M w_k + R r_k + Q q_k, y_k = C w_k.

    Attributes
    ----------
    M : NDArray, shape (n, n)
    R : NDArray, shape (n, 3)
        From the references [rad].
    Q : NDArray, shape (n, 2)
        From loads on difference and sum of the voltages [V].
    C : NDArray, shape (3, n)
        To the angles [rad].
    """

    M: NDArray[np.float64]
    R: NDArray[np.float64]
    Q: NDArray[np.float64]
    C: NDArray[np.float64]

    @property
    def is_stable(self) -> bool:
        """Whether all modes decay; states on which no other state depends, such as the travel, are left out."""
        acting = list(range(len(self.M)))
        while idle := [i for i in acting if not any(abs(self.M[j, i]) > _NOTHING for j in acting if j != i)]:
            acting = [i for i in acting if i not in idle]
        return bool(np.abs(np.linalg.eigvals(self.M[np.ix_(acting, acting)])).max() < 1.0)

    def trajectory(self, drive: NDArray[np.float64], steps: int) -> NDArray[np.float64]:
        """Angles (steps, 3) from rest under a constant ``drive`` (n,), such as a column of R.

        The exponent of M doubles with each product, so ten products give a thousand steps.
        """
        n = len(self.M)
        power = np.block([[self.M, drive[:, None]], [np.zeros((1, n)), np.ones((1, 1))]])
        path = np.zeros((n + 1, 1))
        path[n] = 1.0
        while path.shape[1] < steps:
            path = np.hstack((path, power @ path))
            power = power @ power
        return (self.C @ path[:n, :steps]).T


def closed_loop(model: LinearModel, settings: PidSettings) -> ClosedLoop:
    """Close the loop of a PID around a plant; the input delay is rounded to whole periods."""
    plant, K = model.sampled, controller(settings, model.sampled.dt)
    n = plant.nstates
    first = n + len(K.A)
    delays = 1 + round(model.input_delay / plant.dt)
    size = first + 2 * delays
    M, R, Q, C = np.zeros((size, size)), np.zeros((size, 3)), np.zeros((size, 2)), np.zeros((3, size))
    M[:n, :n], M[:n, size - 2 :] = plant.A, plant.B
    M[n:first, :n], M[n:first, n:first] = K.B @ plant.C, K.A
    M[first : first + 2, :n], M[first : first + 2, n:first] = K.D @ plant.C, K.C
    for k in range(1, delays):
        newer = first + 2 * k
        M[newer : newer + 2, newer - 2 : newer] = np.eye(2)
    R[n:first], R[first : first + 2] = K.E, K.H
    Q[:n] = plant.B @ TO_ROTORS
    C[:, :n] = plant.C
    return ClosedLoop(M, R, Q, C)
