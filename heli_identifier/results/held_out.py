"""Before and after on held-out logs, which decide nothing in the search: they are for the figure.

    ln p(log | plant) = max over b of  sum_a sum_k -ln sigma_a - ln(2 pi)/2 - rho(e_ak / sigma_a)
                        - |b / tau|^2 / 2 - ln det(1 + tau H tau) / 2

e are the innovations under a plant with the air, the encoders' noise and the spread tau of its own training logs:
nothing but b, what the log has of its own (:class:`.Point`), is fitted to what was held out. b is a random
effect with information H, and its integral is Laplace's; rho is Huber's loss. Of all figures here this one alone ranks
the true plant first in windy air under any controller.

The other figures are root mean squares of errors:

| figure | the plant runs from | under | how long |
|---|---|---|---|
| ahead_100ms, ahead_200ms | the filter's state every .25 s | the measured voltages | .1 s, .2 s |
| prediction_1s, prediction_2s | the smoothed motion every .25 s | the same | 1 s, 2 s |
| free_run | the first samples of a log | the same | the whole log |
| closed_loop_3s | the smoothed motion | its own controller, as recovered | 3 s |

The noise floor has those of the plant on records that it made itself, with the air and the encoders' noise of its fit
(:mod:`.prediction`). All intervals come from one bootstrap over segments of 4 s (:mod:`.bootstrap`).

Source of the test for whiteness: Ljung and Box 1978, eq. (1.2).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import log, nan, pi

import numpy as np
from scipy.signal import correlate
from scipy.special import chdtrc

from heli_identifier.records import Event, Log
from heli_identifier.results.bootstrap import bootstrap, change_figures, rms_figures
from heli_identifier.results.diagnosis import AxisError, AxisReport, ErrorFigure, HeldOutLikelihood, HeldOutSeries, Use
from heli_identifier.results.prediction import FLOWN, HORIZONS, SPACING, Model, Run, simulate_record
from heli_identifier.tracing.fit import Fit, fit, fit_per_log
from heli_identifier.tracing.helicopter import helicopter
from heli_identifier.tracing.likelihood import Likelihood, undo_in_record
from heli_identifier.tracing.noise import filters, recolour
from heli_identifier.tracing.references import CHANNELS, controllers_of
from heli_identifier.tracing.rig import Array, Parameters, Record, records_of
from heli_identifier.tracing.settings import OUTLIER
from heli_identifier.tracing.statements import Determination, ParameterReport

WHITE_TIME = 1.0
"""Time [s] of the lags of a test for whiteness: beyond it the filter has taken for air what a plant lacks."""


def likelihood_of(model: Model, record: Record) -> tuple[Run, Array]:
    """Fit what a log has of its own, run a model along it, and give ln p (N,) of every sample.

    The run has the log's torques, start and zeros, and the gains of the plant.
    """
    likelihood, sigma = Likelihood(model.rig, (record,), model.widths), model.scales(record.step)
    fitted = fit_per_log(likelihood, likelihood.neutral_point(model.parameters, model.z), sigma)
    b, tau = fitted.point.per_log[0], likelihood.tau
    left = fitted.quadratic.covariance[0] / np.outer(tau, tau)  # of the prior's variance: (1 + tau H tau)^-1
    of_log = 0.5 * (float(((b / tau) ** 2).sum()) - np.linalg.slogdet(left)[1])
    u = np.abs(fitted.e[0]) / sigma
    loss = np.where(u < OUTLIER, 0.5 * u * u, OUTLIER * u - 0.5 * OUTLIER**2)
    density = -(record.weights * (np.log(sigma) + 0.5 * log(2.0 * pi) + loss)).sum(1) - of_log / record.samples
    aligned, pushes = likelihood.aligned_record(0, fitted.point), b[len(model.widths) :].tolist()
    return Run.along(model, record, b[: len(sigma)], aligned, pushes), density


def compare(
    before: Fit,
    after: Fit,
    logs: Sequence[Log],
    reports: Mapping[str, ParameterReport] = {},
    events: Sequence[Event] = (),
    closed_loop: bool = False,
) -> tuple[dict[str, AxisReport], HeldOutLikelihood, tuple[HeldOutSeries, ...]]:
    """Compare plants that were fitted to training logs on held-out ``logs``.

    The events of the logs count in the free run only; those that are shown are ``events``. ``reports`` say what the
    parameters of the plant after rest on; a gain that is not among them was given. Under a controller
    (``closed_loop``) the voltages answer the air within 1 s, so what an axis may be used for is then judged over .2 s
    from the filter's state, and not over 1 s under the measured voltages.

    Raises
    ------
    LogError
        No passage is long enough for a prediction over two seconds.
    """
    rig, records = after.likelihood.rig, _records(before, after, logs)
    first, second = (_Held.of(Model.of(fitted), records, logs) for fitted in (before, after))
    models, judged = {"before": first, "after": second}, "ahead_200ms" if closed_loop else "prediction_1s"
    stays = rms_figures([run.measured(0.2) - run.record.angles[run.at] for run in second.runs], *_AHEAD["ahead_200ms"])
    flown, length = _fly_again(models, logs, stays) if closed_loop else ({}, 0.0)
    if length == FLOWN:
        for name, one in flown.items():
            models[name].errors["closed_loop_3s"] = _thin(one, records)
    errors = {name: own.figures() for name, own in models.items()}
    change = {name: change_figures(first.errors[name], second.errors[name], SPACING) for name in first.errors}
    white = {name: [_standardise(run, second.model) for run in own.runs] for name, own in models.items()}
    floor, air = second.noise_floor(), after.air()
    moved = [(run.measured(1.0) - run.motion[:, :3], run.motion[:, 3:]) for run in second.runs]
    angle_stays = rms_figures([angles for angles, _ in moved], *_AHEAD["prediction_1s"])
    rate_stays = rms_figures([angles - rates for angles, rates in moved], *_AHEAD["prediction_1s"])
    axes = {}
    for i, axis in enumerate(rig.axes):
        own, weights = errors["after"][i], [record.weights[:, i] for record in records]
        bare = stays[i].value if closed_loop else min(angle_stays[i].value, rate_stays[i].value)
        gain = rig.gains[i]
        error = getattr(own, judged).value
        use, why = use_of(gain, reports.get(gain), error, bare, HORIZONS[judged], gain in rig.lifting)
        p = {name: _ljung_box_p([z[:, i] for z in one], weights, records[0].step) for name, one in white.items()}
        axes[axis] = AxisReport(
            errors["before"][i], own, floor[i], angle_stays[i], rate_stays[i], p, float(air[0, i]), float(air[1, i]),
            float(second.model.encoder_noise[i]), use, why, {name: figures[i] for name, figures in change.items()},
        )  # fmt: skip
    series = tuple(
        HeldOutSeries(
            own, first.alone[i], second.alone[i], dict(zip(rig.state, map(float, first.begun[i]), strict=True)),
            white["before"][i], white["after"][i], records[i].step,
            tuple(event for event in events if event.log == own.name),
            {name: _draw_stretches(records[i], *one[i]) for name, one in flown.items() if i in one}, length,
        )
        for i, own in enumerate(logs)
    )  # fmt: skip
    return axes, _likelihood(first, second), series


_AHEAD = {name: (SPACING, f"error over {H:g} s") for name, H in HORIZONS.items()}
_AHEAD["closed_loop_3s"] = (SPACING, f"closed-loop error over {FLOWN:g} s")
"""Of errors from many starts: the time from one to the next [s], and what a message calls them."""


def _records(before: Fit, after: Fit, logs: Sequence[Log]) -> tuple[Record, ...]:
    """Prepare held-out logs; an axis without a noise model has no likelihood, and faults are undone as in training."""
    known, likelihood = before.counts & after.counts, after.likelihood
    records = records_of(logs, likelihood.rig)
    return tuple(undo_in_record(likelihood.faults, replace(own, weights=own.weights * known)) for own in records)


@dataclass(frozen=True, eq=False)
class _Held:
    """One model on all held-out logs."""

    model: Model
    logs: Sequence[Log]
    runs: list[Run]
    densities: list[Array]
    """Log-density (N,) of every sample [nats]."""
    begun: list[Array]
    """State of the plant at the first sample of each log."""
    alone: list[Array]
    """Angles (N, a) [rad] of the plant alone under the voltages, at the rate of the log."""

    @classmethod
    def of(cls, model: Model, records: Sequence[Record], logs: Sequence[Log]) -> "_Held":
        """Run a model along the logs."""
        found = [likelihood_of(model, own) for own in records]
        begun = [model.rig.begin(log.angles, log.voltages, log.step) for log in logs]
        alone = [model.rig.simulate(log.voltages, log.step, start, model.parameters)
                 for log, start in zip(logs, begun, strict=True)]  # fmt: skip
        return cls(model, logs, [run for run, _ in found], [density for _, density in found], begun, alone)

    @cached_property
    def errors(self) -> dict[str, list[Array]]:
        """Errors ahead (S, a) [rad] of every log by the name of the figure."""
        return _errors(self.runs)

    def figures(self) -> list[AxisError]:
        """Figures by axis."""
        free = [log.angles - own for log, own in zip(self.logs, self.alone, strict=True)]
        return self._figures(self.errors, free, [log.step for log in self.logs])

    def noise_floor(self) -> list[AxisError]:
        """Figures by axis of the plant on records of its own; zero, which bounds nothing, where it ran away."""
        rig, p, made, free = self.model.rig, self.model.parameters, list[Run](), list[Array]()
        for seed, run in enumerate(self.runs):
            own, r, (torque, noise) = simulate_record(run, seed), run.aligned, self.model.noise(run.record, seed)
            made += [own] if own else []
            with np.errstate(invalid="ignore"):  # of runs away no error is known
                driven = rig.simulate(r.inputs, r.step, r.start, p, run.offset + torque)
                free.append(driven + noise - rig.simulate(r.inputs, r.step, r.start, p))
        return self._figures(_errors(made), free, [run.record.step for run in self.runs])

    def _figures(
        self, errors: Mapping[str, Sequence[Array]], free: Sequence[Array], steps: Sequence[float]
    ) -> list[AxisError]:
        """Figures by axis of errors ahead, and of free runs: None where the axis is not stable."""
        stable = self.model.rig.stable(self.model.parameters)
        found: dict[str, Sequence[ErrorFigure | None]] = {
            name: rms_figures(own, *_AHEAD[name]) if any(map(len, own)) else [ErrorFigure(0.0, 0.0, 0.0)] * len(stable)
            for name, own in errors.items()
        }
        known = all(np.isfinite(own).all() for own in free)
        of_free = rms_figures(free, steps) if known else [None] * len(stable)
        found["free_run"] = [own if ok else None for own, ok in zip(of_free, stable, strict=True)]
        return [AxisError(**dict(zip(found, own, strict=True))) for own in zip(*found.values(), strict=True)]


def _errors(runs: Sequence[Run]) -> dict[str, list[Array]]:
    found = [run.errors() for run in runs]
    return {name: [own[name] for own in found] for name in HORIZONS}


_Stretches = dict[int, tuple[list[int], Array]]
"""By log: first samples of stretches of one model, and their errors (S, n, a) [rad]."""


def _fly_again(
    models: Mapping[str, _Held], logs: Sequence[Log], stays: Sequence[ErrorFigure]
) -> tuple[dict[str, _Stretches], float]:
    """Let plant and recovered controller fly again; 1 s under the measured voltages where no law is known.

    All axes fly together: one that predicts .2 s ahead no better than an angle that ``stays`` would spoil the others.
    The length of the stretches [s] is returned beside them.
    """
    own = rms_figures(models["after"].errors["ahead_200ms"], *_AHEAD["ahead_200ms"])
    if all(figure.value < least.value for figure, least in zip(own, stays, strict=True)):
        laws = {i: law for i, law in enumerate(controllers_of(logs)) if len(law) == len(CHANNELS)}
        found = {name: {i: m.runs[i].fly_again(FLOWN, law) for i, law in laws.items()} for name, m in models.items()}
        errors = [e for one in found.values() for _, e in one.values() if len(e)]
        if errors and all(np.isfinite(e).all() for e in errors):
            return found, FLOWN
    return {name: {i: run.fly_again(1.0) for i, run in enumerate(m.runs)} for name, m in models.items()}, 1.0


def _thin(flown: _Stretches, records: Sequence[Record]) -> list[Array]:
    """Errors (n, a) [rad] of the stretches of each log, :data:`.prediction.SPACING` apart."""
    every = {i: max(1, round(SPACING / records[i].step)) for i in flown}
    return [e[:, every[i] - 1 :: every[i]].reshape(-1, e.shape[2]) for i, (_, e) in flown.items()]


def _draw_stretches(record: Record, firsts: Sequence[int], errors: Array) -> Array:
    """Angles (N, a) [rad] that stretches predict; not a number between them."""
    predicted = np.full_like(record.angles, np.nan)
    for first, e in zip(firsts, errors, strict=True):
        predicted[first : first + len(e) - 1] = (record.angles[first : first + len(e)] - e)[:-1]  # a gap to the next
    return predicted


def _standardise(run: Run, model: Model) -> Array:
    """Innovations (N, a) of a run under the air and over the scales of another model."""
    step, own = run.record.step, run.model
    old, new = (filters(step, own.rig.linear(own.parameters), own.rig.air(z)) for z in (own.z, model.z))
    columns = [recolour(e, was, [now])[0] for e, was, now in zip(run.innovations.T, old, new, strict=True)]
    return np.column_stack(columns) / model.scales(step)


def _ljung_box_p(white: Sequence[Array], weights: Sequence[Array], step: float) -> float:
    """P value of the portmanteau test; pairs of samples of which one does not count are left out.

    (n + 2)/n sum_k c_k^2 / n_k is chi-squared where the residuals are white; c_k sums the n_k products at lag k.
    """
    lags, n = max(1, round(WHITE_TIME / step)), sum(float(w.sum()) for w in weights)
    if n <= lags:
        return nan
    square = sum(float(w @ z**2) for z, w in zip(white, weights, strict=True)) / n
    of_logs = [[correlate(x, x)[len(x) :][:lags] for x in (z * w, w)] for z, w in zip(white, weights, strict=True)]
    products, pairs = (sum(own) for own in zip(*of_logs, strict=True))
    return float(chdtrc(lags, (n + 2.0) / n * float(((products / square) ** 2 / np.maximum(pairs, 1.0)).sum())))


def _likelihood(before: _Held, after: _Held) -> HeldOutLikelihood:
    """Compare the densities of two models in pairs."""
    steps = [run.record.step for run in before.runs]
    seconds = sum(len(own) * h for own, h in zip(before.densities, steps, strict=True))
    totals = [sum(float(density.sum()) for density in own.densities) for own in (before, after)]
    gains = [(two - one)[:, None] for one, two in zip(before.densities, after.densities, strict=True)]
    (gain,) = bootstrap(gains, steps, after=lambda mean: mean * sum(map(len, gains)))
    return HeldOutLikelihood(seconds, totals[0] / seconds, totals[1] / seconds, gain)


def use_of(
    gain: str, report: ParameterReport | None, error: float, least: float, ahead: float, lifts: bool
) -> tuple[Use, str]:
    """Decide what an axis of the plant may be used for, and say why in a clause.

    Nothing, if over ``ahead`` [s] a prediction without a model, which errs by ``least`` [rad], does as well, or if the
    gain ``lifts`` and is negative, as on no rig whose signs and rotors are right. Prediction only, if the logs do not
    determine the axis's gain or references contradict it: a controller multiplies a wrong gain, a prediction of similar
    flights hardly shows it. Else control as well. ``report`` is None for a gain that was given.
    """
    if not error < least:
        bare = f"a prediction without a model by {1e3 * least:.1f} mrad"
        return Use.NOTHING, f"it errs by {1e3 * error:.1f} mrad over {ahead:g} s, {bare}"
    if report is None:
        return Use.CONTROL, f"{gain} was given"
    if lifts and report.estimate.interval[1] < 0.0:
        return Use.NOTHING, f"{gain} is negative, so a sign is wrong or the rotors are exchanged"
    unsure = report.contradicted or report.determination is Determination.NOT_DETERMINED
    return Use.PREDICTION if unsure else Use.CONTROL, f"{gain}: {report.determination}; {report.why}"


def log_likelihood(plant: Parameters, logs: Sequence[Log]) -> float:
    """Give ln p of ``logs`` [nats] under a plant; the air, and what each log has of its own, are fitted to them."""
    return -fit(Likelihood.of(logs, replace(helicopter(logs), parameters=plant)), ()).value
