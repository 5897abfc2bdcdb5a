"""One communication step of a unit: equal integration steps under held, delayed and possibly quantised signals.

steps = ceil(H / h_max),    h = H / steps,    state at t_k + i h,    i = 0 .. steps
"""

from math import ceil, floor, isfinite, pi
from typing import NamedTuple

from .motor import remember
from .parameters import PlantParameters
from .plant import delayed_input, measured_angles, rigid_start, step
from .state import PlantState

_ROUNDING = 1e-9  # share of a step by which H may exceed a whole number of longest steps: H has rounding errors


class PlantMemory(NamedTuple):
    """The unit's memory between communication steps; without an input delay the lists are empty."""

    state: PlantState
    since: list[float]  # instants from which voltages were held [s]
    held: list[tuple[float, float]]  # front and rear voltage [V]


class EncoderCounts(NamedTuple):
    """Counts per turn of the three encoders; 0 reads without quantisation."""

    pitch: int = 4096
    elevation: int = 4096
    travel: int = 8192


def quantise(angle: float, counts: int) -> float:
    """Return ``angle`` [rad] rounded to the encoder's grid of 2 pi / ``counts`` [rad]; 0 counts do not round."""
    if counts == 0:
        return angle
    width = 2.0 * pi / counts
    return floor(angle / width + 0.5) * width


def start_memory(first: PlantState, p: PlantParameters) -> PlantMemory:
    """Return the memory at the start; the elevation of ``first`` is what the encoder reads."""
    return PlantMemory(rigid_start(first, p), [], [])


def communicate(
    memory: PlantMemory, v_front: float, v_rear: float, mass_command: float, time: float, start_time: float,
    step_size: float, longest: float, delay: float, p: PlantParameters,
) -> PlantMemory:  # fmt: skip
    """Return the memory after a communication step H = ``step_size`` [s] from ``time`` [s] under held voltages [V].

    ``mass_command`` [m]; ``start_time`` of the record, ``longest`` integration step and input ``delay`` of ``p`` [s].
    """
    state, since, held = memory
    if delay > 0.0:
        since, held = remember(since, held, time, v_front, v_rear, delay)
    steps = max(ceil(step_size / longest - _ROUNDING), 1)
    h = step_size / steps
    record_time = time - start_time
    for k in range(steps):
        if delay > 0.0:
            v_front, v_rear = delayed_input(since, held, len(since) - 1, time + k * h, h, p)
        state = step(state, v_front, v_rear, mass_command, record_time + k * h, h, p)
    return PlantMemory(state, since, held)


def is_finite(state: PlantState) -> bool:
    """Return whether every number of the state is finite."""
    th, ep, la, w1, w2, w3, nu_front, nu_rear, q, w, x, rest = state
    return isfinite(th + ep + la + w1 + w2 + w3 + nu_front + nu_rear + q + w + x + rest)


def read_sensors(state: PlantState, counts: EncoderCounts) -> tuple[float, float, float, float, float, float]:
    """Return the angles [rad] as the encoders read them, and the rates [rad/s]; ``counts`` of 0 round nothing."""
    pitch, elevation, travel = measured_angles(state)
    return (
        quantise(pitch, counts.pitch), quantise(elevation, counts.elevation), quantise(travel, counts.travel),
        state.pitch_rate, state.elevation_rate + state.bending_rate, state.travel_rate,
    )  # fmt: skip
