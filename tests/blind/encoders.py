"""Encoders: 4096, 4096 and 8192 counts per turn; the edges of the lines shake by a quarter of a count.

The shake is what measured logs of this kind show: second differences of the counts of a moving axis have a standard
deviation of .93, against .71 for ideal lines (6 (1/12 + s^2) = .93^2 gives s = .25).
"""

import numpy as np
from numpy.typing import NDArray

COUNTS_PER_TURN = np.array([4096, 4096, 8192])
"""Pitch, elevation, travel."""


def read(angles: NDArray[np.float64], shake: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Angles as the encoders give them.

    Parameters
    ----------
    angles, shape (n, 3)
        Pitch, elevation and travel [rad].
    shake
        Standard deviation of the position of a line [counts].
    rng
        Source of the shake.

    Returns
    -------
    ndarray, shape (n, 3)
        Whole counts, in radians.
    """
    resolution = 2 * np.pi / COUNTS_PER_TURN
    counts = np.round(angles / resolution + shake * rng.standard_normal(angles.shape))
    return resolution * counts
