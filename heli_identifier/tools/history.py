"""The on-line identifier over the logs of one rig: the estimates of each over time, and all logs together.

**Prediction errors** of several logs, by the information that they have of each log. A log of half a minute leaves
combinations of parameters open: gain with stiffness, gain with damping, gain with the colour of the air. Means of
single parameters, each weighted by its own standard error, throw away what the logs say about the combinations. With
Omega_l and Gamma_l of log l, the noise model nu behind the parameters, P the prior that each of the L logs began with,
and Z by how much the zero of an encoder differs from log to log,

    H     = sum_l (Gamma_l + Z)^-1 - (L - 1) P^-1
    Omega = H^-1 (sum_l (Gamma_l + Z)^-1 Omega_l - (L - 1) P^-1 Omega(0))

The variance of a combination j^T Omega is j^T H^-1 j, over the share of it that came from outside the loops of all logs
(:mod:`heli_identifier.online.loop`), times the square of the Birge ratio (Birge, Physical Review 40 (1932)) where
that exceeds 1: the logs then scatter beyond their errors. A single log keeps the standard errors that it has.

**The adaptation**: means of single parameters, each weighted by the inverse square of its standard error, with the
Birge ratio as well.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from heli_identifier import online
from heli_identifier.online import Estimate, IdentifierOutput, IdentifierState, ModelParameters, Plan
from heli_identifier.records import Log
from heli_identifier.results import Axes, figure, label_with_unit
from heli_identifier.tools import meta_analysis
from heli_identifier.tracing import plausible_range
from heli_plant.effects import AXES
from heli_plant.parameters import BY_FIELD

Array = NDArray[np.float64]

NAMES = ModelParameters._fields
"""The paper's symbols of the estimated parameters; fields of :class:`~heli_plant.parameters.PlantParameters`."""

ROLES = ("after", "before", "third", "measured")  # colours of the logs; of more logs all have the last one
ZERO = 0.02  # standard deviation of an encoder's zero from log to log [rad]: a rig is switched on in another position
CONSISTENT = 2.0  # Birge ratio above which logs disagree by more than their standard errors allow
_STIFFNESS, _TORQUE = 1, 2  # places in Omega: a zero moves the constant torque by the stiffness times itself


class EstimateHistory(NamedTuple):
    """Estimates of one log over time.

    ``time`` [s], shape (M,); ``parameters`` and ``standard_errors`` by :data:`NAMES`, shape (M, 11), in the units of
    the plant; ``state`` of the identifier at the end, standard errors evaluated there, and its ``plan``.
    """

    name: str
    time: Array
    parameters: Array
    standard_errors: Array
    state: IdentifierState
    plan: Plan

    @property
    def last(self) -> dict[str, Estimate]:
        """The last estimates by symbol."""
        return estimates_of(online.output_of(self.state, self.plan), self.plan)


def estimates_of(output: IdentifierOutput, plan: Plan) -> dict[str, Estimate]:
    """Return estimates by symbol, with the motors' lag ``T_m`` where it was estimated; what is given has no error."""
    found = list(zip(NAMES, output.parameters, output.standard_errors, strict=True))
    found += [("T_m", *output.lag)] if plan.estimates_lag else []
    return {name: Estimate(value, error or None, BY_FIELD[name].unit) for name, value, error in found}


def identify_log(log: Log, settings: online.IdentifierSettings) -> EstimateHistory:
    """Run the identifier over a log, with its references where it has any.

    The history has a row for every evaluation of the standard errors.
    """
    plan = online.prepare(settings)
    samples = list(map(tuple, np.column_stack((log.voltages, log.angles)).tolist()))
    rest = np.zeros(len(samples))
    asked = list(map(tuple, np.column_stack([log.references.get(axis, rest) for axis in AXES]).tolist()))
    state = online.start(plan, samples[0], asked[0])
    every, last = max(1, round(settings.report_interval / settings.sample_time)), len(samples) - 1
    rows = []
    for k in range(1, len(samples)):
        state, output = online.step(state, samples[k], plan, asked[k])
        if (k % every == 0 and output.adapting) or k == last:
            rows.append((k * settings.sample_time, *output.parameters, *output.standard_errors))
    time, parameters, errors = np.split(np.array(rows), (1, 1 + len(NAMES)), axis=1)
    return EstimateHistory(log.name, time[:, 0], parameters, errors, state, plan)


