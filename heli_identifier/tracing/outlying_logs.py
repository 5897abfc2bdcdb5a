"""Logs that do not fit the others: zeroed elsewhere, wired differently, or of another rig.

A log whose elevation reads z less than that of the others has the voltages of another height:

    eps'' = -a_e (eps + z) - a_1 + ...,    z_l = -(b_l - median over l of b_l) / a_e.

Up to three standard deviations of b_l a zero is an offset of its log, which every fit estimates. Beyond that the plant
with its effects decides, fitted to the logs that agree. A log that gets likelier by more than
:data:`.settings.UNKNOWN` nats when it is read otherwise was read wrongly. docs/explanation/tracing.md says more of
both under "Logs that differ".

Source: Iglewicz and Hoaglin 1993 (outliers by the median absolute deviation).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from heli_identifier.chain import Defect
from heli_identifier.errors import LogError
from heli_identifier.records import Log

from .fit import Fit, fit, known_fit
from .helicopter import Rig
from .likelihood import Likelihood, undo_in_record
from .noise import error_dynamics
from .rig import Array, Record, record_of
from .settings import KEPT, OUTLIER, PER_LOG, UNKNOWN

ELEVATION = 1


def align_zeros(fitted: Fit, logs: Sequence[Log]) -> tuple[Fit, tuple[Log, ...], tuple[str, ...]]:
    """Read the elevation of logs that were zeroed elsewhere as the others have it.

    The first of the ``logs`` are those of the fit, which is repeated if one of them is shifted. Returns the fit, the
    logs, and a sentence for each log that lies apart.
    """
    likelihood, count = fitted.likelihood, len(fitted.point.per_log)
    records = [undo_in_record(likelihood.faults, record_of(log, likelihood.rig)) for log in logs]
    zeros, judge = _find_zeros(fitted, records)
    moved, notes = list(logs), list[str]()
    for i in np.flatnonzero(zeros).tolist():
        z = zeros[i] * (np.arange(3) == ELEVATION)
        amount = f"{abs(zeros[i]):.2f} rad {'less' if zeros[i] > 0.0 else 'more'}"
        read = f"{logs[i].name}: its elevation reads {amount} than that of the other logs at like voltages, as if"
        shifted = _reread(records[i], likelihood.rig, angles=records[i].angles + z)
        if misfit(judge, records[i])[0] < misfit(judge, shifted)[0] - KEPT:
            notes.append(f"{read} the arm had been balanced otherwise; its gains may differ as well")
            zeros[i] = 0.0
        else:
            moved[i] = replace(logs[i], angles=logs[i].angles + z)
            notes.append(f"{read} its encoder had been zeroed in another position; it was shifted by that much")
    if zeros[:count].any():
        again = Likelihood.of(moved[:count], likelihood.rig).undo_faults(likelihood.faults)
        fitted = fit(replace(again, widths=likelihood.widths), fitted.names, fitted)
    return fitted, tuple(moved), tuple(notes)


def _find_zeros(fitted: Fit, records: Sequence[Record]) -> tuple[Array, Fit]:
    """Angles (L,) [rad] by which each elevation reads less than the others, or zero; and the fit that says so."""
    count = len(fitted.point.per_log)
    zeros, least = _zeros_under(fitted, records)
    if not (apart := lie_apart(zeros, least)).any():
        return np.zeros(len(records)), fitted
    others = np.flatnonzero(~apart[:count])
    if len(others) < count:
        fitted = _fit_some(fitted, others)
        zeros, least = _zeros_under(fitted, records)
    return np.where(apart & lie_apart(zeros, least), zeros, 0.0), fitted


def _zeros_under(fitted: Fit, records: Sequence[Record]) -> tuple[Array, float]:
    """Zeros (L,) [rad] of the logs' elevations, 0 where too few are known, and the least that is no offset."""
    stiffness = fitted.likelihood.rig.linear(fitted.parameters)[ELEVATION][1]
    b = np.array([log_offsets(fitted, record)[0][ELEVATION] for record in records])
    if stiffness <= 0.0 or np.isfinite(b).sum() < 3:
        return np.zeros(len(b)), np.inf
    return np.nan_to_num(np.nanmedian(b) - b) / stiffness, OUTLIER * PER_LOG[0] / stiffness


