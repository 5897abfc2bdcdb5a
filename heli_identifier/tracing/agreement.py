"""What whole logs say apart: the gain of left-out logs, and the agreement of disjoint halves.

Everything is linear algebra on the quadratic forms of the single logs around the last fit. A possible effect enters the
delivered plant where the logs that a fit has not seen get likelier with it (leave one log out). Halves of whole logs,
disjoint and never pieces of the same log, measure how far names depend on the logs that were dealt; a parametric
bootstrap, with the corrected plant as the truth, says how often they would agree if sampling alone made the difference.
"""

from collections.abc import Collection, Sequence
from itertools import combinations

import numpy as np

from .result import Agreement
from .score import Scores
from .select import named, stepwise
from .settings import HALVES_DRAWS, HALVES_SPLITS


def left_out_gain(around: Scores, selected: Collection[str], name: str) -> float:
    """Rise of the log-likelihood of training logs, each left out of the fit in turn, with an effect [nats].

    Parameters
    ----------
    around : Scores
        Of the last fit.
    selected : collection of str
        What the model has beside it.
    name : str
    """
    H, g = around.quadratic.H, around.quadratic.g
    gain = 0.0
    for log in range(len(H)):
        rest = around.of_logs([other for other in range(len(H)) if other != log])
        for model, sign in ((selected, 1.0), ((*selected, name), -1.0)):
            s = rest.minimum(model)[0]
            gain += sign * float(g[log] @ s + 0.5 * s @ H[log] @ s)
    return gain


def halves_agree(around: Scores, selected: Sequence[str]) -> Agreement | None:
    """Compare what disjoint halves of the logs establish; None for a single log.

    Parameters
    ----------
    around : Scores
        Of the last fit.
    selected : sequence of str
        Effects of the corrected plant.
    """
    count = len(around.quadratic.H)
    if count < 2:
        return None
    splits = [half for half in combinations(range(count), count // 2) if 2 * len(half) < count or 0 in half]
    splits = [splits[i] for i in np.linspace(0, len(splits) - 1, min(len(splits), HALVES_SPLITS)).astype(int)]
    truth, rng = around.minimum(selected)[0], np.random.default_rng(0)
    observed = float(np.mean([_index(around, half) for half in splits]))
    expected = np.mean([
        [_index(around.redrawn(truth, rng), half) for half in splits[: max(1, HALVES_SPLITS // 3)]]
        for _ in range(HALVES_DRAWS)
    ])  # fmt: skip
    return Agreement(observed, float(expected), len(splits))


def _index(around: Scores, half: Sequence[int]) -> float:
    """Jaccard index of the families that a half and the rest establish; 1 where neither establishes any."""
    rest = [log for log in range(len(around.quadratic.H)) if log not in half]
    first, second = (named(part, stepwise(part, [], {})) for part in (around.of_logs(half), around.of_logs(rest)))
    return len(first & second) / len(first | second) if first | second else 1.0
