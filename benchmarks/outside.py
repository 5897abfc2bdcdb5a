"""Tools that a laboratory has without this program: the fit alone, and models of other kinds on the same logs.

*fit*: ours beside scipy's least_squares, and the same with CasADi's Jacobian: four logs of 90 s at 100 Hz, eleven
parameters. The general tools minimise the errors of a simulation over the whole log, without a noise model. Each starts
where our fit starts and ends at its own tolerance. Times are of one core, after compilation.

*outside*: models of the demonstration rigs, and of measured ones as in ``measured`` (the first half of their logs is
fitted), judged on the same held-out logs. *ARX*, one model per axis by least squares, with the number of lags n (of
`STEP`) by Schwarz' criterion:

    y_k = c + Σ_i a_i y_{k-i} + Σ_i b_i · (V_front, V_rear)_{k-i},  i = 1 ... n

*SINDYc* (pysindy; Brunton, Proctor and Kutz 2016), thresholded least squares on the rates of change of pitch, elevation
and the three rates, with polynomials of degree 2, sines and cosines and the best of `THRESHOLDS` on the training logs.
Its states are local cubics over .4 s: of the past for .2 s ahead, centred for 1 s ahead, as those of the plants.

Printed are the errors .2 s and 1 s ahead [mrad], from the same starts on the same logs for all. On measured rigs a
controller flew, its voltages answer the air within 1 s, and the error .2 s ahead counts.
"""

import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from time import process_time

import numpy as np
import pandas
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import lfilter, savgol_coeffs
from threadpoolctl import threadpool_limits

from benchmarks.harness import StartTime, Words, print_frame, section, table
from benchmarks.measured import measured_rig
from benchmarks.rigs import likelihood_of, log_of
from heli_identifier import results, tracing
from heli_identifier.chain import SETTLING
from heli_identifier.online import ModelParameters
from heli_identifier.records import DEMO_RIGS, Log, demo_logs
from heli_identifier.results import to_digits
from heli_identifier.results.prediction import SMOOTHING, SPACING
from heli_plant.effects import AXES
from heli_plant.parameters import PlantParameters
from tests.blind.generator import simulate_log
from tests.blind.rigs import draw_rig
from tests.blind.signals import multisines

Array = NDArray[np.float64]
H, LOGS, SECONDS, ROUNDS = 0.01, 4, 90.0, 3
NAMES = ModelParameters._fields


def fit_likelihood(likelihood: tracing.Likelihood, _start: Array) -> Array:
    """Fit by the likelihood."""
    plant = tracing.fit(likelihood, [name for name in likelihood.rig.base if name in NAMES]).parameters
    return np.array([getattr(plant, name) for name in NAMES])


def fit_simulation(likelihood: tracing.Likelihood, start: Array) -> Array:
    """Fit by least squares of simulation errors, derivatives by finite differences of the compiled plant."""
    rig, width = likelihood.rig, np.maximum(np.abs(start), 0.05)
    base: PlantParameters = rig.estimate(likelihood.records)

    def errors(x: Array) -> Array:
        p = base._replace(**dict(zip(NAMES, (x * width).tolist(), strict=True)))
        parts = [rig.simulate(r.inputs, r.step, r.start, p) - r.angles for r in likelihood.records]
        return np.nan_to_num(np.concatenate(parts).ravel(), nan=1e3, posinf=1e3, neginf=-1e3)

    return least_squares(errors, start / width, method="trf", x_scale="jac").x * width


def fit_casadi(likelihood: tracing.Likelihood, start: Array) -> Array:
    """Fit the same by CasADi: RK4 as a mapped function, with its exact Jacobian for least_squares."""
    import casadi as ca

    p, x, u = ca.MX.sym("p", len(NAMES)), ca.MX.sym("x", 8), ca.MX.sym("u", 2)
    k, lag = dict(zip(NAMES, ca.vertsplit(p), strict=True)), likelihood.rig.estimate(likelihood.records).T_m
    th, e, _, wx, wz, wy, front, rear = ca.vertsplit(x)
    slope = ca.vertcat(
        wx, wz, wy,
        -k["a_wx"] * wx - k["a_th"] * ca.sin(th - k["theta0"]) + k["k_x"] * (front - rear),
        -k["a_wz"] * wz - k["a_e"] * e - k["a_1"] - k["a_lt"] * wx * wy + k["k_z"] * (front + rear) * ca.cos(th),
        -k["a_wy"] * wy + k["k_y"] * (front + rear) * ca.sin(th),
        (u - x[6:]) / lag,
    )  # fmt: skip
    inputs = ca.vertcat(u, p)
    next_state = ca.simpleRK(ca.Function("slope", [x, inputs], [slope]), 1, 4)(x, inputs, H)
    step, residuals = ca.Function("step", [x, u, p], [next_state]).expand(), []
    for record in likelihood.records:
        run = step.mapaccum(record.samples - 1)
        angles = run(record.start[:8], record.inputs[:-1].T, p)[:3, :]
        residuals.append(ca.vec(angles - record.angles[1:].T))
    r = ca.vertcat(*residuals)
    value, jacobian = (ca.Function("f", [p], [f]) for f in (r, ca.jacobian(r, p)))
    return least_squares(lambda x: value(x).full().ravel(), start, lambda x: jacobian(x).full(), x_scale="jac").x