def _fit_some(fitted: Fit, logs: NDArray[np.intp]) -> Fit:
    """Repeat a fit with some of its logs."""
    likelihood, point = fitted.likelihood, fitted.point
    records, logged, harmonics = (tuple(every[i] for i in logs) if every else ()
                                  for every in (likelihood.records, likelihood.logged, point.harmonics))  # fmt: skip
    start = replace(fitted, point=replace(point, per_log=point.per_log[logs], harmonics=harmonics))
    return fit(replace(likelihood, records=records, logged=logged), fitted.names, start)


def refuse_mirrored(null: Fit) -> None:
    """Refuse training logs of which some are mirror images: a fit to all of them may lie between the two parts.

    The plant of the log with most samples says how others would be mended. One plant for all says whether that helps.
    """
    likelihood, rig, names = null.likelihood, null.likelihood.rig, null.names
    one = replace(likelihood, records=(max(likelihood.records, key=lambda record: record.weights.sum()),))
    start = one.neutral_point(rig.estimate(one.records), null.point.z)
    alone = fit(one, names, known_fit(one, names, start, null.sigma))
    better = {record.name: mirrored(alone, record, misfit(alone, record)[0]) for record in likelihood.records}
    mended = {name: mirror for name, mirror in better.items() if mirror}
    if not 0 < len(mended) < len(likelihood.records):
        return
    records = tuple(mended[r.name][1] if r.name in mended else r for r in likelihood.records)
    from_one = replace(alone, point=replace(alone.point, per_log=0.0 * null.point.per_log))
    if fit(replace(likelihood, records=records), names, from_one).value > null.value - UNKNOWN:
        return
    fewer = min(list(mended), [r.name for r in records if r.name not in mended], key=len)
    single = len(fewer) == 1
    raise LogError(
        f"the training log{'s' * (not single)} {', '.join(fewer)} fit{'s' * single} the rest with "
        f"{' or '.join(sorted({what for what, _ in mended.values()}))}. Correct that in heli.toml, or take fewer logs."
    )


def refuse_unlimited(null: Fit, limit: float) -> None:
    """Refuse voltages that were logged ahead of the amplifiers' ``limit`` [V]: the logs are likelier within it."""
    likelihood, rig = null.likelihood, null.likelihood.rig
    if (largest := rig.parameters.v_max) <= limit:  # that of the logs
        return
    held = (np.clip(record.inputs, -limit, limit) for record in likelihood.records)
    records = tuple(_reread(r, rig, inputs=inputs) for r, inputs in zip(likelihood.records, held, strict=True))
    if fit(replace(likelihood, records=records), null.names, null).value < null.value - UNKNOWN:
        raise LogError(
            f"the voltages reach {largest:.3g} V, and the logs are far likelier if the amplifiers limit them to "
            f"{limit:g} V: they are commands ahead of that limit. Set clip = true under [log] of heli.toml, or limit "
            "them (numpy.clip) before they are given; if the limit is another one, correct voltage_limit."
        )


