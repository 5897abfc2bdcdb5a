"""The blind plant in flight: its laws, a controller, and Moreau's midpoint rule at 1 ms.

Base, with theta pitch, e elevation, lambda travel:

    theta''  = -a_wx theta' - a_th sin(theta - theta0) + k_x mu_d
    e''      = -a_wz e' - a_e e - a_1 - a_lt theta' lambda' + k_z mu_s cos(theta)
    lambda'' = -a_wy lambda' + k_y mu_s sin(theta)

Each further term is one row of the catalogue's table. E = e + elevation_zero is the elevation from the horizontal arm,
which is what the trigonometry wants; a_e e + a_1 = a_e E + (a_1 - a_e elevation_zero).

Rotors: v is delayed by ``input_delay``, loses the ``dead_zone``, passes the motor (9), T_m dnu/dt + nu = v, with
T_m = t_m + ``motor_lag``; the thrust, as the voltage of an ideal rotor, is then bent by ``quadratic_thrust``, halved in
part for nu < 0 by ``reverse_thrust_loss``, and fades by ``thrust_fade``.

Dry friction is the set-valued law: w != 0 gives the torque -F(w) sign(w); w = 0 gives whatever torque in [-F(0), F(0)]
keeps w at zero. F(w) = c + b exp(-(w/w_s)^2), c the Coulomb level and b the breakaway excess [rad/s^2], w_s the
Stribeck rate [rad/s]. Bristles (P. R. Dahl, 1968) that bend by up to x [rad] replace the jump: z' = w - |w| z / x,
torque -F(w) z / x. The axis then creeps in place of sticking.

Time-stepping in impulses (J. J. Moreau, "Unilateral contact and dry friction in finite freedom dynamics", 1988): drift
half a step, kick at the middle with the impulse of friction, which is at most h F, drift again.

    q_m = q + h/2 w
    w_m = slip(w + h/2 a(t_m, q_m, w), h/2 F)
    w+  = slip(w + h   a(t_m, q_m, w_m), h F)
    q+  = q_m + h/2 w+

Second order where the rate keeps its sign, energy held where there is no damping, and w+ is exactly zero while an axis
sticks. Nothing is smoothed and no rate threshold is tuned.

Torques that no catalogue names: ``periodic`` A sin(2 pi f t + phi), a fan in the room; ``detent``, a notch at the angle
q_0 of width d that pulls the axis in, -A x exp((1 - x^2)/2), x = (q - q_0)/d, with its largest torque A at x = +-1;
``by travel`` A sin(n lambda + phi), a column that leans or a slip ring that binds.

The controller, once per sample, from the read angles and its own filtered rates r' = (dy/dt - r) w_f:

    mu_d = mu_d0 + k_pp (theta_ref - theta) - k_dp r_theta + k_ip int(theta_ref - theta)
    mu_s = mu_s0 + k_pe (e_ref - e)         - k_de r_e     + k_ie int(e_ref - e)

v_f = (mu_s + mu_d)/2 and v_r = (mu_s - mu_d)/2 are clipped to plus or minus V_MAX. Beside the joystick the pitch
reference has b_r r_lambda - b_p (lambda_ref - lambda) where travel is controlled, and what the pilot adds to slow down
where the travel is faster than he likes: b (abs(r_lambda) - limit) sign(r_lambda).

All that is compiled stands in this file, because numba's cache on disk looks at the file of the outermost function.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.signal import lfilter

from tests.blind.coefficients import AXES, Coefficients, Strange
from tests.blind.signals import V_MAX

STEP = 0.001
"""Step of the integration [s]."""

COUNTS_PER_TURN = np.array([4096, 4096, 8192])
"""Encoders of pitch, elevation and travel."""


class Control(NamedTuple):
    """Gains of the controller."""

    # Feedforward [V], proportional [V/rad], rate [V s/rad] and integral gain [V/(rad s)] of pitch and elevation.
    mu_d0: float = 0.0
    k_pp: float = 0.0
    k_dp: float = 0.0
    k_ip: float = 0.0
    mu_s0: float = 0.0
    k_pe: float = 0.0
    k_de: float = 0.0
    k_ie: float = 0.0
    # Bandwidth of the rate filter [rad/s].
    rate_bandwidth: float = 25.0
    # Travel loop [1] and [s], zero where the pilot flies the pitch himself.
    b_p: float = 0.0
    b_r: float = 0.0
    # Travel rate that the pilot does not like to exceed [rad/s], and how he leans against it [s].
    speed_limit: float = 1.0
    brake: float = 0.5
    # Largest pitch reference [rad] and largest integral of an error [rad s].
    tilt_limit: float = 0.4
    integral_limit: float = 0.4


def placed(
    base: Coefficients, k_x: float, k_z: float, omega_p: float, zeta_p: float, omega_e: float, zeta_e: float,
    integral: float = 0.0, **more: float,
) -> Control:  # fmt: skip
    """Gains for poles of pitch and elevation, frequency [rad/s] and damping ratio, by gains that may err."""
    k_pp, k_pe = max(omega_p**2 - base.a_th, 0.8) / k_x, max(omega_e**2 - base.a_e, 0.6) / k_z
    return Control(
        mu_d0=-base.a_th * math.sin(base.theta0) / k_x,
        k_pp=k_pp,
        k_dp=2.0 * zeta_p * omega_p / k_x,
        k_ip=0.25 * k_pp * integral,
        k_pe=k_pe,
        k_de=2.0 * zeta_e * math.sqrt(k_pe * k_z + base.a_e) / k_z,
        k_ie=0.5 * k_pe * integral,
    )._replace(**more)


def drawn_poles(t_m: float, rng: np.random.Generator) -> tuple[float, float, float, float]:
    """Draw bandwidth of the rate filter, frequency of pitch and elevation [rad/s], damping ratio, as laboratories tune.

    A loop is no faster than the motors, of time constant ``t_m`` [s], and the filter allow.
    """
    bandwidth = rng.uniform(18.0, 35.0)
    fastest = 0.42 / (t_m + 1.0 / bandwidth)
    omega_p, omega_e = min(rng.uniform(1.6, 2.5), fastest), min(rng.uniform(1.9, 2.6), fastest)
    return bandwidth, omega_p, omega_e, rng.uniform(0.65, 0.9)


class Push(NamedTuple):
    """A push by a hand: axis, start and end since the log began [s], acceleration with its sign [rad/s^2]."""

    axis: str
    start: float
    end: float
    acceleration: float


class Changes(NamedTuple):
    """Numbers that a rig has in turn, the number of those at each sample (n,), and shares of thrust (n, 2) [1]."""

    tables: Sequence[Coefficients]
    which: NDArray[np.int64]
    shares: NDArray[np.float64]


@njit
def pitch_torque(
    th: float, e: float, w: float, w_e: float, w_l: float, mu_s: float, mu_d: float, p: Coefficients
) -> float:
    """Angular acceleration of pitch but for dry friction [rad/s^2]."""
    horizon = 1.0 + p.pitch_gravity_coupling * (math.cos(e + p.elevation_zero) - 1.0)
    return (
        -p.a_wx * w
        - p.a_th * math.sin(th - p.theta0) * horizon
        + p.k_x * mu_d
        - p.quadratic_drag_pitch * w * abs(w)
        + p.constant_torque_pitch
        + p.rotor_mismatch * mu_s
        - p.airspeed_thrust_loss_pitch * mu_s * w
        - p.gyroscopic_coupling_pitch * mu_s * w_e
        + p.speed_stability * w_l
    )


@njit
def gravity_of_arm(e: float, a_1: float, p: Coefficients) -> float:
    """Restoring torque of the arm, linear or with its trigonometry [rad/s^2]."""
    linear = p.a_e * e + a_1
    if p.large_angle_gravity == 0.0:
        return linear
    from_horizon = e + p.elevation_zero
    offset = a_1 - p.a_e * p.elevation_zero
    full = p.a_e * math.sin(from_horizon) + offset * math.cos(from_horizon)
    return linear + p.large_angle_gravity * (full - linear)


@njit
def elevation_torque(
    t: float, th: float, e: float, w: float, w_e: float, w_l: float, mu_s: float, p: Coefficients
) -> float:
    """Angular acceleration of elevation but for dry friction [rad/s^2]."""
    a_1 = p.a_1 + (p.moving_mass if t >= p.mass_time else 0.0)
    more = p.translational_lift_elevation * w_l**2
    if p.ground_effect != 0.0:
        more += p.ground_effect * math.exp(-(e - p.ground_angle) / p.ground_length)
    return (
        -p.a_wz * w_e
        - gravity_of_arm(e, a_1, p)
        - p.a_lt * w * w_l
        + p.k_z * mu_s * math.cos(th) * (1.0 + more)
        + p.thrust_tilt * mu_s * math.sin(th)
        - p.quadratic_drag_elevation * w_e * abs(w_e)
        - p.airspeed_thrust_loss_elevation * mu_s * w_e * math.cos(th)
        + p.gyroscopic_coupling_elevation * mu_s * w
        - 0.5 * p.inertial_coupling_elevation * math.sin(2.0 * (e + p.elevation_zero)) * w_l * w_l
    )


@njit
def travel_torque(th: float, e: float, lam: float, w_e: float, w_l: float, mu_s: float, p: Coefficients) -> float:
    """Angular acceleration of travel but for dry friction [rad/s^2]; a log's travel starts at zero."""
    from_horizon = e + p.elevation_zero
    return (
        -p.a_wy * w_l
        + p.k_y * mu_s * math.sin(th) * (1.0 + p.translational_lift_travel * w_l**2)
        - p.quadratic_drag_travel * w_l * abs(w_l)
        + p.constant_torque_travel
        + p.rotor_drag_torque * mu_s * math.cos(th) * math.cos(from_horizon)
        - p.cable_stiffness * lam
        + 2.0 * p.inertial_coupling_travel * math.tan(from_horizon) * w_e * w_l
    )


