"""Find the defects that a log shows without any plant.

* **Copies.** Two angles that are the same numbers are one encoder written twice.
* **Degrees.** An encoder's counts are visible as steps of the angle. If they are pi/180 of those that the configuration
  gives, radians were read as degrees; if they are 180/pi times as large, degrees were read as radians.
* **Filters.** An angle without steps, while another has steps, was filtered or resampled, which distorts and delays it.
  If none has steps, all have less noise than their encoders make.
* **Signs.** Both rotors lift. If the means of the voltages have opposite signs and are larger than their variation, one
  has the wrong sign.
* **Counts.** Steps of another size: the encoder has other counts per turn than the configuration says.
* **Rounded voltages.** Steps of the voltages beyond :data:`LEAST_STEP` of their standard deviation that are a power of
  ten are the digits of a text: the error is noise of the input, which looks like a lag and like a curve of the thrust.
  Other steps are those of a converter of few bits, or of a stick: the rotors get what the log says.
* **Jitter.** A reading at a wrong instant is wrong on all axes at once, each by its rate: the errors of two axes are
  correlated by the product of their rates. Errors of two encoders are not.
* **Flat tops.** Voltages that stay at their largest value, below the limit of the rig, were clipped on their way to the
  log, or the amplifier saturates there; a log cannot tell which.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from heli_identifier.errors import LogError
from heli_identifier.records import ANGLES, Array, Log, is_on_grid, quantisation_step

from .faults import parabola_samples, reading_noise

LEAST_STEP = 0.03
"""Largest step as a share of a voltage's standard deviation: an error of 1 %, that of a good multimeter."""

OTHER_COUNTS = 1.5
"""Ratio of the measured step to the configured one from which the encoder has other counts: the next common type has
twice as many."""

COARSE = 4.0
"""The same ratio, from which the reading of an encoder stays and jumps like that of an axis with friction or of an
encoder with backlash, and stays for so long that it may look late."""

FINEST = 1.0 / 6.0
"""The same ratio, below which the steps may be digits of a text, or come from interpolation."""

LEAST_NOISE = 0.3
"""Noise of an angle over that of its encoder's steps, below which something took it away: a mean of ten readings has as
little. The noise is that of third differences, to which the motion of a bench adds a hundredth."""

FLAT_SHARE = 0.02
"""Share of the samples at the largest value that no excitation has by chance."""

LEAST_JITTER = 5e-4
"""Least standard deviation of the instants [s] that matters: an axis moves at .5 rad/s, and .25 mrad is half of the
error of an encoder of 4096 counts. A vibration of 5 Hz, sampled every 10 ms, looks like a tenth of it."""

CERTAIN = 5.0
"""Number of standard errors from which a jitter is certain."""

OPPOSED = 0.5
"""Least mean [V] of both voltages for which opposite signs are no trim: below it a rotor hardly turns."""

FEWEST_LEVELS = 8
"""Least number of values of a voltage whose steps can be those of its digits: a square wave has fewer."""

ROTOR_TIMING, ARM_BENDING = ("lag or delay of the rotors",), ("arm bending of the elevation",)
THRUST = ("curve of the thrust", "thrust fade of the rotors", "thrust tilt of the elevation", "torque on the travel")
BY_VOLTAGES, BY_RATES = ROTOR_TIMING + THRUST + ARM_BENDING, ("speed stability of the pitch", "thrust lost by airspeed")
"""Families of effects that look like errors of the voltages or of an angle's timing (all of them: BY_VOLTAGES); and
(BY_RATES) like a controller's answer to the rates that was clipped."""


@dataclass(frozen=True)
class Defect:
    """A defect of logs; only a late angle can be corrected."""

    name: str
    channel: str
    words: str
    """A sentence on what was seen and what to do."""
    imitates: tuple[str, ...] = ()
    """Families of effects and faults that it looks like; they are not testable on these logs."""
    ratio: float = 1.0
    """Step of the encoder over that of the configuration [1]."""