CONTENDERS: dict[str, Callable[[tracing.Likelihood, Array], Array]] = {
    "this project: likelihood, air and offsets": fit_likelihood,
    "scipy least_squares on simulation errors": fit_simulation,
    "CasADi single shooting, exact Jacobian": fit_casadi,
}


def fit() -> str:
    """Measure the times, and return the section of the page."""
    generated = draw_rig(np.random.SeedSequence(11), "clean")
    flights = [multisines(SECONDS, np.random.default_rng(number)) for number in range(LOGS)]
    likelihood = likelihood_of([log_of(f"log{k}", 1.0 / H, simulate_log(generated, flight, k))
                                for k, flight in enumerate(flights)])  # fmt: skip
    first = likelihood.rig.estimate(likelihood.records)
    start, truth = (np.array([getattr(plant, name) for name in NAMES]) for plant in (first, generated.base))
    gains, rows = [NAMES.index(name) for name in ("k_x", "k_z", "k_y")], []
    with threadpool_limits(1):
        fit_likelihood(likelihood, start)
        for name, run in CONTENDERS.items():
            times = [process_time()]
            for _ in range(ROUNDS):
                estimate = run(likelihood, start)
                times.append(process_time())
            rows.append((name, float(np.median(np.diff(times))), np.abs(estimate / truth - 1.0)[gains].max()))
    lines = [(name, to_digits(time), f"{time / rows[0][1]:.1f}", f"{error:.2%}") for name, time, error in rows]
    samples = sum(record.samples for record in likelihood.records)
    return section(
        "The fit alone",
        f"{len(NAMES)} parameters, {samples} samples, processor time of one core, median of {ROUNDS}; the largest "
        "error of a gain against the truth.",
        table(("fit", "time [s]", "over ours", "gains off by"), lines),
        packages=("numpy", "scipy", "casadi"),
    )


Record = tuple[Array, Array]
"""Voltages (N, 2), means over `STEP`, and angles (N, 3)."""

Predictor = Callable[[Record, NDArray[np.intp], int], Array]
"""Returns the angles (S, 3) of a record a number of steps after the starts (S,)."""

STEP = 0.05
"""Sampling interval of the baselines [s]: at 100 Hz rounding by the encoders is larger than what moves in a step."""

LAGS, THRESHOLDS = range(1, 11), (0.003, 0.01, 0.03, 0.1, 0.3)
HORIZONS = {"ahead_200ms": 4, "prediction_1s": 20}
"""Steps ahead by the name of the figure in a diagnosis."""


def record_of(log: Log) -> Record:
    """Return the angles of a log every `STEP`, and the mean voltages between them."""
    stride = round(STEP / log.step)
    count = log.samples // stride
    return log.voltages[: count * stride].reshape(count, stride, 2).mean(1), log.angles[::stride][:count]


def fit_arx(records: Sequence[Record]) -> Predictor:
    """Fit an ARX model to each axis."""

    def lagged(at: NDArray[np.intp], n: int) -> NDArray[np.intp]:
        return at[:, None] - np.arange(1, n + 1)

    def regressors(past: Array, v: Array, at: NDArray[np.intp]) -> Array:
        return np.hstack((past, v[lagged(at, past.shape[1])].reshape(len(at), -1), np.ones((len(at), 1))))

    at = [np.arange(LAGS[-1], len(y)) for _, y in records]
    fitted = []
    for axis in range(3):
        target, models = np.concatenate([y[k, axis] for (_, y), k in zip(records, at, strict=True)]), []
        for n in LAGS:
            X = np.vstack([regressors(y[lagged(k, n), axis], v, k) for (v, y), k in zip(records, at, strict=True)])
            b, *_ = np.linalg.lstsq(X, target, rcond=None)
            N = len(target)
            models.append((N * np.log(np.mean((target - X @ b) ** 2)) + X.shape[1] * np.log(N), n, b))
        fitted.append(min(models, key=lambda model: model[0])[1:])

    def predict(record: Record, at: NDArray[np.intp], steps: int) -> Array:
        v, y = record
        ends = []
        for axis, (n, b) in enumerate(fitted):
            past = y[lagged(at + 1, n), axis]  # the newest first
            for k in range(1, steps + 1):
                past = np.column_stack((regressors(past, v, at + k) @ b, past[:, :-1]))
            ends.append(past[:, 0])
        return np.column_stack(ends)

    return predict


