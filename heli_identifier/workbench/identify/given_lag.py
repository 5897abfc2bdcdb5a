"""What a given motor lag means for the parameters: how far each moves if the lag is another one.

The paper's adaptation takes the motors' lag T_m for known. Nobody knows it of a real rig, and no standard error covers
a wrong one. The logs are therefore identified once more with T_m + ``MOVED``; the differences are the sensitivities,
which are nearly linear up to some hundredths of a second. (Prediction errors estimate the lag along instead.)
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from heli_identifier.online import Estimate, IdentifierSettings
from heli_identifier.records import Log
from heli_identifier.workbench.identify.identification import combined, identify_log

MOVED = 0.01
"""By how much the lag is moved [s]."""

LEAST = 0.01
"""Relative change of a parameter from which on it is worth a word."""


@dataclass(frozen=True)
class GivenLag:
    """The ``lag`` that was given [s], and the relative change of parameters by symbol with one longer by ``MOVED``."""

    lag: float
    changes: Mapping[str, float]

    @property
    def sentence(self) -> str:
        """What to keep in mind."""
        moved = [f"{name} by {100.0 * change:+.1f} %" for name, change in self.changes.items() if abs(change) >= LEAST]
        effect = f"the estimates change, {', '.join(moved)}" if moved else f"no estimate changes by {100.0 * LEAST:g} %"
        return (
            f"the motors' lag was taken for {self.lag:g} s, which the intervals do not allow for: "
            f"with a lag longer by {MOVED:g} s {effect}"
        )


def effect_of_lag(
    logs: Sequence[Log], settings: Sequence[IdentifierSettings], found: Mapping[str, Estimate]
) -> GivenLag:
    """Return what a longer lag changes.

    Parameters
    ----------
    logs : sequence of Log
    settings : sequence of IdentifierSettings
        Of every log, those that gave ``found``.
    found : mapping of Estimate
        Estimates of all logs together, by symbol. Of those that are not determined nothing is said.
    """
    lag = settings[0].motor_time_constant
    moved = [
        identify_log(log, replace(own, motor_time_constant=lag + MOVED))
        for log, own in zip(logs, settings, strict=True)
    ]
    others = combined(moved).estimates
    changes = {
        name: others[name].value / estimate.value - 1.0
        for name, estimate in found.items()
        if estimate.is_determined and estimate.standard_error is not None and estimate.value != 0.0
    }
    return GivenLag(lag, changes)
