"""Rigs flown by a controller in the air of measured rigs, stirred or quiet, in logs that two controllers made.

The air of the field battery is calm; that of measured rigs is 3 to 30 times rougher, and a plant that is fitted to
how a controller answers it comes out wrong. A windy rig is flown as rigs of a laboratory are, with

* the torque of `tests.blind.air` on each axis;
* a controller as students write them, slow and badly damped, or by a laboratory that places poles: PD or PID on pitch
  and elevation, rates filtered well or hardly, with or without a loop about the travel or its rate; a second one has
  other structure and half the gains;
* references of a stick or in steps, a fifth as large on quiet rigs; logged or not;
* gains that drift by 1.5 % from log to log, encoders zeroed for each log, motors with a lag of their own.

At 100 Hz it is the paper's rig, at 500 Hz one with the pitch balanced and a heavy arm. Seeds, not colour or loudness,
decide on parameters, effects, levels of the air and controllers.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from tests.blind.air import Noise, draw_noise, torque
from tests.blind.coefficients import Coefficients
from tests.blind.plant import COUNTS_PER_TURN, STEP, V_MAX, Control, Push, drawn_poles, fly, placed, push_torque
from tests.blind.rigs import AXES, DRAWN, ENCODER_SHAKE, Effect
from tests.blind.signals import joystick

COUNTS: Mapping[str, int] = {"a": 5, "b": 5, "t": 2, "c": 2}
"""Logs of a rig: two halves a and b, t held out, c of the second controller."""

DURATION = (30.0, 40.0)
"""Length of a log [s]."""

SPREAD, DRIFT = 0.25, 0.015
"""Half-width of the parameters' uniform spread, and standard deviation of a gain from log to log [1]."""

LEAD = 6.0
"""A flight begins this much before its log does [s]."""

TRIM_STD = (0.004, 0.006, 0.003)
"""Constant torque of one log on pitch, elevation and travel [rad/s^2]."""

ZERO_STD = (0.01, 0.02)
"""Encoder zeros of pitch and elevation from log to log [rad]; that of the travel is where the log begins."""

LAG = (0.07, 0.09)
"""Time constant of the motors [s]."""

QUIET = 0.2
"""Size of the references of a quiet flight [1]."""

HOLDS, LEVELS, SMOOTHING = (2.0, 6.0), (0.1, 0.18, 0.45), 0.3
"""References in steps: how long they stay [s], half-widths of their uniform levels on pitch [rad], elevation [rad] and
travel (a rate [rad/s], or an angle [rad]), and the time constant of the lag that they pass [s]."""

STRENGTHS: Mapping[str, tuple[str, float, float]] = {
    "dead_zone": ("rotors", 0.25, 0.4),
    "quadratic_thrust": ("rotors", 0.08, 0.15),
    "dry_friction": ("pitch", 0.04, 0.08),
    "quadratic_drag": ("pitch", 1.0, 2.0),
    "speed_stability": ("pitch", 0.3, 0.7),
    "rotor_drag_torque": ("travel", 0.01, 0.02),
    "cable_stiffness": ("travel", 0.008, 0.015),
}
"""Axis and range of an effect that a rig may hold beside inertial coupling and trigonometric gravity; of a size that a
test may see in this air. In the catalogue's units."""

_BALANCED = Coefficients(
    a_wx=0.21, a_th=0.2, k_x=0.64, theta0=0.02, a_wz=0.08, a_e=0.26, a_1=0.9, a_lt=0.02, k_z=0.2, a_wy=0.09, k_y=-0.115
)
"""A rig of the other make: the pitch balanced, an arm whose weight the rotors carry."""

_STUDENT_POLES = ((1.6, 2.0), (0.38, 0.48), (1.4, 1.9), (0.28, 0.45))
"""Frequency [rad/s] and damping ratio of the pitch's and of the elevation's loop, as students choose them."""

_LIGHT = 80.0
"""Bandwidth of a filter of the rates that a student hardly put in [rad/s]."""


class WindyLog(NamedTuple):
    """Time (n,) [s], front and rear voltage (n, 2) [V], each held to the next sample, angles (n, 3) as read [rad].

    ``references``, by axis: what the pilot asked for [rad], empty if not logged. That of the pitch is the stick's
    share, that of the travel a rate [rad/s] where the controller holds the rate and not the angle.
    """

    time: NDArray[np.float64]
    voltages: NDArray[np.float64]
    angles: NDArray[np.float64]
    references: Mapping[str, NDArray[np.float64]]


