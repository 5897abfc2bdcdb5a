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

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import log, pi

import numpy as np
from scipy.signal import lfilter
from scipy.special import chdtrc

from heli_identifier.chain import Event
from heli_identifier.records import Log

from .fit import Fit, around, fit
from .helicopter import helicopter
from .likelihood import Likelihood, without
from .noise import error_dynamics, filters, physical, recoloured, start_response
from .prediction import HORIZONS, Model, Run, Stretch, made_by_itself, rms_figures, run_along, segment_means
from .records import NOTHING, LeftOut, record_of, records_of
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
from .rig import Array, Parameters, Record
from .settings import FLOWN, HUBER, OWN, SPACING, WHITE_TIME, DiagnosisSettings


def likelihood_of(model: Model, record: Record, passages: Sequence[tuple[int, int]] = ()) -> tuple[Run, Array]:
    """Fit what a log has of its own, its constant torques and its start, then run a model along it.

    Returns
    -------
    run : Run
        With the likeliest constant torques; its predictions lie within ``passages`` [samples].
    density : Array, shape (N,)
        Log-density of every sample [nats].
    """
    h, sigma, a = record.step, model.scales(record.step), len(model.encoder_noise)
    first = run_along(model, record, np.zeros(a), []).e / sigma
    w = record.weights * np.minimum(1.0, HUBER / np.maximum(np.abs(first), 1e-12))
    own, of_log = np.zeros((3, a)), 0.0
    for i, axis in enumerate(model.filters(h)):
        torque = lfilter(*error_dynamics(axis), np.ones(record.samples))
        J = np.column_stack((torque, start_response(axis, 1, record.samples))) / sigma[i]
        width = np.array([model.torque_width[i], *OWN[1:3]])
        H = (w[:, i, None] * J).T @ J + np.diag(width**-2.0)
        own[:, i] = -np.linalg.solve(H, (w[:, i] * first[:, i]) @ J)  # one step: the innovations are linear in these
        of_log += 0.5 * float(((own[:, i] / width) ** 2).sum() + np.linalg.slogdet(H * np.outer(width, width))[1])
    start = record.start.copy()
    start[: 2 * a] += own[1:].ravel()
    run = run_along(model, replace(record, start=start), own[0], passages)
    u = np.abs(run.e) / sigma
    loss = np.where(u < HUBER, 0.5 * u * u, HUBER * u - 0.5 * HUBER**2)
    density = -(record.weights * (np.log(sigma) + 0.5 * log(2.0 * pi) + loss)).sum(1) - of_log / record.samples
    return run, density


