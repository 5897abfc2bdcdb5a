"""How far a selection depends on the logs that it was made from: structure left open, logs left out, halves of them.

All of it is linear algebra on the quadratic forms of whole logs around the last fit. A possible effect enters the
delivered plant if it makes logs likelier that the fit has not seen (leave one log out). Disjoint halves of whole logs
measure how far names depend on the choice of the logs. A parametric bootstrap, with the corrected plant as the truth,
says how often the halves would agree if sampling alone made the difference.
"""

from collections.abc import Collection, Sequence
from itertools import combinations

import numpy as np
from scipy.special import expit

from .fit import Fit
from .rig import Array, Effect
from .score import Scores, fall_by
from .select import Selection, established_families, stepwise
from .settings import KEPT
from .statements import Agreement


def open_structure(selection: Selection, plant: Fit) -> list[tuple[Effect, Array]]:
    r"""Return how far a plant's coordinates (P,) may lie off because of each effect that the logs leave open.

        sqrt(p_j (1 - p_j)) delta_j,    p_j = 1/(1 + exp(T_j - S_j))

    delta_j is how far they move if effect j enters or leaves, or is replaced by a rival; p_j is the probability that it
    is there, S_j its score, and T_j the score of entry or that of the rival. Each family enters once. The squares are
    variances that an interval under one structure does not contain. Source:
    Hoeting, Madigan, Raftery and Volinsky, Statistical Science 14 (1999) 382, eq. (3) (Bayesian model averaging), the
    effects apart.
    """
    form, chosen = selection.form, selection.form.selected
    here, moves_of = form.minimum(chosen)[0], list[tuple[Effect, Array]]()
    columns = [form.fitted.names.index(name) if name in form.fitted.names else None for name in plant.fields]

    def leave_open(effect: Effect, nats: float, other: Sequence[str]) -> None:
        p, delta = expit(nats), form.minimum(other)[0] - here
        moves = np.array([0.0 if j is None else delta[j] for j in columns])
        moves_of.append((effect, np.sqrt(p * (1.0 - p)) * moves))

    for finding in selection.findings:
        name, score = finding.effect.field, finding.score.score
        rest = [other for other in chosen if other != name]
        leave_open(finding.effect, score - form.entry_score(name), rest)
        for rival in finding.alternatives[:1]:
            its = form.scores(rest, among=[rival.field])[rival.field].score
            leave_open(rival, score - its, [*rest, rival.field])
    seen = {finding.effect.family for finding in selection.findings}
    for name, outside in sorted(selection.scores.items(), key=lambda item: -item[1].score):
        effect = form.effects[name]
        if effect.family not in seen and name not in plant.fields and outside.score > 0.0:
            seen.add(effect.family)
            leave_open(effect, outside.score - form.entry_score(name), [*chosen, name])
    return moves_of


def left_out_gain(form: Scores, selected: Sequence[str], name: str = "", table: Collection[str] = ()) -> float:
    """Rise of the log-likelihood of training logs, each left out in turn, with an effect or a ``table`` [nats].

    The model has the ``selected`` effects beside it. A log counts only if the others alone would let the effect enter:
    a log that brought it in cannot judge it.
    """
    H, g = form.quadratic.H, form.quadratic.g
    gain = 0.0
    for log in range(len(H)):
        rest = form.all_but(log)
        if name and rest.scores(selected, among=[name])[name].score < KEPT:
            continue
        without, _ = rest.without(table).minimum(selected)
        beside, _ = rest.minimum([*selected, name] if name else selected)
        gain += fall_by(H[log], g[log], beside) - fall_by(H[log], g[log], without)
    return gain


def halves_agree(form: Scores) -> Agreement | None:
    """Compare what disjoint halves of the logs establish, the selected set being the truth; None for a single log.

    Three splits, and five draws of the bootstrap for one of them, give the index to .1.
    """
    count = len(form.quadratic.H)
    if count < 2:
        return None
    splits = [half for half in combinations(range(count), count // 2) if 2 * len(half) < count or 0 in half]
    splits = [splits[i] for i in np.linspace(0, len(splits) - 1, min(len(splits), 3)).astype(int)]
    truth, rng = form.minimum(form.selected)[0], np.random.default_rng(0)
    observed = float(np.mean([_jaccard_index(form, half) for half in splits]))
    expected = np.mean([_jaccard_index(form.redraw(truth, rng), splits[0]) for _ in range(5)])
    return Agreement(observed, float(expected), len(splits))


def _jaccard_index(form: Scores, half: Sequence[int]) -> float:
    """Jaccard index of the families that a half and the rest establish; 1 where neither establishes any."""
    rest = [log for log in range(len(form.quadratic.H)) if log not in half]
    parts = [form.of_logs(logs) for logs in (half, rest)]
    first, second = (established_families(part, stepwise(part, [])) for part in parts)
    return len(first & second) / len(first | second) if first | second else 1.0
