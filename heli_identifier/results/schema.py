"""The JSON files of results: what each key holds, written once; reading, writing and the reference page follow from it.

A file is a struct. A field's annotation has its type and a sentence for the reference page; what is not finite is null.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from os import PathLike
from pathlib import Path
from reprlib import repr as shortened
from sys import float_info
from typing import Annotated, Any, Literal, TypeVar, get_args, get_origin, get_type_hints

import msgspec
import numpy as np
from msgspec import Meta, field

from heli_identifier.errors import ConfigurationError
from heli_identifier.files import regular_bytes
from heli_identifier.online import Estimate
from heli_identifier.tracing import (
    AxisError,
    AxisReport,
    CatalogueVerdict,
    CurveShape,
    Diagnosis,
    ErrorFigure,
    FoundEffect,
    LogFault,
    NamedShape,
    ParameterReport,
    PeriodicShape,
    RigVerdict,
    Use,
    Verdict,
)

LARGEST_MB = 50.0
"""Size up to which a document is read [MB]; it has some kilobytes."""

Finite = Annotated[float, Meta(ge=-float_info.max, le=float_info.max)]
NotNegative = Annotated[float, Meta(ge=0.0, le=float_info.max)]
"""What Python reads as JSON may hold NaN and Infinity."""

Number = float | None
"""A figure; null where it is not finite or not known."""

Interval = tuple[Number, Number]
File = TypeVar("File", bound=msgspec.Struct)


class Entry(msgspec.Struct):
    """A part of a document."""


class EstimateEntry(Entry):
    """A value with its uncertainty."""

    value: Number
    standard_error: Annotated[Number, "`null` says that the value was given"]
    unit: str
    interval: Annotated[Interval, "95 %: the value ± 1.96 standard errors"]


class EffectKey(Entry):
    """An entry of the catalogue."""

    name: str
    axis: str


class EffectEntry(Entry):
    """An effect that was found, or is possible."""

    name: Annotated[str, "of the catalogue; `unknown` for a torque that no entry explains"]
    axis: Annotated[str, "pitch, elevation, travel or rotors; an effect on several axes has one entry per axis"]
    coefficient: Annotated[Number, "of the delivered plant; `null` for an unknown torque"]
    standard_error: Number
    unit: str | None
    verdict: Verdict
    family: Annotated[str, "effects that ordinary logs do not tell apart; a family is one finding"]
    in_plant: Annotated[
        bool, "whether the corrected plant has it. A periodic torque never is in it; an unknown curve is, as a table"
    ]
    left_out_gain: Annotated[
        Number,
        "of a possible effect: how much likelier training logs get with it that were left out of the fit, one at a "
        "time [nats]",
    ]
    alternatives: Annotated[list[EffectKey], "entries that explain the data about as well"]
    together: Annotated[str, "what the effect and its alternatives come to together, in words"]
    shape: Annotated[
        dict[str, Any],
        'shape parameters by name, `{"value", "standard_error", "unit"}`. `horizontal_offset` is the angle of the arm '
        "above the horizontal at the encoder's zero: the negative of `rig.horizontal` in heli.toml. An unknown torque "
        'has `{"variable", "description", "unit", "curve": [[x, y], ...], "band": [[x, low, high], ...]}` or '
        '`{"variable": "time", "description", "unit", "frequency_hz", "amplitude", "amplitude_standard_error"}`',
    ]
    interval: Interval | None
    score: Annotated[Number, "what the log-likelihood of the training logs gains by the effect [nats]"]
    experiment: Annotated[str, "what would settle it; empty if nothing is open"]


class Untestable(Entry):
    """An effect about which the logs cannot decide."""

    name: str
    axis: str
    why: str
    experiment: Annotated[str, "the experiment that could decide"]


class Parameters(Entry):
    """Parameters by the paper's symbols; a gain is that at no voltage."""

    before: Annotated[dict[str, EstimateEntry], "of the simplified model"]
    after: Annotated[dict[str, EstimateEntry], "of the corrected plant"]


