"""The on-line identifier over the logs of one rig: the estimates of each log over time, and of all logs together.

Estimates of several logs are combined by their information matrices. A log of half a minute does not determine some
combinations of parameters: gain with stiffness, gain with damping, gain with the colour of the air. Means of single
parameters, each weighted by its own standard error, would lose what the logs say about the combinations. With Omega_l
and Gamma_l of log l, in which the noise model nu follows the parameters, the prior P with which each of the L logs
started, and the variance Z of an encoder's zero from log to log,

    H     = sum_l (Gamma_l + Z)^-1 - (L - 1) P^-1
    Omega = H^-1 (sum_l (Gamma_l + Z)^-1 Omega_l - (L - 1) P^-1 Omega(0))

The variance of a combination j^T Omega is j^T H^-1 j, divided by the share of it that came from outside the loops of
all logs (:mod:`heli_identifier.online.loop`), times the square of the Birge ratio (Birge, Physical Review 40 (1932))
if this exceeds 1: the logs then scatter beyond their errors. A single log keeps its standard errors.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from heli_identifier import online
from heli_identifier.online import Estimate, IdentifierOutput, IdentifierState, ModelParameters, Plan
from heli_identifier.records import Array, Log
from heli_identifier.results import Axes, figure, label_with_unit
from heli_identifier.tools import meta_analysis
from heli_identifier.tracing import plausible_range
from heli_plant.effects import AXES
from heli_plant.parameters import BY_FIELD

NAMES = ModelParameters._fields
"""The paper's symbols of the estimated parameters; fields of :class:`heli_plant.parameters.PlantParameters`."""

ROLES = ("after", "before", "third", "measured")  # colours of the logs; if there are more logs, all have the last one
ZERO = 0.02  # standard deviation of an encoder's zero from log to log [rad]: a rig is switched on in another position
CONSISTENT = 2.0  # Birge ratio above which logs disagree by more than their standard errors allow
_STIFFNESS, _TORQUE = 1, 2  # indices in Omega; another zero changes the constant torque by the stiffness times the zero


class EstimateHistory(NamedTuple):
    """Estimates of one log over time.

    ``time`` [s], shape (M,); ``parameters`` and ``standard_errors`` by :data:`NAMES`, shape (M, 11), in the units of
    the plant; the ``state`` of the identifier at the end, with standard errors, and its ``plan``.
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
    """Return estimates by symbol, with the motors' lag ``T_m`` if it was estimated; given values have no error."""
    rows = list(zip(NAMES, output.parameters, output.standard_errors, strict=True))
    rows += [("T_m", *output.lag)] if plan.estimates_lag else []
    return {name: Estimate(value, error or None, BY_FIELD[name].unit) for name, value, error in rows}


def identify_log(log: Log, settings: online.IdentifierSettings) -> EstimateHistory:
    """Run the identifier over a log, with its references if it has any.

    The history has a row for every evaluation of the standard errors.
    """
    plan = online.prepare(settings)
    samples = list(map(tuple, np.column_stack((log.voltages, log.angles)).tolist()))
    zero = np.zeros(len(samples))
    references = list(map(tuple, np.column_stack([log.references.get(axis, zero) for axis in AXES]).tolist()))
    state = online.start(plan, samples[0], references[0])
    every, last = max(1, round(settings.report_interval / settings.sample_time)), len(samples) - 1
    rows = []
    for k in range(1, len(samples)):
        state, output = online.step(state, samples[k], plan, references[k])
        if (k % every == 0 and output.adapting) or k == last:
            rows.append((k * settings.sample_time, *output.parameters, *output.standard_errors))
    time, parameters, errors = np.split(np.array(rows), (1, 1 + len(NAMES)), axis=1)
    return EstimateHistory(log.name, time[:, 0], parameters, errors, state, plan)


def history_text(histories: Sequence[EstimateHistory]) -> str:
    """Return histories as CSV: log, time, every parameter and every standard error."""
    names = [f"{name} [{BY_FIELD[name].unit}]" for name in NAMES]
    columns = ["time [s]", *names, *(f"standard_error.{name}" for name in names)]
    frames = {
        h.name: pd.DataFrame(np.column_stack((h.time, h.parameters, h.standard_errors)), columns=columns)
        for h in histories
    }
    return pd.concat(frames, names=["log"]).droplevel(1).to_csv()


def history_figure(histories: Sequence[EstimateHistory], together: Mapping[str, Estimate], voltage_limit: float) -> str:
    """Draw every parameter over time, one line per log with its 95 % band, and the value of all logs together.

    The ordinate ends at the plausible range of rigs with this ``voltage_limit`` [V], unless the value of all logs lies
    outside.
    """
    panels, many = [], len(histories) > len(ROLES)
    for column, name in enumerate(NAMES):
        final, (low, high) = together[name].value, plausible_range(name, voltage_limit)
        panel, ends = Axes(label_with_unit(name, BY_FIELD[name].unit), 130.0), [final]
        for history, role in zip(histories, ROLES[-1:] * len(histories) if many else ROLES, strict=False):
            value, half = history.parameters[:, column], 1.96 * history.standard_errors[:, column]
            panel.band(history.time, value - half, value + half, role=role)
            panel.line(history.time, value, role, f"each of {len(histories)} logs" if many else history.name, 1.1)
            late = history.time >= 0.5 * history.time[-1]
            ends += [*(value - half)[late], *(value + half)[late]]
        panel.level(final, "ink", "together")
        bottom, top = min(final, max(min(ends), low)), max(final, min(max(ends), high))
        room = 0.25 * max(top - bottom, 1e-6)
        panel.limits = (bottom - room, top + room)
        panels.append(panel)
    return figure(panels, "time [s]", "Estimates over time", 640.0)


