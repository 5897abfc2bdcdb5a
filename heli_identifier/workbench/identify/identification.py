"""The on-line identifier over measured logs, with its standard errors: one history per log, and all logs together.

Prediction errors pass every log twice. The first pass finds the noise model, which is the same for all logs of a rig,
parameters to begin with and the motors' lag; the second begins with the means of these. Nothing is counted twice:
Gamma(0) is the same in both passes.
"""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import (
    ADAPTATION,
    Estimate,
    IdentifierSettings,
    Lag,
    ModelParameters,
    Noise,
    noise_of,
    output_of,
    prepare,
    start,
    step,
)
from heli_identifier.records import Log, RigConfiguration
from heli_plant.parameter_table import BY_FIELD
from heli_plant.parameters import PlantParameters

NAMES = ModelParameters._fields
"""The paper's symbols of the estimated parameters; they are fields of :class:`PlantParameters`."""

CONSISTENT = 2.0
"""Birge ratio above which logs disagree by more than their standard errors allow."""


@dataclass(frozen=True, eq=False)
class EstimateHistory:
    """Estimates of one log over time.

    Attributes
    ----------
    name : str
        Of the log.
    time : NDArray, shape (M,)
        [s].
    parameters, standard_errors : NDArray, shape (M, 11)
        By :data:`NAMES`, in the units of :class:`PlantParameters`.
    feedback : tuple of float
        Scores of a closed loop on pitch, elevation and travel at the end [1].
    noise : tuple of Noise
        Noise models of the three axes at the end; empty where the method is the adaptation.
    lag : Lag
        The motors' lag at the end, with a standard error of 0 where it was given [s].
    """

    name: str
    time: NDArray[np.float64]
    parameters: NDArray[np.float64]
    standard_errors: NDArray[np.float64]
    feedback: tuple[float, float, float]
    noise: tuple[Noise, ...]
    lag: Lag

    @property
    def last(self) -> dict[str, Estimate]:
        """The last estimates by symbol, with the motors' lag ``T_m`` where it was estimated."""
        found = {
            name: Estimate(float(value), float(error), BY_FIELD[name].unit)
            for name, value, error in zip(NAMES, self.parameters[-1], self.standard_errors[-1], strict=True)
        }
        if self.lag.standard_error > 0.0:
            found["T_m"] = Estimate(self.lag.value, self.lag.standard_error, BY_FIELD["T_m"].unit)
        return found


@dataclass(frozen=True, eq=False)
class Together:
    """Estimates from several logs together by symbol, and ``notes`` on logs that disagree."""

    estimates: Mapping[str, Estimate]
    notes: tuple[str, ...]

    def plant(self, motor_time_constant: float, voltage_limit: float) -> PlantParameters:
        """Return the plant with these estimates, the motors' lag [s] if it was given, and their saturation [V]."""
        values = {"T_m": motor_time_constant} | {name: estimate.value for name, estimate in self.estimates.items()}
        return PlantParameters(v_max=voltage_limit, **values)


def settings_for(
    log: Log,
    configuration: RigConfiguration,
    filter_frequency: float = 1.0,
    forgetting: float = 0.001,
    method: str = ADAPTATION,
) -> IdentifierSettings:
    """Return the identifier's settings for a log of a rig.

    Parameters
    ----------
    log : Log
    configuration : RigConfiguration
    filter_frequency : float
        Bandwidth of the state filters [rad/s].
    forgetting : float
        alpha [1/s].
    method : str
        One of :data:`heli_identifier.online.METHODS`.

    Raises
    ------
    ConfigurationError
        A setting is out of range, such as a filter too fast for the log's sampling rate.
    """
    return IdentifierSettings(
        sample_time=log.step,
        filter_frequency=filter_frequency,
        forgetting=forgetting,
        rest_angle=configuration.rest_pitch,
        motor_time_constant=configuration.motor_time_constant,
        voltage_limit=configuration.format.voltage_limit,
        report_interval=max(0.5, 3.0 * log.step),
        method=method,
    )


