"""Before and after on held-out logs, which decide nothing in the search: they are for the figure.

    ln p(log | plant) = max over b of  sum_a sum_k -ln sigma_a - ln(2 pi)/2 - rho(e_ak / sigma_a)
                        - sum_a (b_a^2 / tau_a^2 + ln(tau_a^2 I_a)) / 2

e are the innovations under a plant with the air, the encoders' noise and the spread tau of offsets of its own training
logs: nothing but the offset b of the log itself is fitted to what was held out. b is a random effect, with information
I_a = 1/tau_a^2 + sum (de/db)^2 / sigma_a^2 its integral is Laplace's, exact for Gaussian innovations; rho is Huber's
loss. Of all figures here this one alone ranks the true plant first in windy air under any controller.

Errors ahead, the noise floor and naive predictions are those of :mod:`.prediction`. A free run is the plant alone under
the voltages, from the state that a log's first samples give, at the log's own rate.

Sources: Diebold and Mariano 1995 (paired differences); Ljung and Box 1978, eq. (1.2), for whiteness.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import log, pi

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.special import chdtrc

from heli_identifier.chain import Event
from heli_identifier.records import Log

from .fit import Fit, around, fit
from .helicopter import helicopter
from .likelihood import Likelihood
from .noise import error_dynamics, filters, physical, recoloured, start_response
from .prediction import FLOWN, HORIZONS, Model, Run, Stretch, made_by_itself, rms_figures, run_along, segment_means
from .records import record_of, records_of
from .references import CHANNELS, controllers_of
from .result import (
    AxisError,
    AxisReport,
    Determination,
    ErrorFigure,
    HeldOutLikelihood,
    HeldOutSeries,
    ParameterReport,
    Use,
)  # fmt: skip
from .rig import Parameters, Record
from .settings import HUBER, SPACING, START, WHITE_TIME, DiagnosisSettings

Array = NDArray[np.float64]
Judge = Callable[[Parameters], tuple[float, int]]


@dataclass(frozen=True, eq=False)
class _OnLog:
    """One model on one held-out log: its run, and the log-density of every sample [nats]."""

    run: Run
    density: Array

    def standardised(self, model: Model) -> Array:
        """Give the innovations (N, a) under the air and over the scales of ``model``."""
        record, own, scales = self.run.record, self.run.model, model.scales(self.run.record.step)
        old, new = (filters(record.step, own.rig.linear(own.parameters), physical(z)) for z in (own.z, model.z))
        columns = [recoloured(e, was, now) for e, was, now in zip(self.run.e.T, old, new, strict=True)]
        return np.column_stack(columns) / scales


def likelihood_of(model: Model, record: Record) -> tuple[Array, Array]:
    """Give the log-density (N,) [nats] of every sample of a log, and its likeliest constant torque (a,) [rad/s^2]."""
    found = _on(model, record, [])
    return found.density, found.run.offset


def _on(model: Model, record: Record, passages: Sequence[tuple[int, int]]) -> _OnLog:
    """Fit what a log has of its own, its constant torques and its start, then run along it."""
    h, sigma, a = record.step, model.scales(record.step), len(model.encoder_noise)
    first = run_along(model, record, np.zeros(a), []).e / sigma
    w = record.weights * np.minimum(1.0, HUBER / np.maximum(np.abs(first), 1e-12))
    own, of_log = np.zeros((3, a)), 0.0
    for i, axis in enumerate(model.filters(h)):
        torque = lfilter(*error_dynamics(axis), np.ones(record.samples))
        J = np.column_stack((torque, start_response(axis, 1, record.samples))) / sigma[i]
        width = np.array([model.torque_width[i], *START])
        H = (w[:, i, None] * J).T @ J + np.diag(width**-2.0)
        own[:, i] = -np.linalg.solve(H, (w[:, i] * first[:, i]) @ J)  # one step: the innovations are linear in these
        of_log += 0.5 * float(((own[:, i] / width) ** 2).sum() + np.linalg.slogdet(H * np.outer(width, width))[1])
    start = record.start.copy()
    start[: 2 * a] += own[1:].ravel()
    run = run_along(model, replace(record, start=start), own[0], passages)
    u = np.abs(run.e) / sigma
    loss = np.where(u < HUBER, 0.5 * u * u, HUBER * u - 0.5 * HUBER**2)
    density = -(record.weights * (np.log(sigma) + 0.5 * log(2.0 * pi) + loss)).sum(1) - of_log / record.samples
    return _OnLog(run, density)


def compare(
    before: Fit,
    after: Fit,
    logs: Sequence[Log],
    left_out: Mapping[str, Sequence[tuple[float, float]]] | None = None,
    reports: Mapping[str, ParameterReport] | None = None,
    judge: Judge | None = None,
    events: Sequence[Event] = (),
    closed_loop: bool = False,
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
    closed_loop : bool
        Whether a controller flew: its voltages answer the air within 1 s, so what an axis may be used for is then
        judged over .2 s from the filter's state, and not over 1 s under the measured voltages.

    Raises
    ------
    LogError
        No passage is long enough for a prediction over two seconds.
    """
    rig, left_out = after.likelihood.rig, left_out or {}
    records = records_of(logs, rig, left_out)
    fitted = np.prod([sum(r.weights.sum(0) for r in f.likelihood.records) > 0 for f in (before, after)], axis=0)
    records = tuple(replace(r, weights=r.weights * fitted) for r in records)  # no noise model, no likelihood
    if faults := after.likelihood.faults:
        alone = replace(after.likelihood, records=records, faults={}, logged=())
        calm = alone.resting(after.parameters, after.point.z)
        e, _ = alone.filtered(calm)
        records = alone.undoing(faults, e).records
    passages = [_clear(record, left_out.get(record.name, ())) for record in records]
    models = {"before": Model.of(before), "after": Model.of(after)}
    found = {n: [_on(m, r, own) for r, own in zip(records, passages, strict=True)] for n, m in models.items()}
    starts = [rig.begin(own.angles, own.voltages, own.step) for own in logs]
    runs = {name: [rig.simulate(own.voltages, own.step, start, m.parameters)
                   for own, start in zip(logs, starts, strict=True)] for name, m in models.items()}  # fmt: skip
    measured, steps = [own.angles for own in logs], [own.step for own in logs]
    free = {name: _free(m, measured, runs[name], steps) for name, m in models.items()}
    errors = {name: _errors([on.run for on in found[name]], free[name]) for name in models}
    made = [made_by_itself(on.run.model, on.run.record, on.run.offset, seed) for seed, on in enumerate(found["after"])]
    floor = _errors([run for run in made if run is not None], _free_in_air(found["after"]))
    stays = [rms_figures(list(own), SPACING, "error over 1 s") for own in
             zip(*(on.run.naive() for on in found["after"]), strict=True)]  # fmt: skip
    stood = rms_figures([on.run.still("ahead_200ms") for on in found["after"]], SPACING, "error over .2 s")
    change = _changes([on.run for on in found["before"]], [on.run for on in found["after"]])
    near, length = [own.ahead_200ms.value for own in errors["after"]], 1.0 if closed_loop else 0.0
    drawn = {n: {i: on.run.run_on(length) for i, on in enumerate(own) if length} for n, own in found.items()}
    if closed_loop and all(error < least.value for error, least in zip(near, stood, strict=True)):
        laws = controllers_of(logs)  # all axes fly together: one that the model does not know would spoil the others
        both = [i for i, own in enumerate(laws) if len(own) == len(CHANNELS)]
        flown = {name: {i: found[name][i].run.flown_again(laws[i]) for i in both} for name in models}
        again = {name: [_thinned(records[i], own) for i, own in one.items()] for name, one in flown.items()}
        if sum(map(len, again["after"])) and all(np.isfinite(own).all() for one in again.values() for own in one):
            for name, one in again.items():
                figures = rms_figures(one, SPACING, f"closed-loop error over {FLOWN:g} s")
                errors[name] = [replace(e, closed_loop_3s=own) for e, own in zip(errors[name], figures, strict=True)]
            change["closed_loop_3s"] = _change(zip(again["before"], again["after"], strict=True))
            drawn, length = flown, FLOWN
    white = {n: [on.standardised(models["after"]) for on in found[n]] for n in models}
    p = {n: [_ljung_box_p([z[:, i] for z in white[n]], [r.weights[:, i] for r in records], records[0].step)
             for i in range(len(rig.axes))] for n in models}  # fmt: skip
    air, noise, axes = after.air(), models["after"].encoder_noise, {}
    for i, axis in enumerate(rig.axes):
        own, bare, ahead = errors["after"][i].prediction_1s, min(stays[0][i].value, stays[1][i].value), 1.0
        if closed_loop:
            own, bare, ahead = errors["after"][i].ahead_200ms, stood[i].value, HORIZONS["ahead_200ms"]
        use, why = use_of(rig.gains[i], (reports or {}).get(rig.gains[i]), own.value, bare, ahead)
        axes[axis] = AxisReport(
            errors["before"][i], errors["after"][i], floor[i], stays[0][i], stays[1][i],
            {name: own[i] for name, own in p.items()}, float(air[0, i]), float(air[1, i]), float(noise[i]), use, why,
            {name: own[i] for name, own in change.items()},
        )  # fmt: skip
    judged = {} if judge is None else {name: judge(m.parameters) for name, m in models.items()}
    series = tuple(
        HeldOutSeries(
            own, runs["before"][i], runs["after"][i], dict(zip(rig.state, map(float, starts[i]), strict=True)),
            white["before"][i], white["after"][i], records[i].step,
            tuple(event for event in events if event.log == own.name),
            {name: _drawn(records[i], stretches[i]) for name, stretches in drawn.items() if i in stretches}, length,
        )
        for i, own in enumerate(logs)
    )  # fmt: skip
    return axes, _likelihood(found["before"], found["after"], judged), series


