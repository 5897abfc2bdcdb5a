"""Rigs in calm flight: what the on-line identifier and the twin that follows are judged by.

Every axis has an Ornstein-Uhlenbeck torque, and the encoders' lines shake by a quarter count. A rig has the paper's
coefficients, or each within 20 % of them. It hovers at an elevation and a thrust of its own, under a controller of
pitch and elevation (PID or state feedback on filtered rates, tuned by poles with gains known to ten percent), while a
joystick moves the references in steps. In open loop a rig flies multisines on the sum and the difference of the
voltages.

A rig for the identifier flies five logs (:func:`closed_loop_rigs`). A rig for the twin changes in :func:`flight`: a
sequence of stages, each with coefficients of its own and shares of thrust of the two rotors; between two stages
everything changes at once, or the thrust along a line in time where ``slow`` is given. :func:`changed` makes the next
stage of a kind: one gain by a fifth (k_x, k_z, k_y), a dry friction that is added (friction_pitch, ...), a mass that
is moved, a rotor that lost a fifth of its thrust (front, rear), a cable that is hung on, motors that warm up (warming).
"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.blind.coefficients import Coefficients
from tests.blind.plant import STEP, V_MAX, Changes, Control, drawn_poles, fly, placed, room_torque
from tests.blind.rigs import draw_base
from tests.blind.signals import joystick

Array = NDArray[np.float64]
TORQUE_STD, TORQUE_TIME, SHAKE = 0.012, 1.0, 0.25
"""Random torque [rad/s^2], its correlation time [s], shake of the encoders' lines [counts]."""

LOGS, DURATIONS = 5, (22.0, 40.0)
"""Logs of a rig for the identifier, and their shortest and longest length [s]."""

RATE = 100.0
"""Samples in a second of a rig for the twin."""

_LEAD = 6.0
"""A flight begins this much before its log does [s]."""

_HOVER, _THRUST = (-0.2, 0.4), (4.4, 6.4)
_OPEN_SUM, _OPEN_DIFFERENCE = 0.8, 0.35
"""Standard deviation of the voltages' sum and difference in open loop [V]."""

_LINES = np.array([0.05, 0.08, 0.12, 0.17, 0.26, 0.4, 0.6, 0.9, 1.4])
"""Frequencies in open loop, before they are spread at random [Hz]."""

_APART = np.array([0.05, 0.08, 0.26, 0.4, 0.6, 0.9, 1.4])
"""The same for the difference of the voltages: none near .13 Hz, where the pitch has a resonance 13 times the static
gain, and the rig would turn over."""

_SLOW_STEPS = 40
"""Pieces that a slow change is made of."""


class FlownRig(NamedTuple):
    """A rig before it changes: coefficients, controller and hover (elevation [rad], mu_s [V])."""

    coefficients: Coefficients
    control: Control
    hover: tuple[float, float]


def draw_flown(rng: np.random.Generator, like_paper: bool | None = None, lag: float | None = None) -> FlownRig:
    """Return a rig; every second one has the paper's coefficients if it is not said which."""
    base = Coefficients() if (rng.random() < 0.5 if like_paper is None else like_paper) else draw_base(rng)
    hover = float(rng.uniform(*_HOVER)), float(rng.uniform(*_THRUST))
    theta0 = float(rng.uniform(-0.14, 0.06))
    base = base._replace(
        theta0=theta0, a_1=base.k_z * hover[1] - base.a_e * hover[0], t_m=base.t_m if lag is None else lag
    )
    bandwidth, omega_p, omega_e, zeta = drawn_poles(base.t_m, rng)
    k_x, k_z = (k * rng.uniform(0.9, 1.1) for k in (base.k_x, base.k_z))
    integral = rng.random() < 0.5
    hovering = hover[1] * rng.uniform(0.98, 1.02)
    control = placed(base, k_x, k_z, omega_p, zeta, omega_e, zeta, integral, mu_s0=hovering, rate_bandwidth=bandwidth)
    return FlownRig(base, control, hover)


def _recorded(
    rig: FlownRig, voltages: Array, references: Array, start: Array, rate: float, noise: float, columns: int,
    rng: np.random.Generator, closed: bool = True, changes: Changes | None = None,
) -> Array:  # fmt: skip
    """Fly; give voltages [V] and angles as they are read [rad], (N, 5), from behind the lead on."""
    start = start + np.append(rng.uniform(-0.03, 0.03, 2), 0.0)
    lead, n = round(_LEAD * rate), len(voltages)
    # Of the six columns of older rigs three were a torque of the air: the published rigs have these numbers.
    normal = rng.standard_normal((n * round(1.0 / rate / STEP) + 1, columns))[:, :3]
    read, _, _, used = fly(
        voltages, start, rig.coefficients, room_torque(normal, noise * TORQUE_STD, TORQUE_TIME),
        SHAKE * rng.standard_normal((n, 3)), control=rig.control if closed else None, references=references,
        hover=rig.hover[0], rate=rate, lead=lead, changes=changes,
    )  # fmt: skip
    return np.column_stack([used, read])[lead:]


