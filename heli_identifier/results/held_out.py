"""The model before and the corrected plant on held-out logs, which decide nothing: they measure the search's result.

    ln p(log | plant) = max over b of  sum_a sum_k -ln sigma_a - ln(2 pi)/2 - rho(e_ak / sigma_a)
                        - |b / tau|^2 / 2 - ln det(1 + tau H tau) / 2

e are the innovations of a plant with the air, the encoders' noise and the spread tau of its training logs. Only b, the
log's own parameters (:class:`.Point`), is fitted to the held-out log. b is a random effect with information H; it is
integrated by Laplace's method. rho is Huber's loss. Of all figures here only this one ranks the true plant first in
windy air under any controller.

The other figures are root mean squares of errors:

| figure | the plant runs from | under | how long |
|---|---|---|---|
| ahead_100ms, ahead_200ms | the filter's state every .25 s | the measured voltages | .1 s, .2 s |
| prediction_1s, prediction_2s | the smoothed motion every .25 s | the same | 1 s, 2 s |
| free_run | the first samples of a log | the same | the whole log |
| closed_loop_3s | the smoothed motion | its own controller, as recovered | 3 s |

The noise floor is the same errors of the plant on records that it simulated itself, with the air and the encoders'
noise of its fit (:mod:`.prediction`). All intervals come from one bootstrap over segments of 4 s (:mod:`.bootstrap`).

Source of the test for whiteness: Ljung and Box 1978, eq. (1.2).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from math import log, nan, pi

import numpy as np
from scipy.signal import correlate
from scipy.special import chdtrc

from heli_identifier.chain import CHANNELS, Fault, controllers_of, undo_faults
from heli_identifier.records import Log
from heli_identifier.results.bootstrap import bootstrap, change_figures, rms_figures
from heli_identifier.results.diagnosis import AxisError, AxisReport, ErrorFigure, HeldOutLikelihood, HeldOutSeries, Use
from heli_identifier.results.prediction import HORIZONS, SPACING, STRETCH, Model, Run, answer_deviation, simulate_record
from heli_identifier.results.statements import Determination, ParameterReport
from heli_identifier.results.words import AHEAD
from heli_identifier.tracing.fit import Fit, fit, fit_per_log
from heli_identifier.tracing.helicopter import helicopter
from heli_identifier.tracing.likelihood import Likelihood, undo_in_record
from heli_identifier.tracing.noise import filters, recolour
from heli_identifier.tracing.rig import Array, Parameters, Record, records_of
from heli_identifier.tracing.settings import OUTLIER
from heli_plant.state import PlantState

WHITE_TIME = 1.0
"""Longest lag [s] of the test for whiteness. What the plant lacks at longer times, the filter takes for air."""


def likelihood_of(model: Model, record: Record) -> tuple[Run, Array]:
    """Fit the log's own parameters, run a model along the log, and give ln p (N,) of every sample."""
    likelihood, sigma = Likelihood(model.rig, (record,), model.widths), model.scales(record.step)
    fitted = fit_per_log(likelihood, likelihood.neutral_point(model.parameters, model.z), sigma)
    b, tau = fitted.point.per_log[0], likelihood.tau
    shrinkage = fitted.quadratic.covariance[0] / np.outer(tau, tau)  # (1 + tau H tau)^-1
    log_terms = 0.5 * (float(((b / tau) ** 2).sum()) - np.linalg.slogdet(shrinkage)[1])
    u = np.abs(fitted.e[0]) / sigma
    loss = np.where(u < OUTLIER, 0.5 * u * u, OUTLIER * u - 0.5 * OUTLIER**2)
    density = -(record.weights * (np.log(sigma) + 0.5 * log(2.0 * pi) + loss)).sum(1) - log_terms / record.samples
    aligned, pushes = likelihood.aligned_record(0, fitted.point), b[len(model.widths) :].tolist()
    return Run.along(model, record, b[: len(sigma)], aligned, pushes), density


def air_of(fitted: Fit) -> Array:
    """Return level [rad/s^2], c, f [1/s], psi [rad] and k [1/s] of the air of every axis, shape (5, a).

    The level is the standard deviation of the part that lasts for 1/:data:`.settings.SLOW_RATE`: a shorter torque does
    not move a bench.
    """
    air, record = fitted.likelihood.rig.air(fitted.point.z), fitted.likelihood.records[0]
    axes = fitted.likelihood.filters(record, fitted.point)
    lasting = [max(np.linalg.matrix_power(axis.F, record.held)[0, 0], 0.0) for axis in axes]
    return np.vstack((air[0] * fitted.encoder_noise() * np.sqrt(lasting), air[1:]))