@njit
def strange_torque(t: float, angle: float, travel: float, u: Strange) -> float:
    """Unknown angular acceleration at time t of the axis at `angle` [rad/s^2]."""
    total = 0.0
    if u.periodic != 0.0:
        total += u.periodic * math.sin(2.0 * math.pi * u.frequency * t + u.phase)
    if u.detent != 0.0:
        x = (angle - u.centre) / u.width
        total -= u.detent * x * math.exp((1.0 - x * x) / 2.0)
    if u.by_travel != 0.0:
        total += u.by_travel * math.sin(u.waves * travel + u.phase)
    return total


_ROUNDING = 1e-9
"""Keeps a step that starts on a sample from falling into the one before [s]."""


@njit
def delayed(voltages: NDArray, rotor: int, t: float, h: float, sample: float, delay: float) -> float:
    """Mean over [t, t + h] of the held voltage as it was `delay` ago; before the log, its first value [V]."""
    start = t - delay + _ROUNDING
    first = math.floor(start / sample)
    last = math.floor((start + h - 2 * _ROUNDING) / sample)
    v_first = voltages[min(max(first, 0), voltages.shape[0] - 1), rotor]
    if last == first:
        return v_first
    v_last = voltages[min(max(last, 0), voltages.shape[0] - 1), rotor]
    share = (start + h - last * sample) / h
    return v_first + share * (v_last - v_first)


