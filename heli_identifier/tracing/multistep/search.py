"""One descent of a multi-step fit: Levenberg-Marquardt steps under scales and spreads that follow the errors.

Sensitivities serve until a step gains much less than they promised (chord method). Scales and spreads are renewed as
long as the search moves far; once it has come near they are held, so that it can settle.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heli_identifier.tracing.multistep.normal import NormalEquations, normal_equations, offset_precision
from heli_identifier.tracing.multistep.priors import Coordinate
from heli_identifier.tracing.multistep.problem import OFFSET_WIDTHS, Arrays, Multistep
from heli_identifier.tracing.multistep.robust import loss, robust_scales, weights
from heli_plant.parameters import PlantParameters

NEAR = 1.0
"""Gain of the objective, in units of log-likelihood, below which scales and spreads are held."""

SETTLED = 0.03
"""Gain below which the search ends: no parameter moves by more than a quarter of its standard error."""

PROMISED = 0.5
"""Share of the promised gain below which the sensitivities are taken anew."""

SHORTEST = 1e4
"""Damping beyond which there is no step left that lowers the objective."""


@dataclass(eq=False)
class Search:
    """Where a descent stands; the arrays are those of :class:`heli_identifier.tracing.multistep.fit.MultistepFit`.

    ``fresh``: whether the sensitivities were taken where the search stands.
    """

    problem: Multistep
    frame: tuple[Coordinate, ...]
    x: NDArray[np.float64]
    offsets: NDArray[np.float64]
    spreads: NDArray[np.float64]
    errors: Arrays
    scales: NDArray[np.float64]
    jacobian: Arrays
    fresh: bool = False

    @classmethod
    def begun(cls, problem: Multistep, frame: tuple[Coordinate, ...], x: NDArray[np.float64]) -> "Search | None":
        """Search that begins at ``x`` without offsets; None where predictions diverge there."""
        offsets = np.zeros((len(problem.records), len(OFFSET_WIDTHS)))
        errors = problem.errors(problem.parameters(frame, x), offsets)
        if not all(np.isfinite(e).all() for e in errors):
            return None
        search = cls(problem, frame, x, offsets, np.array(OFFSET_WIDTHS), errors, robust_scales(problem, errors), [])
        search.linearise()
        return search

    def linearise(self) -> None:
        """Take the sensitivities where the search stands."""
        self.jacobian = self.problem.sensitivities(self.frame, self.x, self.offsets, self.errors)
        self.fresh = True

    @property
    def parameters(self) -> PlantParameters:
        """Parameter set for predictions on any log."""
        return self.problem.parameters(self.frame, self.x)

    def penalty(self) -> float:
        """Half the squared distance from the priors' centre."""
        offsets = self.offsets.ravel()
        of_offsets = offsets @ offset_precision(self.spreads, len(self.offsets)) @ offsets
        return 0.5 * float(self.x @ self.x + of_offsets)

    def objective(self) -> float:
        """Loss of the errors and penalty."""
        return loss(self.errors, self.scales) + self.penalty()

    def normal_equations(self, blocks: Sequence[NDArray[np.intp]] | None = None) -> NormalEquations:
        """Assemble the normal equations under the present scales, spreads and sensitivities."""
        return normal_equations(
            self.jacobian, self.errors, weights(self.problem, self.errors, self.scales), self.x,
            self.offsets, self.spreads, blocks,
        )  # fmt: skip

    def descend(self, steps: int, enough: float = SETTLED) -> bool:
        """Take up to ``steps`` steps; tell whether it has settled: the last one gained less than ``enough``."""
        lower, upper = np.array([c.bounds for c in self.frame]).T
        damping, gain = 1e-3, np.inf
        for _ in range(steps):
            if gain > NEAR:
                self._renew()
            system, before = self.normal_equations(), self.objective()
            while True:
                step, offset_step = system.step(damping, self.x <= lower, self.x >= upper)
                trial = self.moved(np.clip(self.x + step, lower, upper), self.offsets + offset_step)
                gain = before - trial.objective()
                if gain >= 0.0 or not self.fresh or damping > SHORTEST:
                    break
                damping *= 8.0
            if gain >= 0.0:
                promised = system.promised(trial.x - self.x, trial.offsets - self.offsets)
                self.x, self.offsets, self.errors, self.fresh = trial.x, trial.offsets, trial.errors, False
                if gain < enough:
                    return True
                damping, good = max(damping / 8.0, 1e-6), gain > PROMISED * promised
            elif self.fresh:
                return True  # a corner of the objective: no step, however short, lowers it
            else:
                gain, good = np.inf, False
            if not good:
                self.linearise()
        return False

    def _renew(self) -> None:
        """Take scales and spreads from the present errors and offsets."""
        self.scales = robust_scales(self.problem, self.errors)
        variances = self.normal_equations().offset_variances
        known = (self.offsets**2 + variances).sum(axis=0) + np.square(OFFSET_WIDTHS)
        self.spreads = np.sqrt(known / (len(self.offsets) + 1))

    def moved(self, x: NDArray[np.float64], offsets: NDArray[np.float64]) -> "Search":
        """Give the search at other coordinates and offsets, under the same scales, spreads and sensitivities."""
        errors = self.problem.errors(self.problem.parameters(self.frame, x), offsets)
        return Search(self.problem, self.frame, x, offsets, self.spreads, errors, self.scales, self.jacobian)
