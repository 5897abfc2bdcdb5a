"""What a quadratic problem says of families of effects: whether they are found, and how steadily.

The score of a family with coordinates b and covariance V in the fit of a set is b' V^-1 b, as a score of one degree of
freedom. Its stability is the share of halves of the data, drawn in complementary pairs, in which it is found: in which
its score reaches :data:`FOUND_IN_HALF`. Source: Meinshausen and Buehlmann 2010; Shah and Samworth 2013. A family is
worth its parameters if without it the error of some axis grows by more than :data:`WORTH`, on all data and on records
that the fit has not seen.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, chdtri

from heli_identifier.tracing.predictive.quadratic import Quadratic, SubsetFit

FOUND = 2.0
"""Score from which a family counts as found: two standard errors."""

FOUND_IN_HALF = FOUND / 2.0**0.5
"""The same effect's score in half of the data."""

STEADY = 0.8
"""Share of the halves from which on a family is steady."""

POSSIBLE = 0.3
"""Share of the halves from which on a family is possible: less rests on so few passages that it is no property of the
rig, whatever it scores."""

HOPELESS = 1.0
"""Score in all of the data below which few halves can find a family: stability is taken as zero."""

WORTH = 0.05
"""Share by which an axis's error has to grow without a family: less is not worth a parameter on a rig."""

SMALLEST = 1e-12
"""Loss below which there is nothing to explain."""


@dataclass(frozen=True)
class Support:
    """What speaks for a family beside others: its score, and by which share an axis's error grows without it."""

    score: float
    worth: float

    @property
    def enough(self) -> bool:
        """Whether the family is found in all of the data and worth its parameters."""
        return self.score >= FOUND and self.worth > WORTH


@dataclass(frozen=True, eq=False)
class Judge:
    """A quadratic problem in which families are looked for.

    Attributes
    ----------
    quadratic : Quadratic
    names : tuple of str
        Fields of the problem's coordinates.
    core : tuple of str
        Fields that every model has.
    families : mapping of str to tuple of str
        Fields of each family by its name.
    """

    quadratic: Quadratic
    names: tuple[str, ...]
    core: tuple[str, ...]
    families: Mapping[str, tuple[str, ...]]

    def with_single(self, fields: Mapping[str, str]) -> "Judge":
        """Give the judge under which families have one field each, by name."""
        return replace(self, families={**self.families, **{name: (field,) for name, field in fields.items()}})

    def support(self, asked: Collection[str], kept: Collection[str]) -> dict[str, Support]:
        """Support for each family asked for, all of them in ``kept``, beside the others there."""
        fitted = self.quadratic.fit(self._indices(kept))
        losses, found = self.quadratic.losses(fitted.x), {}
        for name in asked:
            without = self._losses([other for other in kept if other != name])
            found[name] = Support(self._score(name, fitted), _growth(losses, without))
        return found

    def unseen_worth(self, asked: Collection[str], fields: Mapping[str, str]) -> dict[str, float]:
        """Worth of each family asked for on records that the fit has not seen, beside the others of ``fields``.

        ``fields`` has the one field that represents each family. Every record is predicted by fits to all other
        records, with the family and without it. Source: Stone 1974, Cross-validatory choice.
        """
        single = self.with_single(fields)
        losses = single._unseen_losses(fields)
        return {name: _growth(losses, single._unseen_losses(fields.keys() - {name})) for name in asked}

    def stability(self, asked: Collection[str], kept: Collection[str]) -> dict[str, float]:
        """Share of the halves in which each family asked for is found beside the others of ``kept``."""
        indices = self._indices(kept)
        fits = [half.fit(indices) for half in self.quadratic.halves]
        return {name: float(np.mean([self._score(name, fitted) >= FOUND_IN_HALF for fitted in fits])) for name in asked}

    def steady(self) -> list[str]:
        """Families that are steady beside each other: of all families the least steady are dropped one by one.

        Of two families that can take each other's place one goes, and the other one then has all the support.
        """
        kept = list(self.families)
        while kept:
            support = self.support(kept, kept)
            least = min(kept, key=lambda name: (support[name].worth > WORTH, support[name].score))
            if support[least].enough:
                stability = self.stability(kept, kept)
                least = min(kept, key=lambda name: (stability[name], support[name].score))
                if stability[least] >= STEADY:
                    break
            kept.remove(least)
        return kept

    def around(self, kept: Sequence[str]) -> tuple[dict[str, Support], dict[str, float]]:
        """Support and stability of every family beside those of ``kept``."""
        found, stability = self.support(kept, kept), self.stability(kept, kept)
        for name in self.families:
            if name not in kept:
                beside = [*kept, name]
                found |= self.support([name], beside)
                hopeless = found[name].score < HOPELESS or found[name].worth <= WORTH
                stability |= {name: 0.0} if hopeless else self.stability([name], beside)
        return found, stability

    def best(self, name: str, kept: Collection[str], excluded: Collection[str] = ()) -> str:
        """Give the field, none of ``excluded``, that alone stands best for a family beside those of ``kept``."""

        def loss(field: str) -> float:
            return float(self.with_single({name: field})._losses({*kept, name}).sum())

        return min((field for field in self.families[name] if field not in excluded), key=loss)

    def as_good(self, kept: Collection[str], others: Collection[str]) -> float:
        """Share of the halves in which the families ``kept`` predict the other half as well as ``others`` do."""
        one, other = self._indices(kept), self._indices(others)
        pairs = list(zip(self.quadratic.halves[::2], self.quadratic.halves[1::2], strict=True))
        tried = [*pairs, *((second, first) for first, second in pairs)]
        losses = [(rest.losses(half.solve(one)[0]), rest.losses(half.solve(other)[0])) for half, rest in tried]
        return float(np.mean([mine.sum() <= theirs.sum() for mine, theirs in losses]))

    def _score(self, name: str, fitted: SubsetFit) -> float:
        place = {int(index): i for i, index in enumerate(fitted.free)}
        own = [place[i] for i in map(self.names.index, self.families[name]) if i in place]
        estimate, covariance = fitted.x[fitted.free[own]], fitted.covariance[np.ix_(own, own)]
        return _one_degree(float(estimate @ np.linalg.solve(covariance, estimate)), len(own))

    def _losses(self, kept: Collection[str]) -> NDArray[np.float64]:
        return self.quadratic.losses(self.quadratic.solve(self._indices(kept))[0])

    def _unseen_losses(self, kept: Collection[str]) -> NDArray[np.float64]:
        """Twice the loss of the axes, each record under the fit to the others."""
        indices = self._indices(kept)
        return np.sum([record.losses(others.solve(indices)[0]) for others, record in self.quadratic.folds], axis=0)

    def _indices(self, kept: Collection[str]) -> NDArray[np.intp]:
        fields = (*self.core, *(field for name in kept for field in self.families[name]))
        return np.sort([self.names.index(field) for field in fields])


def _growth(losses: NDArray[np.float64], without: NDArray[np.float64]) -> float:
    """Largest share over the axes by which errors grow from one set of losses to another."""
    return float(np.sqrt(np.maximum(without, 0.0) / np.maximum(losses, SMALLEST)).max() - 1.0)


def _one_degree(statistic: float, degrees: int) -> float:
    """Score of one degree of freedom that is as improbable as a chi-squared ``statistic``; 0 without any degree."""
    if degrees == 0:
        return 0.0
    # beyond some 35 standard errors probabilities underflow: there the statistic itself is the score's square
    probable = chdtrc(degrees, max(statistic, 0.0)) if degrees > 1 else 0.0
    return float(np.sqrt(chdtri(1, probable) if probable > 0.0 else statistic))