class WindyTruth(NamedTuple):
    """Parameters by the paper's names, gains at zero voltage, T_m the true lag; coefficients by "name/axis"."""

    parameters: Mapping[str, float]
    effects: Mapping[str, float]

    def slopes(self, voltage: float) -> dict[str, float]:
        """Gains k_x, k_z and k_y about a voltage of each rotor [rad/s^2/V]: of the travel, thrust over voltage."""
        v = max(voltage - self.effects.get("dead_zone/rotors", 0.0), 0.0)
        c = self.effects.get("quadratic_thrust/rotors", 0.0)
        slope, share = 1.0 + 2.0 * c * v, (v + c * v * v) / voltage
        return {name: self.parameters[name] * (share if name == "k_y" else slope) for name in ("k_x", "k_z", "k_y")}


class WindyRig(NamedTuple):
    """A rig's logs by name (a1, a2, ..., t1, ..., c1, ...), and its truth."""

    logs: Mapping[str, WindyLog]
    truth: WindyTruth

    def part(self, letter: str) -> dict[str, WindyLog]:
        """Give the logs of a half (a, b), the held-out ones (t) or those of the second controller (c)."""
        return {name: log for name, log in self.logs.items() if name.startswith(letter)}


def _base(rate: float, rng: np.random.Generator) -> tuple[Coefficients, tuple[float, float]]:
    """Parameters, and the hover: elevation [rad] and mu_s [V]."""
    centre = Coefficients() if rate < 300.0 else _BALANCED
    shares = rng.uniform(1 - SPREAD, 1 + SPREAD, len(DRAWN))
    base = centre._replace(
        **{name: float(share * getattr(centre, name)) for name, share in zip(DRAWN, shares, strict=True)},
        t_m=float(rng.uniform(*LAG)),
    )
    if rate < 300.0:
        mu_s = float(rng.uniform(2.2, 3.4))
        return base, ((base.k_z * mu_s - base.a_1) / base.a_e, mu_s)
    elevation = float(rng.uniform(-0.2, 0.0))
    return base, (elevation, (base.a_e * elevation + base.a_1) / base.k_z)


def _effects(kind: str | None, rng: np.random.Generator) -> tuple[Effect, ...]:
    """Effects of a kind; if none is given every other rig is bare."""
    bare, word, where = rng.random() < 0.5, str(rng.choice(list(STRENGTHS))), rng.random(len(STRENGTHS))
    words = ([] if bare else [word]) if kind is None else [w for w in kind.split("+") if w not in ("coupled", "beam")]
    if kind == "bare" or (kind is None and bare):
        return ()
    unknown = [w for w in words if w not in STRENGTHS]
    if unknown:
        raise ValueError(f"effect {unknown[0]!r} is not known; choose of bare, coupled, beam, {', '.join(STRENGTHS)}")
    drawn = []
    for w in words:
        axis, low, high = STRENGTHS[w]
        drawn.append(Effect(w, axis, float(low + (high - low) * where[list(STRENGTHS).index(w)])))
    return (
        Effect("inertial_coupling", "elevation", 1.0),
        Effect("inertial_coupling", "travel", 1.0),
        Effect("large_angle_gravity", "elevation", 1.0),
        *([Effect("inertial_coupling", "pitch", 1.0)] if kind and "beam" in kind.split("+") else []),
        *drawn,
    )


def _student(base: Coefficients, hover: tuple[float, float], rng: np.random.Generator) -> Control:
    """A controller as students write it: slow and badly damped, rates through a slow filter, travel rate held."""
    control = placed(base, base.k_x, base.k_z, *(float(rng.uniform(*limits)) for limits in _STUDENT_POLES))
    return control._replace(
        mu_s0=hover[1] * float(rng.uniform(0.98, 1.02)),
        k_ie=float(rng.uniform(0.2, 0.5)) * control.k_pe,
        rate_bandwidth=float(rng.uniform(9.0, 18.0)),
        b_r=float(rng.uniform(0.7, 1.0)),
        speed_limit=2.0,
    )