def _thinned(record: Record, stretches: Sequence[Stretch]) -> Array:
    """Errors (n, a) [rad] of stretches, :data:`.settings.SPACING` apart."""
    thin = max(1, round(SPACING / record.step))
    return np.concatenate([np.empty((0, record.angles.shape[1])), *(e[thin - 1 :: thin] for _, e in stretches)])


def _drawn(record: Record, stretches: Sequence[Stretch]) -> Array:
    """Angles (N, a) [rad] that stretches predict; not a number between them."""
    predicted = np.full_like(record.angles, np.nan)
    for first, e in stretches:
        predicted[first : first + len(e) - 1] = (record.angles[first : first + len(e)] - e)[:-1]  # a gap to the next
    return predicted


def _clear(record: Record, left_out: Sequence[tuple[float, float]]) -> list[tuple[int, int]]:
    """Passages of a record, in samples, outside of what is left out."""
    clear = np.ones(record.samples, dtype=bool)
    for start, end in left_out:
        clear[(record.time >= start) & (record.time <= end)] = False
    edges = np.flatnonzero(np.diff(np.concatenate(([False], clear, [False])))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def _errors(runs: Sequence[Run], free: Sequence[ErrorFigure | None]) -> list[AxisError]:
    """Figures by axis of one model's runs; zero, which bounds nothing, where there is no run."""
    if not runs:
        nothing = ErrorFigure(0.0, 0.0, 0.0)
        return [AxisError(nothing, nothing, nothing, nothing, own) for own in free]
    errors = [run.errors(tuple(HORIZONS)) for run in runs]
    figures = [
        rms_figures([own[name] for own in errors], SPACING, f"error over {H:g} s") for name, H in HORIZONS.items()
    ]
    return [AxisError(a, b, c, d, own) for a, b, c, d, own in zip(*figures, free, strict=True)]


def _changes(before: Sequence[Run], after: Sequence[Run]) -> dict[str, list[ErrorFigure]]:
    """Figures by axis of the errors ahead of one model over those of another, less 1, on the same segments."""
    pairs = [(old.errors(tuple(HORIZONS)), new.errors(tuple(HORIZONS))) for old, new in zip(before, after, strict=True)]
    return {name: _change((old[name], new[name]) for old, new in pairs) for name in HORIZONS}


def _change(pairs: Iterable[tuple[Array, Array]]) -> list[ErrorFigure]:
    """Figures by axis of the root mean square of the second errors (S, a) of each pair over the first, less 1."""
    squares = [np.hstack(own) ** 2 for own in pairs]
    squares = [own[np.isfinite(own).all(1)] for own in squares]
    ends = np.quantile(_ratio(segment_means(squares, [SPACING] * len(squares))), (0.025, 0.975), axis=0)
    columns = np.vstack((_ratio(np.concatenate(squares).mean(0)), ends)).T
    return [ErrorFigure(*map(float, column)) for column in columns]


def _ratio(squares: Array) -> Array:
    """Root mean square of the second half of the columns over that of the first, less 1."""
    a = squares.shape[-1] // 2
    return np.sqrt(squares[..., a:] / np.maximum(squares[..., :a], 1e-300)) - 1.0


def _free(model: Model, measured: Sequence[Array], runs: Sequence[Array], steps: Sequence[float]) -> list:
    """Figures by axis of free runs; None where the axis is not stable."""
    errors = [own - run for own, run in zip(measured, runs, strict=True)]
    stable = model.rig.stable(model.parameters)
    if not all(np.isfinite(own).all() for own in errors):
        return [None] * len(stable)
    return [own if ok else None for own, ok in zip(rms_figures(errors, steps), stable, strict=True)]


def _free_in_air(found: Sequence[_OnLog]) -> list:
    """Figures by axis of the free runs of a model on whole records that it made itself."""
    made, runs, steps = [], [], []
    for seed, on in enumerate(found):
        model, r, random = on.run.model, on.run.record, np.random.default_rng(seed)
        torque = on.run.offset + model.torque(r.step, r.samples, random)
        noise = model.encoder_errors(r.step, r.samples, random)
        made.append(model.rig.simulate(r.inputs, r.step, r.start, model.parameters, torque) + noise)
        runs.append(model.rig.simulate(r.inputs, r.step, r.start, model.parameters))
        steps.append(r.step)
    return _free(found[0].run.model, made, runs, steps)


def _likelihood(
    before: Sequence[_OnLog], after: Sequence[_OnLog], chi2: Mapping[str, tuple[float, int]]
) -> HeldOutLikelihood:
    """Compare the densities of two models in pairs."""
    steps = [on.run.record.step for on in before]
    seconds = sum(len(on.density) * h for on, h in zip(before, steps, strict=True))
    totals = [sum(float(on.density.sum()) for on in found) for found in (before, after)]
    gains = [second.density - first.density for first, second in zip(before, after, strict=True)]
    low, high = np.quantile(segment_means(gains, steps), (0.025, 0.975)) * sum(map(len, gains))
    gain = ErrorFigure(totals[1] - totals[0], float(low), float(high))
    return HeldOutLikelihood(seconds, totals[0] / seconds, totals[1] / seconds, gain, chi2)


def _ljung_box_p(white: Sequence[Array], weights: Sequence[Array], step: float) -> float:
    """P value of the portmanteau test; pairs of samples of which one does not count are left out.

    (n + 2)/n sum_k c_k^2 / n_k is chi-squared where the residuals are white; c_k sums the n_k products at lag k.
    """
    lags, n = max(1, round(WHITE_TIME / step)), sum(float(w.sum()) for w in weights)
    if n <= lags:
        return 1.0
    square = sum(float(w @ z**2) for z, w in zip(white, weights, strict=True)) / n
    products, pairs = np.zeros(lags), np.zeros(lags)
    for z, w in zip(white, weights, strict=True):
        reach = min(lags, len(z) - 1)
        size = 2 ** int(np.ceil(np.log2(len(z) + reach)))
        for into, of in ((products, z * w), (pairs, w)):
            into[:reach] += np.fft.irfft(np.abs(np.fft.rfft(of, size)) ** 2, size)[1 : reach + 1]
    statistic = (n + 2.0) / n * float(((products / square) ** 2 / np.maximum(pairs, 1.0)).sum())
    return float(chdtrc(lags, statistic))


def use_of(gain: str, report: ParameterReport | None, error: float, least: float, ahead: float) -> tuple[Use, str]:
    """Decide what an axis of the plant may be used for, and say why in a clause.

    Nothing, if over ``ahead`` [s] a prediction without a model, which errs by ``least`` [rad], does as well. Prediction
    only, if the logs do not determine the axis's gain or references contradict it: a controller multiplies a wrong
    gain, a prediction of similar flights hardly shows it. Else control as well. ``report`` is None for a gain that was
    given.
    """
    if not error < least:
        return (
            Use.NOTHING,
            f"it errs by {1e3 * error:.2g} mrad over {ahead:g} s, without a model it is {1e3 * least:.2g}",
        )
    if report is None:
        return Use.CONTROL, f"{gain} was given"
    if report.contradicted or report.determination is Determination.NOT_DETERMINED:
        return Use.PREDICTION, f"{gain} is {report.determination}: {report.why}"
    verb = "is " if report.determination is Determination.OUTSIDE else ""
    return Use.CONTROL, f"{gain} {verb}{report.determination}: {report.why}"


@dataclass(frozen=True)
class Outcome:
    """One axis of one log: its error 1 s ahead [rad] and the limit [rad] it is held to."""

    log: str
    axis: str
    error: ErrorFigure
    limit: float

    @property
    def passed(self) -> bool:
        """Whether the error keeps the limit."""
        return self.error.value <= self.limit


def hold_to(parameters: Parameters, limits: Mapping[str, float], logs: Sequence[Log]) -> list[Outcome]:
    """Predict ``logs`` 1 s ahead with ``parameters`` and hold every axis named in ``limits`` [rad] to its limit."""
    rig, outcomes = helicopter(DiagnosisSettings(), [own.angles for own in logs], [own.voltages for own in logs]), []
    for own in logs:
        run = run_along(Model.alone(rig, parameters), record_of(own, rig), np.zeros(len(rig.axes)))
        errors = run.errors(("prediction_1s",))["prediction_1s"]
        figures = rms_figures([errors], SPACING, f"log {own.name}, error over 1 s")
        outcomes += [Outcome(own.name, axis, figures[rig.axes.index(axis)], limit) for axis, limit in limits.items()]
    return outcomes


def log_likelihood(plant: Parameters, logs: Sequence[Log]) -> float:
    """Give ln p of ``logs`` [nats] under a plant; the air, and what each log has of its own, are fitted to them."""
    rig = helicopter(DiagnosisSettings(), [own.angles for own in logs], [own.voltages for own in logs])
    likelihood = Likelihood(rig, records_of(logs, rig, {}))
    point = likelihood.resting(plant)
    start = around(likelihood, (), point, likelihood.of_axes(likelihood.filtered(point)[0])[1])
    return -fit(likelihood, (), start).value