@njit
def beyond_dead_zone(v: float, width: float) -> float:
    """Voltage that is left of v after a dead zone [V]."""
    if abs(v) <= width:
        return 0.0
    return v - math.copysign(width, v)


@njit
def spun(nu: float, v: float, h: float, time_constant: float) -> float:
    """Motor state after a step h at the voltage v, by the implicit midpoint rule [V]."""
    r = h / (2.0 * time_constant)
    return ((1.0 - r) * nu + 2.0 * r * v) / (1.0 + r)


@njit
def thrust(nu: float, t: float, p: Coefficients) -> float:
    """Thrust of a rotor at the motor state nu, as the voltage at which an ideal rotor would give it [V]."""
    f = nu + p.quadratic_thrust * nu * abs(nu)
    if f < 0.0:
        f *= 1.0 - p.reverse_thrust_loss
    return f * (1.0 - p.thrust_fade * t)


@njit
def level(w: float, coulomb: float, breakaway: float, stribeck_rate: float) -> float:
    """Largest torque of dry friction at the rate w [rad/s^2]."""
    if breakaway == 0.0:
        return coulomb
    return coulomb + breakaway * math.exp(-((w / stribeck_rate) ** 2))


@njit
def slowed(w: float, impulse: float) -> float:
    """Rate after dry friction has taken at most `impulse` [rad/s] from the rate w; exactly zero when it sticks."""
    if w > impulse:
        return w - impulse
    if w < -impulse:
        return w + impulse
    return 0.0