def inspect_logs(logs: Sequence[Log], counts: Sequence[int], voltage_limit: float) -> tuple[Defect, ...]:
    """Find the defects of a rig's logs; ``counts`` per turn of the encoders, ``voltage_limit`` [V].

    A LogError says that no plant can be found: two angles are equal, an angle is wrapped or in a wrong unit, or a
    voltage has the wrong sign.
    """
    defects: list[Defect] = []
    for log in logs:
        _refuse_unusable(log)
    steps = [sorted(quantisation_step(log.angles[:, k]) for log in logs)[len(logs) // 2] for k in range(len(ANGLES))]
    on_grid = [all(is_on_grid(log.angles[:, k], 2.0 * np.pi / counts[k]) for log in logs) for k in range(len(ANGLES))]
    for axis, step, count, fits in zip(ANGLES, steps, counts, on_grid, strict=True):
        defects += _compare_counts(axis, step, count)
        if not step and not fits and any((*steps, *on_grid)):
            words = (
                f"the {axis} has no steps of an encoder, other angles have: a filter or a resampling delays and bends "
                f"it, or a drift was added; log what the encoder of the {axis} reads"
            )
            defects.append(Defect("filtered", axis, words, ARM_BENDING + ROTOR_TIMING))
    if not any((*steps, *on_grid)) and _lack_noise(logs, counts):
        defects.append(Defect(
            "filtered", "angles", "no angle has the steps of an encoder, and all have less noise than the steps of "
            "heli.toml make: they were filtered or resampled, which delays and bends them, or the encoders are finer, "
            "or this is a simulation. Log what the encoders read, or correct encoder_counts",
            (*ARM_BENDING, *ROTOR_TIMING, "timing of voltages"),
        ))  # fmt: skip
    estimates = [estimate_jitter(log.angles, log.step) for log in logs]
    sure = [jitter for jitter, error in estimates if jitter > max(LEAST_JITTER, CERTAIN * error)]
    if len(sure) > len(logs) // 2:
        defects.append(Defect(
            "jitter", "clock", f"the angles were read {1e3 * np.median(sure):.2g} ms early or late, by chance: all err "
            "at once, each by its rate. Log in the task that reads the encoders, or log the time of each reading",
        ))  # fmt: skip
    varied = [v for log in logs for v in log.voltages.T if len(np.unique(v)) >= FEWEST_LEVELS]
    roundings = [s for v in varied if (s := quantisation_step(v)) > LEAST_STEP * float(v.std()) and _is_decimal(s)]
    if len(roundings) > len(logs):
        defects.append(Defect(
            "rounded", "voltages", f"the voltages come in steps of {np.median(roundings):.2g} V: log them with three "
            "decimals. Timing and curve of the thrust cannot be told on these logs", BY_VOLTAGES,
        ))  # fmt: skip
    if tops := [top for log in logs if (top := _clipping_level(log, voltage_limit))]:
        defects.append(Defect(
            "clipped", "voltages", f"the voltages of {len(tops)} of {len(logs)} logs stay at {np.median(tops):.2f} V, "
            f"below the limit of {voltage_limit:g} V: they were clipped on their way to the log, or that is the limit "
            "of the rig (voltage_limit of heli.toml). Curves of the thrust and torques by the rates cannot be told",
            BY_VOLTAGES + BY_RATES,
        ))  # fmt: skip
    return tuple(defects)


def _lack_noise(logs: Sequence[Log], counts: Sequence[int]) -> bool:
    """Whether all angles of the logs have far less noise than the rounding to steps of their encoders makes."""
    noise = np.median([reading_noise(log.angles) for log in logs], axis=0)
    return bool((noise < LEAST_NOISE * 2.0 * np.pi / np.array(counts) / np.sqrt(12.0)).all())


def estimate_jitter(angles: Array, step: float) -> tuple[float, float]:
    """Estimate the error of the sampling instants: its standard deviation and the standard error of that [s].

    If angles (N, 3) with rates w_i are read at t_k + d_k, their third differences e_i contain those of d w_i and noise
    that is independent between axes, or is the same at any rate, as a vibration of the bench. The regression of e_i e_j
    on w_i w_j and a constant, i < j, therefore has the slope 20 tau^2, tau the standard deviation of d. The result is 0
    if no two axes move.
    """
    length = parabola_samples(step)
    if len(angles) < 4 * length:
        return 0.0, 0.0
    rate = savgol_filter(angles, length, 2, 1, step, axis=0)[1:-2]
    error = np.diff(angles, 3, axis=0)
    weight = 1.0 / np.maximum(error.std(0), 1e-12)
    seconds = np.arange(len(rate)) // max(round(1.0 / step), 1)
    xy, xx = np.zeros((2, seconds[-1] + 1))
    for i, j in ((0, 1), (0, 2), (1, 2)):
        e, w = (weight[i] * weight[j] * a[:, i] * a[:, j] for a in (error, rate))
        e, w = e - e.mean(), w - w.mean()
        xy, xx = xy + np.bincount(seconds, e * w), xx + np.bincount(seconds, w * w)
    if not xx.sum() > 0.0:
        return 0.0, 0.0
    slope = xy.sum() / xx.sum()
    slope_error = float(np.linalg.norm(xy - xx * slope) / xx.sum())
    tau = np.sqrt(max(slope, 0.0) / 20.0)
    return float(tau), float(slope_error / 40.0 / tau) if tau > 0.0 else 0.0


def _refuse_unusable(log: Log) -> None:
    """Raise a LogError for equal angles, wrapped angles, and voltages of opposite signs."""
    for i, j in ((0, 1), (0, 2), (1, 2)):
        if np.ptp(log.angles[:, i]) > 0.0 and np.array_equal(log.angles[:, i], log.angles[:, j]):
            raise LogError(
                f"log {log.name}: {ANGLES[i]} and {ANGLES[j]} are the same numbers, one column was written twice. "
                f"Correct [log.columns] of heli.toml, or record the {ANGLES[j]} again."
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
            "the time: one of the two has the wrong sign. Correct it under [log.signs] of heli.toml."
        )


def _compare_counts(axis: str, step: float, counts: int) -> list[Defect]:
    """Compare the step of an angle with that of the configured encoder."""
    ratio = step * counts / (2.0 * np.pi)
    for factor, read, true in ((np.pi / 180.0, "degrees", "radians"), (180.0 / np.pi, "radians", "degrees")):
        if abs(ratio / factor - 1.0) < 0.02:
            raise LogError(
                f"the {axis} moves in steps of {step:.2g} rad, {ratio:.3g} times those of an encoder of {counts} "
                f"counts a turn: its column is in {true} and was read as {read}. Correct its unit in the header or in "
                "heli.toml."
            )
    if ratio < FINEST or 1.0 / OTHER_COUNTS < ratio < OTHER_COUNTS:
        return []
    imitates = (f"friction of the {axis}", f"backlash of {axis}", f"timing of {axis}") if ratio > COARSE else ()
    if _is_decimal(step) or _is_decimal(np.degrees(step)):
        words = f"the {axis} comes in steps of {step:.3g} rad, the last digit of a text: log it with more digits"
        return [Defect("rounded", axis, words, imitates, ratio)]
    words = (
        f"the {axis} moves in steps of {1e3 * step:.3g} mrad, {2.0 * np.pi / step:.0f} a turn, and heli.toml says "
        f"{counts}: correct encoder_counts, or take an encoder that is finer; or correct the factor of the {axis}, if "
        f"it is {ratio:.3g} times too large"
    )
    return [Defect("counts", axis, words, imitates, ratio)]


def _is_decimal(step: float) -> bool:
    """Whether a step is the last digit of a text; a fit to a log of 20 s knows it to a thousandth."""
    decade = float(np.log10(step))
    return abs(decade - round(decade)) < 1e-3


def _clipping_level(log: Log, limit: float) -> float:
    """Find the voltage [V], below the rig's limit, at which a log's voltages were clipped; 0 if there is none."""
    top = float(np.abs(log.voltages).max())
    at_top = np.abs(log.voltages) > top * (1.0 - 1e-6)
    change = np.abs(np.diff(log.voltages, axis=0))
    stays = at_top[1:] & at_top[:-1] & (change < 1e-9)
    varies = (change > 1e-9).mean() > 0.5  # unlike a square wave, which stays at its top as well
    return top if varies and stays.mean() > FLAT_SHARE and top < 0.98 * limit else 0.0