def undo_in_log(faults: Mapping[Fault, float], log: Log, limit: float) -> Log:
    """Return a log with faults undone; the amplifiers give at most ``limit`` [V], or what was logged."""
    voltages, angles = undo_faults(faults, log.voltages, log.angles, log.step)
    largest = max(limit, float(np.abs(log.voltages).max()))
    return replace(log, voltages=np.clip(voltages, -largest, largest), angles=angles)


def compare(
    before: Fit,
    after: Fit,
    logs: Sequence[Log],
    reports: Mapping[str, ParameterReport] = {},
    closed_loop: bool = False,
) -> tuple[dict[str, AxisReport], HeldOutLikelihood, tuple[HeldOutSeries, ...]]:
    """Compare on held-out ``logs`` two plants that were fitted to training logs.

    Samples within the events of a log count in the free run only. ``reports`` say what each parameter of the plant
    after rests on; a gain that is not among them was given. The use of an axis is judged by the error 1 s ahead, and
    under a controller (``closed_loop``) by that .2 s ahead. LogError if no passage is long enough for 2 s ahead.
    """
    rig, records = after.likelihood.rig, _records(before, after, logs)
    mended = [undo_in_log(after.likelihood.faults, log, after.parameters.v_max) for log in logs]
    starts = [rig.initial_state(log.angles, log.voltages, log.step) for log in mended]
    models = {"before": Model.of(before), "after": Model.of(after)}
    found = {name: [likelihood_of(model, record) for record in records] for name, model in models.items()}
    runs = {name: [run for run, _ in of_model] for name, of_model in found.items()}
    free_runs = {
        name: [model.rig.simulate(log.voltages, log.step, start, model.parameters)
               for log, start in zip(mended, starts, strict=True)]
        for name, model in models.items()
    }  # fmt: skip
    errors, ours = {name: _errors(of_model) for name, of_model in runs.items()}, runs["after"]
    angle_changes = [run.measured(0.2) - run.record.angles[run.at] for run in ours]
    angle_stays_200ms = rms_figures(angle_changes, SPACING, "error .2 s ahead")
    ahead = errors["after"]["ahead_200ms"]
    stretches, controlled = _fly_again(runs, logs, ahead, angle_stays_200ms) if closed_loop else ({}, False)
    if controlled:
        for name, of_model in stretches.items():
            errors[name]["closed_loop_3s"] = _thin_errors(of_model, records)
    figures, steps = {}, [log.step for log in mended]
    for name, model in models.items():
        free = [log.angles - angles for log, angles in zip(mended, free_runs[name], strict=True)]
        figures[name] = _figures(model, errors[name], free, steps)
    change = {
        name: change_figures(of_before, errors["after"][name], SPACING) for name, of_before in errors["before"].items()
    }
    residuals = {name: [_standardise(run, models["after"]) for run in of_model] for name, of_model in runs.items()}
    floor, air = _noise_floor(models["after"], ours), air_of(after)
    moved = [(run.measured(1.0) - run.motion[:, :3], run.motion[:, 3:]) for run in ours]
    angle_stays = rms_figures([angles for angles, _ in moved], SPACING, "error 1 s ahead")
    rate_stays = rms_figures([angles - rates for angles, rates in moved], SPACING, "error 1 s ahead")
    axes, judged = {}, "ahead_200ms" if closed_loop else "prediction_1s"
    for i, axis in enumerate(rig.axes):
        error, gain, weights = figures["after"][i], rig.gains[i], [record.weights[:, i] for record in records]
        bare = angle_stays_200ms[i].value if closed_loop else min(angle_stays[i].value, rate_stays[i].value)
        lifts, reached = gain in rig.positive_gains, getattr(error, judged).value
        use, why = judge_use(gain, reports.get(gain), reached, bare, HORIZONS[judged], lifts)
        p = {name: _ljung_box_p([z[:, i] for z in of_model], weights, records[0].step)
             for name, of_model in residuals.items()}  # fmt: skip
        axes[axis] = AxisReport(
            figures["before"][i], error, floor[i], angle_stays[i], rate_stays[i], p, float(air[0, i]), float(air[1, i]),
            float(models["after"].encoder_noise[i]), use, why, {name: by_axis[i] for name, by_axis in change.items()},
        )  # fmt: skip
    series = tuple(
        HeldOutSeries(
            log, {name: of_model[i] for name, of_model in free_runs.items()},
            dict(zip(PlantState._fields, map(float, starts[i]), strict=True)),
            {name: of_model[i] for name, of_model in residuals.items()}, records[i].step,
            {name: _join_stretches(records[i], *of_model[i]) for name, of_model in stretches.items() if i in of_model},
        )
        for i, log in enumerate(mended)
    )  # fmt: skip
    steps = [record.step for record in records]
    densities = {name: [density for _, density in of_model] for name, of_model in found.items()}
    return axes, _likelihood(densities["before"], densities["after"], steps), series


