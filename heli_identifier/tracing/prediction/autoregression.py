"""An autoregression of several records by Burg's method.

With f_i and b_i the forward and backward prediction errors of order m in record i, the next reflection coefficient is

    k = 2 sum_i sum_n f_i(n) b_i(n - 1) / sum_i sum_n (f_i(n)^2 + b_i(n - 1)^2).

Sums run inside the records, so that none of them is predicted from another one's end. All poles lie within the unit
circle. Source: Burg 1967; de Waele and Broersen 2000 (several records).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def burg(signals: Sequence[NDArray[np.float64]], order: int) -> tuple[NDArray[np.float64], float]:
    """Fit one autoregression to records of zero mean.

    Parameters
    ----------
    signals : sequence of NDArray, shape (n_i,)
        Each longer than ``order``.
    order : int

    Returns
    -------
    taps : NDArray, shape (order + 1,)
        Prediction-error filter 1, a_1, ..., in powers of z^-1.
    variance : float
        Of what the filter leaves, in the signals' unit squared.
    """
    taps = np.ones(1)
    variance = sum(float(s @ s) for s in signals) / sum(len(s) for s in signals)
    ahead, behind = list(signals), list(signals)
    for _ in range(order):
        pairs = [(f[1:], b[:-1]) for f, b in zip(ahead, behind, strict=True)]
        power = sum(float(f @ f + b @ b) for f, b in pairs)
        k = 2.0 * sum(float(f @ b) for f, b in pairs) / power if power > 0.0 else 0.0
        longer = np.append(taps, 0.0)
        taps = longer - k * longer[::-1]
        variance *= 1.0 - k * k
        ahead, behind = [f - k * b for f, b in pairs], [b - k * f for f, b in pairs]
    return taps, variance
