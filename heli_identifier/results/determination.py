"""What every parameter of a fitted plant is, and what its value rests on.

A likelihood is as good as its model of the air. References move the rig and do not depend on the air, so instruments
made of them need no such model: they judge the result of the likelihood, as docs/explanation/tracing.md says under
"What a value rests on".
"""

from collections.abc import Callable, Mapping, Sequence
from math import copysign, floor, inf, log10, sqrt
from operator import attrgetter

import numpy as np

from heli_identifier.online import CONTRADICTION, GAINS, Estimate
from heli_identifier.results.statements import Determination, ParameterReport
from heli_identifier.tracing.fit import Fit, covariance
from heli_identifier.tracing.helicopter import LAG_FIELD
from heli_identifier.tracing.identification import IdentifiedPlant
from heli_identifier.tracing.rig import Array, Parameters
from heli_identifier.tracing.settings import OUTLIER
from heli_plant.parameters import BY_FIELD

DETERMINED = 0.35
"""Half-width of a 95 % interval over the gain above which a gain is not determined: a controller's margin of 3 dB. Of
another parameter, over half of its plausible interval."""

CONFIRMED = 0.05
"""Outside share of a gain's regressor below which its interval rests on the air alone: without this rule 11 of 70 gains
that rest on the noise model are wrong in quiet flights in air that swirls, 2 of 70 in an Ornstein-Uhlenbeck torque."""

MATTERS = 0.1
"""Relative difference of two gains up to which instruments contradict nothing: in air that swirls, their gain of the
travel comes out 6 % low, and .8 dB matters to no controller."""

EXPERIMENTS: Mapping[str, str] = {
    "k_x": "Step the pitch by 10 degrees every 5 s for a minute; under a controller step and log its reference.",
    "k_z": "Step the elevation by 10 degrees every 8 s for a minute; under a controller step and log its reference.",
    "k_y": "Lean the pitch by 10 degrees for 5 s either way, six times, at a constant sum of the voltages.",
    "a_th": "Step the pitch by 10 degrees every 5 s for a minute; under a controller step and log its reference.",
    "a_e": "Hover at three heights 10 degrees apart for 20 s each.",
}
"""Experiments that determine a parameter."""

WIRED = {
    "k_x": "the pitch counts the other way or front and rear are exchanged: set pitch = -1 under [log.signs], or "
    "swap_rotors = true under [log],",
    "k_z": "the elevation counts the other way: set elevation = -1 under [log.signs]",
}
"""By gain that is positive on every rig (Table 2): why it comes out negative, and what mends it."""


def estimates(fitted: Fit, C: Array, fields: Sequence[str]) -> dict[str, Estimate]:
    """Return parameters of a plant as its file has them, with standard errors; a parameter that was given has none.

    The standard errors of gains, which the file has at 0 V, hold for a known curve of the thrust. The standard error of
    the curve is the one towards a straight line.
    """
    found = {}
    curve = next((i for i, c in enumerate(fitted.coordinates) if c.bend), None)
    for name in fields:
        error: float | None
        if curve is not None and fitted.names[curve] == name:
            c, x = fitted.coordinates[curve], fitted.x[curve]
            error = float(abs(c.value(x) - c.value(x - copysign(1.96 * sqrt(C[curve, curve]), x))) / 1.96)
        else:
            gradient = _gradient(fitted, attrgetter(name))
            if curve is not None:
                gradient[curve] = 0.0
            error = float(np.sqrt(gradient @ C @ gradient)) if gradient.any() else None
        found[name] = Estimate(float(getattr(fitted.parameters, name)), error, BY_FIELD[name].unit)
    return found


def _gradient(fitted: Fit, read: Callable[[Parameters], float]) -> Array:
    """Return the derivatives (P,), by the coordinates of the plant, of a number that ``read`` takes from it."""
    rig, slopes = fitted.likelihood.rig, np.empty(len(fitted.fields))
    for i in range(len(slopes)):
        c, x = fitted.coordinates[i], fitted.x[i]
        low, high = (read(rig.assign(fitted.parameters, c.assigned(x + d))) for d in (-1e-4, 1e-4))
        slopes[i] = (high - low) / 2e-4
    return slopes