def closed_loop_rigs(
    seed: int, rate: float = 100.0, noise: float = 1.0, lag: float = 0.08,
    durations: tuple[float, float] = DURATIONS, quiet_from: float | None = None,
) -> Iterator[tuple[Coefficients, list[Array]]]:  # fmt: skip
    """Give six rigs with the paper's coefficients and six drawn around them, each with its truth and its logs (N, 5).

    ``rate`` is that of samples and controller [Hz], ``noise`` scales the random torque, ``lag`` is the motors' [s];
    from ``quiet_from`` [s] of a log on nobody moves the joystick.
    """
    for number in range(12):
        rng = np.random.default_rng([13, 100 * seed + number])
        rig, logs = draw_flown(rng, number < 6, lag), []
        for _ in range(LOGS):
            samples = round((_LEAD + rng.uniform(*durations)) * rate)
            references = joystick(samples, rate, 1.0, False, rng)
            if quiet_from is not None:
                references[round((_LEAD + quiet_from) * rate) :] = 0.0
            voltages, start = np.full((samples, 2), rig.control.mu_s0 / 2), np.array([0.0, rig.hover[0], 0.0])
            flown = _recorded(rig, voltages, references, start, rate, noise, 6, rng)
            logs.append(np.column_stack([flown[:, :2], flown[:, 2:].round(6)]))
        yield rig.coefficients, logs


class Stage(NamedTuple):
    """What a rig is from ``start`` [s] of its record on.

    ``shares`` of thrust, front and rear [1]; ``slow``: the time that they take to change [s].
    """

    start: float
    coefficients: Coefficients
    shares: tuple[float, float] = (1.0, 1.0)
    slow: float = 0.0


GAIN, MASS, FRICTION, CABLE, SLOW = 0.2, 0.08, 0.03, 0.06, 60.0
"""Change of a gain [1], of the offset, an added dry friction [rad/s^2], stiffness of a cable that is hung on [1/s^2],
time in which motors warm up [s]."""

SHARES = {"front": (0.8, 1.0), "rear": (1.0, 0.8), "warming": (0.85, 0.85)}
"""Thrust that is left of the front and the rear rotor [1]."""


def changed(kind: str, stage: Stage, start: float, sign: float) -> Stage:
    """Return the stage that follows after a change of one kind at ``start`` [s]."""
    c, after = stage.coefficients, {}
    if kind.startswith("k_"):
        after = {kind: getattr(c, kind) * (1.0 + sign * GAIN)}
    elif kind == "mass":
        after = {"a_1": c.a_1 + sign * MASS}
    elif kind == "cable":
        after = {"cable_stiffness": CABLE}
    elif kind not in SHARES:
        after = {f"dry_{kind}": getattr(c, f"dry_{kind}") + FRICTION}
    front, rear = SHARES.get(kind, (1.0, 1.0))
    shares = front * stage.shares[0], rear * stage.shares[1]
    return Stage(start, c._replace(**after), shares, SLOW if kind == "warming" else 0.0)


def flight(rig: FlownRig, stages: Sequence[Stage], duration: float, closed: bool, rng: np.random.Generator) -> Array:
    """Fly a rig through ``stages`` (the first begins at 0) for ``duration`` [s].

    Returns the record (N, 5), voltages [V] and angles [rad] as they are read, every 10 ms.
    """
    n, base = round((_LEAD + duration) * RATE), rig.coefficients
    references = joystick(n, RATE, 1.0, False, rng)
    voltages, start = np.full((n, 2), rig.control.mu_s0 / 2), np.array([0.0, rig.hover[0], 0.0])
    if not closed:
        trim = base.a_th * math.sin(0.0 - base.theta0) / base.k_x
        total = rig.hover[1] * 0.6 + _multisine(n, _LINES, _OPEN_SUM, rng)
        apart = trim + _multisine(n, _APART, _OPEN_DIFFERENCE, rng)
        voltages = np.clip(np.column_stack([total + apart, total - apart]) / 2, -V_MAX, V_MAX).round(5)
        start[1] = (base.k_z * rig.hover[1] * 0.6 - base.a_1) / base.a_e
    time, which, shares = np.arange(n) / RATE - _LEAD, np.zeros(n, np.int64), np.tile(stages[0].shares, (n, 1))
    for number, stage in enumerate(stages[1:], 1):
        pieces = _SLOW_STEPS if stage.slow > 0.0 else 1
        steps = stage.start + np.arange(pieces) / pieces * stage.slow - 1e-9
        share = np.searchsorted(steps, time, "right")[:, None] / pieces
        which[share[:, 0] > 0.0] = number
        shares = (1.0 - share) * shares + share * np.array(stage.shares)
    changes = Changes([stage.coefficients for stage in stages], which, shares)
    return _recorded(rig, voltages, references, start, RATE, 1.0, 3, rng, closed, changes)


def _multisine(n: int, around: Array, std: float, rng: np.random.Generator) -> Array:
    """Return a random-phase multisine of ``n`` samples with lines ``around`` these [Hz] and a standard deviation."""
    lines = around * rng.uniform(0.85, 1.15, len(around))
    phases = rng.uniform(0, 2 * np.pi, len(lines))
    t = np.arange(n) / RATE
    return std * math.sqrt(2 / len(lines)) * np.sin(2 * np.pi * lines[:, None] * t + phases[:, None]).sum(axis=0)