def _records(before: Fit, after: Fit, logs: Sequence[Log]) -> tuple[Record, ...]:
    """Make records of held-out logs: faults are undone as in training; axes without a noise model do not count."""
    known, likelihood = before.likelihood.counts & after.likelihood.counts, after.likelihood
    records = (replace(record, weights=record.weights * known) for record in records_of(logs, likelihood.rig))
    return tuple(undo_in_record(likelihood.faults, record) for record in records)


def stable_axes(p: Parameters) -> tuple[bool, ...]:
    """Return whether each axis is stable on its own, so that a free run of the plant has a meaning."""
    stiffness = (p.a_th, p.a_e, p.cable_stiffness_travel)
    return tuple(k > 0.0 and a > 0.0 for k, a in zip(stiffness, (p.a_wx, p.a_wz, p.a_wy), strict=True))


def _figures(
    model: Model, errors: Mapping[str, Sequence[Array]], free: Sequence[Array], steps: Sequence[float]
) -> list[AxisError]:
    """Return figures by axis of errors ahead, and of the errors of free runs: None where the axis is not stable."""
    stable = stable_axes(model.parameters)
    figures: dict[str, Sequence[ErrorFigure | None]] = {}
    for name, of_logs in errors.items():
        known = any(map(len, of_logs))
        nothing = [ErrorFigure(0.0, 0.0, 0.0)] * len(stable)
        figures[name] = rms_figures(of_logs, SPACING, f"error {AHEAD[name]}") if known else nothing
    finite = all(np.isfinite(run).all() for run in free)
    of_free = rms_figures(free, steps) if finite else [None] * len(stable)
    figures["free_run"] = [figure if ok else None for figure, ok in zip(of_free, stable, strict=True)]
    by_axis = zip(*figures.values(), strict=True)
    return [AxisError(**dict(zip(figures, of_axis, strict=True))) for of_axis in by_axis]


def _noise_floor(model: Model, runs: Sequence[Run]) -> list[AxisError]:
    """Return the plant's figures by axis on records that it simulates; zero (no bound) if it ran away."""
    rig, p, simulated, free = model.rig, model.parameters, list[Run](), list[Array]()
    for seed, run in enumerate(runs):
        simulated_run, r = simulate_record(run, seed), run.aligned
        simulated += [simulated_run] if simulated_run else []
        torque, noise = model.noise(run.record, seed)
        with np.errstate(invalid="ignore"):  # the error of a run that runs away is not a number
            driven = rig.simulate(r.inputs, r.step, r.start, p, run.offset + torque)
            free.append(driven + noise - rig.simulate(r.inputs, r.step, r.start, p))
    return _figures(model, _errors(simulated), free, [run.record.step for run in runs])


def _errors(runs: Sequence[Run]) -> dict[str, list[Array]]:
    of_runs = [run.errors() for run in runs]
    return {name: [errors[name] for errors in of_runs] for name in HORIZONS}


_Stretches = dict[int, tuple[list[int], Array]]
"""By the index of a log: first samples of one model's stretches, and their errors (S, n, a) [rad]."""


def _fly_again(
    runs: Mapping[str, Sequence[Run]], logs: Sequence[Log], ahead: Sequence[Array], angle_stays: Sequence[ErrorFigure]
) -> tuple[dict[str, _Stretches], bool]:
    """Let plant and recovered controller fly again; without a controller, 1 s under the measured voltages.

    All axes fly together. An axis whose error .2 s ahead, of ``ahead``, is as large as ``angle_stays``, that of a
    constant angle, would spoil the others: then no controller flies. Whether one flew is returned as well.
    """
    figures = rms_figures(ahead, SPACING, "error .2 s ahead")
    if all(figure.value < bare.value for figure, bare in zip(figures, angle_stays, strict=True)):
        laws = {i: law for i, law in enumerate(controllers_of(logs)) if len(law) == len(CHANNELS)}
        answers = {i: partial(answer_deviation, law) for i, law in laws.items()}
        flown = {name: {i: r[i].fly_again(STRETCH, a) for i, a in answers.items()} for name, r in runs.items()}
        errors = [e for of_model in flown.values() for _, e in of_model.values() if len(e)]
        if errors and all(np.isfinite(e).all() for e in errors):
            return flown, True
    return {name: {i: run.fly_again(1.0) for i, run in enumerate(r)} for name, r in runs.items()}, False