def _tuned(
    base: Coefficients, effects: tuple[Effect, ...], hover: tuple[float, float], rng: np.random.Generator,
    integral: bool, travel: bool,
) -> Control:  # fmt: skip
    """A laboratory's loops: by poles, slower behind a slow motor, with gains known to ten percent."""
    strength = {effect.name: effect.coefficient for effect in effects}
    bend = strength.get("quadratic_thrust", 0.0)
    # Each rotor gives half the hover: v + bend v^2 = f, whose slope the gains are divided by.
    f = hover[1] / 2
    v = f if bend == 0.0 else (math.sqrt(1.0 + 4.0 * bend * f) - 1.0) / (2.0 * bend)
    slope = 1.0 + 2.0 * bend * v
    k_x, k_z = (k * slope * rng.uniform(0.9, 1.1) for k in (base.k_x, base.k_z))
    bandwidth, omega_p, omega_e, zeta = drawn_poles(base.t_m, rng)
    rng.random()
    rng.random()
    omega_t = rng.uniform(0.45, 0.7)
    reach = -1.0 / (base.k_y * hover[1])  # pitch for a travel acceleration, with the sign turned [s^2]
    # The difference of the voltages that is left beside the hover limits the speed that the pitch can be held at.
    room = 2.0 * (V_MAX - v) * base.k_x
    speed = min(rng.uniform(0.8, 2.0), 0.5 * room / max(strength.get("speed_stability", 0.0), 0.1))
    return placed(
        base, k_x, k_z, omega_p, zeta, omega_e, zeta, integral,
        mu_s0=2.0 * v * rng.uniform(0.98, 1.02), rate_bandwidth=bandwidth, speed_limit=speed,
        b_p=reach * omega_t**2 * travel, b_r=reach * 2.0 * 0.9 * omega_t * travel,
    )  # fmt: skip


def _controls(
    base: Coefficients, effects: tuple[Effect, ...], hover: tuple[float, float], rate: float, rng: np.random.Generator
) -> tuple[Control, Control]:
    """The first controller, and the second: other structure, half the gains."""
    student, integral, travel, light = rng.random(4) < (5 / 6, 0.4, 0.6, 0.4)
    first = _tuned(base, effects, hover, rng, bool(integral), bool(travel))
    if student:
        first = _student(base, hover, rng)
    elif light and rate < 300.0:
        first = first._replace(rate_bandwidth=_LIGHT)
    second = _tuned(base, effects, hover, rng, first.k_ip == 0.0, first.b_r == 0.0)
    halved = ("k_pp", "k_dp", "k_ip", "k_pe", "k_de", "k_ie")
    return first, second._replace(**{name: 0.5 * getattr(second, name) for name in halved})