@njit
def bent(z: float, w: float, x: float, h: float) -> float:
    """Deflection of the bristles after a step h at the rate w; implicit in z, so it never exceeds x [rad]."""
    return (z + h * w) / (1.0 + h * abs(w) / x)


@njit
def clipped(x: float, limit: float) -> float:
    """Give x, at most `limit` in size."""
    return min(max(x, -limit), limit)


@njit
def pitch_reference(joystick: float, travel_reference: float, travel: float, travel_rate: float, c: Control) -> float:
    """Pitch that the controller is to hold [rad]."""
    wanted = joystick + c.b_r * travel_rate - c.b_p * (travel_reference - travel)
    if abs(travel_rate) > c.speed_limit:
        wanted += c.brake * math.copysign(abs(travel_rate) - c.speed_limit, travel_rate)
    return clipped(wanted, c.tilt_limit)


@njit
def beam_acceleration(th: float, horizon: float, w_e: float, w_l: float, a_l: float) -> float:
    """Angular acceleration about the pitch axis of a thin beam across it that nothing turns [rad/s^2].

    By Euler's equation of the beam's own axes, x' = -y z with rates x about the pitch axis, y along the beam and z;
    x is the pitch's rate and the travel's share of it, and the travel accelerates with a_l.
    """
    y = w_l * math.cos(horizon) * math.sin(th) - w_e * math.cos(th)
    z = w_l * math.cos(horizon) * math.cos(th) + w_e * math.sin(th)
    return -y * z - (a_l * math.sin(horizon) + w_l * w_e * math.cos(horizon))


@njit
def accelerations(t, q, w, mu_s, mu_d, p, u, room):
    """Smooth accelerations of the three axes, the unknown torque u and the added torques `room` among them."""
    a = np.empty(3)
    a[0] = pitch_torque(q[0], q[1], w[0], w[1], w[2], mu_s, mu_d, p)
    a[1] = elevation_torque(t, q[0], q[1], w[0], w[1], w[2], mu_s, p)
    a[2] = travel_torque(q[0], q[1], q[2], w[1], w[2], mu_s, p)
    if q[1] < p.table_angle:
        a[1] += max(0.0, 800.0 * (p.table_angle - q[1]) - 40.0 * w[1])
    for i in range(3):
        a[i] += room[i]
    a[2] += p.product_of_inertia * a[0]
    if p.inertial_coupling_pitch != 0.0:
        a[0] += p.inertial_coupling_pitch * beam_acceleration(q[0], q[1] + p.elevation_zero, w[1], w[2], a[2])
    if u.axis >= 0:
        a[u.axis] += strange_torque(t, q[u.axis], q[2], u)
    return a


@njit
def kicked(w, a, coulomb, breakaway, z, at_rate, h, p):
    """Rates after h of the accelerations a and of dry friction, whose level is that at `at_rate`."""
    w_next = w + h * a
    for i in range(3):
        if coulomb[i] == 0.0 and breakaway[i] == 0.0:
            continue
        friction = level(at_rate[i], coulomb[i], breakaway[i], p.stribeck_rate)
        if p.presliding > 0.0:
            w_next[i] -= h * friction * z[i] / p.presliding
        else:
            w_next[i] = slowed(w_next[i], h * friction)
    return w_next


