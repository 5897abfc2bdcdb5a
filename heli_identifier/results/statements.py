"""The statements of an identification as frozen values; diagnosis.json has them under the names of their fields."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

import msgspec

from heli_identifier.online import Estimate
from heli_identifier.records import Array as Array

if TYPE_CHECKING:
    Number = float
else:
    Number = float | None  # as a file may hold it


class Verdict(StrEnum):
    """The verdict on one effect; the value is the text that stands in diagnosis.json."""

    SHOWN = "shown"
    AMBIGUOUS = "ambiguous"
    POSSIBLE = "possible"
    NOT_SHOWN = "not shown"
    NOT_TESTABLE = "not testable"
    UNKNOWN = "unknown effect"


class Determination(StrEnum):
    """What the value of a parameter rests on; the value is the text that stands in diagnosis.json."""

    OUTSIDE = "determined from outside"
    NOISE_MODEL = "rests on the noise model"
    NOT_DETERMINED = "not determined"


class NamedShape(msgspec.Struct, frozen=True, tag_field="kind", tag="parameters"):
    """Shape parameters of an effect of the catalogue, by name; one that was not estimated has no standard error.

    `horizontal_offset` is the angle of the arm above the horizontal at the encoder's zero: the negative of
    `rig.horizontal` in heli.toml.
    """

    parameters: Mapping[str, Estimate] = {}


def variable_name(variable: str) -> str:
    """Return a variable of a torque as words."""
    voltages = {"mu_sum": "sum of the voltages", "mu_diff": "difference of the voltages"}
    return {**voltages, "mu_rate": "rate of the sum of the voltages"}.get(variable, variable.replace("_", " "))


class CurveShape(msgspec.Struct, frozen=True, eq=False, tag_field="kind", tag="curve"):
    """An unknown torque as a curve of one variable, where records have been."""

    variable: str
    """What the torque depends on."""
    unit: str
    """Of the variable."""
    description: str
    """What kind of curve it is."""
    curve: Array
    """Shape (n, 2): values of the variable and the torque per inertia [rad/s^2]."""
    band: Array
    """Shape (n, 3): the same values of the variable, and the lower and upper end of the 95 % band [rad/s^2]."""


class PeriodicShape(msgspec.Struct, frozen=True, tag_field="kind", tag="periodic"):
    """An unknown torque that is periodic in time: frequency [Hz], mean amplitude over the logs [rad/s^2]."""

    frequency_hz: float
    amplitude: Number
    amplitude_standard_error: Number
    description: str
    variable: str = "time"
    unit: str = "s"


@dataclass(frozen=True)
class FoundEffect:
    """An effect of the catalogue, or an unknown torque, that the simplified model lacks."""

    name: str
    """Of the catalogue; `unknown` for an unknown torque."""
    axis: str
    """Pitch, elevation, travel or rotors; an effect on several axes has one entry an axis."""
    coefficient: Estimate | None
    """Of the corrected plant; None for an unknown torque."""
    verdict: Verdict
    """`shown`, `ambiguous` or `unknown effect` of what is established; `possible` of what is not."""
    family: str
    """Effects that ordinary logs do not tell apart; a family is one finding."""
    alternatives: tuple[tuple[str, str], ...]
    """Entries that explain the data about as well."""
    shape: NamedShape | CurveShape | PeriodicShape
    """By its `kind`: `parameters` of the law by name, each with `value`, `standard_error`, `unit`; a `curve` of (x, y)
    with its `band` of (x, low, high); a `periodic` torque."""
    score: Number
    """What the likelihood of the training logs loses without it [nats], over the dispersion."""
    experiment: str = ""
    """What to measure to settle an ambiguity, or to establish what is possible; empty if nothing is needed."""
    in_plant: bool = True
    """Whether the corrected plant has it. A periodic torque never is in it; an unknown curve is, as a table."""
    left_out_gain: float | None = None
    """Of a possible effect: the rise of the log-likelihood of training logs, each left out in turn [nats]. None for a
    torque that steps at one instant, for a law whose shape lies at the end of its range, and for one that acts along
    the filter's motion alone: no plant has these."""
    together: str = ""
    """What the effect and its alternatives come to together, in words; empty if there is no such figure."""


@dataclass(frozen=True)
class LogFault:
    """Something that is wrong with the logs and not with the rig."""

    name: str
    """Of the catalogue of faults, or of a defect that the logs show of themselves."""
    channel: str
    """What is wrong: an axis, the voltages or the time."""
    words: str
    """What it is, in a sentence."""
    size: Estimate | None = None
    """None for a defect that has none or cannot be undone."""
    score: float | None = None
    """What the likelihood of the training logs loses if it is not undone [nats]."""
    alternatives: tuple[tuple[str, str], ...] = ()
    """Effects of the plant and other faults that explain the logs about as well."""
    advice: str = ""
    """What to do in the laboratory."""


@dataclass(frozen=True)
class CatalogueVerdict:
    """The verdict on one entry of the catalogue."""

    name: str
    axis: str
    verdict: Verdict
    """`shown`, `ambiguous`, `possible`, `not shown` or `not testable`."""
    estimate: Estimate
    """Coefficient beside all effects of the corrected plant."""
    score: Number
    """Gain of log-likelihood by it, or loss without it [nats]."""
    visibility: Number
    """Share of the effect's signature that the fitted parameters cannot imitate."""
    upper_bound: float | None
    """Largest abs(coefficient) that the data allow at 95 %; None for an effect that is not testable."""
    why: str
    """Reason, in a clause."""
    experiment: str
    """What would make the effect visible; empty if nothing is needed."""


@dataclass(frozen=True)
class ParameterReport:
    """A parameter of the corrected plant and what its value rests on."""

    estimate: Estimate
    """Of k_x and k_z the slope at the operating point, of k_y the value per volt: a lean turns the whole thrust."""
    determination: Determination
    """`determined from outside`, `rests on the noise model` or `not determined`."""
    outside_share: float | None
    """Share of its regressor (the signal that it multiplies) that references explain; None without references."""
    instrument: Estimate | None
    """Its estimate by instruments."""
    contradicted: bool
    """Whether the instruments exclude the likelihood's value."""
    plausible: tuple[Number, Number]
    """95 % interval of what can be built on a bench."""
    why: str
    """What the determination rests on, in a clause."""
    experiment: str = ""
    """What to fly where it is not determined; empty otherwise."""


@dataclass(frozen=True)
class Agreement:
    """How often disjoint halves of whole logs agree on the families that they establish."""

    observed: Number
    """Jaccard index, mean over the splits."""
    expected: Number
    """What sampling alone allows if the plant is right."""
    splits: int


@dataclass(frozen=True, eq=False)
class EffectCurve:
    """Partial residual torque of one found effect against its variable, with the fitted law and its band.

    ``points`` (n, 2) and ``curve`` (m, 4): x, y, low, high; x in ``unit``, y in rad/s^2.
    """

    name: str
    axis: str
    variable: str
    unit: str
    points: Array
    curve: Array
