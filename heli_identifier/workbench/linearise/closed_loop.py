"""The sampled closed loop as one linear system: plant, PID, one period of computing delay, the plant's input delay."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heli_identifier.workbench.linearise.controller import controller
from heli_identifier.workbench.linearise.linear_model import LinearModel
from heli_identifier.workbench.linearise.loop import TO_ROTORS
from heli_plant.control import PidSettings


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
        """Whether all modes decay; a state that nothing else depends on, as the travel angle, is left out."""
        acting = list(range(len(self.M)))
        while idle := [i for i in acting if not any(abs(self.M[j, i]) > _NOTHING for j in acting if j != i)]:
            acting = [i for i in acting if i not in idle]
        return bool(np.abs(np.linalg.eigvals(self.M[np.ix_(acting, acting)])).max() < 1.0)

    def trajectory(self, drive: NDArray[np.float64], steps: int) -> NDArray[np.float64]:
        """Angles (steps, 3) from rest under a constant ``drive`` (n,), such as a column of R.

        The powers of M are doubled, so that some ten products give a thousand steps.
        """
        n = len(self.M)
        power = np.block([[self.M, drive[:, None]], [np.zeros((1, n)), np.ones((1, 1))]])
        path = np.zeros((n + 1, 1))
        path[n] = 1.0
        while path.shape[1] < steps:
            path = np.hstack((path, power @ path))
            power = power @ power
        return (self.C @ path[:n, :steps]).T


_NOTHING = 1e-12
"""Entry of a sampled matrix below which it is rounding."""


def closed_loop(model: LinearModel, settings: PidSettings) -> ClosedLoop:
    """Close the loop of a PID around a plant; the input delay counts in whole periods."""
    K = controller(settings, model.period)
    n, first = len(model.F), len(model.F) + 6
    delays = 1 + round(model.input_delay / model.period)
    size = first + 2 * delays
    M, R, Q, C = np.zeros((size, size)), np.zeros((size, 3)), np.zeros((size, 2)), np.zeros((3, size))
    M[:n, :n], M[:n, size - 2 :] = model.F, model.G
    M[n:first, :n], M[n:first, n:first] = K.B @ model.C, K.A
    M[first : first + 2, :n], M[first : first + 2, n:first] = K.D @ model.C, K.C
    for k in range(1, delays):
        newer = first + 2 * k
        M[newer : newer + 2, newer - 2 : newer] = np.eye(2)
    R[n:first], R[first : first + 2] = K.E, K.H
    Q[:n] = model.G @ TO_ROTORS
    C[:, :n] = model.C
    return ClosedLoop(M, R, Q, C)
