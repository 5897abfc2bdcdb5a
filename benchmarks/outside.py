"""What a laboratory would fit to the same logs without this program, judged on the same held-out logs.

    python -m benchmarks outside [RIG...] [--from SECONDS] [--csv FILE]

The demonstration rigs, and measured ones as in ``measured`` (the first half of their logs is fitted).

*ARX*, one model per axis by least squares, with the number of lags n (of `STEP`) by Schwarz' criterion:

    y_k = c + Σ_i a_i y_{k-i} + Σ_i b_i · (V_front, V_rear)_{k-i},  i = 1 ... n

*SINDYc* (pysindy; Brunton, Proctor and Kutz 2016), thresholded least squares on the rates of change of pitch, elevation
and the three rates, with polynomials of degree 2, sines and cosines; the threshold is the best of `THRESHOLDS` on the
training logs. Its states are local cubics over .4 s; for .2 s ahead they know the past alone, for 1 s ahead they are
centred, as those that the plants start from.

Printed are the errors .2 s and 1 s ahead [mrad], from the same starts on the same logs for all. Where a controller flew
(measured rigs), its voltages answer the air within 1 s, and the error .2 s ahead is the one that counts.
"""

import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas
import typer
from numpy.typing import NDArray
from scipy.signal import savgol_coeffs

from benchmarks.halves import rig_logs
from benchmarks.harness import Words, print_frame
from heli_identifier.chain import SETTLING
from heli_identifier.records import DEMO_RIGS, Log, demo_logs
from heli_identifier.tracing import diagnose
from heli_identifier.tracing.settings import SMOOTHING, SPACING
from heli_plant.effects import AXES

Array = NDArray[np.float64]
Record = tuple[Array, Array]
"""Voltages (N, 2), means over `STEP`, and angles (N, 3)."""

Predictor = Callable[[Record, NDArray[np.intp], int], Array]
"""Gives the angles (S, 3) so many steps behind the starts (S,) of a record."""

STEP = 0.05
"""Sampling interval of the baselines [s]: at 100 Hz rounding by the encoders is larger than what moves in a step."""

LAGS, THRESHOLDS = range(1, 11), (0.003, 0.01, 0.03, 0.1, 0.3)
HORIZONS = {"ahead_200ms": 4, "prediction_1s": 20}
"""Steps ahead by the name of the figure in a diagnosis."""


def record_of(log: Log) -> Record:
    """Take every so many samples of a log, and the mean voltages between them."""
    stride = round(STEP / log.step)
    count = log.samples // stride
    return log.voltages[: count * stride].reshape(count, stride, 2).mean(1), log.angles[::stride][:count]


def arx(records: Sequence[Record]) -> Predictor:
    """Fit an ARX model to each axis."""

    def regressors(v: Array, y: Array, at: NDArray[np.intp], n: int) -> Array:
        back = at[:, None] - np.arange(1, n + 1)
        return np.hstack((y[back], v[back].reshape(len(at), -1), np.ones((len(at), 1))))

    fitted = []
    for axis in range(3):
        found = []
        for n in LAGS:
            at = [np.arange(LAGS[-1], len(y)) for _, y in records]
            X = np.vstack([regressors(v, y[:, axis], k, n) for (v, y), k in zip(records, at, strict=True)])
            target = np.concatenate([y[k, axis] for (_, y), k in zip(records, at, strict=True)])
            b, *_ = np.linalg.lstsq(X, target, rcond=None)
            N = len(target)
            found.append((N * np.log(np.mean((target - X @ b) ** 2)) + X.shape[1] * np.log(N), n, b))
        fitted.append(min(found, key=lambda one: one[0])[1:])

    def predict(record: Record, at: NDArray[np.intp], steps: int) -> Array:
        v, y = record
        ends = []
        for axis, (n, b) in enumerate(fitted):
            past = y[at[:, None] - np.arange(n), axis]  # the newest first
            for k in range(steps):
                volts = v[at[:, None] + k - np.arange(n)].reshape(len(at), -1)
                new = np.hstack((past, volts, np.ones((len(at), 1)))) @ b
                past = np.column_stack((new, past[:, :-1]))
            ends.append(past[:, 0])
        return np.column_stack(ends)

    return predict