def derivatives(y: Array, order: int, centred: bool = True) -> Array:
    """Return the derivative (N, 3) by local cubics over `SMOOTHING`; NaN at the ends of the log."""
    length = int(SMOOTHING / STEP) | 1
    filtered: Array = lfilter(savgol_coeffs(length, 3, order, STEP, None if centred else length - 1), 1.0, y, axis=0)
    filtered[: length - 1] = np.nan
    return np.roll(filtered, -(length // 2), axis=0) if centred else filtered


def fit_sindy(records: Sequence[Record], threshold: float) -> Predictor:
    """Fit sparse dynamics of pitch, elevation and the three rates; the travel has no influence."""
    import pysindy

    states, slopes, volts = [], [], []
    for v, y in records:
        angles, rates, accelerations = (derivatives(y, order) for order in (0, 1, 2))
        inside = np.isfinite(angles).all(1)
        states.append(np.hstack((angles[:, :2], rates))[inside])
        slopes.append(np.hstack((rates[:, :2], accelerations))[inside])
        volts.append(v[inside])
    library = pysindy.PolynomialLibrary(degree=2) + pysindy.FourierLibrary(n_frequencies=1)
    model = pysindy.SINDy(pysindy.STLSQ(threshold=threshold), library)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about columns that depend on each other
        model.fit(states, t=STEP, x_dot=slopes, u=volts)

    def slope(x: Array, u: Array) -> Array:
        predicted = np.asarray(model.predict(np.delete(np.clip(x, -1e3, 1e3), 2, axis=1), u=u))
        return np.insert(predicted, 2, x[:, 5], axis=1)

    def predict(record: Record, at: NDArray[np.intp], steps: int) -> Array:
        v, y = record
        x = np.hstack([derivatives(y, order, steps == HORIZONS["prediction_1s"])[at] for order in (0, 1)])  # (S, 6)
        for u in (v[at + k] for k in range(steps)):
            a = slope(x, u)
            b = slope(x + 0.5 * STEP * a, u)
            c = slope(x + 0.5 * STEP * b, u)
            d = slope(x + STEP * c, u)
            x = x + STEP / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        return x[:, :3]

    return predict


def starts(record: Record, left_out: Sequence[tuple[float, float]]) -> NDArray[np.intp]:
    """Return the samples at which predictions start, as in a diagnosis: without passages that a fit leaves out."""
    at = np.arange(round(SETTLING / STEP), len(record[1]) - HORIZONS["prediction_1s"], round(SPACING / STEP))
    clear = [not any(t - SETTLING <= end and t + 1.0 >= start for start, end in left_out) for t in STEP * at]
    return at[clear]


def errors(predict: Predictor, records: Sequence[Record], at: Sequence[NDArray[np.intp]], steps: int) -> Array:
    """Return root mean squares (3,) [mrad] of the errors a number of steps ahead."""
    differences = [record[1][k + steps] - predict(record, k, steps) for record, k in zip(records, at, strict=True)]
    return np.asarray(1e3 * np.sqrt(np.mean(np.concatenate(differences) ** 2, axis=0)))


def judge_models(rig: str, training: Sequence[Log], held_out: Sequence[Log]) -> pandas.DataFrame:
    """Return a row for each horizon and axis, with errors in mrad."""
    diagnosis = results.diagnose(training, held_out=held_out)
    training_records, records = ([record_of(log) for log in logs] for logs in (training, held_out))
    at = [starts(record, [(e.start, e.end) for e in diagnosis.events if e.log == log.name])
          for record, log in zip(records, held_out, strict=True)]  # fmt: skip
    training_starts = [starts(record, ()) for record in training_records]
    arx, sindy = fit_arx(training_records), [fit_sindy(training_records, threshold) for threshold in THRESHOLDS]
    parts = []
    for name, steps in HORIZONS.items():
        best = min(sindy, key=lambda x: float(np.log(errors(x, training_records, training_starts, steps)).sum()))
        plants = {word: [1e3 * getattr(getattr(diagnosis.axes[axis], stage), name).value for axis in AXES]
                  for word, stage in (("model before", "before"), ("corrected", "after"))}  # fmt: skip
        parts.append(pandas.DataFrame({
            "rig": rig, "ahead": f"{steps * STEP:g} s", "axis": AXES, "ARX": errors(arx, records, at, steps),
            "SINDYc": errors(best, records, at, steps), **plants,
        }))  # fmt: skip
    return pandas.concat(parts)


def outside(rigs: Words, start: StartTime = 6.0, csv: Path | None = None) -> None:
    """Judge all models on the demonstration rigs and on measured ones; write the errors to the file ``csv``."""
    data = {rig: [list(logs) for logs in demo_logs(rig)] for rig in DEMO_RIGS}
    data |= {name: [logs[k::2] for k in (0, 1)] for name, logs in (measured_rig(rig, start) for rig in rigs)}
    rows = pandas.concat([judge_models(rig, *logs) for rig, logs in data.items()])
    print_frame(rows, csv)
