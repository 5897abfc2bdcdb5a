"""Fits with fields more or fewer, begun where another fit ended: a larger model is never left worse than the smaller.

With N the curvature of the fit that ended at z = (x, o), and D the fields that are left out, the others begin at the
minimum of its quadratic problem under x_D = 0:

    z_R + N_RR^-1 N_RD x_D,    R = all coordinates and offsets but D.

Fields that are added begin at zero, where they change nothing.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from heli_identifier.tracing.multistep.fit import STEPS, MultistepFit, settled
from heli_identifier.tracing.multistep.priors import Coordinate, coordinates
from heli_identifier.tracing.multistep.problem import Arrays
from heli_identifier.tracing.multistep.robust import weights
from heli_identifier.tracing.multistep.search import NEAR, Search


def with_fields(fit: MultistepFit, added: Sequence[str]) -> MultistepFit:
    """Fit with further effects."""
    search = widened(fit, coordinates([field for field in added if field not in fit.names], fit.problem.base))
    return settled(search, search.descend(STEPS))


def widened(fit: MultistepFit, added: Sequence[Coordinate]) -> Search:
    """Give the search that stands where a fit ended, with further coordinates at zero and all sensitivities."""
    count, zeros = len(fit.x), np.zeros(len(added))
    problem = replace(fit.problem, base=fit.parameters)
    columns = problem.by_coordinates(added, zeros, fit.offsets, fit.errors)
    jacobian = [
        np.concatenate((own[..., :count], new, own[..., count:]), axis=-1)
        for own, new in zip(fit.jacobian, columns, strict=True)
    ]
    x = np.concatenate((fit.x, zeros))
    return Search(
        fit.problem, (*fit.fields, *added), x, fit.offsets, fit.spreads, fit.errors, fit.scales, jacobian, fresh=True
    )


def without(fit: MultistepFit, dropped: Collection[str]) -> MultistepFit:
    """Fit without some effects, until a step gains less than :data:`NEAR` in log-likelihood."""
    return settled(search_without(fit, dropped), True)


def search_without(fit: MultistepFit, dropped: Collection[str]) -> Search:
    """Descend without some effects; the search has not taken the sensitivities at its end.

    Raises
    ------
    ValueError
        Predictions diverge wherever the descent could begin.
    """
    count, size = len(fit.x), len(fit.normal.gradient)
    kept = [i for i, c in enumerate(fit.fields) if c.field not in dropped]
    out = [i for i in range(count) if i not in kept]
    rest = [*kept, *range(count, size)]
    N = fit.normal.matrix
    moved = np.concatenate((fit.x, fit.offsets.ravel()))
    moved[rest] += np.linalg.solve(N[np.ix_(rest, rest)], N[np.ix_(rest, out)] @ fit.x[out])
    frame = tuple(fit.fields[i] for i in kept)
    lower, upper = np.array([c.bounds for c in frame]).T
    problem = replace(fit.problem, base=fit.problem.base._replace(**{fit.fields[i].field: 0.0 for i in out}))
    starts = (
        (np.clip(moved[kept], lower, upper), moved[count:].reshape(fit.offsets.shape)),
        (fit.x[kept], fit.offsets),
        (np.zeros(len(kept)), np.zeros_like(fit.offsets)),
    )
    for x, offsets in starts:
        errors = problem.errors(problem.parameters(frame, x), offsets)
        if all(np.isfinite(e).all() for e in errors):
            break
    else:
        raise ValueError(f"the model's predictions diverge without {', '.join(dropped)}")
    columns = [*kept, *range(count, fit.jacobian[0].shape[-1])]
    jacobian = [J[..., columns] for J in fit.jacobian]
    search = Search(problem, frame, x, offsets, fit.spreads, errors, fit.scales, jacobian)
    search.descend(STEPS, enough=NEAR)
    return search


def growth(fit: MultistepFit, errors: Arrays) -> float:
    """Largest share over the axes by which the weighted size of other ``errors`` exceeds that of a fit's errors."""
    weight = weights(fit.problem, fit.errors, fit.scales)

    def by_axis(these: Arrays):
        return sum((w * e**2).sum(axis=(0, 1)) for w, e in zip(weight, these, strict=True))

    return float(np.sqrt(by_axis(errors) / by_axis(fit.errors)).max() - 1.0)
