"""Root mean squares of errors with 95 % intervals, from one bootstrap over segments of a time series.

Sources: Kuensch, Annals of Statistics 17 (1989) 1217 (blocks); Diebold and Mariano 1995 (two models in pairs).
"""

from collections.abc import Callable, Sequence

import numpy as np

from heli_identifier.errors import LogError
from heli_identifier.results.diagnosis import ErrorFigure
from heli_identifier.tracing.rig import Array
from heli_identifier.tracing.settings import BLOCK, SETTLING

DRAWS = 1000
"""Number of draws; the ends of a 95 % interval are then known to a twentieth of its width."""


def rms_figures(errors: Sequence[Array], spacing: float | Sequence[float], what: str = "errors") -> list[ErrorFigure]:
    """Return the root mean squares by column of errors (S_i, a), rows ``spacing`` [s] apart, pooled over records.

    Rows with a number that is not finite are left out. LogError if no row is left; ``what`` names the errors in it.
    """
    squares = [rows[np.isfinite(rows).all(1)] ** 2 for rows in errors]
    if not any(map(len, squares)):
        raise LogError(
            f"{what}: no passage of the logs is long enough for it, behind {SETTLING:g} s in which the filter settles "
            "and outside of what is left out; give longer logs, or keep the events."
        )
    return bootstrap(squares, spacing, after=np.sqrt)


def bootstrap(
    values: Sequence[Array],
    spacing: float | Sequence[float],
    read: Callable[[Array], Array] = np.asarray,
    after: Callable[[Array], Array] = np.asarray,
) -> list[ErrorFigure]:
    """Return a function ``read`` of the means (k,) of values (S_i, k), rows ``spacing`` [s] apart, with 95 % intervals.

    Segments of :data:`heli_identifier.tracing.settings.BLOCK` s are drawn at random. ``after`` is a monotonic function
    that is applied to the result and to the ends of its interval.
    """
    spacings = [spacing] * len(values) if isinstance(spacing, float) else spacing
    totals, lengths = [], []
    for rows, step in zip(values, spacings, strict=True):
        if len(rows):
            starts = np.arange(0, len(rows), max(1, round(BLOCK / step)))
            totals.append(np.add.reduceat(rows, starts, axis=0))
            lengths.append(np.diff([*starts, len(rows)]).astype(float))
    total, length = np.concatenate(totals), np.concatenate(lengths)
    random, shares = np.random.default_rng(0), np.full(len(total), 1.0 / len(total))
    counts = random.multinomial(len(total), shares, DRAWS).astype(float)
    drawn = read(counts @ total / (counts @ length)[:, None])
    figures = np.vstack((read(np.concatenate(values).mean(0)), np.quantile(drawn, (0.025, 0.975), axis=0)))
    return [ErrorFigure(*map(float, column)) for column in after(figures).T]


def change_figures(first: Sequence[Array], second: Sequence[Array], spacing: float) -> list[ErrorFigure]:
    """Return by axis the root mean square of the second errors (S, a) over that of the first, less 1."""
    squares, axes = [np.hstack(pair) ** 2 for pair in zip(first, second, strict=True)], first[0].shape[1]

    def ratio(means: Array) -> Array:
        return np.sqrt(means[..., axes:] / np.maximum(means[..., :axes], 1e-300)) - 1.0

    return bootstrap([rows[np.isfinite(rows).all(1)] for rows in squares], spacing, ratio)
