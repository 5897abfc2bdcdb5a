"""Families that could take the place of a predictive one, which the logs do not tell apart from it.

Beside the other predictive families, a fit with either of the two is made to one half of the data and judged by its
loss on the other half. A family is a stand-in if it would be named in the other's place, and loses there in fewer of
the halves than make a finding steady.
"""

from collections.abc import Mapping

from heli_identifier.tracing.predictive.judge import STEADY, Judge
from heli_plant.effects import effect_of

NOT_DECIDED = 1.0 - STEADY
"""Share of the halves, above which the worse of two families still predicts as well as the better one too often."""


def stand_ins(judge: Judge, fields: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """Find the stand-ins of each predictive family.

    Parameters
    ----------
    judge : Judge
        Of the quadratic problem around the fit with the predictive families.
    fields : mapping of str to str
        The coefficient that represents each of them.

    Returns
    -------
    dict of str to tuple of str
        By family, the coefficients that represent its stand-ins. Each acts on an axis that the family acts on.
    """
    return {name: _of(name, judge, fields) for name in fields}


def _of(name: str, judge: Judge, fields: Mapping[str, str]) -> tuple[str, ...]:
    others = [other for other in fields if other != name]
    axes = set(effect_of(fields[name]).axes)
    found = []
    for rival in judge.families.keys() - fields.keys():
        field = judge.best(rival, others)
        if not axes & set(effect_of(field).axes):
            continue
        alone = judge.with_single({**fields, rival: field})
        beside = [*others, rival]
        if not alone.support([rival], beside)[rival].enough or alone.stability([rival], beside)[rival] < STEADY:
            continue
        if alone.as_good(beside, [*others, name]) > NOT_DECIDED:
            found.append(field)
    return tuple(sorted(found))