def _steps(samples: int, rate: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Steps to random levels at random times, each through a first-order lag, shape (n, 3)."""
    wanted, count = np.empty((samples, 3)), int(samples / rate / HOLDS[0]) + 1
    for axis, level in enumerate(LEVELS):
        times, values = np.cumsum(rng.uniform(*HOLDS, count)), rng.uniform(-level, level, count + 1)
        wanted[:, axis] = values[np.searchsorted(times, np.arange(samples) / rate)]
    stay = math.exp(-1.0 / (rate * SMOOTHING))
    wanted[1:] *= 1.0 - stay  # the lag has settled at the first level
    lagged: NDArray[np.float64] = lfilter([1.0], [1.0, -stay], wanted, axis=0)
    return lagged


def _references(
    samples: int, rate: float, size: float, control: Control, steps: bool, rng: np.random.Generator
) -> NDArray[np.float64]:
    """What the pilot asks for, shape (n, 3) [rad].

    With a stick he asks for more elevation where no integral brings it, for less pitch where a loop holds the travel.
    """
    if steps:
        wanted = size * _steps(samples, rate, rng)
        if control.b_r == 0.0:
            wanted[:, 0] *= 2.0
            wanted[:, 2] = 0.0
        return wanted
    wanted = joystick(samples, rate, size, False, rng)
    if control.k_ie == 0.0:
        wanted[:, 1] *= 2.0
    if control.b_r != 0.0:
        wanted[:, 0] *= 0.4
        wanted[:, 2] = joystick(samples, rate, 0.25 * size, True, rng)[:, 2]
    return wanted


def _log(
    base: Coefficients, control: Control, hover: tuple[float, float], noise: Noise, rate: float, size: float,
    steps: bool, logged: bool, pushes: Sequence[Push], finer: int, shake: float, rng: np.random.Generator,
) -> WindyLog:  # fmt: skip
    """Fly one log."""
    person, world, air = rng.spawn(3)
    lead, travel = round(LEAD * rate), control.b_r != 0.0
    samples = lead + round(rate * person.uniform(*DURATION))
    wanted = _references(samples, rate, size, control, steps, person)
    zeros = (*(world.normal(0.0, std) for std in ZERO_STD), 0.0)
    trims = tuple(world.normal(0.0, std) for std in TRIM_STD)
    base = base._replace(**{k: getattr(base, k) * (1.0 + world.normal(0.0, DRIFT)) for k in ("k_x", "k_z", "k_y")})
    asked = wanted + np.array([0.0, hover[0], 0.0])
    if control.b_p == 0.0:  # the travel's reference is a rate, which the loop turns into a pitch
        wanted[:, 0] -= control.b_r * wanted[:, 2]
    per_sample = round(1.0 / rate / STEP)
    count, before = per_sample * samples, per_sample * lead
    world.standard_normal((count + 1, 6))  # of torques that the rigs once had: the published ones have this shake
    added = trims + torque(noise, count, STEP, air)
    added[before:] += push_torque(count - before, pushes)
    read, angles, _, voltages = fly(
        np.full((samples, 2), control.mu_s0 / 2), np.array([base.theta0, hover[0], 0.0]), base, added,
        shake * world.standard_normal((samples, 3)), control=control, references=wanted,
        hover=hover[0], rate=rate, lead=lead, zeros=zeros,
    )  # fmt: skip
    if finer > 1:
        count = 2.0 * np.pi / COUNTS_PER_TURN / finer
        read = count * np.round((angles + zeros) / count)
    begin = np.array([0.0, 0.0, read[lead, 2]])
    if control.b_p != 0.0:
        asked -= begin
    references = {axis: asked[lead:, i] for i, axis in enumerate(AXES) if logged and (travel or axis != "travel")}
    return WindyLog(np.arange(samples - lead) / rate, voltages[lead:], read[lead:] - begin, references)


def windy_rig(
    seed: int,
    colour: str = "ou",
    quiet: bool = False,
    rate: float = 100.0,
    effects: str | None = None,
    references: bool = True,
    counts: Mapping[str, int] = COUNTS,
    pushes: Mapping[str, Sequence[Push]] | None = None,
    finer: int = 1,
    shake: float = ENCODER_SHAKE,
) -> WindyRig:
    """Draw a windy rig and fly its logs; what is not given follows the seed.

    ``colour`` of the air: ou, slow or swirl; ``quiet``: references a fifth as large; ``rate`` of samples and
    controller, 100 or 500 [Hz]; ``effects``, drawn if not given: bare, coupled (inertial coupling of elevation and
    travel, trigonometric gravity), on top of that joined by ``+`` beam (inertial coupling of the pitch) and names of
    `STRENGTHS`; ``references``: whether they are logged; ``counts`` of logs by letter, which do not change one another;
    ``pushes`` by a hand, by the log's name; ``finer``: how many times finer the encoders are that write the log, the
    controller keeps its own; ``shake`` of the encoders' lines [counts].
    """
    drawn, air, held, tuning, pilot, flights = map(np.random.default_rng, np.random.SeedSequence(seed).spawn(6))
    base, hover = _base(rate, drawn)
    noise, lacking = draw_noise(colour, air), _effects(effects, held)
    controls = _controls(base, lacking, hover, rate, tuning)
    acting = base._replace(**{effect.field: effect.coefficient for effect in lacking})
    steps, size = bool(pilot.random() < 2 / 3), float(pilot.uniform(0.7, 1.15)) * (QUIET if quiet else 1.0)
    logs = {}
    for letter, source in zip(COUNTS, flights.spawn(len(COUNTS)), strict=True):
        control = controls[letter == "c"]
        for number, own in enumerate(source.spawn(counts.get(letter, 0)), 1):
            name = f"{letter}{number}"
            pushed = (pushes or {}).get(name, ())
            logs[name] = _log(acting, control, hover, noise, rate, size, steps, references, pushed, finer, shake, own)
    parameters = {name: getattr(base, name) for name in (*DRAWN, "theta0")} | {"T_m": base.t_m}
    truth = WindyTruth(parameters, {f"{e.name}/{e.axis}": e.coefficient for e in lacking})
    return WindyRig(logs, truth)
