"""The blind battery as a campaign: what its rigs hold, what is measured with the truth at hand, and its figures."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from benchmarks.blind import bars
from benchmarks.rigs import blind_rig, measured, true_structure
from heli_identifier.tools import TrueEffect, TrueUnknown, Truth
from heli_identifier.tools.campaign_rows import complete, truth_columns
from tests.blind.generator import Case
from tests.blind.rigs import STRENGTHS, draw_rig


def found(name, axis, variable=None):
    coefficient = None if variable else 0.02
    return {
        "name": name, "axis": axis, "coefficient": coefficient, "standard_error": coefficient and 0.001, "score": 20.0,
        "verdict": "shown", "alternatives": [], "variable": variable, "frequency_hz": None,
    }  # fmt: skip


def row(rig, true, *effects, verdict="effects shown", told=None, nats=30.0):
    measures = {"told_score": told} if told else {}
    return complete(
        {"rig": rig, "key": rig, "verdict": verdict, "effects": list(effects), "seconds": 9.0, "measures": measures}
        | {"held_out_nats": nats}
        | truth_columns(true)
    )


FRICTION = Truth("dry_friction", {}, (TrueEffect("dry_friction", "pitch", 0.02),))
PAIR = replace(FRICTION, effects=(*FRICTION.effects, TrueEffect("cable_stiffness", "travel", 0.006)))
DETENT = Truth("unknown:detent", unknown=TrueUnknown("pitch", "pitch"))
CLEAN = Truth("clean")


# --- rigs --------------------------------------------------------------------------------------------------------


def test_logs_of_a_rig_carry_no_word_of_its_truth():
    rig = blind_rig("single", "moving_mass", 20, 1.0, 0)
    assert [log.name for log in (*rig.training, *rig.held_out)] == ["train1", "train2", "train3", "held"]
    assert {(log.path, log.sha256, log.notes, len(log.extra)) for log in rig.training} == {("", "", (), 0)}
    made = Case("single", "moving_mass", 20).rig(0)
    assert rig.training[2].angles == pytest.approx(made.train[2][:, 3:])
    assert rig.held_out[0].voltages == pytest.approx(made.held[:, 1:3])


@pytest.mark.parametrize("kind", STRENGTHS)
def test_catalogue_knows_every_effect_of_the_battery(kind):
    drawn = draw_rig(3, kind)
    told = true_structure(kind, drawn)
    assert [(e.name, e.axis) for e in told.effects] == [(e.name, e.axis) for e in drawn.effects]


def test_unknown_torque_is_told_by_axis_and_variable():
    rig = blind_rig("unknown", "unknown:periodic", 20, 1.0, 0)
    assert rig.truth.unknown == TrueUnknown(Case("unknown", "unknown:periodic", 20).rig(0).truth.unknown.axis, "time")


# --- measures ----------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_test_that_is_told_the_effect_sees_it_and_a_clean_rig_has_none():
    rig = blind_rig("single", "quadratic_drag:pitch", 20, 1.0, 0)
    # the weak rigs of the battery have a third of this strength and score some ten nats; this one ten times as much
    assert measured(rig, SimpleNamespace())["told_score"] > 50.0
    assert measured(blind_rig("clean", "clean", 200, 1.0, 0), SimpleNamespace()) == {}


# --- figures -----------------------------------------------------------------------------------------------------


GROUPED = {
    "clean": [row("c0", CLEAN, verdict="model adequate"), row("c1", CLEAN, found("motor_lag", "rotors"))],
    "single": [
        row("s0", FRICTION, found("dry_friction", "pitch"), told=30.0),
        row("s1", FRICTION, found("dry_friction", "pitch"), found("motor_lag", "rotors"), told=30.0, nats=20.0),
        row("s2", FRICTION, verdict="model adequate", told=30.0),
    ],
    "weak": [
        row("w0", FRICTION, verdict="model adequate", told=7.9),
        row("w1", FRICTION, found("dry_friction", "pitch"), told=8.1),
    ],
    "pair": [row("p0", PAIR, found("dry_friction", "pitch"), told=30.0)],
    "unknown": [
        row("u0", DETENT, found("unknown", "pitch", "pitch"), verdict="unknown effect"),
        row("u1", DETENT, found("dry_friction", "pitch")),
    ],
}


def shares():
    return {what: (own.hits, own.count, low <= own.hits / own.count <= high) for what, own, low, high in bars(GROUPED)}


def test_bars_count_what_they_say():
    counted = shares()
    assert counted["clean rigs accused of anything"] == (1, 2, False)
    assert counted["single effects named first"] == (2, 3, False)
    assert counted["single effects without a false one"] == (2, 3, False)
    assert counted["pairs: both named, nothing else"] == (0, 1, False)
    assert counted["unknown torques: right axis and variable"] == (1, 2, False)
    assert counted["unknown torques wrongly named"] == (1, 2, False)


def test_weak_effect_that_even_the_told_test_would_miss_is_not_held_against_the_tracer():
    assert shares()["weak effects (told: above 8) named first"] == (1, 1, True)
