"""Angles that jump by whole turns between samples, as a logger that folds them into one turn writes them."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import LogError

_TURN = 2.0 * np.pi
# Half a turn from one sample to the next is 157 rad/s at the lowest rate; the rig moves at a few.
_JUMP = np.pi
# What the rig itself moves during the jump: half a radian is 25 rad/s at the lowest rate.
_OFF_TURN = 0.5


def unwrapped(
    angle: NDArray[np.float64], signal: str, place: Callable[[int], str]
) -> tuple[NDArray[np.float64], str | None]:
    """Take jumps of whole turns out of an angle.

    Parameters
    ----------
    angle : NDArray, shape (N,)
        Samples [rad].
    signal : str
        Name of the angle for messages.
    place : Callable[[int], str]
        Names the row of a sample.

    Returns
    -------
    angle : NDArray, shape (N,)
        Without the jumps [rad].
    note : str or None
        What was done, if anything.

    Raises
    ------
    LogError
        If the angle jumps by more than half a turn that is no whole number of turns: the encoder or the logger failed.
    """
    jumps = np.diff(angle)
    large = np.abs(jumps) > _JUMP
    if not large.any():
        return angle, None
    off_turn = np.abs(jumps - _TURN * np.round(jumps / _TURN))
    broken = large & (off_turn > _OFF_TURN)
    if broken.any():
        at = int(broken.argmax())
        raise LogError(
            f"{place(at + 1)}: {signal} jumps by {jumps[at]:.3g} rad from the row before, which no rig can; mend the "
            "value or cut the log there with --from and --to."
        )
    return np.unwrap(angle), f"{signal} unwrapped at {large.sum()} jumps of whole turns"