def compare(
    before: Fit,
    after: Fit,
    logs: Sequence[Log],
    left_out: LeftOut = NOTHING,
    reports: Mapping[str, ParameterReport] = {},
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
    left_out : LeftOut, optional
        Passages that count in the free run only.
    reports : mapping of str to ParameterReport, optional
        What the parameters of the plant after rest on; a gain that is not among them was given.
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
    rig, records = after.likelihood.rig, _records(before, after, logs, left_out)
    passages = [_clear(record, left_out.get(record.name, ())) for record in records]
    starts = [rig.begin(own.angles, own.voltages, own.step) for own in logs]
    first, second = (_Held.of(Model.of(fitted), records, passages, logs, starts) for fitted in (before, after))
    models = {"before": first, "after": second}
    errors = {name: _errors(own.ahead, own.free(logs)) for name, own in models.items()}
    change = {name: _change(zip(first.ahead[name], second.ahead[name], strict=True)) for name in HORIZONS}
    stood = rms_figures([run.still("ahead_200ms") for run in second.runs], SPACING, "error over .2 s")
    flown = _Flown({}, 0.0)
    if closed_loop:
        known = all(own.ahead_200ms.value < least.value for own, least in zip(errors["after"], stood, strict=True))
        flown = _flown(models, logs, known)
    if flown.length == FLOWN:
        thin = {name: [_thinned(records[i], own) for i, own in one.items()] for name, one in flown.stretches.items()}
        for name, one in thin.items():
            figures = rms_figures(one, SPACING, f"closed-loop error over {FLOWN:g} s")
            errors[name] = [replace(e, closed_loop_3s=own) for e, own in zip(errors[name], figures, strict=True)]
        change["closed_loop_3s"] = _change(zip(thin["before"], thin["after"], strict=True))
    white = {name: [_standardised(run, second.model) for run in own.runs] for name, own in models.items()}
    axes = _reports(second, errors, change, white, reports, stood if closed_loop else None, after.air())
    series = tuple(
        HeldOutSeries(
            own, first.alone[i], second.alone[i], dict(zip(rig.state, map(float, starts[i]), strict=True)),
            white["before"][i], white["after"][i], records[i].step,
            tuple(event for event in events if event.log == own.name),
            {name: _drawn(records[i], one[i]) for name, one in flown.stretches.items() if i in one}, flown.length,
        )
        for i, own in enumerate(logs)
    )  # fmt: skip
    return axes, _likelihood(first, second), series


def _reports(
    held: "_Held",
    errors: Mapping[str, Sequence[AxisError]],
    change: Mapping[str, Sequence[ErrorFigure]],
    white: Mapping[str, Sequence[Array]],
    reports: Mapping[str, ParameterReport],
    stood: Sequence[ErrorFigure] | None,
    air: Array,
) -> dict[str, AxisReport]:
    """Report every axis of the plant after; ``stood`` is the .2 s error of an angle that stays, where control flew."""
    rig, records, axes = held.model.rig, [run.record for run in held.runs], dict[str, AxisReport]()
    floor = _errors(_ahead([it for seed, run in enumerate(held.runs) if (it := made_by_itself(run, seed))]),
                    held.free_in_air())  # fmt: skip
    angle_stays, rate_stays = (
        rms_figures(own, SPACING, "error over 1 s") for own in zip(*(run.naive() for run in held.runs), strict=True)
    )
    for i, axis in enumerate(rig.axes):
        own, bare, ahead = errors["after"][i].prediction_1s, min(angle_stays[i].value, rate_stays[i].value), 1.0
        if stood is not None:
            own, bare, ahead = errors["after"][i].ahead_200ms, stood[i].value, HORIZONS["ahead_200ms"]
        use, why = use_of(rig.gains[i], reports.get(rig.gains[i]), own.value, bare, ahead)
        weights = [record.weights[:, i] for record in records]
        p = {name: _ljung_box_p([z[:, i] for z in own], weights, records[0].step) for name, own in white.items()}
        axes[axis] = AxisReport(
            errors["before"][i], errors["after"][i], floor[i], angle_stays[i], rate_stays[i], p, float(air[0, i]),
            float(air[1, i]), float(held.model.encoder_noise[i]), use, why,
            {name: figures[i] for name, figures in change.items()},
        )  # fmt: skip
    return axes


def _records(before: Fit, after: Fit, logs: Sequence[Log], left_out: LeftOut) -> tuple[Record, ...]:
    """Prepare held-out logs; an axis without a noise model has no likelihood, and faults are undone as in training."""
    likelihood = after.likelihood
    fitted = np.prod([sum(r.weights.sum(0) for r in f.likelihood.records) > 0 for f in (before, after)], axis=0)
    records = tuple(replace(r, weights=r.weights * fitted) for r in records_of(logs, likelihood.rig, left_out))
    return tuple(without(likelihood.faults, record) for record in records)


@dataclass(frozen=True, eq=False)
class _Held:
    """One model on all held-out logs."""

    model: Model
    runs: list[Run]
    densities: list[Array]
    """Log-density (N,) of every sample [nats]."""
    alone: list[Array]
    """Angles (N, a) [rad] of the plant alone under the voltages, at the rate of the log."""

    @classmethod
    def of(
        cls,
        model: Model,
        records: Sequence[Record],
        passages: Sequence[Sequence[tuple[int, int]]],
        logs: Sequence[Log],
        starts: Sequence[Array],
    ) -> "_Held":
        """Run a model along the logs."""
        found = [likelihood_of(model, record, own) for record, own in zip(records, passages, strict=True)]
        alone = [model.rig.simulate(log.voltages, log.step, start, model.parameters)
                 for log, start in zip(logs, starts, strict=True)]  # fmt: skip
        return cls(model, [run for run, _ in found], [density for _, density in found], alone)

    @cached_property
    def ahead(self) -> dict[str, list[Array]]:
        """Errors (S, a) [rad] of every log by the name of the figure."""
        return _ahead(self.runs)

    def free(self, logs: Sequence[Log]) -> list[ErrorFigure | None]:
        """Figures by axis of the plant alone."""
        errors = [log.angles - own for log, own in zip(logs, self.alone, strict=True)]
        return _free(self.model, errors, [log.step for log in logs])

    def free_in_air(self) -> list[ErrorFigure | None]:
        """Figures by axis of the plant alone on whole records that it made itself."""
        errors, rig, p = list[Array](), self.model.rig, self.model.parameters
        for seed, run in enumerate(self.runs):
            r, random = run.record, np.random.default_rng(seed)
            torque = run.offset + self.model.torque(r.step, r.samples, random)
            noise = self.model.encoder_errors(r.step, r.samples, random)
            made, own = (rig.simulate(r.inputs, r.step, r.start, p, *t) for t in ((torque,), ()))
            with np.errstate(invalid="ignore"):  # of runs away no error is known
                errors.append(made + noise - own)
        return _free(self.model, errors, [run.record.step for run in self.runs])


def _standardised(run: Run, model: Model) -> Array:
    """Innovations (N, a) of a run under the air and over the scales of another model."""
    step, own = run.record.step, run.model
    old, new = (filters(step, own.rig.linear(own.parameters), physical(z)) for z in (own.z, model.z))
    columns = [recoloured(e, was, now) for e, was, now in zip(run.e.T, old, new, strict=True)]
    return np.column_stack(columns) / model.scales(step)


def _ahead(runs: Sequence[Run]) -> dict[str, list[Array]]:
    """Errors (S, a) [rad] of runs by the name of the figure."""
    found = [run.errors() for run in runs]
    return {name: [own[name] for own in found] for name in HORIZONS}


@dataclass(frozen=True)
class _Flown:
    """Stretches that models flew again, by model and log, of ``length`` [s]: with the controller where it is FLOWN."""

    stretches: Mapping[str, Mapping[int, list[Stretch]]]
    length: float


def _flown(models: Mapping[str, _Held], logs: Sequence[Log], known: bool) -> _Flown:
    """Let plant and recovered controller fly again; 1 s under the measured voltages where no law is known.

    All axes fly together: one that the model does not know (``known``) would spoil the others.
    """
    laws = {i: own for i, own in enumerate(controllers_of(logs)) if known and len(own) == len(CHANNELS)}
    found = {name: {i: own.runs[i].flown_again(FLOWN, law) for i, law in laws.items()} for name, own in models.items()}
    errors = [e for one in found.values() for own in one.values() for _, e in own]
    if errors and all(np.isfinite(e).all() for e in errors):
        return _Flown(found, FLOWN)
    alone = {name: {i: run.flown_again(1.0) for i, run in enumerate(own.runs)} for name, own in models.items()}
    return _Flown(alone, 1.0)


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


def _errors(ahead: Mapping[str, Sequence[Array]], free: Sequence[ErrorFigure | None]) -> list[AxisError]:
    """Figures by axis of one model's errors; zero, which bounds nothing, where there is no run."""
    if not any(map(len, ahead.values())):
        nothing = ErrorFigure(0.0, 0.0, 0.0)
        return [AxisError(nothing, nothing, nothing, nothing, own) for own in free]
    figures = [rms_figures(own, SPACING, f"error over {HORIZONS[name]:g} s") for name, own in ahead.items()]
    return [AxisError(a, b, c, d, own) for a, b, c, d, own in zip(*figures, free, strict=True)]


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


def _free(model: Model, errors: Sequence[Array], steps: Sequence[float]) -> list[ErrorFigure | None]:
    """Figures by axis of free runs; None where the axis is not stable."""
    stable = model.rig.stable(model.parameters)
    if not all(np.isfinite(own).all() for own in errors):
        return [None] * len(stable)
    return [own if ok else None for own, ok in zip(rms_figures(errors, steps), stable, strict=True)]


def _likelihood(before: _Held, after: _Held) -> HeldOutLikelihood:
    """Compare the densities of two models in pairs."""
    steps = [run.record.step for run in before.runs]
    seconds = sum(len(density) * h for density, h in zip(before.densities, steps, strict=True))
    totals = [sum(float(density.sum()) for density in own.densities) for own in (before, after)]
    gains = [second - first for first, second in zip(before.densities, after.densities, strict=True)]
    low, high = np.quantile(segment_means(gains, steps), (0.025, 0.975)) * sum(map(len, gains))
    gain = ErrorFigure(totals[1] - totals[0], float(low), float(high))
    return HeldOutLikelihood(seconds, totals[0] / seconds, totals[1] / seconds, gain)


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
    """One axis of one log: its error ahead [rad] and the limit [rad] it is held to."""

    log: str
    axis: str
    error: ErrorFigure
    limit: float

    @property
    def passed(self) -> bool:
        """Whether the error keeps the limit."""
        return self.error.value <= self.limit


def hold_to(
    parameters: Parameters, limits: Mapping[str, float], logs: Sequence[Log], figure: str = "prediction_1s"
) -> list[Outcome]:
    """Predict ``logs`` ahead with ``parameters`` alone, and hold every axis named in ``limits`` [rad] to its limit.

    ``figure`` is one of :data:`.prediction.HORIZONS`; from the filter's state it is larger than that of a fit, which
    knows the air.
    """
    rig, outcomes = helicopter(DiagnosisSettings(), [own.angles for own in logs], [own.voltages for own in logs]), []
    for own in logs:
        run = run_along(Model.alone(rig, parameters), record_of(own, rig), np.zeros(len(rig.axes)))
        said = f"log {own.name}, error over {HORIZONS[figure]:g} s"
        figures = rms_figures([run.errors()[figure]], SPACING, said)
        outcomes += [Outcome(own.name, axis, figures[rig.axes.index(axis)], limit) for axis, limit in limits.items()]
    return outcomes


def log_likelihood(plant: Parameters, logs: Sequence[Log]) -> float:
    """Give ln p of ``logs`` [nats] under a plant; the air, and what each log has of its own, are fitted to them."""
    rig = helicopter(DiagnosisSettings(), [own.angles for own in logs], [own.voltages for own in logs])
    likelihood = Likelihood(rig, records_of(logs, rig, {}))
    point = likelihood.resting(plant)
    start = around(likelihood, (), point, likelihood.of_axes(likelihood.filtered(point)[0])[1])
    return -fit(likelihood, (), start).value
