"""Logs that do not fit the others: zeroed elsewhere, wired otherwise, of another rig; and signs that none can have.

A constant torque b on an axis of log l changes its innovations by c b, c the answer of the filter's error dynamics to
one, so that b_l follows from one run of the filter by a robust regression of e on c, whatever the prior of the offsets.

**Zeros.** The encoder counts from where the arm was when the rig was switched on: on the table, or held by hand. A log
that reads z less than the others needs the voltages of another height:

    eps'' = -a_e (eps + z) - a_1 + ...,    z_l = -(b_l - median over l of b_l) / a_e.

Up to three standard deviations of b_l a zero is an offset of its log, which the fits allow for. The plant that is found
decides, fitted to the logs that do not lie apart: the simplified model takes a curve of the thrust for zeros of logs
that hover elsewhere. An arm that was balanced otherwise needs other voltages as well; sines of the elevation tell the
two apart, and a log is not shifted where that makes it less likely.

**Mirrors.** A log is another one's mirror image where it gets likelier by more than :data:`.settings.UNKNOWN` nats with
the sign of an axis changed or the rotors swapped, its own offsets and scale of the noise allowed. No plant fits logs of
which some are mirror images: training logs are refused, the fewer of them by name, where one plant for all of them gets
likelier by as much.

**Gains.** A log of another rig has gains of its own, which the likelihood estimates beside those that the logs share;
they lie apart by more than three standard deviations of what a supply drifts from log to log.

**Signs.** A larger v_f - v_r raises the pitch, k_x > 0; a larger v_f + v_r raises the elevation, k_z > 0 (Table 2). The
sign of k_y is a convention, the sense of the travel; where k_x < 0 it tells the two causes apart:

| k_x | k_y | k_z | then |
|---|---|---|---|
| < 0 | > 0 | > 0 | the pitch counts the other way |
| < 0 | < 0 | > 0 | front and rear are exchanged |
| > 0 | | < 0 | the elevation counts the other way |
| < 0 | > 0 | < 0 | pitch and elevation count the other way, or both voltages do |
| < 0 | < 0 | < 0 | front and rear are exchanged, and the elevation counts the other way |

Source: Iglewicz and Hoaglin 1993 (outliers by the median absolute deviation).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from heli_identifier.errors import LogError
from heli_identifier.online import Estimate
from heli_identifier.records import Log

from .fit import Fit, around, fit
from .helicopter import Rig
from .likelihood import Likelihood, without
from .noise import error_dynamics
from .rig import Array, Record, record_of
from .settings import ALIEN, FEWEST, HUBER, KEPT, OUTLYING, OWN, SURE, UNKNOWN

ELEVATION = 1


def align_zeros(fitted: Fit, logs: Sequence[Log]) -> tuple[Fit, tuple[Log, ...], tuple[str, ...]]:
    """Read the elevation of logs that were zeroed elsewhere as the others have it.

    The first of the ``logs`` are those of the fit, which goes on with them if one of these is shifted. Given are the
    fit, the logs, and a sentence for each log that lies apart.
    """
    likelihood, count = fitted.likelihood, len(fitted.point.own)
    records = [without(likelihood.faults, record_of(log, likelihood.rig)) for log in logs]
    zeros, judge = _find_zeros(fitted, records)
    moved, notes = list(logs), list[str]()
    for i in np.flatnonzero(zeros).tolist():
        z = zeros[i] * (np.arange(3) == ELEVATION)
        amount = f"{abs(zeros[i]):.2f} rad {'less' if zeros[i] > 0.0 else 'more'}"
        read = f"{logs[i].name}: its elevation reads {amount} than that of the other logs at like voltages, as if"
        shifted = _restart(replace(records[i], angles=records[i].angles + z), likelihood.rig)
        if _misfit(judge, records[i])[0] < _misfit(judge, shifted)[0] - KEPT:
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
    """Angles (L,) [rad] by which the elevation of each log reads less than that of the others, or zero; their fit."""
    count = len(fitted.point.own)
    zeros, least = _zeros_under(fitted, records)
    if not (apart := _lie_apart(zeros, least)).any():
        return np.zeros(len(records)), fitted
    others = np.flatnonzero(~apart[:count])
    if len(others) < count:
        fitted = _fit_some(fitted, others)
        zeros, least = _zeros_under(fitted, records)
    return np.where(apart & _lie_apart(zeros, least), zeros, 0.0), fitted


def _zeros_under(fitted: Fit, records: Sequence[Record]) -> tuple[Array, float]:
    """Zeros (L,) [rad] of the elevations of logs, none where too few are known, and the least that is no offset."""
    stiffness = fitted.likelihood.rig.linear(fitted.parameters)[ELEVATION][1]
    b = np.array([own_offsets(fitted, record)[0][ELEVATION] for record in records])
    if stiffness <= 0.0 or np.isfinite(b).sum() < FEWEST:
        return np.zeros(len(b)), np.inf
    return np.nan_to_num(np.nanmedian(b) - b) / stiffness, SURE * OWN[0] / stiffness


def _fit_some(fitted: Fit, logs: NDArray[np.intp]) -> Fit:
    """Fit the same to some of its logs."""
    likelihood, point = fitted.likelihood, fitted.point
    records, logged, harmonics = (tuple(own[i] for i in logs) if own else ()
                                  for own in (likelihood.records, likelihood.logged, point.harmonics))  # fmt: skip
    start = replace(fitted, point=replace(point, own=point.own[logs], harmonics=harmonics))
    return fit(replace(likelihood, records=records, logged=logged), fitted.names, start)


def refuse_mirrored(null: Fit) -> None:
    """Refuse training logs of which some are mirror images: a fit to all of them may lie between the two parts.

    The plant of the log that counts most says how others would be mended, and one plant for all whether they are.

    Raises
    ------
    LogError
        Some of the training logs are mirror images of the others.
    """
    likelihood, rig, names = null.likelihood, null.likelihood.rig, null.names
    one = replace(likelihood, records=(max(likelihood.records, key=lambda own: own.weights.sum()),))
    begun = one.resting(rig.estimate(one.records), null.point.z)
    alone = fit(one, names, around(one, names, begun, null.sigma))
    found = {own.name: _mirrored(alone, own, _misfit(alone, own)[0]) for own in likelihood.records}
    mended = {name: better for name, better in found.items() if better}
    if not 0 < len(mended) < len(likelihood.records):
        return
    records = tuple(mended[own.name][1] if own.name in mended else own for own in likelihood.records)
    start = replace(alone, point=replace(alone.point, own=0.0 * null.point.own))
    if fit(replace(likelihood, records=records), names, start).value > null.value - UNKNOWN:
        return
    fewer = min(list(mended), [own.name for own in records if own.name not in mended], key=len)
    single = len(fewer) == 1
    raise LogError(
        f"the training log{'s' * (not single)} {', '.join(fewer)} fit{'s' * single} the rest with "
        f"{' or '.join(sorted({what for what, _ in mended.values()}))}. Mend that in heli.toml, or take fewer logs."
    )


def _lie_apart(values: Array, least: float) -> NDArray[np.bool_]:
    """Which of the logs' values (L, ...) lie apart from those of the others, by more than ``least``."""
    apart = np.abs(values - np.median(values, axis=0))
    return np.asarray(apart > np.maximum(least, OUTLYING * np.median(apart, axis=0) / 0.6745), dtype=bool)


