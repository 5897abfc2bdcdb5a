"""An autoregression by Burg's method.

With f and b the forward and backward prediction errors of order m, the next reflection coefficient is

    k = 2 sum_n f(n) b(n - 1) / sum_n (f(n)^2 + b(n - 1)^2).

All poles lie within the unit circle. Source: Burg 1967; Kay, Modern Spectral Estimation, 1988, section 7.5.
"""

import numpy as np
from numpy.typing import NDArray


def burg(signal: NDArray[np.float64], order: int) -> NDArray[np.float64]:
    """Fit an autoregression.

    Parameters
    ----------
    signal : NDArray, shape (n,)
        Of zero mean, longer than ``order``.
    order : int

    Returns
    -------
    taps : NDArray, shape (order + 1,)
        Prediction-error filter 1, a_1, ..., in powers of z^-1.
    """
    taps, ahead, behind = np.ones(1), signal, signal
    for _ in range(order):
        f, b = ahead[1:], behind[:-1]
        power = float(f @ f + b @ b)
        k = 2.0 * float(f @ b) / power if power > 0.0 else 0.0
        longer = np.append(taps, 0.0)
        taps = longer - k * longer[::-1]
        ahead, behind = f - k * b, b - k * f
    return taps
