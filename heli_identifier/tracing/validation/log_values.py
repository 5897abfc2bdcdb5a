"""What one log has of its own under the corrected plant, as a value."""

from collections.abc import Mapping
from dataclasses import dataclass

from heli_identifier.online import Estimate


@dataclass(frozen=True)
class LogValues:
    """What one log has of its own.

    Attributes
    ----------
    log : str
        Its name.
    offsets : mapping of str to Estimate
        ``pitch_torque``, ``elevation_torque``, ``travel_torque`` [rad/s^2], and ``pitch_zero`` [rad] of the encoder.
    gain : Estimate
        Relative change [1] of the three gains against the plant's.
    belongs : bool
    why : str
        What is wrong with a log that does not belong.
    """

    log: str
    offsets: Mapping[str, Estimate]
    gain: Estimate
    belongs: bool = True
    why: str = ""
