"""How a field rig is drawn from its seed and its kind.

==================  ======================================================================================
`field`             lag, inertial coupling, trigonometric gravity, and up to three drawn effects
effects by name     the same with these effects: ``dry_friction:pitch+quadratic_thrust``
`clean`             inertial coupling and trigonometric gravity alone; zeros, gains and air as everywhere
`clean_linear`      zeros, gains and air, and nothing but the base model
`clean_loop`        nothing but the base model and the loop: no zeros, one gain, no air
`open_clean`        open loop, 90 s, nothing but the base model
`open_touched`      the same logs, each with one touch put in
==================  ======================================================================================

Rigs of one seed have the same base parameters, nuisances and person, whatever their kind.
"""

import math
from types import MappingProxyType

import numpy as np

from tests.blind.coefficients import Coefficients
from tests.blind.field.control import V_MAX, Control
from tests.blind.field.strengths import EITHER_SIGN, MOST, STRENGTHS
from tests.blind.field.truth import Air, FieldTruth, LogTruth, Touch
from tests.blind.rigs import Effect, Room, draw_base

CLEAN = ("clean", "clean_linear", "clean_loop", "open_clean", "open_touched")

OPEN_DURATION, OPEN_LOGS = 90.0, 6
"""Length of a log in open loop [s], and how many there are."""

LOGS, DURATIONS = (10, 16), (20.0, 40.0)
"""Number of logs of a flown rig, and their lengths [s]."""

ZERO_STD, GAIN_STD, TRIM_STD = (0.02, 0.02, 0.02), 0.03, (0.004, 0.006, 0.003)
"""What varies from log to log: encoder zeros [rad], voltage gain [1], torques [rad/s^2]; normal, cut at two."""

AIR_STD, AIR_TIME = (0.004, 0.012), (0.3, 2.0)
"""Torque of the air in hover [rad/s^2], its correlation time [s]."""

LAG = (0.05, 0.15)
"""True time constant of the motors [s]; 0.08 is assumed."""

OFFSETS, HOVER_FROM_HORIZONTAL, HOVER = (-0.5, 0.1), (-0.2, 0.1), (-0.2, 0.4)
"""Horizontal offset; hover from the horizontal arm; limits of the hover as the encoder reads it [rad]."""

HOVER_THRUST = (4.4, 6.4)
"""Thrust of both rotors in hover, as voltage [V]."""

TOUCHED_SHARE = 0.2
"""Share of the logs of a touched rig that a hand disturbs; one at least."""

_TOUCHES = {"pitch": (0.6, 1.4), "elevation": (0.5, 1.2), "travel": (0.9, 2.2)}
"""Acceleration by a hand [rad/s^2]."""

_TOUCH_TIMES, _LARGEST_PUSH = (0.3, 1.0), {"pitch": 0.5, "elevation": 0.4, "travel": 0.9}
"""How long it pushes [s], and what it changes the rate by at most [rad/s]."""


def _cut_normal(std: float, rng: np.random.Generator) -> float:
    return std * float(np.clip(rng.standard_normal(), -2.0, 2.0))


def _cut_normals(stds: tuple[float, float, float], rng: np.random.Generator) -> tuple[float, float, float]:
    pitch, elevation, travel = (_cut_normal(std, rng) for std in stds)
    return pitch, elevation, travel


def _named(word: str, scale: float, rng: np.random.Generator) -> tuple[Effect, ...]:
    name, _, axis = word.partition(":")
    if name not in STRENGTHS:
        raise ValueError(f"kind {word!r} is not known; choose field, {', '.join(CLEAN)}, or of {', '.join(STRENGTHS)}")
    options = [option for option in STRENGTHS[name] if not axis or axis in dict(option)]
    if not options:
        raise ValueError(f"kind {word!r}: {name} does not act on {axis!r}")
    option = options[rng.integers(len(options))]
    sign = float(rng.choice([-1.0, 1.0])) if name in EITHER_SIGN else 1.0
    where = float(rng.random())  # effects that act together are of like strength
    return tuple(Effect(name, on, scale * sign * (low + where * (high - low))) for on, (low, high) in option)


