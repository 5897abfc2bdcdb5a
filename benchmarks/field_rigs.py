"""The field battery as sources of a campaign: each half of a rig's logs is a rig of its own, with the same truth."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from benchmarks.blind_rigs import SHAPE_NAMES
from heli_identifier.online import ModelParameters
from heli_identifier.records import Log
from heli_identifier.tools import GeneratedRig, Rig, TrueEffect, TrueUnknown, Truth
from heli_plant.effects import CATALOGUE, effect
from tests.blind.field.battery import FIELD_BATTERY, FieldCase
from tests.blind.field.generator import FieldRig
from tests.blind.field.truth import FieldTruth, LogTruth
from tests.blind.rigs import Effect

FIELD_GROUPS = tuple(dict.fromkeys(case.group for case in FIELD_BATTERY))

HALVES = ("a", "b")

_SHAPE_NAMES = SHAPE_NAMES | {"eps_0": "horizontal_offset"}

_VARIABLES = {"speed_stability": "travel_rate"}
"""Variable on which an unknown torque would depend, for effects that the catalogue may lack."""


@dataclass(frozen=True)
class FieldHalfTruth(Truth):
    """The truth of one half of a field rig.

    Attributes
    ----------
    beyond : tuple of Effect
        Effects that the rig holds and the catalogue lacks, under the generator's names. A single one stands under
        ``unknown`` as well, by its axis and the variable that it depends on.
    logs : mapping of str to LogTruth
        Encoder zeros, gain, trims and touches by the name of the log.
    motor_lag_s : float
        True time constant of the motors [s].
    """

    beyond: tuple[Effect, ...] = ()
    logs: Mapping[str, LogTruth] = field(default_factory=dict)
    motor_lag_s: float = 0.08


def field_name(case: FieldCase, index: int, half: int) -> str:
    """Name of one half of one rig of the battery, which is not passed to a diagnosis."""
    return f"{case.group} {case.kind} {index} {HALVES[half]}"


def field_sources(
    groups: Collection[str] = FIELD_GROUPS, limits: Mapping[str, int] | None = None
) -> dict[str, tuple[FieldCase, GeneratedRig]]:
    """Give both halves of the rigs of some groups, at most ``limits[group]`` rigs of each of its cases, by name."""
    limits = limits or {}
    rigs = {}
    for case in FIELD_BATTERY:
        if case.group in groups:
            for index in range(min(case.count, limits.get(case.group, case.count))):
                for half in range(2):
                    name = field_name(case, index, half)
                    arguments = (case.group, case.kind, case.count, case.scale, case.touched, index, half)
                    source = GeneratedRig(name, "benchmarks.field_rigs:field_half", arguments, ("tests.blind",))
                    rigs[name] = (case, source)
    return rigs


def field_half(group: str, kind: str, count: int, scale: float, touched: bool, index: int, half: int) -> Rig:
    """Make one half of one rig of the battery."""
    return half_of(FieldCase(group, kind, count, scale, touched).rig(index), half)


def half_of(made: FieldRig, half: int) -> Rig:
    """Give one half of a field rig as a rig of a campaign; logs carry their number on the rig and nothing else."""
    dealt, rate = made.halves[half], made.truth.rate
    training = tuple(
        _log(name_of(number), rate, samples) for number, samples in zip(dealt.train_numbers, dealt.train, strict=True)
    )
    held_out = tuple(
        _log(name_of(number), rate, samples) for number, samples in zip(dealt.held_numbers, dealt.held, strict=True)
    )
    return Rig(training, held_out, half_truth(made.truth, dealt.numbers))


def name_of(number: int) -> str:
    """Name of a log by its number on the rig."""
    return f"log{number:02d}"


def half_truth(rig: FieldTruth, numbers: Collection[int]) -> FieldHalfTruth:
    """Translate a field rig's truth into the names of the catalogue, with the logs of the given numbers."""
    known = {(entry.name, entry.axis) for entry in CATALOGUE}
    beyond = tuple(held for held in rig.effects if (held.name, held.axis) not in known)
    strength = {held.name: held.coefficient for held in rig.effects}
    return FieldHalfTruth(
        kind=rig.kind,
        parameters={symbol: getattr(rig.base, symbol) for symbol in ModelParameters._fields},
        effects=tuple(_true_effect(held) for held in rig.effects if held not in beyond),
        unknown=TrueUnknown(beyond[0].axis, _VARIABLES[beyond[0].name]) if len(beyond) == 1 else None,
        beyond=beyond,
        logs={name_of(number): rig.logs[number] for number in sorted(numbers)},
        motor_lag_s=rig.base.t_m + strength.get("motor_lag", 0.0),
    )


def _true_effect(held: Effect) -> TrueEffect:
    fields = {shape.name: shape.field for shape in effect(held.name, held.axis).shapes}
    shape = {fields[_SHAPE_NAMES[name]]: value for name, value in held.shape.items()}
    return TrueEffect(held.name, held.axis, held.coefficient, shape)


def _log(name: str, rate: float, samples) -> Log:
    return Log(name, rate, samples[:, 1:3], samples[:, 3:])