class DeterminationEntry(EstimateEntry):
    """What the value of a parameter rests on."""

    determination: Annotated[str, "`determined from outside`, `rests on the noise model` or `not determined`"]
    outside_share: Annotated[Number, "share of its regressor that references explain"]
    instrument: Annotated[EstimateEntry | None, "its estimate by references alone"]
    contradicted: Annotated[bool, "whether references exclude the likelihood's value"]
    plausible: Annotated[Interval, "95 % interval of what can be built on a bench"]
    why: str
    experiment: Annotated[str, "what to fly where it is not determined"]


class UseEntry(Entry):
    """What an axis of the plant may be used for."""

    use: Annotated[Use, "`prediction and control`, `prediction only` or `not usable`"]
    why: str


class Errors(Entry):
    """Root-mean-square errors on the held-out logs [rad]."""

    ahead_100ms_rad: Number
    ahead_200ms_rad: Number
    prediction_1s_rad: Number
    prediction_2s_rad: Number
    free_run_rad: Annotated[Number, "`null` where the axis is not stable"]
    closed_loop_3s_rad: Annotated[Number, "`null` where references or controller are not known"]


class ErrorIntervals(Entry):
    """95 % intervals of errors, from a bootstrap over segments [rad]."""

    ahead_100ms_rad: Interval | None
    ahead_200ms_rad: Interval | None
    prediction_1s_rad: Interval | None
    prediction_2s_rad: Interval | None
    free_run_rad: Interval | None
    closed_loop_3s_rad: Interval | None


class Stages(Entry):
    """Intervals of the errors by stage."""

    before: ErrorIntervals
    after: ErrorIntervals
    noise_floor: ErrorIntervals


class Naive(Entry):
    """Errors 1 s ahead of predictions that know no model, on the same logs."""

    angle_stays_1s_rad: Number
    rate_stays_1s_rad: Number


class Air(Entry):
    """The torque of the air on an axis."""

    deviation_rad_s2: Number
    rate_per_s: Number


class Figure(Entry):
    """A figure with its 95 % interval."""

    value: Number
    low: Number
    high: Number


class AxisEntry(Entry):
    """One axis before and after. Where a controller flew, errors 1 s and 2 s ahead decide nothing."""

    before: Errors
    after: Errors
    noise_floor: Annotated[Errors, "of the corrected plant on logs that it made itself; `null` where none is known"]
    intervals: Stages
    naive: Naive
    whiteness_p: Annotated[
        dict[str, Number], "p of Ljung and Box's test of the innovations over one second, `before` and `after`"
    ]
    air: Air
    encoder_noise_rad: Number
    change: Annotated[
        dict[str, Figure],
        "error after over error before, less 1, by the figures' names, with its interval from the same segments drawn "
        "for both: real if that does without zero",
    ] = field(default_factory=dict)


class ChiSquared(Entry):
    """The instruments' judgement of a plant."""

    chi2: Number
    degrees_of_freedom: int


class HeldOut(Entry):
    """Log-likelihood of the held-out logs under the plants before and after."""

    seconds: Number
    before_nats_per_s: Number
    after_nats_per_s: Number
    gain_nats: Figure
    instruments: Annotated[dict[str, ChiSquared], "what the instruments make of both plants"]


class AgreementEntry(Entry):
    """Jaccard index of the families that disjoint halves of the training logs show."""

    observed: Number
    expected: Annotated[Number, "what sampling alone would leave"]
    splits: int


class DataFile(Entry):
    """A log."""

    file: str
    sha256: str
    samples: int
    rate_hz: Number
    used_for: Annotated[str, "`training` or `held out`"]
    notes: Annotated[list[str], "the changes that were made to it on reading"]


