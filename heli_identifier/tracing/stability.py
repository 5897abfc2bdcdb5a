"""How far a selection depends on the logs that it was made from: logs left out, and halves of them.

All of it is linear algebra on the quadratic forms of whole logs around the last fit. A possible effect enters the
corrected plant if it makes logs likelier that the fit has not seen (leave one log out). Disjoint halves of whole logs
measure how far names depend on the choice of the logs. A parametric bootstrap, with the corrected plant as the truth,
says how often the halves would agree if sampling alone made the difference.
"""

from collections.abc import Collection, Sequence
from itertools import combinations

import numpy as np

from .fit import Fit, covariance
from .rig import Array
from .score import Scores, fall_by, pooled_dispersion
from .select import Selection, established_families, stepwise
from .settings import KEPT


def leave_logs_out(selection: Selection, plant: Fit) -> Array:
    """Return how each log left out moves the plant's coordinates, names chosen anew, shape (L, P); zero for one log.

    sqrt((L - 1)/L) (x_l - mean x) of L logs: the sums of squares are the jackknife's variances over whole logs. They
    contain what differs from log to log beyond the per-log parameters, the choice of effects, and that one log may say
    more than all others. Sources: Efron and Stein, Annals of Statistics 9 (1981) 586; MacKinnon, Nielsen and Webb, J.
    Applied Econometrics 38 (2023) 671 (CV3).
    """
    form, count = selection.form, len(selection.form.quadratic.H)
    if count == 1:
        return np.zeros((1, len(plant.fields)))
    rest = [form.all_but(log) for log in range(count)]
    x = np.array([part.minimum(stepwise(part, []))[0] for part in rest])
    moves, names = np.sqrt((count - 1.0) / count) * (x - x.mean(0)), form.fitted.names
    return np.column_stack([moves[:, names.index(name)] if name in names else np.zeros(count) for name in plant.fields])


def covariance_of_logs(plant: Fit, moves: Array) -> Array:
    """Covariance (P, P) of a plant's coordinates: the likelihood's times the dispersion by :func:`leave_logs_out`."""
    C = covariance(plant)
    base = [i for i, name in enumerate(plant.fields) if name in plant.likelihood.rig.base]
    return C * pooled_dispersion(moves[:, base], np.diag(C)[base])


def left_out_gain(form: Scores, selected: Sequence[str], name: str = "", table: Collection[str] = ()) -> float:
    """Rise of the log-likelihood of training logs, each left out in turn, with an effect or a ``table`` [nats].

    The model has the ``selected`` effects beside it. A log counts only if the others alone would let the effect enter:
    a log that brought it in cannot judge it.
    """
    H, g, gain = form.quadratic.H, form.quadratic.g, 0.0
    for log in range(len(H)):
        rest = form.all_but(log)
        if name and rest.scores(selected, among=[name])[name].score < KEPT:
            continue
        without, _ = rest.without(table).minimum(selected)
        beside, _ = rest.minimum([*selected, name] if name else selected)
        gain += fall_by(H[log], g[log], beside) - fall_by(H[log], g[log], without)
    return gain


def weigh_possible(selection: Selection) -> tuple[dict[str, float], list[str]]:
    """Gain on left-out logs of every possible effect, and the effects that the plant does not take.

    They leave one at a time, the one with the lowest gain first, because some help only beside each other. The plant
    never takes a torque that steps at one instant, as it repeats in no other flight, or a law that is doubtful, as
    something else is more likely. These have no gain.
    """
    possible = [f for f in selection.findings if not f.established and f.effect.fault is None]
    dropped = [f.effect.field for f in possible if f.effect.steps_in_time or f.doubtful]
    judged, gains = [f.effect.field for f in possible if f.effect.field not in dropped], dict[str, float]()
    while judged:
        kept = [name for name in selection.form.selected if name not in dropped]
        for name in judged:
            gains[name] = left_out_gain(selection.form, [other for other in kept if other != name], name)
        worst = min(judged, key=lambda name: gains[name])
        if gains[worst] > 0.0:
            break
        judged.remove(worst)
        dropped.append(worst)
    return gains, dropped


def halves_agree(form: Scores) -> tuple[float, float, int] | None:
    """Compare what disjoint halves of the logs establish, the selected set being the truth; None for a single log.

    Returned are the mean Jaccard index over the splits, what sampling alone allows, and the number of splits. Three
    splits, and five draws of the bootstrap for one of them, give the index to .1.
    """
    count = len(form.quadratic.H)
    if count < 2:
        return None
    splits = [half for half in combinations(range(count), count // 2) if 2 * len(half) < count or 0 in half]
    splits = [splits[i] for i in np.linspace(0, len(splits) - 1, min(len(splits), 3)).astype(int)]
    truth, rng = form.minimum(form.selected)[0], np.random.default_rng(0)
    observed = float(np.mean([_jaccard_index(form, half) for half in splits]))
    expected = np.mean([_jaccard_index(form.redraw(truth, rng), splits[0]) for _ in range(5)])
    return observed, float(expected), len(splits)


def _jaccard_index(form: Scores, half: Sequence[int]) -> float:
    """Jaccard index of the families that a half and the rest establish; 1 where neither establishes any."""
    rest = [log for log in range(len(form.quadratic.H)) if log not in half]
    parts = [form.of_logs(logs) for logs in (half, rest)]
    first, second = (established_families(part, stepwise(part, [])) for part in parts)
    return len(first & second) / len(first | second) if first | second else 1.0
