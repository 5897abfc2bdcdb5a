"""The corrector's state as lists of numbers, which ``json.dumps`` writes and ``json.loads`` reads back bit for bit."""

from typing import Any

from heli_plant.communication import PlantMemory
from heli_plant.observer import Torque
from heli_plant.state import PlantState

from .baseline import Baseline, Coefficients
from .blocks import Block, Colour, Level, Sums
from .detection import Finding, Page
from .gap import Gap
from .instant import Instant
from .plan import FollowPlan, parameters_of
from .roughness import Roughness
from .sensitivity import Sensitivity
from .state import CorrectorState
from .stream import Stream
from .twins import Twins
from .uncertainty import Uncertainty
from .values import Values


def frozen_state(state: CorrectorState) -> list[Any]:
    """Return ``state`` as lists; the plants' parameters follow from the values."""
    return _lists((*state._replace(values=state.values._replace(parameters=0, rival_parameters=0)),))  # type: ignore[arg-type]


def _lists(value: Any) -> Any:
    return [_lists(one) for one in value] if isinstance(value, tuple | list) else value


def _tuples(value: Any) -> Any:
    return tuple([_tuples(one) for one in value]) if isinstance(value, tuple | list) else value


def thawed_state(saved: list[Any], plan: FollowPlan) -> CorrectorState:
    """Return the state that :func:`frozen_state` turned into lists."""
    fields = dict(zip(CorrectorState._fields, saved, strict=True))
    instant = _instant(fields["memory"], fields["torque"], fields["sensitivities"])
    fields["memory"], fields["torque"], fields["sensitivities"] = instant
    begin, voltages, unseen, arrived = fields["gap"]
    fields["gap"] = Gap(_instant(*begin), tuple(voltages), unseen, tuple(arrived))
    fields["roughness"] = Roughness(*_tuples(fields["roughness"]))
    fields["uncertainties"] = _each(Uncertainty, fields["uncertainties"])
    fields["sums"] = _each(Sums, fields["sums"])
    fields["levels"] = _each(Level, fields["levels"])
    now, coming, proved, age = fields["baseline"]
    fields["baseline"] = Baseline(
        _each(Coefficients, now), _each(Coefficients, coming), _each(Coefficients, proved), age
    )
    fields["tested"] = _each(Block, fields["tested"])
    fields["colours"] = _each(Colour, fields["colours"])
    fields["blocks"] = _each(Block, fields["blocks"])
    fields["pages"] = _each(Page, fields["pages"])
    fields["pages_before"] = _each(Page, fields["pages_before"])
    fields["finding"] = Finding(*fields["finding"])
    fields["stream"] = Stream(*_tuples(fields["stream"]))
    twins = _tuples(fields["twins"])
    copies = [tuple([PlantState(*one) for one in own]) for own in twins[:3]]
    fields["twins"] = Twins(copies[0], copies[1], copies[2], *twins[3:])
    values = Values(*_tuples(fields["values"]))
    fields["values"] = values._replace(
        parameters=parameters_of(values.now, plan), rival_parameters=parameters_of(values.rival or values.now, plan)
    )
    fields["heard"] = _tuples(fields["heard"])
    for name in ("voltages", "arrived", "scored"):
        fields[name] = tuple(fields[name])
    return CorrectorState(**fields)


def _instant(memory: list[Any], torque: list[float], sensitivities: list[Any]) -> Instant:
    state, since, held = memory
    kept = PlantMemory(PlantState(*state), list(since), [(front, rear) for front, rear in held])
    a, b, c = _each(Sensitivity, sensitivities)
    return Instant(kept, Torque(*torque), (a, b, c))


def _each(kind: Any, saved: list[Any]) -> tuple[Any, ...]:
    return tuple([kind(*_tuples(one)) for one in saved])
