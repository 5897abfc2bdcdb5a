"""Which families predict: a joint selection at the fit of everything, with its stability under resamples.

1. Everything at once is fitted (:func:`fit_everything`), its quadratic problem taken apart into independent blocks.
2. In wild resamples of the blocks a family is found if the left-out blocks miss it: without it the error of some axis
   grows there by more than :data:`WORTH` and by more than one standard error over the blocks (Breiman et al. 1984).
   Its stability is the share of the resamples in which it is found beside the other families of the set.
3. The family that is least steady is dropped, all others are looked at again, until every family left is steady. All
   resamples go down the same path: of two aliases one goes, and the other one then has all the votes.
4. The steady families are fitted with all the others off (:func:`refitted`). A family stays if a refit without it is
   worse by more than :data:`WORTH` on some axis; one that the refit lacks by the same measure is taken in. Around this
   fit stability is taken once more, and that is what is told.

The list says what improves predictions, not what causes the motion.
"""

from collections.abc import Container, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from benchmarks.joint.blocks import Blocks, Sample, blocks_of
from benchmarks.joint.families import FAMILIES, Family, members
from heli_identifier.tracing.multistep.fit import MultistepFit, fit_multistep
from heli_identifier.tracing.multistep.priors import ENTRIES, EVERYTHING
from heli_identifier.tracing.multistep.problem import Multistep
from heli_identifier.tracing.multistep.robust import weights
from heli_identifier.tracing.prediction.fit import BASE

RESAMPLES = 100
"""Wild resamples: the share of them in which a family is found is known within .05."""

STEADY = 0.8
"""Share of the resamples from which on a family is steady."""

POSSIBLE = 0.3
"""Share of the resamples from which on a family is possible."""

SMALLEST = 1e-12
"""Loss below which there is nothing to explain."""

WORTH = 0.02
"""Share of an axis's error that a family has to take off: less is not worth a parameter."""


@dataclass(frozen=True)
class Finding:
    """A family and what the logs say of it.

    Attributes
    ----------
    family : Family
    stability : float
        Share of the resamples in which the left-out blocks miss it.
    worth : float
        Largest share over the axes by which the error grows in a refit without it; NaN where none was made.
    """

    family: Family
    stability: float
    worth: float


@dataclass(frozen=True, eq=False)
class PredictiveSelection:
    """Outcome of the selection.

    Attributes
    ----------
    everything : MultistepFit
        The fit of everything at once.
    predictive : tuple of Finding
        Families that are steady and worth their parameters in a refit.
    possible : tuple of Finding
        Families found in some of the resamples only, or not worth their parameters.
    fit : MultistepFit
        Fit with every family that has a worth, predictive or possible, all others off.
    """

    everything: MultistepFit
    predictive: tuple[Finding, ...]
    possible: tuple[Finding, ...]
    fit: MultistepFit


def fit_everything(problem: Multistep) -> MultistepFit:
    """Fit the whole catalogue at once: ridge regression under the priors, the elevation's ground at its lowest."""
    lowest = min(float(starts.record.angles[:, 1].min()) for starts in problem.records)
    return fit_multistep(replace(problem, base=problem.base._replace(ground_elevation=lowest)), EVERYTHING)


def select_predictive(everything: MultistepFit, seed: int = 0) -> PredictiveSelection:
    """Select the families that predict, given the fit of everything."""
    steady = Judge(blocks_of(everything), everything.names, seed).steady()
    fit, kept, worth = refitted(everything, steady)
    stability = Judge(blocks_of(_around(fit, everything)), everything.names, seed).stability(kept)
    findings = [
        Finding(FAMILIES[n], float(stability[n]), worth.get(n, float("nan")))
        for n in range(len(FAMILIES))
        if n in kept or stability[n] >= POSSIBLE
    ]
    predictive = tuple(finding for finding in findings if finding.worth > WORTH and finding.stability >= STEADY)
    return PredictiveSelection(everything, predictive, tuple(f for f in findings if f not in predictive), fit)


