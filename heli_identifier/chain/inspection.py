"""Defects that a log shows of itself, without any plant.

* **Copies.** Two angles that are the same numbers are one encoder written twice.
* **Degrees.** An encoder's counts are visible as steps of the angle. Steps that are pi/180 of those that the rig's
  configuration gives are radians that were read as degrees, steps 180/pi times as large the other way round.
* **Filters.** An angle without steps beside one with steps passed a filter or a resampling, which bends and delays it.
* **Signs.** Both rotors lift: of voltages whose means lie on either side of zero, further than they vary, one has the
  wrong sign.
* **Counts.** Steps of another size: the encoder has other counts a turn than the configuration says.
* **Rounded voltages.** Steps of the voltages beyond :data:`LEAST_STEP` of their standard deviation are no converter's:
  their error is noise of the input, which looks like a lag and like a curve of the thrust.
* **Jitter.** Readings at a wrong instant are wrong on all axes at once, each by its rate: the errors of two axes go
  together then, as the product of their rates does. Errors of two encoders do not.
* **Flat tops.** Voltages that stay at their largest value, below the limit of the rig, have been clipped on their way
  to the log, or the amplifier saturates there; a log cannot tell which.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from heli_identifier.errors import LogError
from heli_identifier.records import ANGLES, Array, Log, is_on_grid, quantisation_step

from .faults import parabola_samples

LEAST_STEP = 0.03
"""Share of a voltage's standard deviation: an error of 1 % of it, as large as that of a good multimeter."""

OTHER_COUNTS = 1.5
"""Ratio of steps from which an encoder is another one: the next common make has twice the counts."""

COARSE = 4.0
"""Ratio of steps beyond which the reading of an encoder stays and jumps, as that of an axis with friction or of an
encoder with backlash does, and is held for long enough to pass for late."""

FINEST = 1.0 / 6.0
"""Ratio of steps below which they may be digits of a text, or of an interpolation by shares of a sample."""

FLAT_SHARE = 0.02
"""Share of the samples at the largest value that no excitation has by chance."""

LEAST_JITTER = 5e-4
"""Standard deviation of the instants [s] from which they matter: an axis moves .5 rad/s, and .25 mrad is half of what
an encoder of 4096 counts errs by. A vibration of 5 Hz, bent within three samples of 10 ms, looks like a tenth of it."""

CERTAIN = 5.0
"""Standard errors beyond which a jitter is no chance."""

OPPOSED = 0.5
"""Least mean [V] of either voltage from which opposite signs are no trim: below it a rotor hardly turns."""

FEWEST_LEVELS = 8
"""Values of a voltage whose steps are those of its digits: a square wave has fewer."""

TIMING, BENDING = ("lag or delay of the rotors",), ("arm bending of the elevation",)
THRUST = ("curve of the thrust", "thrust fade of the rotors", "thrust tilt of the elevation", "torque on the travel")
ANSWERED = ("speed stability of the pitch", "thrust lost by airspeed")
"""Families of effects that errors of the voltages, or of an angle's timing, look like; and that what was cut off a
controller's answer to the rates looks like."""


@dataclass(frozen=True)
class Defect:
    """A defect that logs show of themselves; a late angle is read earlier, the others cannot be undone."""

    name: str
    channel: str
    words: str
    """What was seen and what to do, in a sentence."""
    imitates: tuple[str, ...] = ()
    """Families of effects and faults that it looks like: they are not testable on these logs."""
    ratio: float = 1.0
    """Step of the encoder over that of the configuration [1]."""