def own_offsets(fitted: Fit, record: Record) -> tuple[Array, Array]:
    """Constant torques (a,) [rad/s^2] of one log under a plant, whatever their prior, and its innovations (N, a) [rad].

    An axis on which nothing counts has nan.
    """
    likelihood = replace(fitted.likelihood, records=(record,))
    return without_own(fitted, record, likelihood.run_all(likelihood.resting(fitted.parameters, fitted.point.z))[0][0])


def without_own(fitted: Fit, record: Record, e: Array) -> tuple[Array, Array]:
    """Take constant torques out of the innovations ``e`` (N, a) of one log, and the periodic ones of the fit.

    Their phases are other ones in every log. Given are the constant torques (a,) [rad/s^2], and what is left.
    """
    b, own, left = np.full(e.shape[1], np.nan), fitted.likelihood.filters(record, fitted.point), e.copy()
    for axis in range(len(b)):
        w = huber = record.weights[:, axis]
        if not w.any():
            continue
        phases = [u[1] * record.time for u in (fitted.point.harmonics or [[]])[0] if u[0] == axis]
        torques = [np.ones(record.samples), *(wave(phase) for phase in phases for wave in (np.cos, np.sin))]
        c = np.column_stack([lfilter(*error_dynamics(own[axis]), torque) for torque in torques])
        for _ in range(4):  # from least squares on
            x = np.linalg.solve((c.T * huber) @ c, -(c.T * huber) @ e[:, axis])
            left[:, axis] = e[:, axis] + c @ x
            size = np.abs(left[:, axis])
            huber = w * np.minimum(1.0, HUBER * np.median(size[w > 0]) / 0.6745 / np.maximum(size, 1e-12))
        b[axis] = x[0]
    return b, left


def stranger_notes(fitted: Fit, logs: Sequence[Log]) -> tuple[str, ...]:
    """Name the logs that do not belong to the rig of the others: mirror images first, then logs that fit far worse."""
    rig, notes = fitted.likelihood.rig, []
    records = [record_of(log, rig) for log in logs]
    as_read = [_misfit(fitted, record) for record in records]
    scales = np.array([np.nanmedian(sigma / fitted.sigma) for _, sigma in as_read])
    usual = float(np.median(scales))
    for log, record, (F, _), scale in zip(logs, records, as_read, scales, strict=True):
        if better := _mirrored(fitted, record, F):
            notes.append(f"the log {log.name} does not belong to the others: it fits with {better[0]}")
        elif scale > ALIEN * usual:
            notes.append(
                f"the log {log.name} does not belong to the others: "
                f"its innovations are {scale / usual:.1f} times theirs"
            )
    notes += _other_gains(fitted)
    return tuple(f"{note}. Mend it in heli.toml or leave it out, and run this again" for note in notes)