def identify_log(log: Log, settings: IdentifierSettings) -> EstimateHistory:
    """Run the identifier over a log; the history has a row for every evaluation of the standard errors."""
    plan = prepare(settings)
    samples = np.column_stack((log.voltages, log.angles)).tolist()
    state = start(plan, *samples[0])
    every = max(1, round(settings.report_interval / settings.sample_time))
    time, parameters, errors = [], [], []
    output = output_of(state, plan)
    for k, (v_front, v_rear, pitch, elevation, travel) in enumerate(samples[1:], start=1):
        state, output = step(state, v_front, v_rear, pitch, elevation, travel, plan)
        if (k % every == 0 and output.adapting) or k == len(samples) - 1:
            time.append(k * settings.sample_time)
            parameters.append(tuple(output.parameters))
            errors.append(tuple(output.standard_errors))
    axes = () if state.predictors is None else (state.pitch, state.elevation, state.travel)
    noise = tuple(noise_of(axis) for axis in axes)
    return EstimateHistory(
        log.name, np.array(time), np.array(parameters), np.array(errors), output.feedback, noise, output.lag
    )


def begun_at(settings: IdentifierSettings, histories: Sequence[EstimateHistory]) -> IdentifierSettings:
    """Return ``settings`` that begin with the noise models, parameters and lag of a first pass over all logs."""
    found = {name: estimate.value for name, estimate in combined(histories).estimates.items()}
    lag = max(found.pop("T_m", settings.motor_time_constant), 0.0)
    pitch, elevation, travel = (
        Noise(*np.exp(np.mean(np.log([history.noise[axis] for history in histories]), axis=0)).tolist())
        for axis in range(3)
    )
    return replace(
        settings, noise=(pitch, elevation, travel), initial=ModelParameters(**found), motor_time_constant=lag
    )


def combined(histories: Sequence[EstimateHistory]) -> Together:
    """Combine the last estimates of several logs, each weighted by the inverse square of its standard error.

    The standard error of the weighted mean is multiplied by the Birge ratio (Birge, Physical Review 40 (1932)) where
    that exceeds 1: the logs then scatter by more than their own standard errors allow.
    """
    estimates, notes = {}, []
    lasts = [history.last for history in histories]
    for name in lasts[0]:
        values = np.array([last[name].value for last in lasts])
        errors = np.array([last[name].standard_error for last in lasts])
        unit = BY_FIELD[name].unit
        if not (errors > 0.0).all():  # a known rest angle has no error
            estimates[name] = Estimate(float(values.mean()), None, unit)
            continue
        weights = errors**-2.0
        mean = float(weights @ values / weights.sum())
        degrees = max(len(values) - 1, 1)
        ratio = float(np.sqrt(weights @ (values - mean) ** 2 / degrees))
        estimates[name] = Estimate(mean, float(weights.sum() ** -0.5) * max(ratio, 1.0), unit)
        if len(values) > 1 and ratio > CONSISTENT:
            notes.append(f"{name}: the logs scatter {ratio:.1f} times as far as their standard errors say")
    if notes:
        notes.append(
            "logs that disagree come from a rig with an effect that the model lacks, or from a rig that changes: "
            "run `heli diagnose`"
        )
    return Together(estimates, tuple(notes))


def history_text(histories: Sequence[EstimateHistory]) -> str:
    """Return histories as CSV: log, time, every parameter and every standard error."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    units = [BY_FIELD[name].unit for name in NAMES]
    values = [f"{name} [{unit}]" for name, unit in zip(NAMES, units, strict=True)]
    errors = [f"standard_error.{name} [{unit}]" for name, unit in zip(NAMES, units, strict=True)]
    rows.writerow(["log", "time [s]", *values, *errors])
    for history in histories:
        table = np.column_stack((history.time, history.parameters, history.standard_errors))
        rows.writerows([history.name, *row] for row in table.tolist())
    return text.getvalue()