class CatalogueEntry(Entry):
    """The verdict on one entry of the catalogue."""

    name: str
    axis: str
    verdict: Annotated[Verdict, "`shown`, `ambiguous`, `possible`, `not shown` or `not testable`"]
    coefficient: Number
    standard_error: Number
    unit: str
    score: Number
    visibility: Annotated[Number, "share, 0 to 1, of its signature that no parameter can imitate"]
    upper_bound: Annotated[Number, "largest size that the data still allow at 95 %; `null` where they bound nothing"]
    why: str
    experiment: str


class EventEntry(Entry):
    """A passage in which something outside the plant acts on the rig."""

    log: str
    axis: str
    from_s: Annotated[Number, "in the time of the file [s]"]
    to_s: Number


class FaultEntry(Entry):
    """Something wrong with the logs; what can be undone is undone before anything else is said."""

    name: str
    channel: str
    words: Annotated[str, "what it is"]
    size: EstimateEntry | None
    score: Annotated[Number, "what the likelihood of the training logs loses if it is not undone [nats]"]
    alternatives: Annotated[list[EffectKey], "effects and other faults that explain the logs about as well"]
    advice: Annotated[str, "what to do in the laboratory"]


class DiagnosisFile(Entry):
    """diagnosis.json: what a diagnosis found."""

    schema: Literal["heli-diagnosis/1"]
    verdict: Annotated[
        RigVerdict,
        "`effects shown`: entries of the catalogue were found; `unknown effect`: also, or only, a torque that no entry "
        "explains; `model adequate`: nothing was shown. That does not mean that the model is exact or its errors small",
    ]
    effects: Annotated[list[EffectEntry], "what the simplified model lacks, strongest evidence first"]
    possible: Annotated[
        list[EffectEntry],
        "what the likelihood favours without establishing it: no findings. The plant has those whose `left_out_gain` "
        "is above zero, and terms of rigid-body mechanics",
    ]
    not_testable: Annotated[list[Untestable], "effects about which these data cannot decide"]
    parameters: Parameters
    determinations: Annotated[
        dict[str, DeterminationEntry],
        "[what a parameter rests on](../explanation/tracing.md#what-a-value-rests-on). A gain is the slope of the "
        "thrust at the logs' mean voltage, `settings.operating_point`",
    ]
    use: Annotated[dict[str, UseEntry], "what an axis of the plant may be used for"]
    closed_loop: Annotated[bool, "whether a controller flew the training logs"]
    references: Annotated[str, "where the instruments come from: `voltages`, `logged`, `rebuilt` or `none`"]
    error: Annotated[dict[str, AxisEntry], "root-mean-square errors on the held-out logs, by axis"]
    held_out: HeldOut
    agreement: Annotated[AgreementEntry | None, "`null` for a single log"]
    data: Annotated[list[DataFile], "every log"]
    settings: Annotated[
        dict[str, Any],
        "what was given of the rig, the score from which an effect is shown (`score_needed` [nats]), and the mean "
        "voltage (`operating_point` [V])",
    ]
    seconds: Annotated[Number, "duration of the diagnosis"]
    catalogue: Annotated[list[CatalogueEntry], "the verdict on every entry"]
    events: Annotated[list[EventEntry], "left out unless `--keep-events` was given"]
    notes: Annotated[list[str], "remarks that matter for this diagnosis"]
    provenance: Annotated[
        dict[str, Any], "command, date, system, and the version of everything that can change a result"
    ]
    faults: Annotated[list[FaultEntry], "what is wrong with the logs"] = field(default_factory=list)


class ParameterValue(Entry):
    """A value of a unit's parameter."""

    value: Finite
    standard_error: Annotated[NotNegative | None, "`null` says that the value was given"]
    unit: str


class ExpectedFigure(Entry):
    """A root-mean-square error with its 95 % interval."""

    value: NotNegative
    low: NotNegative
    high: NotNegative


class Expected(Entry):
    """The error of the 1 s prediction of an axis."""

    prediction_1s_rad: Annotated[ExpectedFigure, "on the held-out logs"]
    noise_floor_rad: Annotated[NotNegative, "of a perfect model; 0 where none could be computed"]
    use: Annotated[Use | None, "what the axis may be used for, as in diagnosis.json"] = None


