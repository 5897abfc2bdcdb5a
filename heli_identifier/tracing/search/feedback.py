"""Does a controller close the loop? The correlation of innovations with the voltages that come after them.

An innovation is what nothing before it can tell. In open loop no later voltage depends on it; under a controller the
next ones do. With z_k the whitened innovation of an axis, v_k the voltages that drive it (the rotors' difference for
pitch and travel, their sum for the elevation) averaged over the same 40 ms, and b the seconds of the records,

    s_b = sum of z_k (v_(k+1) - v_k) over b,    score = sum_b s_b / sqrt(sum_b s_b^2).

Differences leave out slow changes. In open loop the s_b are independent of zero mean and the score is roughly normal.
Source: Soderstrom and Stoica, System Identification, 1989, section 11.2 (independence of residuals and inputs).
"""

import numpy as np

from heli_identifier.tracing.prediction.fit import Fit
from heli_identifier.tracing.prediction.problem import REDUCED_RATE

DRIVES = np.array(((1.0, -1.0), (1.0, 1.0), (1.0, -1.0)))
"""What drives pitch, elevation and travel: weights of front and rear voltage."""


def feedback_score(fit: Fit) -> float:
    """Largest score of the three axes, whatever its sign."""
    problem, order, width = fit.problem, fit.whitener.order, round(REDUCED_RATE)
    white, scores = fit.white.reshape(3, -1), []
    voltages = [problem.reduce(record, record.voltages)[order:] for record in problem.records]
    ends = np.cumsum([len(v) for v in voltages])[:-1]
    for z, drive in zip(white, DRIVES, strict=True):
        sums: list[float] = []
        for of_record, v in zip(np.split(z, ends), voltages, strict=True):
            products = of_record[:-1] * np.diff(v @ drive)
            sums += [float(products[i : i + width].sum()) for i in range(0, len(products), width)]
        total = float(np.sqrt(np.square(sums).sum()))
        scores.append(abs(sum(sums)) / total if total > 0.0 else 0.0)
    return max(scores)
