"""What the value of every parameter rests on: on what came from outside, on the model of the noise, or on nothing.

A likelihood is as good as its model of the air. References move the rig and know nothing of the air, so instruments
made of them need no such model: they judge what the likelihood says.

* The instruments' interval is narrow and holds the likelihood's value: *determined from outside*.
* It is narrow and excludes that value: the two contradict each other. The value is *not determined*, and no controller
  is to be designed on it.
* There is no reference, or its instruments say little, and the likelihood's interval is narrow: *rests on the noise
  model*.
* Else: *not determined*. The value is the likeliest within what is plausible for any rig of this kind.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import Estimate

from .fit import Fit
from .instruments import InstrumentEstimates
from .settings import CONTRADICTION, DETERMINED


class Determination(StrEnum):
    """What the value of a parameter rests on; the value is the text that stands in results."""

    OUTSIDE = "determined from outside"
    NOISE_MODEL = "rests on the noise model"
    NOT_DETERMINED = "not determined"


@dataclass(frozen=True)
class ParameterReport:
    """A parameter of a fitted plant and what its value rests on.

    Attributes
    ----------
    estimate : Estimate
        By the likelihood; of a gain the slope at the operating point.
    determination : Determination
    outside_share : float or None
        Share of its regressor that references explain beside the other regressors, 0 to 1; None without references.
    instrument : Estimate or None
        Its estimate by instruments.
    contradicted : bool
        Whether the instruments exclude the likelihood's value.
    plausible : tuple of float
        95 % interval of what can be built on a bench.
    why : str
        What the determination rests on, in a clause.
    experiment : str
        What to fly where it is not determined from outside; empty where nothing is known to help.
    """

    estimate: Estimate
    determination: Determination
    outside_share: float | None
    instrument: Estimate | None
    contradicted: bool
    plausible: tuple[float, float]
    why: str
    experiment: str = ""


def parameter_reports(
    fitted: Fit, covariance: NDArray[np.float64], outside: InstrumentEstimates | None
) -> dict[str, ParameterReport]:
    """State of every base parameter of a fit what its value rests on.

    Parameters
    ----------
    fitted : Fit
    covariance : NDArray, shape (P, P)
        Of its coordinates, from :func:`heli_identifier.tracing.fit.covariance`.
    outside : InstrumentEstimates or None
        None where nothing came from outside.
    """
    rig, found = fitted.likelihood.rig, {}
    by_instruments: Mapping[str, tuple[float, float, float]] = {
        name: (float(axis.values[k]), float(axis.half_widths[k]), float(axis.shares[k]))
        for axis in (outside.axes if outside else ())
        for k, name in enumerate(axis.parameters)
        if np.isfinite(axis.values[k])
    }
    for i, (name, coordinate) in enumerate(zip(fitted.fields, fitted.coordinates, strict=True)):
        if name not in rig.base:
            continue
        error = float(fitted.slope(name) * np.sqrt(covariance[i, i]))
        estimate = Estimate(fitted.estimate(name), error, rig.units[name])
        low, high = sorted((coordinate.value(-1.96), coordinate.value(1.96)))
        found[name] = _report(
            estimate, by_instruments.get(name), (low, high), name in rig.gains, rig.fly.get(name, "")
        )
    return found


def _report(
    estimate: Estimate,
    instrument: tuple[float, float, float] | None,
    plausible: tuple[float, float],
    is_gain: bool,
    fly: str,
) -> ParameterReport:
    """Decide what one parameter rests on."""
    half = 1.96 * (estimate.standard_error or 0.0)
    allowed = DETERMINED * (abs(estimate.value) if is_gain else 0.5 * (plausible[1] - plausible[0]))
    value, width, share = instrument or (0.0, np.inf, None)
    by_instrument = Estimate(value, width / 1.96, estimate.unit) if instrument else None
    sure = width < DETERMINED * abs(value)
    contradicted = bool(is_gain and sure and abs(value - estimate.value) > CONTRADICTION * width / 1.96)
    said = f"references alone give {value:.3g} ± {width:.2g}"
    if contradicted:
        word, why = Determination.NOT_DETERMINED, f"{said}, the likelihood {estimate.value:.3g} ± {half:.2g}"
    elif half > allowed:
        word, why = Determination.NOT_DETERMINED, f"its interval is ± {half:.2g}"
    elif sure:
        word, why, fly = Determination.OUTSIDE, said, ""
    else:
        word, why = Determination.NOISE_MODEL, "no reference confirms it: it holds if the air's torque is as modelled"
    return ParameterReport(estimate, word, share, by_instrument, contradicted, plausible, why, fly)
