"""What the response of the angles to the voltages says against a log's columns and signs.

The signs of two gains are known of every rig that works: a larger front voltage raises the pitch, a larger sum raises
the elevation. Over 71 logs of ten rigs, most of them in closed loop, the score of the first was never below -0.9 and
that of the second never below -3.2 with the right columns.
"""

import numpy as np

from heli_identifier.records.assignment import responses
from heli_identifier.records.log import Log
from heli_identifier.records.response import coarse
from heli_identifier.records.units import ANGLES, VOLTAGES

PITCH_SURE, ELEVATION_SURE = 3.5, 6.0
"""Scores below minus which a gain is beyond doubt of the wrong sign."""

SHOWN = 2.0
"""Score from which a log shows that an angle follows its voltage."""

_SHORTEST = 50
"""Samples of the coarse record below which nothing is said."""


def suspicions(log: Log) -> tuple[str, ...]:
    """Give what is probably wrong with a log's columns or signs, one sentence each."""
    voltages, step = coarse(log.voltages, log.rate_hz)
    values = np.column_stack((voltages, coarse(log.angles, log.rate_hz)[0]))
    if len(values) < _SHORTEST:
        return ()
    pitch, elevation, _ = responses(values, step, {name: i for i, name in enumerate((*VOLTAGES, *ANGLES))})
    advice = "`heli init LOG` looks into a log and writes a heli.toml with the columns and signs that fit"
    found = []
    if pitch.score < -PITCH_SURE:
        found.append(
            f"WRONG SIGN: the pitch falls where v_front exceeds v_rear, by {-pitch.value:.2g} rad/s^2/V; look at the "
            f"sign of pitch and at swap_rotors: {advice}"
        )
    if elevation.score < -ELEVATION_SURE:
        found.append(
            f"WRONG SIGN: the elevation falls where the voltages rise, by {-elevation.value:.2g} rad/s^2/V; look at "
            f"the sign of elevation and at the columns of the voltages: {advice}"
        )
    if not found and pitch.score < SHOWN and elevation.score < SHOWN:
        found.append(
            "neither the pitch nor the elevation is seen to follow the voltages: these are not the voltages of this "
            f"log, or it is too calm to show it: {advice}"
        )
    return tuple(found)
