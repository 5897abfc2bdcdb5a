"""Logs of one rig together, by the information that prediction errors have of each.

A log of half a minute leaves combinations of parameters open: gain with stiffness, gain with damping. Means of single
parameters, each weighted by its own standard error, throw away what the logs say about the combinations. With Omega_l
and Gamma_l of log l, P the prior that each of the L logs began with, and Z by how much the zero of an encoder differs
from log to log,

    H     = sum_l (Gamma_l + Z)^-1 - (L - 1) P^-1
    Omega = H^-1 (sum_l (Gamma_l + Z)^-1 Omega_l - (L - 1) P^-1 Omega(0))

The variance of a combination j^T Omega is j^T H^-1 j, over the share of it that came from outside the loops of all logs
(:mod:`heli_identifier.online.loop`), times the square of the Birge ratio (Birge, Physical Review 40 (1932)) where
that exceeds 1: the logs then scatter beyond their errors. A single log keeps the standard errors that it has.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import (
    CONTRADICTION,
    GAINS,
    Estimate,
    IdentifierState,
    Plan,
    combinations,
    gain_matrix,
    output_of,
    shares,
)
from heli_plant.parameters import BY_FIELD

Array = NDArray[np.float64]

ZERO = 0.02
"""Standard deviation of an encoder's zero from log to log [rad]: a rig is switched on in another position."""

_STIFFNESS, _TORQUE = 1, 2
"""Places in Omega of pitch and elevation: a zero moves the constant torque by the stiffness times itself."""

Flight = tuple[IdentifierState, Plan]
"""What the identifier knew at the end of a log."""


def joint(flights: Sequence[Flight]) -> tuple[dict[str, Estimate], dict[str, float]]:
    """Return the estimates of all logs together by symbol, and by how much the logs scatter beyond their errors [1].

    Parameters
    ----------
    flights : sequence of (IdentifierState, Plan)
        Final states of prediction errors, standard errors evaluated there, and the plan, the same lag in all of them.

    Returns
    -------
    estimates : dict of Estimate
        With the motors' lag ``T_m`` where it was estimated.
    ratios : dict of float
        Birge ratios, 0 for a single log.
    """
    state, plan = flights[-1]
    omegas, informations = zip(*(_together(flights, axis) for axis in range(3)), strict=True)
    state = _with(state, "omega", omegas)
    rows = [np.array(own) for own in combinations(state, plan)]
    errors, ratios = zip(*(_errors(flights, a, omegas[a], informations[a], rows[a]) for a in range(3)), strict=True)
    output = output_of(_with(state, "standard_errors", errors), plan)
    scatter = output_of(_with(state, "standard_errors", ratios), plan)
    found = {
        name: Estimate(value, error if error > 0.0 else None, BY_FIELD[name].unit)
        for name, value, error in zip(output.parameters._fields, output.parameters, output.standard_errors, strict=True)
    }
    if plan.estimates_lag:
        found["T_m"] = Estimate(*output.lag, BY_FIELD["T_m"].unit)
    return found, scatter.standard_errors._asdict()


def contradictions(estimates: Mapping[str, Estimate], flights: Sequence[Flight]) -> tuple[str, ...]:
    """Return a sentence for each gain that the references of all logs exclude."""
    found = []
    outputs = [output_of(state, plan) for state, plan in flights]
    for axis, name in enumerate(GAINS):
        known = [(o.instruments[axis], o.instrument_errors[axis]) for o in outputs if o.instrument_errors[axis] > 0.0]
        if not known:
            continue
        values, errors = np.array(known).T
        weights = errors**-2.0
        value, error = float(weights @ values / weights.sum()), float(weights.sum() ** -0.5)
        if abs(value - estimates[name].value) > CONTRADICTION * error:
            found.append(
                f"{name} = {estimates[name].value:.3g} rests on a noise model that the references contradict: they "
                f"give {value:.3g} ± {1.96 * error:.2g} {BY_FIELD[name].unit}. The air has another colour than the "
                "model allows, or what was logged as a reference answers the rig"
            )
    return tuple(found)


def _with(state: IdentifierState, field: str, values: Sequence[Array]) -> IdentifierState:
    """Return ``state`` with a ``field`` of the estimates of its three axes replaced."""
    changes: list[dict[str, Any]] = [{field: tuple(own.tolist())} for own in values]
    pitch, elevation, travel = (
        axis._replace(estimate=axis.estimate._replace(**change))
        for axis, change in zip(state.axes, changes, strict=True)
    )
    return state._replace(axes=(pitch, elevation, travel))


def _known(state: IdentifierState, axis: int) -> tuple[Array, Array]:
    """Return Omega and Gamma of an axis without the noise model."""
    own = state.axes[axis].estimate
    n = len(own.standard_errors)
    return np.array(own.omega[:n]), np.array(gain_matrix(own.factor, len(own.omega)))[:n, :n]


def _together(flights: Sequence[Flight], axis: int) -> tuple[Array, Array]:
    """Return Omega and H of an axis."""
    known = [_known(state, axis) for state, _ in flights]
    own = flights[0][1].axes[axis]
    first, prior = np.array(own.first[: own.reported]), np.array(own.prior[: own.reported])
    others = len(flights) - 1
    H = -others * np.diag(1.0 / prior)
    g = H @ first
    for omega, gain in known:
        if others and _TORQUE < len(omega) - 1 and axis < 2:
            gain[_TORQUE, _TORQUE] += (ZERO * np.median([abs(x[_STIFFNESS]) for x, _ in known])) ** 2
        information = np.linalg.inv(gain)
        H, g = H + information, g + information @ omega
    return np.linalg.solve(H, g), H


def _errors(flights: Sequence[Flight], axis: int, omega: Array, H: Array, rows: Array) -> tuple[Array, Array]:
    """Return the standard errors of the combinations ``rows`` (m, n) and the Birge ratios, each of shape (m,)."""
    outside = [p.outside for state, _ in flights if (p := state.axes[axis].predictor) is not None]
    if len(flights) == 1:
        return np.array(flights[0][0].axes[axis].estimate.standard_errors), np.zeros(len(rows))
    products = tuple(np.sum([own.products for own in outside], axis=0).tolist())
    counted = np.array(shares(outside[0]._replace(products=products), tuple(map(tuple, rows.tolist()))))
    scatter = np.zeros(len(rows))
    for state, _ in flights:
        value, gain = _known(state, axis)
        scatter += (rows @ (value - omega)) ** 2 / np.einsum("ij,jk,ik->i", rows, gain, rows)
    ratios = np.sqrt(scatter / (len(flights) - 1))
    variance = np.einsum("ij,ji->i", rows, np.linalg.solve(H, rows.T))
    return np.sqrt(variance / counted) * np.maximum(1.0, ratios), ratios