# --- all logs together ------------------------------------------------------------------------------------------------


class CombinedEstimates(NamedTuple):
    """Estimates from several logs together by symbol, with the motors' lag ``T_m``.

    ``notes`` are about logs that disagree; ``noise`` holds the noise models of pitch, elevation and travel.
    """

    estimates: Mapping[str, Estimate]
    notes: tuple[str, ...]
    noise: tuple[online.Noise, ...]


def combine_histories(histories: Sequence[EstimateHistory]) -> CombinedEstimates:
    """Combine prediction errors of logs that started with the same prior; their sampling periods may differ."""
    plan, last = histories[-1].plan, histories[-1].state
    axes, notes = [], list[str]()
    for index, axis in enumerate(last.axes):
        omega, errors, ratio = _combine_axis([history.state for history in histories], index, plan)
        estimate = axis.estimate._replace(omega=tuple(omega.tolist()), standard_errors=tuple(errors.tolist()))
        axes.append(axis._replace(estimate=estimate))
        if ratio > CONSISTENT:
            notes.append(f"{AXES[index]}: the logs scatter {ratio:.1f} times as far as their standard errors say")
    if notes:
        cause = "a rig with an effect that the model lacks, or from a rig that changes: run `heli diagnose`"
        notes.append(f"logs that disagree come from {cause}")
    state = last._replace(axes=(axes[0], axes[1], axes[2]))
    estimates = estimates_of(online.output_of(state, plan), plan)
    outputs = [online.output_of(history.state, history.plan) for history in histories]
    notes += _describe_contradictions(estimates, outputs)
    return CombinedEstimates(estimates, tuple(notes), tuple(online.noise_of(axis.estimate) for axis in state.axes))


def _combine_axis(states: Sequence[IdentifierState], axis: int, plan: Plan) -> tuple[Array, Array, float]:
    """Return Omega of an axis, the standard errors of its reported combinations, and their largest Birge ratio.

    The plan of any log serves, because it enters by time constants and not by the number of samples.
    """
    axis_plan, others = plan.axes[axis], len(states) - 1
    estimates = [state.axes[axis].estimate for state in states]
    omegas = np.array([estimate.omega for estimate in estimates])
    gammas = np.array([online.gain_matrix(estimate.factor, len(estimate.omega)) for estimate in estimates])
    variances = gammas.copy()
    if others and axis_plan.gain > _TORQUE:
        variances[:, _TORQUE, _TORQUE] += (ZERO * np.median(np.abs(omegas[:, _STIFFNESS]))) ** 2
    informations, prior = np.linalg.inv(variances), np.diag(1.0 / np.array(axis_plan.prior))
    H = informations.sum(axis=0) - others * prior
    g = np.einsum("lij,lj->i", informations, omegas) - others * prior @ np.array(axis_plan.first)
    omega = np.linalg.solve(H, g)
    rows = np.array(online.combinations(axis, estimates[-1]._replace(omega=tuple(omega.tolist())), plan))
    if not others:
        return omega, np.array(estimates[0].standard_errors), 0.0
    outside = [p.outside for state in states if (p := state.axes[axis].predictor) is not None]
    products = tuple(np.sum([moments.products for moments in outside], axis=0).tolist())
    shares = np.array(online.shares(outside[0]._replace(products=products), tuple(map(tuple, rows.tolist()))))
    rows = np.pad(rows, ((0, 0), (0, len(omega) - rows.shape[1])))  # the noise model nu is not reported
    scatter = ((omegas - omega) @ rows.T) ** 2 / np.einsum("mi,lij,mj->lm", rows, gammas, rows)
    ratios = np.sqrt(scatter.sum(axis=0) / others)
    variance = np.einsum("ij,ji->i", rows, np.linalg.solve(H, rows.T))
    return omega, np.sqrt(variance / shares) * np.maximum(1.0, ratios), float(ratios.max())


def _describe_contradictions(estimates: Mapping[str, Estimate], outputs: Sequence[IdentifierOutput]) -> list[str]:
    """Return a sentence for each gain that the references of all logs exclude."""
    notes = []
    for axis, name in enumerate(online.GAINS):
        known = [(o.instruments[axis], o.instrument_errors[axis]) for o in outputs if o.instrument_errors[axis] > 0.0]
        if not known:
            continue
        values, errors = np.array(known).T
        value, _, precision = meta_analysis.weighted_mean(values, errors, 0.0)
        error = precision**-0.5
        if abs(value - estimates[name].value) > online.CONTRADICTION * error:
            notes.append(
                f"{name} = {estimates[name].value:.3g} rests on a noise model that the references contradict: they "
                f"give {value:.3g} ± {1.96 * error:.2g} {estimates[name].unit}. The air has another colour than the "
                "model allows, or what was logged as a reference answers the rig"
            )
    return notes