class CovarianceEntry(Entry):
    """Joint covariance of the estimates of a diagnosis; `null` where only standard errors are known."""

    names: Annotated[tuple[str, ...], "structured names of what was estimated"]
    logarithms: Annotated[
        tuple[str, ...], "those of them, the gains, that count with the logarithm of their slope at the operating point"
    ]
    operating_point_v: Annotated[Finite, "voltage of the slopes [V]"]
    matrix: Annotated[
        tuple[tuple[Finite, ...], ...], "in the squares and products of the parameters' units, of a logarithm 1"
    ]


class ParametersFile(Entry):
    """parameters.json: start values of a unit, and the error that is expected of them."""

    schema: Literal["heli-parameters/1"]
    unit: str
    values: Annotated[
        dict[str, ParameterValue],
        "start values of the unit by structured name. Where an axis has a tabulated torque, `table.<axis>.variable` "
        "says what it runs over (1 pitch, 2 elevation, 3 travel, 4 to 6 their rates, 7 μ_s, 8 μ_d, 9 time; 0 or "
        "nothing: no table), `first` and `spacing` at which values, in the variable's unit, and `torque_1` to "
        "`torque_21` the acceleration at each of them",
    ]
    expected: Annotated[dict[str, Expected], "by axis: what `heli check` compares a new log with"]
    provenance: Annotated[dict[str, Any], "where they come from"]
    covariance: CovarianceEntry | None = None


def diagnosis_file(diagnosis: Diagnosis) -> DiagnosisFile:
    """Give the content of diagnosis.json."""
    held = diagnosis.held_out
    return DiagnosisFile(
        schema="heli-diagnosis/1",
        verdict=diagnosis.verdict,
        effects=[_effect(effect) for effect in diagnosis.effects],
        possible=[_effect(effect) for effect in diagnosis.possible],
        not_testable=[
            Untestable(entry.name, entry.axis, entry.why, entry.experiment)
            for entry in diagnosis.catalogue
            if entry.verdict == Verdict.NOT_TESTABLE
        ],
        parameters=Parameters(_estimates(diagnosis.parameters_before), _estimates(diagnosis.parameters_after)),
        determinations={name: _determination(report) for name, report in diagnosis.parameters.items()},
        use={axis: UseEntry(report.use, report.why) for axis, report in diagnosis.axes.items()},
        closed_loop=diagnosis.closed_loop,
        references=diagnosis.references,
        error={axis: _axis(report) for axis, report in diagnosis.axes.items()},
        held_out=HeldOut(
            held.seconds, held.before, held.after, _figure(held.gain),
            {stage: ChiSquared(chi2, freedom) for stage, (chi2, freedom) in held.chi2.items()},
        ),
        agreement=_like(diagnosis.agreement, AgreementEntry) if diagnosis.agreement else None,
        data=[_like(entry, DataFile) for entry in diagnosis.data],
        settings=dict(diagnosis.settings),
        seconds=diagnosis.seconds,
        catalogue=[_catalogue_entry(entry) for entry in diagnosis.catalogue],
        events=[EventEntry(e.log, e.axis, e.start_in_file, e.end_in_file) for e in diagnosis.events],
        notes=list(diagnosis.notes),
        provenance=dict(diagnosis.provenance),
        faults=[_fault_entry(fault) for fault in diagnosis.faults],
    )  # fmt: skip


def _like(value: Any, kind: type[File], /, **more: Any) -> File:
    """Give an entry whose fields are the attributes of ``value``, but for those in ``more``."""
    names = [name for name in kind.__struct_fields__ if name not in more]
    return kind(**{name: getattr(value, name) for name in names}, **more)


def estimate_entry(estimate: Estimate) -> EstimateEntry:
    """Give an estimate with its standard error, unit and 95 % interval."""
    return _like(estimate, EstimateEntry)


def _estimates(estimates: Mapping[str, Estimate]) -> dict[str, EstimateEntry]:
    return {name: estimate_entry(value) for name, value in estimates.items()}


