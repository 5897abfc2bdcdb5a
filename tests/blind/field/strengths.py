"""Which effects a field rig may hold beside those that every rig has, and how strong they are.

The ranges are those found on measured rigs of one make where there are such figures (friction, constant torque of the
travel, pitch torque by travel rate, lag), and otherwise lie about the strengths of the open-loop battery.
"""

from collections.abc import Mapping
from types import MappingProxyType

from tests.blind.rigs import AXES

_P, _E, _T, _R = (*AXES, "rotors")

Range = tuple[float, float]

STRENGTHS: Mapping[str, tuple[tuple[tuple[str, Range], ...], ...]] = MappingProxyType(
    {
        # One inner tuple is what acts together; of several, one is drawn.
        "dry_friction": (((_P, (0.05, 0.20)),), ((_E, (0.01, 0.03)),), ((_T, (0.01, 0.04)),)),
        "quadratic_thrust": (((_R, (0.03, 0.15)),),),
        "rotor_drag_torque": (((_T, (0.008, 0.02)),),),
        "constant_torque": (((_T, (0.05, 0.12)),),),
        "cable_stiffness": (((_T, (0.004, 0.012)),),),
        "rotor_mismatch": (((_P, (0.006, 0.02)),),),
        "input_delay": (((_R, (0.02, 0.08)),),),
        "speed_stability": (((_P, (0.2, 0.9)),),),
        "quadratic_drag": (((_P, (0.2, 0.6)),), ((_E, (0.4, 1.0)),), ((_T, (0.04, 0.12)),)),
        "gyroscopic_coupling": (((_P, (0.03, 0.08)), (_E, (0.015, 0.04))),),
        "airspeed_thrust_loss": (((_P, (0.02, 0.06)), (_E, (0.02, 0.06))),),
    }
)
"""In the catalogue's units; `speed_stability` is the pitch torque c lambda', c in 1/s."""

EITHER_SIGN = frozenset({"rotor_mismatch", "constant_torque", "rotor_drag_torque"})
"""Effects whose sign is drawn; that of `speed_stability` is the same on all rigs that were measured."""

MOST = 3
"""Largest number of effects that a rig of mixed kind holds beside those that every rig has."""