@dataclass(frozen=True, eq=False)
class Judge:
    """Resamples of a quadratic problem, in which families are looked for.

    Attributes
    ----------
    blocks : Blocks
    names : tuple of str
        Fields of the problem's coordinates.
    seed : int
        Of the signs of the resamples.
    """

    blocks: Blocks
    names: tuple[str, ...]
    seed: int

    @cached_property
    def sample(self) -> Sample:
        """Wild resamples of the blocks."""
        return self.blocks.resamples(RESAMPLES, np.random.default_rng(self.seed))

    def left_out(self, numbers: Sequence[int], sample: Sample | None) -> NDArray[np.float64]:
        """Losses (R, B, 3) on left-out blocks with the base parameters and some families."""
        fields = (*BASE, *members([FAMILIES[n] for n in numbers]))
        return self.blocks.left_out_losses(np.sort([self.names.index(field) for field in fields]), sample)

    def evidence(self, numbers: Sequence[int]) -> dict[int, NDArray[np.float64]]:
        """Evidence (R,) for each of some families beside the others, in every resample."""
        losses = self.left_out(numbers, self.sample)
        return {n: _evidence(losses, self.left_out([m for m in numbers if m != n], self.sample)) for n in numbers}

    def steady(self) -> list[int]:
        """Numbers of the families that are steady beside each other: the least steady are dropped one by one."""
        kept = list(range(len(FAMILIES)))
        while evidence := self.evidence(kept):
            least = min(kept, key=lambda n: (_share(evidence[n]), np.mean(evidence[n])))
            if _share(evidence[least]) >= STEADY:
                break
            kept.remove(least)
        return kept

    def stability(self, kept: Sequence[int]) -> NDArray[np.float64]:
        """Share (families,) of the resamples in which each family is found beside those kept."""
        found, losses = self.evidence(kept), self.left_out(kept, self.sample)
        for n in set(range(len(FAMILIES))) - set(kept):
            found[n] = _evidence(self.left_out([*kept, n], self.sample), losses)
        return np.array([_share(found[n]) for n in range(len(FAMILIES))])

    def missing(self, kept: Sequence[int], closed: Container[int]) -> int | None:
        """Give the family, neither kept nor ``closed``, that the left-out blocks miss most; None if they miss none."""
        losses = self.left_out(kept, None)
        evidence = {
            n: float(_evidence(self.left_out([*kept, n], None), losses)[0])
            for n in range(len(FAMILIES))
            if n not in kept and n not in closed
        }
        best = max(evidence, key=lambda n: evidence[n], default=None)
        return best if best is not None and evidence[best] > 1.0 else None


def _share(evidence: NDArray[np.float64]) -> float:
    return float(np.mean(evidence > 1.0))


def _evidence(losses: NDArray[np.float64], without: NDArray[np.float64]) -> NDArray[np.float64]:
    """By how many standard errors over blocks the loss (R, B, 3) grows without a unit, on its best axis; shape (R,).

    An axis counts where the error grows by more than :data:`WORTH`, and none does where all losses together fall.
    """
    excess = without - losses
    total = excess.sum(axis=1)
    worth = np.sqrt(np.maximum(without.sum(axis=1), 0.0) / np.maximum(losses.sum(axis=1), SMALLEST)) - 1.0
    errors = np.sqrt(excess.shape[1]) * excess.std(axis=1, ddof=1)
    counts = (worth > WORTH) & (total.sum(axis=1, keepdims=True) > 0.0)
    return np.where(counts, total / np.maximum(errors, SMALLEST), 0.0).max(axis=1)


def refitted(everything: MultistepFit, kept: Sequence[int]) -> tuple[MultistepFit, list[int], dict[int, float]]:
    """Fit with the families ``kept``, less those that a refit does not miss, more what the fit lacks.

    The quadratic problem around the fit of everything overstates what a curved law is worth far from there, and then
    lets it stand for another effect. So what a refit lacks is looked for around the refit itself, where a single family
    is a small move, and has to prove its worth in a refit, too. No family comes back that was dropped here.

    Returns
    -------
    fit : MultistepFit
    kept : list of int
    worth : dict of int to float
        Share of an axis's error that each family takes off.
    """
    dropped: set[int] = set()
    kept = list(kept)
    fit = _fit_of(kept, everything)
    while True:
        worth = {n: missed(fit, _fit_of([m for m in kept if m != n], fit)) for n in kept}
        while worth and min(worth.values()) <= WORTH:
            least = min(kept, key=lambda n: worth[n])
            kept.remove(least)
            dropped.add(least)
            fit = _fit_of(kept, fit)
            worth = {n: missed(fit, _fit_of([m for m in kept if m != n], fit)) for n in kept}
        lacking = Judge(blocks_of(_around(fit, everything)), everything.names, 0).missing(kept, dropped)
        if lacking is None:
            return fit, kept, worth
        larger = _fit_of([*kept, lacking], fit)
        if missed(larger, fit) > WORTH:
            kept, fit = [*kept, lacking], larger
        else:
            dropped.add(lacking)


def _fit_of(numbers: Sequence[int], near: MultistepFit) -> MultistepFit:
    """Fit of the base parameters and some families, begun at ``near``."""
    base = near.problem.base._replace(**{entry.field: 0.0 for entry in ENTRIES})
    problem = replace(near.problem, base=base)
    return fit_multistep(problem, (*BASE, *members([FAMILIES[n] for n in numbers])), (near.parameters,))


def _around(fit: MultistepFit, everything: MultistepFit) -> MultistepFit:
    """Give the problem of everything linearised at another fit, where all other effects are off."""
    frame, fitted = everything.fields, dict(zip(fit.names, fit.x, strict=True))
    x = np.array([fitted.get(c.field, 0.0) for c in frame])
    jacobian = fit.problem.sensitivities(frame, x, fit.offsets, fit.errors)
    return replace(fit, fields=frame, x=x, jacobian=jacobian)


def missed(fit: MultistepFit, without: MultistepFit) -> float:
    """Largest share over the axes by which the weighted error of ``without`` exceeds that of ``fit``."""
    weight = weights(fit.problem, fit.errors, fit.scales)

    def axes(errors):
        return sum((w * e**2).sum(axis=(0, 1)) for w, e in zip(weight, errors, strict=True))

    return float(np.sqrt(axes(without.errors) / axes(fit.errors)).max() - 1.0)