def _figure(figure: ErrorFigure) -> Figure:
    return _like(figure, Figure)


def _effect(effect: FoundEffect) -> EffectEntry:
    own = effect.coefficient
    return _like(
        effect, EffectEntry,
        coefficient=own and own.value, standard_error=own and own.standard_error, unit=own and own.unit,
        interval=own and own.interval, shape=_shape(effect.shape),
        alternatives=[EffectKey(name, axis) for name, axis in effect.alternatives],
    )  # fmt: skip


def _shape(shape: NamedShape | CurveShape | PeriodicShape) -> dict[str, Any]:
    if isinstance(shape, NamedShape):
        return {
            name: {"value": own.value, "standard_error": own.standard_error, "unit": own.unit}
            for name, own in shape.parameters.items()
        }
    periodic = ("frequency_hz", "amplitude", "amplitude_standard_error")
    keys = ("curve", "band") if isinstance(shape, CurveShape) else periodic
    return {key: getattr(shape, key) for key in ("variable", "unit", "description", *keys)}


def _determination(report: ParameterReport) -> DeterminationEntry:
    own, outside = report.estimate, report.instrument
    return _like(
        report, DeterminationEntry,
        value=own.value, standard_error=own.standard_error, unit=own.unit, interval=own.interval,
        instrument=estimate_entry(outside) if outside else None,
    )  # fmt: skip


def _axis(report: AxisReport) -> AxisEntry:
    before, after, floor = (_errors(stage) for stage in (report.before, report.after, report.noise_floor))
    intervals = Stages(*(_intervals(stage) for stage in (report.before, report.after, report.noise_floor)))
    return AxisEntry(
        before, after, floor, intervals, Naive(report.angle_stays.value, report.rate_stays.value),
        dict(report.whiteness_p), Air(report.air, report.air_rate), report.encoder_noise,
        {name: _figure(figure) for name, figure in report.change.items()},
    )  # fmt: skip


def _known(error: AxisError) -> dict[str, ErrorFigure | None]:
    figures = {key: getattr(error, key.removesuffix("_rad")) for key in Errors.__struct_fields__}
    return {key: figure if figure and figure.is_known else None for key, figure in figures.items()}


def _errors(error: AxisError) -> Errors:
    return Errors(**{key: figure.value if figure else None for key, figure in _known(error).items()})


def _intervals(error: AxisError) -> ErrorIntervals:
    return ErrorIntervals(
        **{key: (figure.low, figure.high) if figure else None for key, figure in _known(error).items()}
    )


def _catalogue_entry(entry: CatalogueVerdict) -> CatalogueEntry:
    own = entry.estimate
    return _like(entry, CatalogueEntry, coefficient=own.value, standard_error=own.standard_error, unit=own.unit)


def _fault_entry(fault: LogFault) -> FaultEntry:
    return _like(
        fault, FaultEntry, size=estimate_entry(fault.size) if fault.size else None,
        alternatives=[EffectKey(name, axis) for name, axis in fault.alternatives],
    )  # fmt: skip


def plain(value: Any) -> Any:
    """Give a value as JSON can hold it: lists, plain numbers, and null for what is not finite."""
    if isinstance(value, msgspec.Struct):
        return {name: plain(getattr(value, name)) for name in value.__struct_fields__}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, str):
        return str(value)
    if isinstance(value, Sequence):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float):
        return value if isfinite(value) else None
    return value


