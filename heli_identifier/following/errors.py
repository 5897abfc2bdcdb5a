"""Squared errors of 1 s predictions, and whether one twin's are smaller than another's."""

from math import sqrt

Row = tuple[float, float, float]
"""Errors of pitch, elevation and travel [rad]."""

_BATCH = 5
"""Comparisons in a batch, 1 s: errors 1 s ahead that overlap are correlated."""


def rms(rows: tuple[Row, ...]) -> Row:
    """Return the rms error of each axis [rad]; zero without rows."""
    if not rows:
        return 0.0, 0.0, 0.0
    a = b = c = 0.0
    for e1, e2, e3 in rows:
        a += e1 * e1
        b += e2 * e2
        c += e3 * e3
    n = len(rows)
    return sqrt(a / n), sqrt(b / n), sqrt(c / n)


def compared(rivals: tuple[Row, ...], used: tuple[Row, ...], axes: tuple[int, ...]) -> tuple[float, float]:
    """Return how much larger the rival's squared errors are, as a share of those in use, and t of this difference.

    On every axis the squares are divided by the mean square in use; the mean over ``axes`` is taken. t comes from the
    scatter of batches of 1 s. Negative: the rival predicts better.
    """
    count = len(used)
    batches = count // _BATCH
    if batches < 2:
        return 0.0, 0.0
    first = count - batches * _BATCH
    means: list[float] = []
    scales = [1.0, 1.0, 1.0]
    for axis in axes:
        total = 1e-12
        for i in range(first, count):
            total += used[i][axis] * used[i][axis]
        scales[axis] = (count - first) / total
    for batch in range(batches):
        total = 0.0
        for i in range(first + batch * _BATCH, first + (batch + 1) * _BATCH):
            for axis in axes:
                a, b = rivals[i][axis], used[i][axis]
                total += scales[axis] * (a * a - b * b)
        means.append(total / (_BATCH * len(axes)))
    mean = 0.0
    for value in means:
        mean += value / batches
    square = 0.0
    for value in means:
        square += (value - mean) * (value - mean)
    error = sqrt(square / (batches * (batches - 1)))
    return mean, mean / error if error > 0.0 else 0.0