def inspect_logs(logs: Sequence[Log], counts: Sequence[int], voltage_limit: float) -> tuple[Defect, ...]:
    """Find the defects of a rig's logs, whose encoders have so many ``counts`` a turn; ``voltage_limit`` is in [V].

    Raises
    ------
    LogError
        Two angles are the same signal, or an angle is in other units than its header says: no plant can be found.
    """
    found: list[Defect] = []
    for log in logs:
        _refuse_log(log)
    steps = [sorted(quantisation_step(log.angles[:, k]) for log in logs)[len(logs) // 2] for k in range(len(ANGLES))]
    expected = [all(is_on_grid(log.angles[:, k], 2.0 * np.pi / counts[k]) for log in logs) for k in range(len(ANGLES))]
    for axis, step, count, usual in zip(ANGLES, steps, counts, expected, strict=True):
        found += _compare_counts(axis, step, count)
        if not step and not usual and any((*steps, *expected)):
            words = (
                f"the {axis} has no steps of an encoder, other angles have: a filter or a resampling delays and bends "
                f"it, or a drift was added; log what the encoder of the {axis} reads"
            )
            found.append(Defect("filtered", axis, words, BENDING + TIMING))
    jitters = [estimate_jitter(log.angles, log.step) for log in logs]
    sure = [std for std, error in jitters if std > max(LEAST_JITTER, CERTAIN * error)]
    if len(sure) > len(logs) // 2:
        found.append(Defect(
            "jitter", "clock", f"the angles were read {1e3 * np.median(sure):.2g} ms early or late, by chance: all err "
            "at once, each by its rate. Log in the task that reads the encoders, or log the time of each reading",
        ))  # fmt: skip
    many = [v for log in logs for v in log.voltages.T if len(np.unique(v)) >= FEWEST_LEVELS]
    grids = [step for v in many if (step := quantisation_step(v)) > LEAST_STEP * float(v.std())]
    if len(grids) > len(logs):
        found.append(Defect(
            "rounded", "voltages", f"the voltages come in steps of {np.median(grids):.2g} V: log them with three "
            "decimals. Timing and curve of the thrust cannot be told on these logs", TIMING + THRUST + BENDING,
        ))  # fmt: skip
    if tops := [top for log in logs if (top := _clipping_level(log, voltage_limit))]:
        found.append(Defect(
            "clipped", "voltages", f"the voltages of {len(tops)} of {len(logs)} logs stay at {np.median(tops):.2f} V, "
            f"below the limit of {voltage_limit:g} V: they were clipped on their way to the log, or that is the limit "
            "of the rig (voltage_limit of heli.toml). Curves of the thrust and torques by the rates cannot be told",
            TIMING + THRUST + BENDING + ANSWERED,
        ))  # fmt: skip
    return tuple(found)


def estimate_jitter(angles: Array, step: float) -> tuple[float, float]:
    """Estimate by how much instants err.

    Read at t_k + d_k, the third differences e_i of the angles (N, 3) with rates w_i hold those of d w_i beside noise of
    their own: the regression of e_i e_j on w_i w_j, i < j, has the slope 20 tau^2. Returns tau, the standard deviation
    of d, and its standard error [s]; 0 where no two axes move.
    """
    length = parabola_samples(step)
    if len(angles) < 4 * length:
        return 0.0, 0.0
    rate = savgol_filter(angles, length, 2, 1, step, axis=0)[1:-2]
    error = np.diff(angles, 3, axis=0)
    weight = 1.0 / np.maximum(error.std(0), 1e-12)
    pairs = [(i, j, weight[i] * weight[j]) for i, j in ((0, 1), (0, 2), (1, 2))]
    seconds = np.arange(len(rate)) // max(round(1.0 / step), 1)
    xy, xx = (
        np.bincount(seconds, sum((w * w * a[:, i] * a[:, j] * rate[:, i] * rate[:, j] for i, j, w in pairs)))
        for a in (error, rate)
    )
    if not xx.sum() > 0.0:
        return 0.0, 0.0
    squared, own = xy.sum() / xx.sum(), float(np.linalg.norm(xy - xx * (xy.sum() / xx.sum())) / xx.sum())
    tau = np.sqrt(max(squared, 0.0) / 20.0)
    return float(tau), float(own / 40.0 / tau) if tau > 0.0 else 0.0


def _refuse_log(log: Log) -> None:
    """Refuse copies, angles that are folded, and voltages of opposite signs."""
    for i, j in ((0, 1), (0, 2), (1, 2)):
        if np.ptp(log.angles[:, i]) > 0.0 and np.array_equal(log.angles[:, i], log.angles[:, j]):
            raise LogError(
                f"log {log.name}: {ANGLES[i]} and {ANGLES[j]} are the same numbers, one column was written twice. "
                f"Mend [log.columns] of heli.toml, or record the {ANGLES[j]} again."
            )
    for axis, angle in zip(ANGLES, log.angles.T, strict=True):
        jumps = np.flatnonzero(np.abs(np.abs(np.diff(angle)) - 2.0 * np.pi) < 0.5)
        if len(jumps):
            raise LogError(
                f"log {log.name}: the {axis} jumps by a whole turn at {log.start + (jumps[0] + 1) * log.step:.2f} s; "
                "unwrap it (numpy.unwrap) before it is given."
            )
    mean, spread = log.voltages.mean(0), log.voltages.std(0)
    if mean[0] * mean[1] < 0.0 and (np.abs(mean) > np.maximum(spread, OPPOSED)).all():
        raise LogError(
            f"log {log.name}: v_front averages {mean[0]:.2f} V and v_rear {mean[1]:.2f} V, so one rotor pulls down all "
            "the time: one of the two has the wrong sign. Mend it under [log.signs] of heli.toml."
        )


def _compare_counts(axis: str, step: float, counts: int) -> list[Defect]:
    """Compare an encoder's step with that of the configuration."""
    ratio = step * counts / (2.0 * np.pi)
    for factor, read, true in ((np.pi / 180.0, "degrees", "radians"), (180.0 / np.pi, "radians", "degrees")):
        if abs(ratio / factor - 1.0) < 0.02:
            raise LogError(
                f"the {axis} moves in steps of {step:.2g} rad, {ratio:.3g} times those of an encoder of {counts} "
                f"counts a turn: its column is in {true} and was read as {read}. Mend its unit in the header or in "
                "heli.toml."
            )
    if ratio < FINEST or 1.0 / OTHER_COUNTS < ratio < OTHER_COUNTS:
        return []
    words = (
        f"the {axis} moves in steps of {1e3 * step:.3g} mrad, {2.0 * np.pi / step:.0f} a turn, and heli.toml says "
        f"{counts}: mend encoder_counts, or take an encoder that is finer; or mend the factor of the {axis}, if it is "
        f"{ratio:.3g} times too large"
    )
    imitates = (f"friction of the {axis}", f"backlash of {axis}", f"timing of {axis}") if ratio > COARSE else ()
    return [Defect("counts", axis, words, imitates, ratio)]


def _clipping_level(log: Log, limit: float) -> float:
    """Largest voltage [V] at which a log's voltages stay, below the rig's limit; 0 if there is none."""
    top = float(np.abs(log.voltages).max())
    at = np.abs(log.voltages) > top * (1.0 - 1e-6)
    held = at[1:] & at[:-1] & (np.abs(np.diff(log.voltages, axis=0)) < 1e-9)
    moves = (np.abs(np.diff(log.voltages, axis=0)) > 1e-9).mean() > 0.5  # a square wave stays at its top as well
    return top if moves and held.mean() > FLAT_SHARE and top < 0.98 * limit else 0.0