def _effects(kind: str, scale: float, offset: float, lag: float, rng: np.random.Generator) -> tuple[Effect, ...]:
    if kind in CLEAN and kind != "clean":
        return ()
    eps_0 = MappingProxyType({"eps_0": offset})
    always = (
        Effect("inertial_coupling", "elevation", 1.0, eps_0),
        Effect("inertial_coupling", "travel", 1.0, eps_0),
        Effect("large_angle_gravity", "elevation", 1.0),
    )
    if kind == "clean":
        return always
    words = kind.split("+")
    if kind == "field":
        words = list(rng.permutation(list(STRENGTHS))[: rng.integers(MOST + 1)])
    drawn = tuple(effect for word in words for effect in _named(word, scale, rng))
    return (*always, Effect("motor_lag", "rotors", lag - Coefficients().t_m), *drawn)


def tuned(
    base: Coefficients,
    effects: tuple[Effect, ...],
    hover: tuple[float, float],
    rng: np.random.Generator,
    integral: bool | None = None,
    travel: bool | None = None,
) -> Control:
    """Tune the loops as a laboratory does: by poles, slower behind a slow motor, with gains known to ten percent.

    Parameters
    ----------
    base, effects
        The plant.
    hover
        Elevation [rad] and thrust, as mu_s [V].
    rng
        Of all that the laboratory decides.
    integral, travel
        Whether the errors are integrated, and whether there is a loop about the travel; drawn if not given.

    Returns
    -------
    Control
        Its gains.
    """
    strength = {effect.name: effect.coefficient for effect in effects}
    late = base.t_m + strength.get("motor_lag", 0.0) + strength.get("input_delay", 0.0)
    bend = strength.get("quadratic_thrust", 0.0)
    # Each rotor gives half the hover: v + bend v^2 = f, whose slope the gains are divided by.
    f = hover[1] / 2
    v = f if bend == 0.0 else (math.sqrt(1.0 + 4.0 * bend * f) - 1.0) / (2.0 * bend)
    slope = 1.0 + 2.0 * bend * v
    k_x, k_z = (k * slope * rng.uniform(0.9, 1.1) for k in (base.k_x, base.k_z))
    bandwidth = rng.uniform(18.0, 35.0)
    fastest = 0.42 / (late + 1.0 / bandwidth)
    omega_p, omega_e = min(rng.uniform(1.6, 2.5), fastest), min(rng.uniform(1.9, 2.6), fastest)
    zeta = rng.uniform(0.65, 0.9)
    drawn = rng.random() < 0.5  # PID or state feedback
    integral = drawn if integral is None else integral
    k_pp = max(omega_p**2 - base.a_th, 0.8) / k_x
    k_pe = max(omega_e**2 - base.a_e, 0.6) / k_z
    drawn = rng.random() < 0.3
    travel = drawn if travel is None else travel
    omega_t = rng.uniform(0.45, 0.7)
    reach = -1.0 / (base.k_y * hover[1])  # pitch for a travel acceleration, with the sign turned [s^2]
    # The difference of the voltages that is left beside the hover limits the speed that the pitch can be held at.
    room = 2.0 * (V_MAX - v) * base.k_x
    speed = min(rng.uniform(0.8, 2.0), 0.5 * room / max(strength.get("speed_stability", 0.0), 0.1))
    return Control(
        mu_d0=-base.a_th * math.sin(base.theta0) / k_x,
        k_pp=k_pp,
        k_dp=2.0 * zeta * omega_p / k_x,
        k_ip=0.25 * k_pp * integral,
        mu_s0=2.0 * v * rng.uniform(0.98, 1.02),
        k_pe=k_pe,
        k_de=2.0 * zeta * math.sqrt(k_pe * k_z + base.a_e) / k_z,
        k_ie=0.5 * k_pe * integral,
        rate_bandwidth=bandwidth,
        b_p=reach * omega_t**2 * travel,
        b_r=reach * 2.0 * 0.9 * omega_t * travel,
        speed_limit=speed,
    )


def _touch(begin: float, duration: float, rng: np.random.Generator) -> Touch:
    axis = ("travel", "travel", "pitch", "elevation")[rng.integers(4)]
    strength = float(rng.uniform(*_TOUCHES[axis]))
    lasts = min(float(rng.uniform(*_TOUCH_TIMES)), max(_LARGEST_PUSH[axis] / strength, _TOUCH_TIMES[0]))
    start = float(rng.uniform(begin, duration - 3.0))
    return Touch(axis, round(start, 3), round(start + lasts, 3), strength * float(rng.choice([-1.0, 1.0])))