def history_text(histories: Sequence[EstimateHistory]) -> str:
    """Return histories as CSV: log, time, every parameter and every standard error."""
    columns = [f"{name} [{BY_FIELD[name].unit}]" for name in NAMES]
    heads = ["time [s]", *columns, *(f"standard_error.{column}" for column in columns)]
    rows = {
        one.name: pd.DataFrame(np.column_stack((one.time, one.parameters, one.standard_errors)), columns=heads)
        for one in histories
    }
    return pd.concat(rows, names=["log"]).droplevel(1).to_csv()


def history_figure(histories: Sequence[EstimateHistory], together: Mapping[str, Estimate], voltage_limit: float) -> str:
    """Draw every parameter over time, one line per log with its 95 % band, and the value of all logs together.

    The ordinate ends where hardly any rig with this ``voltage_limit`` [V] has the parameter, unless the value of all
    logs lies beyond.
    """
    panels, several = [], len(histories) > len(ROLES)
    for column, name in enumerate(NAMES):
        final, (low, high) = together[name].value, plausible_range(name, voltage_limit)
        panel, ends = Axes(label_with_unit(name, BY_FIELD[name].unit), 130.0), [final]
        for history, role in zip(histories, ROLES[-1:] * len(histories) if several else ROLES, strict=False):
            value, half = history.parameters[:, column], 1.96 * history.standard_errors[:, column]
            panel.band(history.time, value - half, value + half, role=role)
            panel.line(history.time, value, role, f"each of {len(histories)} logs" if several else history.name, 1.1)
            late = history.time >= 0.5 * history.time[-1]
            ends += [*(value - half)[late], *(value + half)[late]]
        panel.level(final, "ink", "together")
        bottom, top = min(final, max(min(ends), low)), max(final, min(max(ends), high))
        room = 0.25 * max(top - bottom, 1e-6)
        panel.limits = (bottom - room, top + room)
        panels.append(panel)
    return figure(panels, "time [s]", "Estimates over time", 640.0)


# --- all logs together ------------------------------------------------------------------------------------------------


class Together(NamedTuple):
    """Estimates from several logs together by symbol, with the motors' lag ``T_m`` where it was estimated.

    ``notes`` are on logs that disagree; ``noise`` are the noise models of pitch, elevation and travel, none where the
    method was the adaptation.
    """

    estimates: Mapping[str, Estimate]
    notes: tuple[str, ...]
    noise: tuple[online.Noise, ...] = ()


def combine_histories(histories: Sequence[EstimateHistory]) -> Together:
    """Combine prediction errors of logs that began with one prior; their sampling periods may differ."""
    plan, last = histories[-1].plan, histories[-1].state
    together = [_of_axis([one.state for one in histories], axis, plan) for axis in range(3)]

    def state_with(part: int) -> IdentifierState:
        """State of all logs together, with a part of what is known of each axis as its standard errors."""
        axes = []
        for axis, of in zip(last.axes, together, strict=True):
            omega, errors = (tuple(of[k].tolist()) for k in (0, part))
            axes.append(axis._replace(estimate=axis.estimate._replace(omega=omega, standard_errors=errors)))
        return last._replace(axes=(axes[0], axes[1], axes[2]))

    state = state_with(1)
    found, scatter = estimates_of(online.output_of(state, plan), plan), online.output_of(state_with(2), plan)
    outputs = [online.output_of(one.state, one.plan) for one in histories]
    notes = (*_describe_scatter(scatter.standard_errors._asdict()), *_contradictions(found, outputs))
    return Together(found, notes, tuple(online.noise_of(axis.estimate) for axis in state.axes))


