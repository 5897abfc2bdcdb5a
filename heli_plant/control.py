"""PID on three axes: pitch through v_f - v_r, elevation through v_f + v_r, travel through the pitch reference.

Pitch law of the paper, with gains 8.35, 4.25, 8.76:

    v_f - v_r = -(8.35 (theta - theta_ref) + 4.25 integral + 8.76 theta').

As printed the law has the other sign, which makes the loop unstable (a pole at +2.7 rad/s for k_x > 0).

Angles alone are measured; a rate is the filtered difference (theta - xi) / tau with xi' = (theta - xi) / tau, held
over the control period and advanced exactly. Integrals stop while their output saturates (conditional integration).
"""

from math import exp
from typing import NamedTuple


class AxisGains(NamedTuple):
    """Gains of one axis on error [per rad], integral [per rad s] and rate [per rad/s]."""

    proportional: float
    integral: float
    derivative: float


class PidSettings(NamedTuple):
    """Settings of the three loops.

    The elevation's output is a voltage sum [V] added to ``trim`` [V], the pitch's a voltage difference [V], the
    travel's a pitch reference [rad] clipped to plus or minus ``pitch_limit`` [rad].
    """

    pitch: AxisGains = AxisGains(8.35, 4.25, 8.76)
    elevation: AxisGains = AxisGains(12.0, 6.0, 14.0)
    travel: AxisGains = AxisGains(0.12, 0.0, 0.6)
    travel_enabled: bool = False
    trim: float = 2.4
    pitch_limit: float = 0.5
    rate_time_constant: float = 0.05
    voltage_limit: float = 5.0


class PidState(NamedTuple):
    """Integrals [rad s] and filtered angles [rad] of pitch, elevation, travel."""

    integral_pitch: float
    integral_elevation: float
    integral_travel: float
    filtered_pitch: float
    filtered_elevation: float
    filtered_travel: float


def start_pid(pitch: float, elevation: float, travel: float) -> PidState:
    """State without a history: integrals zero, rates zero."""
    return PidState(0.0, 0.0, 0.0, pitch, elevation, travel)


def clip(value, limit):
    """``value`` clipped to plus or minus ``limit``."""
    return min(max(value, -limit), limit)


def pid_voltages(state, pitch, elevation, travel, references, settings):
    """Return (v_front, v_rear) [V] for angles and ``references`` (pitch, elevation, travel) [rad]."""
    v_front, v_rear, _, _ = _outputs(state, pitch, elevation, travel, references, settings)
    return v_front, v_rear


def _outputs(state, pitch, elevation, travel, references, settings):
    """Voltages [V], the pitch reference in force [rad], and whether each of the three outputs is within its limit."""
    tau = settings.rate_time_constant
    g = settings.travel
    pitch_reference, travel_free = references[0], True
    if settings.travel_enabled:
        # k_y < 0: a positive pitch drives the travel backwards, hence the plus sign on the travel error
        wanted = (
            g.proportional * (travel - references[2])
            + g.integral * state.integral_travel
            + g.derivative * (travel - state.filtered_travel) / tau
        )
        pitch_reference = clip(wanted, settings.pitch_limit)
        travel_free = pitch_reference == wanted
    g = settings.pitch
    difference = -(
        g.proportional * (pitch - pitch_reference)
        + g.integral * state.integral_pitch
        + g.derivative * (pitch - state.filtered_pitch) / tau
    )
    g = settings.elevation
    total = settings.trim - (
        g.proportional * (elevation - references[1])
        + g.integral * state.integral_elevation
        + g.derivative * (elevation - state.filtered_elevation) / tau
    )
    wanted_front, wanted_rear = 0.5 * (total + difference), 0.5 * (total - difference)
    v_front, v_rear = clip(wanted_front, settings.voltage_limit), clip(wanted_rear, settings.voltage_limit)
    free = v_front == wanted_front and v_rear == wanted_rear
    return v_front, v_rear, pitch_reference, (free, free, travel_free)


def pid_step(state, pitch, elevation, travel, references, h, settings):
    """Return (state after ``h`` [s], (v_front, v_rear) [V] held over it).

    Parameters
    ----------
    state : PidState
    pitch, elevation, travel : float
        Measured angles [rad].
    references : tuple of float
        Pitch, elevation, travel [rad]; the pitch's is ignored while the travel loop is on.
    """
    v_front, v_rear, pitch_reference, free = _outputs(state, pitch, elevation, travel, references, settings)
    kept = exp(-h / settings.rate_time_constant)
    errors = (pitch - pitch_reference, elevation - references[1], travel - references[2])
    integrals = [i + h * e if ok else i for i, e, ok in zip(state[:3], errors, free, strict=True)]
    filtered = [a + (f - a) * kept for a, f in zip((pitch, elevation, travel), state[3:], strict=True)]
    return PidState(*integrals, *filtered), (v_front, v_rear)