@njit(cache=True)
def _fly(
    references, voltages, start, lead, closed, torque, shake, zeros, sample, steps, hover_elevation, c, tables, which,
    shares, u,
):  # fmt: skip
    n = references.shape[0]
    h = sample / steps
    resolution = 2 * np.pi / COUNTS_PER_TURN
    read, angles, rates = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    q, w, z = start.copy(), np.zeros(3), np.zeros(3)
    p = tables[which[0]]
    nu = np.array([beyond_dead_zone(voltages[0, 0], p.dead_zone), beyond_dead_zone(voltages[0, 1], p.dead_zone)])
    bend, bend_rate = p.arm_bending * (thrust(nu[0], 0.0, p) + thrust(nu[1], 0.0, p)), 0.0
    smoothing = 1.0 - math.exp(-c.rate_bandwidth * sample)
    r, integral, before = np.zeros(3), np.zeros(2), np.zeros(3)
    nu_next, cable_rest = np.empty(2), q[2]
    for k in range(n):
        p = tables[which[k]]
        coulomb = np.array([p.dry_friction_pitch, p.dry_friction_elevation, p.dry_friction_travel])
        breakaway = np.array([p.breakaway_friction_pitch, p.breakaway_friction_elevation, p.breakaway_friction_travel])
        time_constant = p.t_m + p.motor_lag
        stiffness = (2.0 * math.pi * p.bending_frequency) ** 2
        damping = 4.0 * math.pi * p.bending_damping * p.bending_frequency
        angles[k], rates[k] = q, w
        angles[k, 1] += bend
        for i in range(3):
            read[k, i] = resolution[i] * round((angles[k, i] + zeros[i]) / resolution[i] + shake[k, i])
        if closed:
            if k > 0:
                r += smoothing * ((read[k] - before) / sample - r)
            before[:] = read[k]
            wanted = pitch_reference(references[k, 0], references[k, 2], read[k, 2], r[2], c)
            pitch_error = wanted - read[k, 0]
            elevation_error = hover_elevation + references[k, 1] - read[k, 1]
            integral[0] = clipped(integral[0] + sample * pitch_error, c.integral_limit)
            integral[1] = clipped(integral[1] + sample * elevation_error, c.integral_limit)
            asked_d = c.mu_d0 + c.k_pp * pitch_error - c.k_dp * r[0] + c.k_ip * integral[0]
            asked_s = c.mu_s0 + c.k_pe * elevation_error - c.k_de * r[1] + c.k_ie * integral[1]
            # Five decimals are what the files hold; the rig gets what the file says.
            voltages[k, 0] = round(1e5 * clipped((asked_s + asked_d) / 2, V_MAX)) / 1e5
            voltages[k, 1] = round(1e5 * clipped((asked_s - asked_d) / 2, V_MAX)) / 1e5
        if k == lead:
            cable_rest = q[2]
        for j in range(steps):
            t = k * sample + j * h
            middle = t + h / 2
            for i in range(2):
                v = delayed(voltages, i, t, h, sample, p.input_delay)
                nu_next[i] = spun(nu[i], beyond_dead_zone(v, p.dead_zone), h, time_constant)
            f_front = shares[k, 0] * thrust((nu[0] + nu_next[0]) / 2, middle, p)
            f_rear = shares[k, 1] * thrust((nu[1] + nu_next[1]) / 2, middle, p)
            nu[:] = nu_next
            mu_s, mu_d = f_front + f_rear, f_front - f_rear

            added = torque[k * steps + j]
            q_m = q + h / 2 * w
            q_m[2] -= cable_rest
            z_m = z
            if p.presliding > 0.0:
                z_m = np.array([bent(z[i], w[i], p.presliding, h / 2) for i in range(3)])
            a = accelerations(middle, q_m, w, mu_s, mu_d, p, u, added)
            w_m = kicked(w, a, coulomb, breakaway, z, w, h / 2, p)
            a = accelerations(middle, q_m, w_m, mu_s, mu_d, p, u, added)
            w = kicked(w, a, coulomb, breakaway, z_m, w_m, h, p)
            q = q_m + h / 2 * w
            q[2] += cable_rest
            if p.presliding > 0.0:
                z = np.array([bent(z_m[i], w[i], p.presliding, h / 2) for i in range(3)])

            bend += h / 2 * bend_rate
            pull = stiffness * (p.arm_bending * mu_s - bend)
            bend_rate = ((1.0 - damping * h / 2) * bend_rate + h * pull) / (1.0 + damping * h / 2)
            bend += h / 2 * bend_rate
    return read, angles, rates


