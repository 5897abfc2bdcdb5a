"""The values of a diagnosis; they are frozen, and they are the content of its file as well.

diagnosis.json holds the fields of `DiagnosisFile` and of its parts by their names, and docs/reference/files.md says of
each what the docstrings here say. A figure that is not finite is null in the file.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from enum import StrEnum
from html import escape
from os import PathLike
from pathlib import Path
from typing import Any, Literal

from heli_identifier import results  # its other modules show and write these values, and are loaded when they do
from heli_identifier.online import Estimate
from heli_identifier.provenance import provenance
from heli_identifier.records import Event, Log
from heli_identifier.results.statements import (
    Agreement,
    Array,
    CatalogueVerdict,
    EffectCurve,
    FoundEffect,
    LogFault,
    Number,
    ParameterReport,
)


class RigVerdict(StrEnum):
    """The verdict on a rig; the value is the text that stands in diagnosis.json."""

    EFFECTS_SHOWN = "effects shown"
    MODEL_ADEQUATE = "model adequate"
    UNKNOWN_EFFECT = "unknown effect"


class Use(StrEnum):
    """What an axis of the corrected plant may be used for; the value is the text that stands in diagnosis.json."""

    CONTROL = "prediction and control"
    PREDICTION = "prediction only"
    NOTHING = "not usable"


@dataclass(frozen=True)
class DataEntry:
    """A log."""

    file: str
    sha256: str
    samples: int
    rate_hz: float
    used_for: str
    """`training` or `held out`."""
    notes: tuple[str, ...] = ()
    """The changes that were made to it on reading."""


@dataclass(frozen=True)
class ErrorFigure:
    """A figure with its 95 % interval from a bootstrap over segments."""

    value: Number
    low: Number
    high: Number

    @property
    def is_known(self) -> bool:
        """Whether there is an error: zero stands for a noise floor that could not be computed."""
        return self.high > 0.0


@dataclass(frozen=True)
class AxisError:
    """Root-mean-square errors of one model on one axis of the held-out logs [rad]."""

    ahead_100ms: ErrorFigure
    """.1 s ahead of the filter's state."""
    ahead_200ms: ErrorFigure
    """.2 s ahead of it."""
    prediction_1s: ErrorFigure
    """1 s ahead of the smoothed state under the measured voltages. If a controller flew, these answer the air, and the
    figure decides nothing."""
    prediction_2s: ErrorFigure
    """2 s ahead of it."""
    free_run: ErrorFigure | None = None
    """Of a run without corrections; None if the axis is not stable."""
    closed_loop_3s: ErrorFigure | None = None
    """3 s ahead with the controller; None if references or controller are not known."""


@dataclass(frozen=True)
class AxisReport:
    """One axis before and after on the held-out logs."""

    before: AxisError
    """Of the model before: the simplified model with the effects that heli.toml gives."""
    after: AxisError
    """Of the corrected plant."""
    noise_floor: AxisError
    """Of the corrected plant on records that it simulated itself; zero if none could be computed."""
    angle_stays: ErrorFigure
    """Error 1 s ahead [rad] of the prediction that the angle stays as it is; a model has to beat it."""
    rate_stays: ErrorFigure
    """The same, of a rate that stays."""
    whiteness_p: Mapping[str, Number]
    """Ljung-Box p value of the innovations, `before` and `after`."""
    air: Number
    """Standard deviation of the torque of the air [rad/s^2]."""
    air_rate: Number
    """Its rate c [1/s]."""
    encoder_noise: Number
    """Standard deviation [rad]."""
    use: Use
    """What the axis of the plant may be used for: `prediction and control`, `prediction only` or `not usable`."""
    why: str
    """The reason of this use, in a clause."""
    change: Mapping[str, ErrorFigure]
    """By the names of the errors: error after over error before, less 1, over the same segments for both. It is real if
    its interval excludes zero."""


@dataclass(frozen=True)
class HeldOutLikelihood:
    """Log-likelihood of the held-out logs under the two plants, the air as in the training logs."""

    seconds: float
    """Length of the held-out logs [s]."""
    before: Number
    """Under the model before [nats/s]."""
    after: Number
    """Under the corrected plant [nats/s]."""
    gain: ErrorFigure
    """After less before [nats], all held-out logs together, with its 95 % interval."""
    chi2: Mapping[str, tuple[Number, int]] = field(default_factory=dict)
    """Of the instruments' judgement `before` and `after`, on the training logs: statistic and degrees of freedom; empty
    if no axis was moved by references."""


@dataclass(frozen=True, eq=False)
class HeldOutSeries:
    """One held-out log and what the models before and after make of it."""

    log: Log
    """As it was read, with faults undone."""
    free_runs: Mapping[str, Array]
    """Of the models "before" and "after": angles (N, 3) [rad], simulated from ``start`` under the voltages."""
    start: Mapping[str, float]
    """Start state by the fields of the plant's state, so that the FMU repeats the run."""
    residuals: Mapping[str, Array]
    """Of both, shape (n, 3): innovations under the air and over the scales of the plant after, every ``residual_step``
    [s]: under its own air the model before would look white, since that has taken what it lacks for air."""
    residual_step: float
    """[s]."""
    stretches: Mapping[str, Array] = field(default_factory=dict)
    """Of both, shape (n, 3): what they predict of a flight under a controller in stretches, each begun at the measured
    motion, every ``residual_step`` [s]: 3 s with the controller where it is known, else 1 s under the voltages. Not a
    number between two stretches."""


