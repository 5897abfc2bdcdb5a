"""The blind battery as sources of a campaign: logs, and the truth in the catalogue's names, which no diagnosis sees."""

from collections.abc import Collection, Mapping

from heli_identifier.online import ModelParameters
from heli_identifier.records import Log
from heli_identifier.tools import GeneratedRig, Rig, TrueEffect, TrueUnknown, Truth
from heli_plant.effects import effect
from tests.blind.battery import BATTERY, Case
from tests.blind.rigs import Effect
from tests.blind.rigs import Rig as BlindTruth

GROUPS = tuple(dict.fromkeys(case.group for case in BATTERY))

RATE = 100.0
"""Sampling rate of the generator's logs [Hz]."""

SHAPE_NAMES = {
    "w_s": "stribeck_rate",
    "t_1": "step_time",
    "w_b": "frequency",
    "zeta": "damping",
    "eps_ground": "ground_elevation",
    "eps_g": "ground_height",
}
"""The catalogue's names for the shape parameters of the generator's laws."""

STATED_ELSEWHERE = {"ground_effect"}
"""Effects whose coefficient the tracer states at another point of the law than the generator does."""


def rig_name(case: Case, index: int) -> str:
    """Name of one rig of the battery, which is not passed to a diagnosis."""
    return f"{case.group} {case.kind} {index}"


def sources(
    groups: Collection[str] = GROUPS, limits: Mapping[str, int] | None = None
) -> dict[str, tuple[Case, GeneratedRig]]:
    """Give the rigs of some groups, at most ``limits[group]`` of each of its cases, by their names."""
    limits = limits or {}
    rigs = {}
    for case in BATTERY:
        if case.group in groups:
            for index in range(min(case.count, limits.get(case.group, case.count))):
                name = rig_name(case, index)
                arguments = (case.group, case.kind, case.count, case.scale, index)
                rigs[name] = (case, GeneratedRig(name, "benchmarks.blind_rigs:blind_rig", arguments, ("tests.blind",)))
    return rigs


def blind_rig(group: str, kind: str, count: int, scale: float, index: int) -> Rig:
    """Make one rig of the battery."""
    made = Case(group, kind, count, scale).rig(index)
    training = tuple(_log(f"train{number}", samples) for number, samples in enumerate(made.train, 1))
    return Rig(training, (_log("held", made.held),), truth(kind, made.truth))


def truth(kind: str, rig: BlindTruth) -> Truth:
    """Translate a blind rig's truth into the names of the catalogue."""
    unknown = rig.unknown
    return Truth(
        kind,
        {symbol: getattr(rig.base, symbol) for symbol in ModelParameters._fields},
        tuple(_true_effect(held) for held in rig.effects),
        TrueUnknown(unknown.axis, unknown.variable) if unknown else None,
    )


def _true_effect(held: Effect) -> TrueEffect:
    shapes = {shape.name: shape.field for shape in effect(held.name, held.axis).shapes}
    return TrueEffect(
        held.name,
        held.axis,
        None if held.name in STATED_ELSEWHERE else held.coefficient,
        {shapes[SHAPE_NAMES[name]]: value for name, value in held.shape.items()},
    )


def _log(name: str, samples) -> Log:
    return Log(name, RATE, samples[:, 1:3], samples[:, 3:])