def _other_gains(fitted: Fit) -> list[str]:
    """Name the training logs whose gains, all of them or one, lie apart from those of the others."""
    axes, records, notes = fitted.likelihood.rig.axes, fitted.likelihood.records, list[str]()
    if len(records) < FEWEST:
        return notes
    gains = fitted.point.own[:, 3 * len(axes) : 4 * len(axes)]
    apart, outlying = gains - np.median(gains, axis=0), _lie_apart(gains, SURE * OWN[3])
    for record, own, others in zip(records, apart, outlying, strict=True):
        if others.any():
            said = [f"{100.0 * np.expm1(own[i]):+.0f} % on the {axes[i]}" for i in np.flatnonzero(others)]
            notes.append(
                f"the log {record.name} does not belong to the others: its gains differ from theirs by "
                f"{', '.join(said)}, as those of another rig or another supply"
            )
    return notes


def _misfit(fitted: Fit, record: Record) -> tuple[float, Array]:
    """Data's part of F [nats] of one log with its own offsets and scales, and these scales (a,) [rad].

    The plant may run away from a mirror image: its F is infinite then.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        F, sigma = fitted.likelihood.of_axes([own_offsets(fitted, record)[1]], [record])
    total = float(F.sum())
    return total if np.isfinite(total) else np.inf, np.where(record.weights.any(0), sigma, np.nan)


def _mirrored(fitted: Fit, record: Record, as_read: float) -> tuple[str, Record] | None:
    """Say with what a log fits far better than ``as_read`` [nats], and give it with that mended; None otherwise."""
    mended = [(_misfit(fitted, other)[0], what, other) for what, other in _mirrors(fitted.likelihood.rig, record)]
    least, what, other = min(mended, key=lambda own: own[0])
    return (what, other) if as_read - least > UNKNOWN else None


def _mirrors(rig: Rig, record: Record) -> list[tuple[str, Record]]:
    """Give a record as it would be with the usual mistakes undone."""
    found = [("front and rear exchanged", replace(record, inputs=np.ascontiguousarray(record.inputs[:, ::-1])))]
    for i, axis in enumerate(rig.axes):
        signs = np.where(np.arange(len(rig.axes)) == i, -1.0, 1.0)
        found.append((f"the sign of the {axis} changed", replace(record, angles=record.angles * signs)))
    return [(what, _restart(other, rig)) for what, other in found]


def _restart(record: Record, rig: Rig) -> Record:
    """Begin a record whose angles or inputs were changed as these say."""
    return replace(record, start=rig.begin(record.angles, record.inputs, record.step))


_PITCH: Mapping[int, tuple[str, str]] = {
    1: ("the pitch counts the other way", "pitch = -1 under [log.signs]"),
    -1: ("front and rear are exchanged", "swap_rotors = true under [log]"),
    0: ("the pitch counts the other way or front and rear are exchanged",
        "pitch = -1 under [log.signs] or swap_rotors = true under [log]"),
}  # fmt: skip
"""Causes of a negative k_x, and what mends them, by the sign of k_y."""


def sign_notes(estimates: Mapping[str, Estimate]) -> tuple[str, ...]:
    """Warn of gains, by the paper's symbols, that are significantly negative, and say what mends them."""
    pitch, elevation, travel = (_sign(estimates[name]) for name in ("k_x", "k_z", "k_y"))
    negative = [name for name, sign in (("k_x", pitch), ("k_z", elevation)) if sign < 0]
    if not negative:
        return ()
    found = [_PITCH[travel]] if pitch < 0 else []
    if elevation < 0:
        found.append(("the elevation counts the other way", "elevation = -1 under [log.signs]"))
    cause = " and ".join(cause for cause, _ in found)
    advice = f"set {' and '.join(remedy for _, remedy in found)} of heli.toml (`heli init` writes one)"
    if pitch < 0 and elevation < 0 and travel >= 0:
        cause += ", or both voltages do"
        advice += " (for the voltages v_front = -1 and v_rear = -1)"
    gains = " and ".join(f"{name} = {estimates[name].value:.3g} {estimates[name].unit}" for name in negative)
    are = "are" if len(negative) > 1 else "is"
    return (
        f"WRONG SIGN: {gains} {are} negative, so {cause}; do not trust this result but {advice}, "
        "or take the entry away if it stands there already, and run it again",
    )


def _sign(estimate: Estimate) -> int:
    """Give -1 or 1 where a sign is beyond chance, else 0."""
    if abs(estimate.value) <= SURE * (estimate.standard_error or 0.0):
        return 0
    return 1 if estimate.value > 0.0 else -1