def derivatives(y: Array, order: int, centred: bool = True) -> Array:
    """Give the derivative (N, 3) by local cubics over `SMOOTHING`; not a number where the log ends."""
    length = int(SMOOTHING / STEP) | 1
    weights = savgol_coeffs(length, 3, order, STEP, None if centred else length - 1, use="dot")
    found = np.full_like(y, np.nan)
    first = length // 2 if centred else length - 1
    found[first : first + len(y) - length + 1] = np.einsum(
        "nak,k->na", np.lib.stride_tricks.sliding_window_view(y, length, axis=0), weights
    )
    return found


def sindy(records: Sequence[Record], threshold: float) -> Predictor:
    """Fit sparse dynamics of pitch, elevation and the three rates; the travel moves nothing."""
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
        warnings.simplefilter("ignore")  # of columns that depend on each other
        model.fit(states, t=STEP, x_dot=slopes, u=volts)

    def predict(record: Record, at: NDArray[np.intp], steps: int) -> Array:
        v, y = record
        angles, rates = (derivatives(y, order, steps == HORIZONS["prediction_1s"])[at] for order in (0, 1))
        x = np.hstack((angles, rates))  # (S, 6)

        def slope(x: Array, u: Array) -> Array:
            found = np.asarray(model.predict(np.delete(np.clip(x, -1e3, 1e3), 2, axis=1), u=u))
            return np.insert(found, 2, x[:, 5], axis=1)

        for k in range(steps):
            u, h = v[at + k], STEP
            a = slope(x, u)
            b = slope(x + 0.5 * h * a, u)
            c = slope(x + 0.5 * h * b, u)
            d = slope(x + h * c, u)
            x = x + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        return x[:, :3]

    return predict


def starts(record: Record, left_out: Sequence[tuple[float, float]]) -> NDArray[np.intp]:
    """Give the samples at which predictions start, those of a diagnosis: none whose passage meets what is left out."""
    at = np.arange(round(SETTLING / STEP), len(record[1]) - HORIZONS["prediction_1s"], round(SPACING / STEP))
    clear = [not any(t - SETTLING <= end and t + 1.0 >= start for start, end in left_out) for t in STEP * at]
    return at[clear]


def errors(predict: Predictor, records: Sequence[Record], at: Sequence[NDArray[np.intp]], steps: int) -> Array:
    """Root mean squares (3,) [rad] of the errors so many steps ahead."""
    found = [record[1][k + steps] - predict(record, k, steps) for record, k in zip(records, at, strict=True)]
    return np.asarray(np.sqrt(np.mean(np.concatenate(found) ** 2, axis=0)))


def judged(rig: str, training: Sequence[Log], held_out: Sequence[Log]) -> pandas.DataFrame:
    """Give a row for each horizon and axis, the errors in mrad."""
    diagnosis = diagnose(training, held_out=held_out)
    fitted, judge = ([record_of(log) for log in logs] for logs in (training, held_out))
    at = [starts(own, [(e.start, e.end) for e in diagnosis.events if e.log == log.name])
          for own, log in zip(judge, held_out, strict=True)]  # fmt: skip
    everywhere = [starts(own, ()) for own in fitted]
    sparse = [sindy(fitted, threshold) for threshold in THRESHOLDS]
    rows = []
    for name, steps in HORIZONS.items():
        best = min(sparse, key=lambda one: float(np.log(errors(one, fitted, everywhere, steps)).sum()))
        baselines = [errors(one, judge, at, steps) for one in (arx(fitted), best)]
        for axis, *own in zip(AXES, *baselines, strict=True):
            report = diagnosis.axes[axis]
            plants = [getattr(stage, name).value for stage in (report.before, report.after)]
            rows.append((rig, f"{steps * STEP:g} s", axis, *(1e3 * value for value in (*own, *plants))))
    return pandas.DataFrame(rows, columns=["rig", "ahead", "axis", "ARX", "SINDYc", "model before", "corrected"])


def outside(rigs: Words, start: Annotated[float, typer.Option("--from")] = 6.0, csv: Path | None = None) -> None:
    """Judge all on the demonstration rigs and on measured ones; write the errors to the file ``csv``."""
    data = {rig: [list(logs) for logs in demo_logs(rig)] for rig in DEMO_RIGS}
    data |= {Path(rig).name.partition(":")[0]: [rig_logs(rig, start)[k::2] for k in (0, 1)] for rig in rigs}
    rows = pandas.concat([judged(rig, *logs) for rig, logs in data.items()])
    print_frame(rows, csv)