def parameter_reports(identified: IdentifiedPlant) -> dict[str, ParameterReport]:
    """State for every base parameter of an identified plant, by its field, what its value rests on."""
    fitted, C, outside = identified.plant, identified.covariance, identified.instruments
    rig, reports = fitted.likelihood.rig, {}
    by_instruments = {
        name: (Estimate(float(value), float(half) / 1.96, BY_FIELD[name].unit), float(share))
        for axis in (outside.axes if outside else ())
        for name, value, half, share in zip(axis.parameters, axis.values, axis.half_widths, axis.shares, strict=True)
        if np.isfinite(value) and name in BY_FIELD
    }
    for i, (name, coordinate) in enumerate(zip(fitted.fields, fitted.coordinates, strict=False)):
        if name not in rig.base:
            continue
        is_gain, value = name in rig.gains, fitted.estimate(name)
        if is_gain:
            estimate = Estimate(value, float(fitted.slope(name) * np.sqrt(C[i, i])), BY_FIELD[name].unit)
        else:
            estimate = estimates(fitted, C, [name])[name]
        low, high = sorted(estimate.value - value + coordinate.value(x) for x in (-1.96, 1.96))
        instrument, share = by_instruments.get(name, (None, None))
        allowed = DETERMINED * (abs(estimate.value) if is_gain else 0.5 * (high - low))
        determination, why, contradicted = _judge_parameter(estimate, instrument, share, allowed, is_gain)
        if name == LAG_FIELD and voltages_shifted(fitted):
            determination = Determination.NOT_DETERMINED
            why = "it trades off against the timing of the voltages in the log"
        experiment = "" if determination is Determination.OUTSIDE else EXPERIMENTS.get(name, "")
        reports[name] = ParameterReport(
            estimate, determination, share, instrument, contradicted, (low, high), why, experiment
        )
    return reports


def _judge_parameter(
    estimate: Estimate, instrument: Estimate | None, share: float | None, allowed: float, is_gain: bool
) -> tuple[Determination, str, bool]:
    """Decide what one parameter rests on, why, and whether references contradict it.

    ``allowed`` is the half-width of an interval that determines it.
    """
    half, unit, confirmed, said = 1.96 * (estimate.standard_error or 0.0), unit_suffix(estimate.unit), False, ""
    if instrument is not None:
        value, error = instrument.value, instrument.standard_error or 0.0
        said = f"references alone give {_with_half_width(value, 1.96 * error)}{unit}"
        agrees = abs(value - estimate.value) <= max(CONTRADICTION * error, MATTERS * abs(value))
        apart = abs(value - estimate.value) > half + 1.96 * error
        if is_gain and not agrees and (apart or half <= allowed):
            why = f"{said}, the likelihood {_with_half_width(estimate.value, half)}{unit}"
            return Determination.NOT_DETERMINED, why, True
        confirmed = agrees and 1.96 * error < DETERMINED * abs(value)
    if half > allowed:
        interval = f"{_with_half_width(estimate.value, half)}{unit}"
        return Determination.NOT_DETERMINED, f"its interval is wide, {interval}", False
    if confirmed:
        return Determination.OUTSIDE, said, False
    if is_gain and (share or 0.0) < CONFIRMED and OUTLIER * half > allowed:
        why = "no reference moves it, and what the air moves alone misleads a fit"
        return Determination.NOT_DETERMINED, why, False
    why = "no reference confirms it; it holds if the air's torque is as modelled"
    return Determination.NOISE_MODEL, why, False


def unit_suffix(unit: str) -> str:
    """Return a unit as it is written after a number; the unit 1 is not written."""
    return "" if unit == "1" else f" {unit}"


def _with_half_width(value: float, half: float) -> str:
    """Return a value and the half-width of its interval, both to the second digit of the half-width."""
    digits = max(1 - floor(log10(half)), 0) if 0.0 < half < inf else 3
    return f"{value:z.{digits}f} ± {half:.{digits}f}"


def voltages_shifted(fitted: Fit) -> bool:
    """Whether a delay of the logged voltages is undone: the lag of the motors trades off against it."""
    return any(fault.channel == "voltages" for fault in fitted.likelihood.faults)


def sign_notes_of(null: Fit) -> tuple[str, ...]:
    """Warn as :func:`sign_notes` does of the gains of the simplified model."""
    return sign_notes(estimates(null, covariance(null), GAINS))


def sign_notes(estimates: Mapping[str, Estimate]) -> tuple[str, ...]:
    """Warn of gains, by the paper's symbols, that are significantly negative, and say what mends them."""
    return tuple(
        f"WRONG SIGN: {name} = {gain.value:.3g} {gain.unit} is negative, so {cause} of heli.toml (`heli init` writes "
        "one), or take the entry away if it stands there already, and run it again: do not trust this result"
        for name, cause in WIRED.items()
        if (gain := estimates[name]).value < -OUTLIER * (gain.standard_error or 0.0)
    )
