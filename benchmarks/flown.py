"""Generated rigs in flight, with their truth: what the on-line identifier and the twin that follows are judged by.

The physics are those of the blind battery (:mod:`tests.blind`), which share nothing with the packages that are judged:
Moreau's midpoint rule, dry friction that sticks, Ornstein-Uhlenbeck torques on every axis, encoders of 4096 counts
whose lines shake by a quarter count. Every second rig, or half of them, has the paper's coefficients, the others each
within 20 % of them. Each hovers at an elevation and a thrust of its own, under a controller of pitch and elevation (PID
or state feedback on filtered rates, tuned by poles with gains known to ten percent), while a joystick moves the
references in steps. In open loop a rig flies multisines on the sum and the difference of the voltages.

A rig for the identifier flies five logs (:func:`closed_loop_rig`). A rig for the twin changes in :func:`flight`: a
sequence of stages, each with coefficients of its own and shares of thrust of the two rotors; between two stages
everything changes at once, or along a straight line in time where ``slow`` is given.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heli_identifier.records import Log
from tests.blind.coefficients import Coefficients
from tests.blind.plant import STEP, V_MAX, Changes, Control, fly, placed, room_torque
from tests.blind.rigs import draw_base
from tests.blind.signals import joystick

Array = NDArray[np.float64]
TORQUE_STD, TORQUE_TIME, SHAKE = 0.012, 1.0, 0.25
"""Random torque [rad/s^2], its correlation time [s], shake of the encoders' lines [counts]."""

_LEAD = 6.0
"""A flight begins this much before its log does [s]."""

_HOVER, _THRUST = (-0.2, 0.4), (4.4, 6.4)
_PITCH_POLES, _ELEVATION_POLES, _DAMPING = (1.6, 2.5), (1.9, 2.6), (0.65, 0.9)
_GAIN_ERROR = (0.9, 1.1)
_RATE_BANDWIDTH = (18.0, 35.0)


class Rig(NamedTuple):
    """A rig before it changes: coefficients, controller and hover (elevation [rad], mu_s [V])."""

    coefficients: Coefficients
    control: Control
    hover: tuple[float, float]


def draw_rig(rng: np.random.Generator, like_paper: bool | None = None, lag: float | None = None) -> Rig:
    """Return a rig; every second one has the paper's coefficients if it is not said which."""
    base = Coefficients() if (rng.random() < 0.5 if like_paper is None else like_paper) else draw_base(rng)
    hover = float(rng.uniform(*_HOVER)), float(rng.uniform(*_THRUST))
    theta0 = float(rng.uniform(-0.14, 0.06))
    base = base._replace(
        theta0=theta0, a_1=base.k_z * hover[1] - base.a_e * hover[0], t_m=base.t_m if lag is None else lag
    )
    return Rig(base, _tuned(base, hover, rng), hover)


def _tuned(base: Coefficients, hover: tuple[float, float], rng: np.random.Generator) -> Control:
    """Loops by poles, no faster than the motors and the rate filter allow."""
    bandwidth = rng.uniform(*_RATE_BANDWIDTH)
    fastest = 0.42 / (base.t_m + 1.0 / bandwidth)
    omega_p, omega_e = (min(rng.uniform(*poles), fastest) for poles in (_PITCH_POLES, _ELEVATION_POLES))
    zeta = rng.uniform(*_DAMPING)
    k_x, k_z = base.k_x * rng.uniform(*_GAIN_ERROR), base.k_z * rng.uniform(*_GAIN_ERROR)
    control = placed(base, k_x, k_z, omega_p, zeta, omega_e, zeta, rng.random() < 0.5)
    return control._replace(mu_s0=hover[1] * rng.uniform(0.98, 1.02), rate_bandwidth=bandwidth)


def _recorded(
    rig: Rig, p: Coefficients, voltages: Array, references: Array, at: Array, rate: float, noise: float, columns: int,
    rng: np.random.Generator, control: Control | None, changes: Changes | None = None,
) -> Array:  # fmt: skip
    """Fly; give voltages [V] and angles as they are read [rad], (N, 5), from behind the lead on."""
    at = at + np.append(rng.uniform(-0.03, 0.03, 2), 0.0)
    lead, n = round(_LEAD * rate), len(voltages)
    # Of the six columns of older rigs three were a torque of the air: the published rigs have these numbers.
    normal = rng.standard_normal((n * round(1.0 / rate / STEP) + 1, columns))[:, :3]
    read, _, _, used = fly(
        voltages, at, p, room_torque(normal, noise * TORQUE_STD, TORQUE_TIME), SHAKE * rng.standard_normal((n, 3)),
        control=control, references=references, hover=rig.hover[0], rate=rate, lead=lead, changes=changes,
    )  # fmt: skip
    return np.column_stack([used, read])[lead:]


# --- logs of one rig ---------------------------------------------------------------------------------------------

LOGS, DURATIONS = 5, (22.0, 40.0)


class ClosedLoopRig(NamedTuple):
    """A rig with the logs flown on it."""

    truth: Coefficients
    logs: tuple[Log, ...]


