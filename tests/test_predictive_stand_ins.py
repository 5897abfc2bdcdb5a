"""What could take the place of a predictive family: an alias can, an independent one or one of another axis cannot."""

import numpy as np
import pytest

from heli_identifier.tracing.predictive.judge import Judge
from heli_identifier.tracing.predictive.quadratic import Quadratic
from heli_identifier.tracing.predictive.stand_ins import stand_ins

CAUSE, ALIAS, ELSEWHERE = "speed_stability_pitch", "constant_torque_pitch", "constant_torque_travel"
NAMES = ("base", CAUSE, ALIAS, ELSEWHERE)


def judge(correlation, seed=0, blocks=24, rows=30):
    """Judge of rows with unit noise in which ``CAUSE`` acts, and ``ALIAS`` has a ``correlation`` with it."""
    random = np.random.default_rng(seed)
    J = random.standard_normal((blocks, 3, rows, len(NAMES)))
    J[..., 2] = correlation * J[..., 1] + np.sqrt(1.0 - correlation**2) * J[..., 2]
    y = J @ np.array([1.0, 0.5, 0.0, 0.0]) + random.standard_normal((blocks, 3, rows))
    G, h = np.einsum("barp,barq->bapq", J, J), np.einsum("barp,bar->bap", J, y)
    wide = np.full(len(NAMES), np.inf)
    problem = Quadratic(
        G, h, (y**2).sum(axis=2), np.arange(blocks), float(y.size), -wide, wide,
    )  # fmt: skip
    return Judge(problem, NAMES, ("base",), {name: (name,) for name in NAMES[1:]})


def test_an_alias_is_a_stand_in():
    """Of two columns with a correlation of .9999 the noise of each half decides which one predicts the other better."""
    assert stand_ins(judge(0.9999), {CAUSE: CAUSE}) == {CAUSE: (ALIAS,)}


@pytest.mark.parametrize("correlation", [0.0, 0.9])
def test_what_the_data_tell_apart_is_none(correlation):
    """At .9 the alias leaves .19 of the cause's .25 of a unit variance: 2160 rows of unit noise show it in halves."""
    assert stand_ins(judge(correlation), {CAUSE: CAUSE}) == {CAUSE: ()}


def test_what_acts_on_another_axis_is_none_however_alike():
    alike = judge(0.9999)
    elsewhere = Judge(alike.quadratic, ("base", CAUSE, ELSEWHERE, ALIAS), ("base",), alike.families)
    assert stand_ins(elsewhere, {CAUSE: CAUSE}) == {CAUSE: ()}


def test_what_is_named_itself_is_none():
    named = {CAUSE: CAUSE, ALIAS: ALIAS}
    assert all(not found for found in stand_ins(judge(0.9999), named).values())
