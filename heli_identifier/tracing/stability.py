"""How far a selection depends on the logs that it was made from: structure left open, logs left out, halves of them.

All of it is linear algebra on the quadratic forms of whole logs around the last fit. A possible effect enters the
delivered plant where logs get likelier with it that the fit has not seen (leave one log out). Halves of whole logs,
disjoint and never pieces of the same log, measure how far names depend on the logs that were dealt; a parametric
bootstrap, with the corrected plant as the truth, says how often they would agree if sampling alone made the difference.
"""

from collections.abc import Collection, Sequence
from itertools import combinations

import numpy as np
from scipy.special import expit

from .fit import Fit
from .rig import Array, Effect
from .score import Scores, fall_by
from .select import Selection, established_families, stepwise
from .settings import HALVES_DRAWS, HALVES_SPLITS, KEPT
from .statements import Agreement


def open_structure(selection: Selection, plant: Fit) -> list[tuple[Effect, Array]]:
    r"""Give how far a plant's coordinates (P,) may lie off by each effect that the logs leave open.

        sqrt(p_j (1 - p_j)) delta_j,    p_j = 1/(1 + exp(T_j - S_j))

    delta_j is how far they move where effect j enters or leaves, or gives its place to a rival; p_j is the probability
    that it is there, S_j its score and T_j that of entry or of the rival; each family enters once. The squares are
    variances: an interval under one structure misses what a gain and an effect that is hardly seen share. Source:
    Hoeting, Madigan, Raftery and Volinsky, Statistical Science 14 (1999) 382, eq. (3) (Bayesian model averaging), the
    effects apart.
    """
    around, chosen = selection.last, selection.last.selected
    here, found = around.minimum(chosen)[0], list[tuple[Effect, Array]]()
    columns = [around.fitted.names.index(name) if name in around.fitted.names else None for name in plant.fields]

    def leave_open(effect: Effect, nats: float, other: Sequence[str]) -> None:
        p, moved = expit(nats), around.minimum(other)[0] - here
        moves = np.array([0.0 if j is None else moved[j] for j in columns])
        found.append((effect, np.sqrt(p * (1.0 - p)) * moves))

    for finding in selection.findings:
        name, own = finding.effect.field, finding.score.score
        rest = [other for other in chosen if other != name]
        leave_open(finding.effect, own - around.entry_score(name), rest)
        for rival in finding.alternatives[:1]:
            other = around.scores(rest, among=[rival.field])[rival.field].score
            leave_open(rival, own - other, [*rest, rival.field])
    seen = {finding.effect.family for finding in selection.findings}
    for name, score in sorted(selection.scores.items(), key=lambda item: -item[1].score):
        effect = around.effects[name]
        if effect.family not in seen and name not in plant.fields and score.score > 0.0:
            seen.add(effect.family)
            leave_open(effect, score.score - around.entry_score(name), [*chosen, name])
    return found


def left_out_gain(around: Scores, selected: Sequence[str], name: str = "", table: Collection[str] = ()) -> float:
    """Rise of the log-likelihood of training logs, each left out in turn, with an effect or a ``table`` [nats].

    The model has the ``selected`` beside it. Where the other logs do not ask for the effect, it goes without: the log
    itself has brought it in, and cannot say what it is worth.
    """
    H, g = around.quadratic.H, around.quadratic.g
    gain = 0.0
    for log in range(len(H)):
        rest = around.all_but(log)
        if name and rest.scores(selected, among=[name])[name].score < KEPT:
            continue
        without, _ = rest.without(table).minimum(selected)
        beside, _ = rest.minimum([*selected, name] if name else selected)
        gain += fall_by(H[log], g[log], beside) - fall_by(H[log], g[log], without)
    return gain


def halves_agree(around: Scores) -> Agreement | None:
    """Compare what disjoint halves of the logs establish, the selected set being the truth; None for a single log."""
    count = len(around.quadratic.H)
    if count < 2:
        return None
    splits = [half for half in combinations(range(count), count // 2) if 2 * len(half) < count or 0 in half]
    splits = [splits[i] for i in np.linspace(0, len(splits) - 1, min(len(splits), HALVES_SPLITS)).astype(int)]
    truth, rng = around.minimum(around.selected)[0], np.random.default_rng(0)
    observed = float(np.mean([_index(around, half) for half in splits]))
    expected = np.mean([
        [_index(around.redraw(truth, rng), half) for half in splits[: max(1, HALVES_SPLITS // 3)]]
        for _ in range(HALVES_DRAWS)
    ])  # fmt: skip
    return Agreement(observed, float(expected), len(splits))


def _index(around: Scores, half: Sequence[int]) -> float:
    """Jaccard index of the families that a half and the rest establish; 1 where neither establishes any."""
    rest = [log for log in range(len(around.quadratic.H)) if log not in half]
    parts = [around.of_logs(logs) for logs in (half, rest)]
    first, second = (established_families(part, stepwise(part, [])) for part in parts)
    return len(first & second) / len(first | second) if first | second else 1.0
