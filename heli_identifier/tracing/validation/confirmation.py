"""Confirm what a search found: at other filter frequencies, in halves of the training data, on the held-out logs.

What fewer than :data:`STEADY` of the halves show is not shown: from :data:`POSSIBLE` on an effect is possible.

Named effects that were found beside an unknown torque have left to it what it explains better. Where no unknown torque
is confirmed, they are not the best that the catalogue can do, and what was found without one is checked in their place.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from heli_identifier.online import Estimate
from heli_identifier.tracing.predictive.judge import POSSIBLE, STEADY
from heli_identifier.tracing.search.agreement import agreement
from heli_identifier.tracing.search.horizontal import with_horizontal_offset
from heli_identifier.tracing.search.model import Model, without, without_unknown
from heli_identifier.tracing.search.selection import Selection
from heli_identifier.tracing.search.stability import effect_stability, unknown_stability
from heli_identifier.tracing.search.unknown import Unknown
from heli_identifier.tracing.search.verdict import Withdrawal
from heli_identifier.tracing.validation.held_out import HeldOut
from heli_identifier.tracing.validation.withdrawal import Validation, validate
from heli_plant.effects import Effect


@dataclass(frozen=True, eq=False)
class Confirmation:
    """What is left of a search.

    Attributes
    ----------
    selection : Selection
        The search, without its unknown torques if none of them is confirmed.
    validation : Validation
    agreed : mapping
        Per coefficient field and filter frequency [rad/s] the estimate.
    possible : tuple of (Effect, float)
        Effects that only some halves of the training data show, and the share of the halves.
    withdrawn : tuple of Withdrawal
    """

    selection: Selection
    validation: Validation
    agreed: Mapping[str, Mapping[float, Estimate]]
    possible: tuple[tuple[Effect, float], ...]
    withdrawn: tuple[Withdrawal, ...]


def confirm(selection: Selection, bandwidths: Sequence[float], held_out: HeldOut) -> Confirmation:
    """Check a search's model at other filter frequencies [rad/s], in halves of its data and on held-out logs."""
    model, agreed, unstable = agreement(with_horizontal_offset(selection.model), bandwidths)
    model, possible, unsteady = steady(model, selection.threshold)
    validation = validate(model, selection.null.model.fit, held_out, selection.threshold)
    withdrawn = (*unstable, *unsteady, *validation.withdrawn)
    if selection.model.unknowns and not validation.model.unknowns:
        again = confirm(replace(selection, last=selection.named), bandwidths, held_out)
        unknowns = tuple(one for one in withdrawn if one.name == "unknown")
        return replace(again, withdrawn=(*unknowns, *again.withdrawn))
    return Confirmation(selection, validation, agreed, tuple(possible), withdrawn)


def steady(model: Model, threshold: float) -> tuple[Model, list[tuple[Effect, float]], list[Withdrawal]]:
    """Take out of a model, the least steady first, what too few halves of the training data show.

    Returns
    -------
    model : Model
    possible : list of (Effect, float)
        Effects that many halves show all the same, and their share.
    withdrawn : list of Withdrawal
        The others, and unknown torques.
    """
    possible, withdrawn = [], []
    while model.effects or model.unknowns:
        shares: list[tuple[float, Effect | Unknown]] = [
            *((effect_stability(model, effect, threshold), effect) for effect in model.effects),
            *((unknown_stability(model, index), unknown) for index, unknown in enumerate(model.unknowns)),
        ]
        share, least = min(shares, key=lambda row: row[0])
        if share >= STEADY:
            break
        if isinstance(least, Effect) and share >= POSSIBLE:
            possible.append((least, share))
        else:
            few, asked = (f"{100.0 * part:.0f} %" for part in (share, STEADY))
            why = f"only {few} of the halves of the training data show it, of {asked} asked"
            withdrawn.append(Withdrawal(least.name, least.axis, why))
        model = without(model, least) if isinstance(least, Effect) else without_unknown(model, least)
    return model, possible, withdrawn