def _open_rig(kind: str, base: Coefficients, rng: np.random.Generator) -> FieldTruth:
    logs = []
    for _ in range(OPEN_LOGS):
        seed, touch = int(rng.integers(2**62)), _touch(10.0, OPEN_DURATION, rng)
        logs.append(LogTruth(seed, OPEN_DURATION, touches=(touch,) if kind == "open_touched" else ()))
    return FieldTruth(
        kind, base, (), 0.0, (0.0, 4.5), 0.0, Air(), Room(), Control(), False, 100.0, 1.0, tuple(logs)
    )  # fmt: skip


def draw_field_rig(
    seed: int | np.random.SeedSequence, kind: str = "field", scale: float = 1.0, touched: bool | None = None
) -> FieldTruth:
    """Draw a field rig.

    Parameters
    ----------
    seed
        Of all that the kind leaves open.
    kind
        See the module's first lines.
    scale
        Share of the strength of the drawn effects.
    touched
        Whether a hand disturbs some of the logs; drawn if not given (one rig of three; clean rigs never).

    Returns
    -------
    FieldTruth
        What the logs must not tell.

    Raises
    ------
    ValueError
        For a kind that does not exist.
    """
    base_seed, kind_seed, log_seed, touch_seed = np.random.default_rng(seed).integers(2**63, size=4)
    rng = np.random.default_rng(base_seed)
    base = draw_base(rng)
    if kind.startswith("open_") and kind in CLEAN:
        return _open_rig(kind, base, np.random.default_rng(log_seed))
    offset = float(rng.uniform(*OFFSETS))
    lean = float(rng.uniform(-0.14, 0.06))
    hover_elevation = float(np.clip(rng.uniform(*HOVER_FROM_HORIZONTAL) - offset, *HOVER))
    hover = (hover_elevation, float(rng.uniform(*HOVER_THRUST)))
    lag = float(rng.uniform(*LAG))
    rate = float(rng.choice([100.0, 500.0]))
    liveliness = float(rng.uniform(0.6, 1.15))
    air = Air(tuple(float(s) for s in rng.uniform(*AIR_STD, 3)), float(np.exp(rng.uniform(*np.log(AIR_TIME)))))
    bristles = float(rng.uniform(0.0003, 0.001)) if rng.random() < 1 / 3 else 0.0
    tuning_seed = int(rng.integers(2**62))

    effects = _effects(kind, scale, offset, lag, np.random.default_rng(kind_seed))
    base = base._replace(theta0=lean)._replace(**_weight(base, hover, offset, linear=not effects))
    control = tuned(base, effects, hover, np.random.default_rng(tuning_seed))

    still = kind == "clean_loop"
    rng, hands = np.random.default_rng(log_seed), np.random.default_rng(touch_seed)
    count = int(rng.integers(LOGS[0], LOGS[1] + 1))
    by_chance = hands.random() < 1 / 3 and kind not in CLEAN
    disturbed = max(1, round(TOUCHED_SHARE * count)) if (by_chance if touched is None else touched) else 0
    touched_logs = set(hands.permutation(count)[:disturbed].tolist())
    logs = []
    for number in range(count):
        own = int(rng.integers(2**62)), round(float(rng.uniform(*DURATIONS)), 1)
        zeros, gain, trims = _cut_normals(ZERO_STD, rng), 1.0 + _cut_normal(GAIN_STD, rng), _cut_normals(TRIM_STD, rng)
        touch = (_touch(3.0, own[1], hands),) if number in touched_logs else ()
        if still:
            logs.append(LogTruth(*own, touches=touch))
        else:
            logs.append(LogTruth(*own, zeros, gain, (0.0, 0.0, 0.0) if kind in CLEAN else trims, touch))
    return FieldTruth(
        kind=kind,
        base=base,
        effects=effects,
        horizontal_offset=offset,
        hover=hover,
        presliding=bristles,
        air=Air() if still else air,
        room=Room(),
        control=control,
        closed_loop=True,
        rate=rate,
        liveliness=liveliness,
        logs=tuple(logs),
    )


def _weight(base: Coefficients, hover: tuple[float, float], offset: float, linear: bool) -> dict[str, float]:
    """Weight of the arm such that the hover's thrust holds it at the hover's elevation: a_e and a_1."""
    lift = base.k_z * hover[1]
    if linear:
        return {"a_1": lift - base.a_e * hover[0]}
    from_horizontal = hover[0] + offset
    a = base.a_e
    b = (lift - a * math.sin(from_horizontal)) / math.cos(from_horizontal)
    z = offset
    return {"a_e": a * math.cos(z) - b * math.sin(z), "a_1": a * math.sin(z) + b * math.cos(z)}