def fly(
    voltages: NDArray[np.floating],
    start: NDArray[np.float64],
    coefficients: Coefficients,
    torque: NDArray[np.float64],
    shake: NDArray[np.float64],
    *,
    control: Control | None = None,
    references: NDArray[np.float64] | None = None,
    hover: float = 0.0,
    rate: float = 100.0,
    lead: int = 0,
    zeros: Sequence[float] = (0.0, 0.0, 0.0),
    strange: Strange = Strange(),  # noqa: B008
    changes: Changes | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Fly once, from rest, motors in steady state for the first voltages.

    Given are ``voltages`` (n, 2), held over each sample [V], of which only the first count under a ``control``; the
    ``start`` of pitch, elevation and travel [rad]; ``torque`` (n steps, 3), further torque over inertia at each step of
    1 ms [rad/s^2]; ``shake`` (n, 3) of the encoders' lines [counts], which read ``zeros`` [rad] where the angles are
    zero; ``references`` (n, 3) of the controller, on elevation about the elevation ``hover`` [rad]; the ``rate`` of
    samples [Hz] and how many ``lead`` the log, where the cable is relaxed; ``changes`` in place of `coefficients` where
    the rig changes.

    Returns, at each sample, what the encoders say, the true angles (bending of the arm included) [rad], the rates of
    the rigid body [rad/s] (n, 3), and the voltages as they are written down [V] (n, 2).
    """
    n, held = len(voltages), np.array(voltages, dtype=float)
    changes = changes or Changes((coefficients,), np.zeros(n, dtype=np.int64), np.ones((n, 2)))
    tables = np.array([tuple(table) for table in changes.tables], [(name, float) for name in Coefficients._fields])
    asked = np.zeros((n, 3)) if references is None else references
    read, angles, rates = _fly(
        asked, held, np.array(start, dtype=float), lead, control is not None, torque, shake, np.array(zeros),
        1.0 / rate, round(1.0 / rate / STEP), hover, control or Control(), tables, changes.which, changes.shares,
        strange,
    )  # fmt: skip
    return read, angles, rates, held


def room_torque(noise: NDArray[np.float64], std: float, correlation_time: float) -> NDArray[np.float64]:
    """Ornstein-Uhlenbeck torque r' = -r/tau + noise at each step of 1 ms [rad/s^2], from its normal numbers (m, 3)."""
    stay = math.exp(-STEP / correlation_time)
    kicks = std * math.sqrt(1.0 - stay * stay) * noise
    kicks[0] = std * noise[0]
    torque: NDArray[np.float64] = lfilter([1.0], [1.0, -stay], kicks, axis=0)
    return torque


def push_torque(count: int, pushes: Sequence[Push]) -> NDArray[np.float64]:
    """Torque of pushes at each step of 1 ms [rad/s^2], shape (count, 3); the force of a hand rises within .05 s."""
    t, torque = STEP * np.arange(count), np.zeros((count, 3))
    for axis, start, end, acceleration in pushes:
        inside = np.minimum(t - start, end - t) / 0.05
        share = np.sin(0.5 * np.pi * np.clip(inside, 0.0, 1.0)) ** 2
        torque[:, AXES.index(axis)] += acceleration * share
    return torque
