"""The adaptation (7) over measured logs, with its standard errors: one history per log, and all logs together."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import Estimate, IdentifierSettings, ModelParameters, prepare, start, step
from heli_identifier.records import Log, RigConfiguration
from heli_plant.parameters import BY_FIELD, PlantParameters

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
    """

    name: str
    time: NDArray[np.float64]
    parameters: NDArray[np.float64]
    standard_errors: NDArray[np.float64]

    @property
    def last(self) -> dict[str, Estimate]:
        """The last estimates by symbol."""
        return {
            name: Estimate(float(value), float(error), BY_FIELD[name].unit)
            for name, value, error in zip(NAMES, self.parameters[-1], self.standard_errors[-1], strict=True)
        }


@dataclass(frozen=True, eq=False)
class Together:
    """Estimates from several logs together by symbol, and ``notes`` on logs that disagree."""

    estimates: Mapping[str, Estimate]
    notes: tuple[str, ...]

    def plant(self, motor_time_constant: float, voltage_limit: float) -> PlantParameters:
        """Return the plant with these estimates, the motors' lag [s] and their saturation [V]."""
        values = {name: estimate.value for name, estimate in self.estimates.items()}
        return PlantParameters(T_m=motor_time_constant, v_max=voltage_limit, **values)


def settings_for(
    log: Log, configuration: RigConfiguration, filter_frequency: float = 1.0, forgetting: float = 0.001
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
    )


def identify_log(log: Log, settings: IdentifierSettings) -> EstimateHistory:
    """Run the identifier over a log; the history has a row for every evaluation of the standard errors."""
    plan = prepare(settings)
    samples = np.column_stack((log.voltages, log.angles)).tolist()
    state = start(plan, *samples[0])
    every = max(1, round(settings.report_interval / settings.sample_time))
    time, parameters, errors = [], [], []
    for k, (v_front, v_rear, pitch, elevation, travel) in enumerate(samples[1:], start=1):
        state, output = step(state, v_front, v_rear, pitch, elevation, travel, plan)
        if (k % every == 0 and output.adapting) or k == len(samples) - 1:
            time.append(k * settings.sample_time)
            parameters.append(tuple(output.parameters))
            errors.append(tuple(output.standard_errors))
    return EstimateHistory(log.name, np.array(time), np.array(parameters), np.array(errors))


def combined(histories: Sequence[EstimateHistory]) -> Together:
    """Combine the last estimates of several logs, each weighted by the inverse square of its standard error.

    The standard error of the weighted mean is multiplied by the Birge ratio (Birge, Physical Review 40 (1932)) where
    that exceeds 1: the logs then scatter by more than their own standard errors allow.
    """
    estimates, notes = {}, []
    for column, name in enumerate(NAMES):
        values = np.array([history.parameters[-1, column] for history in histories])
        errors = np.array([history.standard_errors[-1, column] for history in histories])
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