def document_text(document: Mapping[str, Any]) -> str:
    """Give a document as the text of a JSON file."""
    return json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def read_document(path: str | PathLike[str], kind: type[File]) -> File:
    """Read a JSON file of results.

    Raises
    ------
    ConfigurationError
        The file cannot be read, is no JSON or not of the schema, or an entry is missing, there twice, of the wrong type
        or not finite; file and entry are named.
    """
    file, name = Path(path), (kind.__doc__ or "").partition(":")[0]
    if file.is_dir():
        raise ConfigurationError(f"{path} is a folder; name the {name} in it.")
    try:
        content = json.loads(regular_bytes(file, LARGEST_MB).decode("utf-8"), object_pairs_hook=_once)
    except _Repeated as error:
        raise ConfigurationError(f"{path} is damaged: the key {str(error)!r} stands there twice; keep one.") from error
    except FileNotFoundError:
        raise ConfigurationError(f"{path} does not exist; `heli diagnose` writes a {name}.") from None
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be read: {error.strerror}.") from error
    except (ValueError, RecursionError) as error:
        raise ConfigurationError(f"{path} is no JSON: {error}.") from error
    schema = content.get("schema") if isinstance(content, dict) else None
    (expected,) = get_args(get_type_hints(kind)["schema"])
    if schema != expected:
        said = f"its schema is {shortened(schema)}"
        raise ConfigurationError(f"{path} must hold an object of schema {expected!r}, {said}.")
    try:
        return msgspec.convert(content, kind)
    except msgspec.ValidationError as error:
        said = _fault(content, kind, error)
        raise ConfigurationError(
            f"{path} is damaged: {said}; write it again with `heli diagnose` or `heli identify`."
        ) from error


class _Repeated(Exception):
    """A key stands twice in one object of the file; JSON would keep the last without a word."""


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise _Repeated(key)
        found[key] = value
    return found


def _fault(content: Any, kind: type, error: msgspec.ValidationError) -> str:
    """Name the entry of a document that is of another type, its value, and what was expected."""
    said, _, path = str(error).partition(" - at `$")
    value, keys = content, []
    for key in path.rstrip("`").replace("[...]", ".?").replace("[", ".").replace("]", "").split(".")[1:]:
        if isinstance(value, list):
            value = value[int(key)]
        else:
            key = _faulty_key(content, kind, value) if key == "?" else key
            value = value[key]
        keys.append(key)
    if isinstance(value, float) and not isfinite(value):
        said = "a finite number is expected"
    entry = f"{'.'.join(keys)} = {shortened(value)}: " if keys else ""
    return f"{entry}{said[:1].lower()}{said[1:]}"


def _faulty_key(content: Any, kind: type, value: dict[str, Any]) -> str:
    """Which key of ``value``, a part of ``content``, is refused: msgspec does not say it. The others are taken out."""
    for key, item in list(value.items()):
        value.clear()
        value[key] = item
        try:
            msgspec.convert(content, kind)
        except msgspec.ValidationError:
            return key
    raise AssertionError("a document was refused whose entries are all accepted")


def reference_rows(kind: type[msgspec.Struct]) -> Iterator[tuple[str, str]]:
    """Give every key of a document, those of its parts after a point, and what it holds; a kind of part once."""
    yield from _rows(kind, "", {EstimateEntry, Figure, ErrorIntervals, EffectKey, ExpectedFigure})


def _rows(kind: type[msgspec.Struct], above: str, told: set[type]) -> Iterator[tuple[str, str]]:
    for name, hint in get_type_hints(kind, include_extras=True).items():
        said = [own for own in getattr(hint, "__metadata__", ()) if isinstance(own, str)]
        part, mark = _part(hint)
        fields = f"; {', '.join(f'`{own}`' for own in part.__struct_fields__)}" if part in told and part else ""
        yield f"{above}{name}", (said[0] if said else (part.__doc__ or "").rstrip(".") if part else "") + fields
        if part and part not in told:
            told.add(part)
            yield from _rows(part, f"{above}{name}{mark}.", told)


def _part(hint: Any) -> tuple[type[msgspec.Struct] | None, str]:
    """Give the struct in a type, and how one of several is written: ``[]`` in a list, ``.<name>`` by name."""
    if isinstance(hint, type) and issubclass(hint, msgspec.Struct):
        return hint, ""
    mark = {list: "[]", dict: ".<name>"}.get(get_origin(hint) or hint, "")
    for inner in get_args(hint):
        part, below = _part(inner)
        if part:
            return part, mark + below
    return None, mark
