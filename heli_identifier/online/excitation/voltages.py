"""Both rotor voltages from one signal on their difference and one on their sum.

    v_f - v_r = u_d(t)              the difference mu_d drives the pitch, eq. (2)
    v_f + v_r = 2 v_0 + u_s(t)      the sum mu_s drives elevation and travel, eqs (10), (12)

with the base voltage v_0 of each rotor [V]. Both voltages are clipped to the amplifier's limit, as the plant's are.
Everything is a function of time alone, so that any state of a simulation is restored by its time.
"""

from dataclasses import dataclass
from typing import Protocol

from heli_plant.motor import saturate

from ...errors import require_positive, require_range


class Signal(Protocol):
    """A pure function of time."""

    def at(self, t: float) -> float:
        """Value [V] at time ``t`` [s]."""
        ...


@dataclass(frozen=True)
class Excitation:
    """What drives both rotors.

    Parameters
    ----------
    base : float
        Voltage v_0 of each rotor [V].
    difference : Signal or None
        u_d on v_f - v_r [V]; none for no excitation of the pitch.
    total : Signal or None
        u_s on v_f + v_r [V]; none for no excitation of elevation and travel.
    limit : float
        Bound of each voltage [V].

    Raises
    ------
    ConfigurationError
        The base is not finite or beyond the limit, or the limit is not positive.
    """

    base: float = 1.0
    difference: Signal | None = None
    total: Signal | None = None
    limit: float = 5.0

    def __post_init__(self) -> None:
        check_bounds(self.base, self.limit)


def check_bounds(base: float, limit: float) -> None:
    """Raise ConfigurationError unless ``base`` [V] lies within plus or minus ``limit`` [V], which is positive."""
    require_positive("excitation.limit", limit, "V")
    require_range("excitation.base", base, "V", -limit, limit)


def voltages(t: float, excitation: Excitation) -> tuple[float, float]:
    """Return (v_front, v_rear) [V] at time ``t`` [s]."""
    difference = excitation.difference.at(t) if excitation.difference is not None else 0.0
    total = excitation.total.at(t) if excitation.total is not None else 0.0
    return combined(excitation.base, difference, total, excitation.limit)


def combined(base: float, difference: float, total: float, limit: float) -> tuple[float, float]:
    """Return (v_front, v_rear) [V] from the base voltage and the signals u_d and u_s [V]."""
    front = base + 0.5 * (total + difference)
    rear = base + 0.5 * (total - difference)
    return saturate(front, limit), saturate(rear, limit)
