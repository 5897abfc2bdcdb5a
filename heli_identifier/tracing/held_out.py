"""Before and after on held-out logs, which decide nothing in the search: they are for the figure.

    ln p(log | plant) = max over b of  sum_a sum_k -ln sigma_a - ln(2 pi)/2 - rho(e_ak / sigma_a)
                        - sum_a (b_a^2 / tau_a^2 + ln(tau_a^2 I_a)) / 2

e are the innovations under a plant with the air, the encoders' noise and the spread tau of offsets of its own training
logs: nothing but the offset b of the log itself is fitted to what was held out. b is a random effect, with information
I_a = 1/tau_a^2 + sum (de/db)^2 / sigma_a^2 its integral is Laplace's, exact for Gaussian innovations; rho is Huber's
loss. The likelihood of unseen logs, and nothing else here, ranks the true plant first in windy air under any controller.

Errors ahead, the noise floor and naive predictions are those of :mod:`.prediction`. A free run is the plant alone under
the voltages, from the state that a log's first samples give, at the log's own rate.

Sources: Diebold and Mariano 1995 (paired differences); Ljung and Box 1978, eq. (1.2), for whiteness.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import log, pi

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.special import chdtrc

from heli_identifier.records import Log

from .events import Event
from .fit import Fit
from .helicopter import helicopter
from .noise import error_dynamics, physical, recoloured
from .prediction import HORIZONS, NAIVE, Model, Run, made_by_itself, rms_figures, run_along, segment_means
from .records import record_of, records_of
from .result import (
    AxisError, AxisReport, Determination, ErrorFigure, HeldOutLikelihood, HeldOutSeries, ParameterReport, Use,
)  # fmt: skip
from .rig import Parameters, Record
from .settings import HUBER, SETTLING, SPACING, WHITE_TIME, DiagnosisSettings

Array = NDArray[np.float64]
Judge = Callable[[Parameters], tuple[float, int]]


@dataclass(frozen=True, eq=False)
class _OnLog:
    """One model on one held-out log: its run, and the log-density of every sample [nats]."""

    run: Run
    density: Array

    def standardised(self, model: Model) -> Array:
        """Give the innovations (N, a) under the air and over the scales of ``model``; zero where nothing counts."""
        record, own, scales = self.run.record, self.run.model, model.scales(self.run.record.step)
        linear, old, new = own.rig.linear(own.parameters), physical(own.z), physical(model.z)
        columns = [
            recoloured(self.run.e[:, i], record.step, (axis, old[:, i]), (axis, new[:, i]), [])
            for i, axis in enumerate(linear)
        ]
        return np.column_stack(columns) / scales * record.weights


def likelihood_of(model: Model, record: Record) -> tuple[Array, Array]:
    """Give the log-likelihood of a held-out log.

    Parameters
    ----------
    model : Model
    record : Record
        Samples without weight do not count.

    Returns
    -------
    density : Array, shape (N,)
        Of every sample [nats]; the offset's part is spread over the log.
    offset : Array, shape (a,)
        Likeliest constant torque of the log [rad/s^2].
    """
    run = _on(model, record, ())
    return run.density, run.run.offset


def _on(model: Model, record: Record, passages: Sequence[tuple[int, int]]) -> _OnLog:
    """Fit the offset of a log, then run along it."""
    h, tau, sigma = record.step, model.offset_width, model.scales(record.step)
    air, linear = physical(model.z), model.rig.linear(model.parameters)
    unit = np.ones(record.samples)
    J = np.column_stack([lfilter(*error_dynamics(h, own, air[:, i]), unit) for i, own in enumerate(linear)]) / sigma
    first = run_along(model, record, np.zeros(len(sigma)), [(0, 0)]).e / sigma
    w = record.weights * np.minimum(1.0, HUBER / np.maximum(np.abs(first), 1e-12))
    information = 1.0 / tau**2 + (w * J * J).sum(0)
    b = -(w * J * first).sum(0) / information  # one Gauss-Newton step: the innovations are linear in b
    run = run_along(model, record, b, passages)
    u = np.abs(run.e) / sigma
    loss = np.where(u < HUBER, 0.5 * u * u, HUBER * u - 0.5 * HUBER**2)
    of_offset = 0.5 * ((b / tau) ** 2 + np.log(tau**2 * information)).sum() / record.samples
    return _OnLog(run, -(record.weights * (np.log(sigma) + 0.5 * log(2.0 * pi) + loss)).sum(1) - of_offset)


def compare(
    before: Fit,
    after: Fit,
    logs: Sequence[Log],
    left_out: Mapping[str, Sequence[tuple[float, float]]] | None = None,
    reports: Mapping[str, ParameterReport] | None = None,
    judge: Judge | None = None,
    events: Sequence[Event] = (),
) -> tuple[dict[str, AxisReport], HeldOutLikelihood, tuple[HeldOutSeries, ...]]:
    """Compare two plants on held-out logs.

    Parameters
    ----------
    before, after : Fit
        On the training logs.
    logs : sequence of Log
        Held-out logs.
    left_out : mapping of str to sequence of (start, end), optional
        Passages [s] by log in which something other than the plant acts; they count in the free run only.
    reports : mapping of str to ParameterReport, optional
        What the parameters of the plant after rest on; a gain that is not among them was given.
    judge : callable, optional
        Chi-squared and degrees of freedom of the instruments for a plant.
    events : sequence of Event, optional
        Passages to be shown.

    Raises
    ------
    LogError
        No passage is long enough for a prediction over two seconds.
    """
    rig, left_out = after.likelihood.rig, left_out or {}
    records = records_of(logs, rig, left_out)
    fitted = np.prod([sum(r.weights.sum(0) for r in f.likelihood.records) > 0 for f in (before, after)], axis=0)
    records = tuple(replace(r, weights=r.weights * fitted) for r in records)  # no noise model, no likelihood
    passages = [_clear(record, left_out.get(record.name, ())) for record in records]
    models = {"before": Model.of(before), "after": Model.of(after)}
    found = {n: [_on(m, r, own) for r, own in zip(records, passages, strict=True)] for n, m in models.items()}
    starts = [rig.begin(log.angles, log.voltages, log.step) for log in logs]
    runs = {
        name: [
            rig.simulate(log.voltages, log.step, start, m.parameters) for log, start in zip(logs, starts, strict=True)
        ]
        for name, m in models.items()
    }
    errors = {n: _errors([on.run for on in found[n]], _free(n, models, logs, runs)) for n in models}
    made = [made_by_itself(on.run.model, on.run.record, on.run.offset, seed) for seed, on in enumerate(found["after"])]
    floor = _errors([run for run in made if run is not None], _floor_runs(found["after"]))
    stays = [rms_figures(list(own), SPACING, "error over 1 s") for own in
             zip(*(on.run.naive() for on in found["after"]), strict=True)]  # fmt: skip
    white = {n: [on.standardised(models["after"]) for on in found[n]] for n in models}
    p = {n: [_ljung_box_p([z[:, i] for z in white[n]], [r.weights[:, i] for r in records], records[0].step)
             for i in range(len(rig.axes))] for n in models}  # fmt: skip
    air, noise, axes = after.air(), models["after"].encoder_noise, {}
    for i, axis in enumerate(rig.axes):
        use, why = use_of(rig.gains[i], (reports or {}).get(rig.gains[i]), errors["after"][i], stays[0][i], stays[1][i])
        axes[axis] = AxisReport(
            errors["before"][i], errors["after"][i], floor[i], stays[0][i], stays[1][i],
            {name: own[i] for name, own in p.items()}, float(air[0, i]), float(air[1, i]), float(noise[i]), use, why,
        )  # fmt: skip
    judged = {} if judge is None else {name: judge(m.parameters) for name, m in models.items()}
    series = tuple(
        HeldOutSeries(
            own, runs["before"][i], runs["after"][i], dict(zip(rig.state, map(float, starts[i]), strict=True)),
            white["before"][i], white["after"][i], records[i].step,
            tuple(event for event in events if event.log == own.name),
        )
        for i, own in enumerate(logs)
    )  # fmt: skip
    return axes, _likelihood(found["before"], found["after"], judged), series