def _thin_errors(flown: _Stretches, records: Sequence[Record]) -> list[Array]:
    """Return errors (n, a) [rad] of the stretches of each log, :data:`.prediction.SPACING` apart."""
    every = {i: max(1, round(SPACING / records[i].step)) for i in flown}
    return [e[:, every[i] - 1 :: every[i]].reshape(-1, e.shape[2]) for i, (_, e) in flown.items()]


def _join_stretches(record: Record, firsts: Sequence[int], errors: Array) -> Array:
    """Return the angles (N, a) [rad] that stretches predict; not a number between them."""
    predicted = np.full_like(record.angles, np.nan)
    for first, e in zip(firsts, errors, strict=True):
        predicted[first : first + len(e) - 1] = (record.angles[first : first + len(e)] - e)[:-1]  # a gap to the next
    return predicted


def _standardise(run: Run, model: Model) -> Array:
    """Return the innovations (N, a) of a run under the air and over the scales of another ``model``."""
    step, rig, linear = run.record.step, run.model.rig, run.model.rig.linear(run.model.parameters)
    old, new = (filters(step, linear, rig.air(z)) for z in (run.model.z, model.z))
    columns = [next(recolour(e, before, [after])) for e, before, after in zip(run.innovations.T, old, new, strict=True)]
    return np.column_stack(columns) / model.scales(step)


def _ljung_box_p(white: Sequence[Array], weights: Sequence[Array], step: float) -> float:
    """Return the p value of the portmanteau test; pairs with a sample that does not count are left out.

    (n + 2)/n sum_k c_k^2 / n_k is chi-squared if the residuals are white; c_k is the sum of the n_k products at lag k.
    """
    lags, n = max(1, round(WHITE_TIME / step)), sum(float(w.sum()) for w in weights)
    if n <= lags:
        return nan
    square = sum(float(w @ z**2) for z, w in zip(white, weights, strict=True)) / n
    of_logs = [[correlate(x, x)[len(x) :][:lags] for x in (z * w, w)] for z, w in zip(white, weights, strict=True)]
    products, pairs = (sum(of_lags) for of_lags in zip(*of_logs, strict=True))
    return float(chdtrc(lags, (n + 2.0) / n * float(((products / square) ** 2 / np.maximum(pairs, 1.0)).sum())))


def _likelihood(before: Sequence[Array], after: Sequence[Array], steps: Sequence[float]) -> HeldOutLikelihood:
    """Compare the log-densities (N,) of two models on every log, sample by sample."""
    seconds = sum(len(density) * h for density, h in zip(before, steps, strict=True))
    totals = [sum(float(density.sum()) for density in densities) for densities in (before, after)]
    gains = [(new - old)[:, None] for old, new in zip(before, after, strict=True)]
    (gain,) = bootstrap(gains, steps, after=lambda mean: mean * sum(map(len, gains)))
    return HeldOutLikelihood(seconds, totals[0] / seconds, totals[1] / seconds, gain)


def judge_use(
    gain: str, report: ParameterReport | None, error: float, bare: float, ahead: float, lifts: bool
) -> tuple[Use, str]:
    """Decide what an axis of the plant may be used for, and say why in a clause.

    * Nothing, if a prediction over ``ahead`` [s] without a model, whose error is ``bare`` [rad], is as good; or if the
      gain ``lifts`` and is negative, which it is on no rig with right signs and rotors.
    * Prediction only, if the logs do not determine the gain or references contradict it. A controller multiplies a
      wrong gain; a prediction of similar flights hardly shows it.
    * Control as well in all other cases. ``report`` is None for a gain that was given.
    """
    if not error < bare:
        compared = f"a prediction without a model by {1e3 * bare:.1f} mrad"
        return Use.NOTHING, f"it errs by {1e3 * error:.1f} mrad over {ahead:g} s, {compared}"
    if report is None:
        return Use.CONTROL, f"{gain} was given"
    if lifts and report.estimate.interval[1] < 0.0:
        return Use.NOTHING, f"{gain} is negative, so a sign is wrong or the rotors are exchanged"
    unsure = report.contradicted or report.determination is Determination.NOT_DETERMINED
    return Use.PREDICTION if unsure else Use.CONTROL, f"{gain}: {report.determination}; {report.why}"


def log_likelihood(plant: Parameters, logs: Sequence[Log]) -> float:
    """Return ln p of ``logs`` [nats] under a plant; the air and each log's own parameters are fitted to the logs."""
    return -fit(Likelihood.of(logs, replace(helicopter(logs), parameters=plant)), ()).value