def refuse_scaled(fitted: Fit, defects: Sequence[Defect]) -> None:
    """Refuse logs with an angle as many times too large as its steps are: gravity and thrust turn with the true angle.

    ``fitted`` has the effects that were found, because a torque that the model lacks may look like a scale. Logs are
    likelier by the change of unit alone.
    """
    likelihood, axes = fitted.likelihood, fitted.likelihood.rig.axes
    for defect in defects:
        if defect.name != "counts":
            continue
        scale = np.where(np.array(axes) == defect.channel, 1.0 / defect.ratio, 1.0)
        records = tuple(_reread(record, likelihood.rig, angles=record.angles * scale) for record in likelihood.records)
        counted = sum(float(record.weights[:, axes.index(defect.channel)].sum()) for record in records)
        other = fit(replace(likelihood, records=records), fitted.fields, fitted)
        if other.value + counted * np.log(defect.ratio) < fitted.value - UNKNOWN:
            raise LogError(
                f"the {defect.channel} is {defect.ratio:.3g} times too large: its steps say so, and so do the other "
                "axes. Correct its unit or its factor."
            )


def lie_apart(values: Array, least: float) -> NDArray[np.bool_]:
    """Which of the logs' values (L, ...) lie apart from those of the others, by more than ``least``."""
    apart = np.abs(values - np.median(values, axis=0))
    return np.asarray(apart > np.maximum(least, OUTLIER * np.median(apart, axis=0) / 0.6745), dtype=bool)


def log_offsets(fitted: Fit, record: Record) -> tuple[Array, Array]:
    """Take constant torques out of the innovations of one log under a plant, without a prior.

    Returns the torques (a,) [rad/s^2], nan for an axis on which nothing counts, and the rest of the innovations (N, a)
    [rad].
    """
    likelihood = replace(fitted.likelihood, records=(record,))
    (rest,), _ = likelihood.run_all(likelihood.neutral_point(fitted.parameters, fitted.point.z))
    b, axes = np.full(rest.shape[1], np.nan), likelihood.filters(record, fitted.point)
    for axis in np.flatnonzero(record.weights.any(0)).tolist():
        w = huber = record.weights[:, axis]
        e, c = rest[:, axis].copy(), lfilter(*error_dynamics(axes[axis]), np.ones(record.samples))
        for _ in range(4):  # from least squares on
            b[axis] = -((c * huber) @ e) / ((c * huber) @ c)
            rest[:, axis] = e + c * b[axis]
            size = np.abs(rest[:, axis])
            huber = w * np.minimum(1.0, OUTLIER * np.median(size[w > 0]) / 0.6745 / np.maximum(size, 1e-12))
    return b, rest


def misfit(fitted: Fit, record: Record) -> tuple[float, Array]:
    """Data's part of F [nats] of one log with free offsets and scales, and these scales (a,) [rad].

    The filter may diverge on a mirror image: F is infinite then.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        F, sigma = fitted.likelihood.data_terms([log_offsets(fitted, record)[1]], [record])
    total = float(F.sum())
    return total if np.isfinite(total) else np.inf, np.where(record.weights.any(0), sigma, np.nan)


def mirrored(fitted: Fit, record: Record, as_read: float) -> tuple[str, Record] | None:
    """Name and correct the mistake without which a log fits far better than ``as_read`` [nats]; None without one."""
    mended = [(misfit(fitted, other)[0], what, other) for what, other in _mirrors(fitted.likelihood.rig, record)]
    least, what, other = min(mended, key=lambda candidate: candidate[0])
    return (what, other) if as_read - least > UNKNOWN else None


def _mirrors(rig: Rig, record: Record) -> list[tuple[str, Record]]:
    """Return a record as it would be with the usual mistakes undone."""
    exchanged = _reread(record, rig, inputs=np.ascontiguousarray(record.inputs[:, ::-1]))
    signs = 1.0 - 2.0 * np.eye(len(rig.axes))
    return [("front and rear exchanged", exchanged)] + [
        (f"the sign of the {axis} changed", _reread(record, rig, angles=record.angles * of_axes))
        for axis, of_axes in zip(rig.axes, signs, strict=True)
    ]


def _reread(record: Record, rig: Rig, **changed: Any) -> Record:
    """Return a record with other angles or inputs, and with the initial state that they imply."""
    other = replace(record, **changed)
    return replace(other, start=rig.initial_state(other.angles, other.inputs, other.step))
