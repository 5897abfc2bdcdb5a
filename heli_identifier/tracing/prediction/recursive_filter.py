"""Linear filters over records: y_n = sum_i b_i x_(n-i) - sum_(i>0) a_i y_(n-i), in the transposed direct form II.

`scipy.signal.lfilter` does the same to the bit; it is not used, since its package takes half a second to import, and
since it goes through a table column by column, which is slower than row by row.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heli_plant.compiled import compiled, read_only


def _filter(b, a, signal, memory, out):
    """Fill ``out`` (N, k) from ``signal`` (N, k); ``memory`` (p + 1, k) holds zeros at first, b and a have p + 1."""
    order = len(memory) - 1
    for n in range(len(signal)):
        for j in range(signal.shape[1]):
            out[n, j] = memory[0, j] + b[0] * signal[n, j]
        for i in range(order):
            for j in range(signal.shape[1]):
                memory[i, j] = memory[i + 1, j] + signal[n, j] * b[i + 1] - out[n, j] * a[i + 1]


def filtered(numerator: ArrayLike, denominator: ArrayLike, signal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Signal (N, ...) through a filter that begins at rest.

    Parameters
    ----------
    numerator, denominator : array_like, shapes (m,) and (n,)
        b and a in powers of z^-1; a begins with 1.
    signal : NDArray, shape (N, ...)
    """
    taps = [np.asarray(given, dtype=float) for given in (numerator, denominator)]
    longest = max(map(len, taps))
    b, a = (read_only(np.pad(one, (0, longest - len(one)))) for one in taps)
    columns = read_only(signal.reshape(len(signal), -1))
    out = np.empty(columns.shape)
    compiled(_filter)(b, a, columns, np.zeros((longest, columns.shape[1])), out)
    return out.reshape(signal.shape)