@dataclass(frozen=True, eq=False, kw_only=True)
class DiagnosisFile:
    """diagnosis.json: what a diagnosis found."""

    schema: Literal["heli-diagnosis/2"] = "heli-diagnosis/2"
    verdict: RigVerdict
    """`effects shown`: entries of the catalogue were found; `unknown effect`: also, or only, a torque that no entry
    explains; `model adequate`: nothing was shown, which does not mean that the model is exact or its errors small."""
    faults: tuple[LogFault, ...] = ()
    """What is wrong with the logs. What can be undone was undone for all figures of this file."""
    effects: tuple[FoundEffect, ...]
    """What is established, strongest evidence first. The corrected plant has all of it, except torques that are
    periodic in time."""
    possible: tuple[FoundEffect, ...]
    """What the likelihood favours without establishing it; these are not findings. The plant has those
    whose `left_out_gain` is above zero, and terms of rigid-body mechanics."""
    catalogue: tuple[CatalogueVerdict, ...]
    """The verdict on every entry; these logs cannot decide about one that is `not testable`."""
    parameters_before: Mapping[str, Estimate]
    """Of the simplified model, by the paper's symbols; a gain is the slope at 0 V. A standard error of None says that
    the value was given."""
    parameters_after: Mapping[str, Estimate]
    """The same of the corrected plant."""
    effects_after: Mapping[str, Estimate]
    """Coefficients and shapes of the effects of the corrected plant and the tables of its unknown torques, by field."""
    parameters: Mapping[str, ParameterReport]
    """[What each parameter of the corrected plant rests on](../explanation/tracing.md#what-a-value-rests-on). A gain is
    the slope of the thrust at the logs' median voltage, `settings.operating_point`, and k_y the thrust per volt
    there."""
    axes: Mapping[str, AxisReport]
    """Errors on the held-out logs and use, by axis. Where a controller flew, errors 1 s and 2 s ahead decide
    nothing."""
    held_out: HeldOutLikelihood
    closed_loop: bool
    """Whether a controller flew the training logs."""
    references: str
    """Where the instruments come from: `voltages`, `logged`, `rebuilt` or `none`."""
    agreement: Agreement | None
    """None where the training logs are too few to be halved."""
    data: tuple[DataEntry, ...]
    """Every log."""
    settings: Mapping[str, Any]
    """What was given of the rig, the score [nats] from which an effect is shown (`score_needed`, and
    `score_needed_certain` for one that every rig has), and the median size of the voltages (`operating_point` [V])."""
    notes: tuple[str, ...]
    """Remarks that matter for this diagnosis."""
    seconds: float
    """Duration of the diagnosis."""
    events: tuple[Event, ...] = ()
    """Passages in which something other than the plant acts, in training and held-out logs."""
    provenance: Mapping[str, Any] = field(default_factory=provenance)
    """Command, date, system, and the version of everything that can change a result."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Diagnosis(DiagnosisFile):
    """The complete result of a diagnosis: the content of its file, the plants, and the data of the figures."""

    plant_before: Any
    plant_after: Any
    """plant_before, plant_after: The complete parameter sets, :class:`heli_plant.parameters.PlantParameters`."""
    covariance: Array
    """Shape (n, n), of the parameters that ``covariance_fields`` names. A gain is the slope at the operating point; a_1
    is the offset less the lift there."""
    covariance_fields: tuple[str, ...]
    series: tuple[HeldOutSeries, ...]
    curves: tuple[EffectCurve, ...]
    ahead_200ms: Mapping[str, float] = field(default_factory=dict)
    """Where a controller flew: by axis the corrected plant's largest error .2 s ahead [rad] on one log, training logs
    included, in air of which nothing is known."""

    def summary(self) -> str:
        """Return the verdict, the errors before and after, and the notes as plain text."""
        return results.diagnosis_summary(self)

    def to_dict(self) -> dict[str, Any]:
        """Return the content of diagnosis.json; docs/reference/files.md describes it."""
        return results.to_json_value({entry.name: getattr(self, entry.name) for entry in fields(DiagnosisFile)})

    def write(self, folder: str | PathLike[str], rig: str = "rig") -> Path:
        """Write diagnosis.json, report.html, parameters.json and the corrected HelicopterPlant.fmu, all or nothing.

        The folder is made if it does not exist, and returned. ``rig`` is what the report calls the rig.
        ConfigurationError if the folder cannot be written to, IdentifierError if the free run of the corrected unit is
        not the one that the diagnosis reports.
        """
        with results.write_whole_folder(folder) as draft:
            results.write_results(self, rig, draft)
        return Path(folder)

    def _repr_html_(self) -> str:
        """Show the report in a notebook."""
        page = escape(results.report_page(self, "rig"))
        return f'<iframe srcdoc="{page}" style="width: 100%; height: 60em; border: 0"></iframe>'

    def __repr__(self) -> str:
        effects = ", ".join(f"{effect.name} on {effect.axis}" for effect in self.effects)
        return f"<Diagnosis: {self.verdict}{f': {effects}' if effects else ''}>"