def _of_axis(states: Sequence[IdentifierState], axis: int, plan: Plan) -> tuple[Array, Array, Array]:
    """Omega of an axis, the standard errors of what is reported of it, and their Birge ratios; the prior is the plan's.

    What a log gives enters by its time constants, not by its samples, so the plan of any log serves.
    """
    own, others, estimates = plan.axes[axis], len(states) - 1, [state.axes[axis].estimate for state in states]
    omegas = np.array([one.omega for one in estimates])
    gammas = np.array([online.gain_matrix(one.factor, len(one.omega)) for one in estimates])
    spread = gammas.copy()
    if others and own.gain > _TORQUE:
        spread[:, _TORQUE, _TORQUE] += (ZERO * np.median(np.abs(omegas[:, _STIFFNESS]))) ** 2
    informations, prior = np.linalg.inv(spread), np.diag(1.0 / np.array(own.prior))
    H = informations.sum(axis=0) - others * prior
    g = np.einsum("lij,lj->i", informations, omegas) - others * prior @ np.array(own.first)
    omega = np.linalg.solve(H, g)
    rows = np.array(online.combinations(axis, estimates[-1]._replace(omega=tuple(omega.tolist())), plan))
    if not others:
        return omega, np.array(estimates[0].standard_errors), np.zeros(len(rows))
    outside = [p.outside for state in states if (p := state.axes[axis].predictor) is not None]
    products = tuple(np.sum([one.products for one in outside], axis=0).tolist())
    counted = np.array(online.shares(outside[0]._replace(products=products), tuple(map(tuple, rows.tolist()))))
    rows = np.pad(rows, ((0, 0), (0, len(omega) - rows.shape[1])))  # of nu nothing is reported
    scatter = ((omegas - omega) @ rows.T) ** 2 / np.einsum("mi,lij,mj->lm", rows, gammas, rows)
    ratios = np.sqrt(scatter.sum(axis=0) / others)
    variance = np.einsum("ij,ji->i", rows, np.linalg.solve(H, rows.T))
    return omega, np.sqrt(variance / counted) * np.maximum(1.0, ratios), ratios


def combine_estimates(logs: Sequence[Mapping[str, Estimate]]) -> Together:
    """Combine estimates by symbol of several logs, each weighted by the inverse square of its standard error."""
    found, ratios = {}, {}
    for name, first in logs[0].items():
        values = np.array([log[name].value for log in logs])
        errors = np.array([log[name].standard_error or 0.0 for log in logs])
        mean, error = float(values.mean()), None
        if (errors > 0.0).all():  # a known rest angle has no error
            mean, error, ratios[name] = _weighted_mean(values, errors)
            error *= max(ratios[name], 1.0)
        found[name] = Estimate(mean, error, first.unit)
    return Together(found, _describe_scatter(ratios))


def _weighted_mean(values: Array, errors: Array) -> tuple[float, float, float]:
    """Return mean, standard error and Birge ratio, 0 of a single value."""
    mean, Q, precision = meta_analysis.weighted_mean(values, errors, 0.0)
    return mean, precision**-0.5, float(np.sqrt(Q / max(len(values) - 1, 1)))


def _contradictions(estimates: Mapping[str, Estimate], outputs: Sequence[Any]) -> list[str]:
    """Return a sentence for each gain that the references of all logs exclude."""
    found = []
    for axis, name in enumerate(online.GAINS):
        known = [(o.instruments[axis], o.instrument_errors[axis]) for o in outputs if o.instrument_errors[axis] > 0.0]
        if not known:
            continue
        value, error, _ = _weighted_mean(*np.array(known).T)
        if abs(value - estimates[name].value) > online.CONTRADICTION * error:
            found.append(
                f"{name} = {estimates[name].value:.3g} rests on a noise model that the references contradict: they "
                f"give {value:.3g} ± {1.96 * error:.2g} {BY_FIELD[name].unit}. The air has another colour than the "
                "model allows, or what was logged as a reference answers the rig"
            )
    return found


def _describe_scatter(ratios: Mapping[str, float]) -> tuple[str, ...]:
    """Return what is to be said of logs that scatter by these Birge ratios."""
    notes = [
        f"{name}: the logs scatter {ratio:.1f} times as far as their standard errors say"
        for name, ratio in ratios.items()
        if ratio > CONSISTENT
    ]
    if notes:
        notes.append(
            "logs that disagree come from a rig with an effect that the model lacks, or from a rig that changes: "
            "run `heli diagnose`"
        )
    return tuple(notes)