def closed_loop_rig(
    seed: int,
    like_paper: bool,
    rate: float = 100.0,
    noise: float = 1.0,
    lag: float = 0.08,
    durations: tuple[float, float] = DURATIONS,
    quiet_from: float | None = None,
) -> ClosedLoopRig:
    """Return a rig with the coefficients of Table 2, or each within 20 % of them, and five logs.

    ``rate`` is that of samples and controller [Hz], ``noise`` scales the random torque, ``lag`` is the motors' [s],
    ``durations`` are the shortest and longest log [s]; from ``quiet_from`` [s] of a log on nobody moves the joystick.
    """
    rng = np.random.default_rng([13, seed])
    rig = draw_rig(rng, like_paper, lag)
    truth, at, logs = rig.coefficients, np.array([0.0, rig.hover[0], 0.0]), []
    for number in range(LOGS):
        samples = round((_LEAD + rng.uniform(*durations)) * rate)
        references = joystick(samples, rate, 1.0, False, rng)
        if quiet_from is not None:
            references[round((_LEAD + quiet_from) * rate) :] = 0.0
        voltages = np.full((samples, 2), rig.control.mu_s0 / 2)
        flown = _recorded(rig, truth, voltages, references, at, rate, noise, 6, rng, rig.control)
        logs.append(Log(f"log{number}", rate, flown[:, :2], flown[:, 2:].round(6)))
    return ClosedLoopRig(truth, tuple(logs))


def closed_loop_rigs(seed: int, **settings: Any) -> list[ClosedLoopRig]:
    """Return six rigs with the paper's coefficients and six drawn around them; ``settings`` as for one rig."""
    return [closed_loop_rig(100 * seed + number, number < 6, **settings) for number in range(12)]


# --- rigs that change in flight ----------------------------------------------------------------------------------

RATE = 100.0
"""Samples in a second."""

_OPEN_SUM, _OPEN_DIFFERENCE = 0.8, 0.35
"""Standard deviation of the voltages' sum and difference in open loop [V]."""

_LINES = np.array([0.05, 0.08, 0.12, 0.17, 0.26, 0.4, 0.6, 0.9, 1.4])
"""Frequencies in open loop, before they are spread at random [Hz]."""

_APART = np.array([0.05, 0.08, 0.26, 0.4, 0.6, 0.9, 1.4])
"""The same for the difference of the voltages: none near .13 Hz, where the pitch has a resonance 13 times the static
gain, and the rig would turn over."""


class Stage(NamedTuple):
    """What a rig is from ``start`` [s] of its record on.

    ``shares`` of thrust, front and rear [1]; ``slow``: the time that the change to this stage takes [s].
    """

    start: float
    coefficients: Coefficients
    shares: tuple[float, float] = (1.0, 1.0)
    slow: float = 0.0


_SLOW_STEPS = 40
"""Pieces that a slow change is made of."""


def flight(rig: Rig, stages: Sequence[Stage], duration: float, closed: bool, rng: np.random.Generator) -> Array:
    """Fly a rig through ``stages`` (the first begins at 0) for ``duration`` [s].

    Returns the record (N, 5), voltages [V] and angles [rad] as they are read, every 10 ms.
    """
    n = round((_LEAD + duration) * RATE)
    references, base = joystick(n, RATE, 1.0, False, rng), stages[0].coefficients
    voltages, at = np.full((n, 2), rig.control.mu_s0 / 2), np.array([0.0, rig.hover[0], 0.0])
    if not closed:
        trim = base.a_th * math.sin(0.0 - base.theta0) / base.k_x
        total = rig.hover[1] * 0.6 + _multisine(n, _LINES, _OPEN_SUM, rng)
        apart = trim + _multisine(n, _APART, _OPEN_DIFFERENCE, rng)
        voltages = np.clip(np.column_stack([total + apart, total - apart]) / 2, -V_MAX, V_MAX).round(5)
        at[1] = (base.k_z * rig.hover[1] * 0.6 - base.a_1) / base.a_e
    changes = _changes(stages, np.arange(n) / RATE - _LEAD)
    return _recorded(rig, base, voltages, references, at, RATE, 1.0, 3, rng, rig.control if closed else None, changes)


def _changes(stages: Sequence[Stage], time: Array) -> Changes:
    """Give the coefficients and the shares of thrust at each time [s]."""
    before = stages[0]
    tables, shares, which = [before.coefficients], np.tile(before.shares, (len(time), 1)), np.zeros(len(time), np.int64)
    for stage in stages[1:]:
        pieces = _SLOW_STEPS if stage.slow > 0.0 else 1
        for piece in range(1, pieces + 1):
            share, later = piece / pieces, time >= stage.start + (piece - 1) / pieces * stage.slow - 1e-9
            mixed = [(1 - share) * a + share * b for a, b in zip(before.coefficients, stage.coefficients, strict=True)]
            tables.append(Coefficients(*mixed))
            which[later] = len(tables) - 1
            shares[later] = (1 - share) * np.array(before.shares) + share * np.array(stage.shares)
        before = stage
    return Changes(tables, which, shares)


def _multisine(n: int, around: Array, std: float, rng: np.random.Generator) -> Array:
    """Return a random-phase multisine of ``n`` samples with lines ``around`` these [Hz] and a standard deviation."""
    lines = around * rng.uniform(0.85, 1.15, len(around))
    phases = rng.uniform(0, 2 * np.pi, len(lines))
    t = np.arange(n) / RATE
    return std * math.sqrt(2 / len(lines)) * np.sin(2 * np.pi * lines[:, None] * t + phases[:, None]).sum(axis=0)
