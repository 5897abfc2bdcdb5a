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
"""Draws of the bootstrap: the ends of a 95 % interval are then known to a twentieth of its width."""


def rms_figures(errors: Sequence[Array], spacing: float | Sequence[float], what: str = "errors") -> list[ErrorFigure]:
    """Root mean squares by column of errors (S_i, a) that lie ``spacing`` [s] apart, pooled over records.

    Rows that are not a number are left out.

    Raises
    ------
    LogError
        No row is left.
    """
    squares = [own[np.isfinite(own).all(1)] ** 2 for own in errors]
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
    """Give what is read off the means (k,) of values (S_i, k) ``spacing`` [s] apart, with 95 % intervals.

    Segments of :data:`heli_identifier.tracing.settings.BLOCK` s are drawn at random. ``after`` is monotonic, and read
    off their quantiles.
    """
    spacings = [spacing] * len(values) if isinstance(spacing, float) else spacing
    totals, lengths = [], []
    for own, apart in zip(values, spacings, strict=True):
        if len(own):
            starts = np.arange(0, len(own), max(1, round(BLOCK / apart)))
            totals.append(np.add.reduceat(own, starts, axis=0))
            lengths.append(np.diff([*starts, len(own)]).astype(float))
    total, length = np.concatenate(totals), np.concatenate(lengths)
    times = np.random.default_rng(0).multinomial(len(total), np.full(len(total), 1.0 / len(total)), DRAWS).astype(float)
    drawn = read(times @ total / (times @ length)[:, None])
    found = np.vstack((read(np.concatenate(values).mean(0)), np.quantile(drawn, (0.025, 0.975), axis=0)))
    return [ErrorFigure(*map(float, column)) for column in after(found).T]


def change_figures(first: Sequence[Array], second: Sequence[Array], spacing: float) -> list[ErrorFigure]:
    """Root mean squares by axis of the second errors (S, a), ``spacing`` [s] apart, over those of the first, less 1."""
    pairs = [np.hstack(own) ** 2 for own in zip(first, second, strict=True)]
    return bootstrap([own[np.isfinite(own).all(1)] for own in pairs], spacing, _rms_ratio)


def _rms_ratio(squares: Array) -> Array:
    """Root mean square of the second half of the columns over that of the first, less 1."""
    a = squares.shape[-1] // 2
    return np.sqrt(squares[..., a:] / np.maximum(squares[..., :a], 1e-300)) - 1.0
