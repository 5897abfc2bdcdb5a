"""The spread of the paper's Table 1: a known cause is found again, at its size, and ranked first."""

import numpy as np
import pytest

from heli_identifier.workbench.paper.pitch_experiment import PitchEstimate
from heli_identifier.workbench.paper.published import PITCH, TABLE_1
from heli_identifier.workbench.paper.spread import (
    HALF_WIDTHS,
    MIDDLES,
    candidates,
    explain,
    explain_without,
    residuals,
    search,
    write_spread,
)
from heli_plant.effects import effect

CAUSE = effect("constant_torque", "pitch")
SECOND = effect("input_delay", "rotors")
IDLE = effect("dead_zone", "rotors")
OWN = np.array([0.05, 0.70, 0.25])
# What each effect does to (a_wx, a_th, k_x) of experiments 1 and 2 per unit of its coefficient, made up so that the
# cause at .1 and the second at .03 lead from OWN to the paper's midpoints.
BY_SECOND = np.array([[0.2, 0.0, 0.0], [0.3, 0.1, -0.2]])
BY_CAUSE = (MIDDLES - OWN - 0.03 * BY_SECOND) / 0.1


def stand_in(plant, experiment):
    """An identification whose bias is linear in the effects' coefficients."""
    own = np.array([getattr(plant, name) for name in PITCH])
    bias = BY_CAUSE * plant.constant_torque_pitch + BY_SECOND * plant.input_delay_rotors
    return PitchEstimate(*(own + bias[experiment - 1]).tolist())


def test_two_experiments_on_a_plant_without_an_effect_meet_in_the_weighted_mean():
    found = explain_without(stand_in)
    weights = HALF_WIDTHS**-2.0
    mean = (weights * MIDDLES).sum(axis=0) / weights.sum(axis=0)
    # Linear least squares ends at its closed form; the solver stops at a relative 1e-8 of the cost.
    assert found.own == pytest.approx(mean.tolist(), rel=1e-6)
    assert found.misfit == pytest.approx(float(np.sqrt(np.mean(((mean - MIDDLES) / HALF_WIDTHS) ** 2))), rel=1e-9)


def test_the_paper_s_experiments_differ_by_more_than_their_ranges():
    for name in PITCH:
        first, second = TABLE_1[1][name], TABLE_1[2][name]
        assert first.highest < second.lowest or second.highest < first.lowest
    assert explain_without(stand_in).misfit > 2.0  # half widths, for one plant between both


def test_the_cause_is_found_at_its_size_on_top_of_the_other():
    found = explain(stand_in, CAUSE, explain(stand_in, SECOND, explain_without(stand_in)))
    # Zero residual: Gauss-Newton on a linear map is exact but for the differences' rounding.
    assert dict(zip((e.name for e in found.effects), found.coefficients, strict=True)) == pytest.approx(
        {"constant_torque": 0.1, "input_delay": 0.03}, rel=1e-4
    )
    assert found.own == pytest.approx(OWN.tolist(), rel=1e-4)
    assert found.misfit < 1e-3
    assert found.inside == 6


def test_the_search_ranks_the_causes_before_an_effect_without_influence(tmp_path):
    found = search(stand_in, (IDLE, SECOND, CAUSE))
    assert {effect.name for effect in found[0].effects} == {"constant_torque", "input_delay"}
    single = [one.effects[0].name for one in found if len(one.effects) == 1]
    assert single == ["constant_torque", "input_delay", "dead_zone"]
    misfits = [one.misfit for one in found]
    assert misfits == sorted(misfits)
    write_spread(found, tmp_path / "spread.csv")
    lines = (tmp_path / "spread.csv").read_text().splitlines()
    assert len(lines) == 2 + len(found)
    assert len({line.count(",") for line in lines}) == 1
    assert lines[2].startswith("constant_torque,pitch,0.1,rad/s^2,input_delay,rotors,0.03,s,")


def test_a_coefficient_keeps_to_its_sign_rule():
    def backwards(plant, experiment):
        drag = plant._replace(constant_torque_pitch=-plant.quadratic_drag_pitch)
        return stand_in(drag, experiment)

    found = explain(backwards, effect("quadratic_drag", "pitch"), explain_without(backwards))
    # The data ask for -.1; a drag may not drive, so that it ends at zero and helps nothing.
    assert found.coefficients[0] == pytest.approx(0.0, abs=1e-6)
    assert found.misfit == pytest.approx(explain_without(backwards).misfit, rel=1e-6)


def test_a_plant_that_runs_away_is_a_bad_explanation_and_no_error():
    def fragile(plant, experiment):
        if abs(plant.constant_torque_pitch) > 0.05:
            return PitchEstimate(float("nan"), float("nan"), float("nan"))
        return stand_in(plant, experiment)

    found = explain(fragile, CAUSE, explain_without(fragile))
    assert abs(found.coefficients[0]) <= 0.05
    assert np.isfinite(residuals(found.estimates)).all()


def test_every_entry_that_reaches_the_pitch_is_tried():
    names = {(entry.name, entry.axis) for entry in candidates()}
    assert {("dry_friction", "pitch"), ("rotor_mismatch", "pitch"), ("motor_lag", "rotors")} <= names
    assert all(axis in ("pitch", "rotors") for _, axis in names)
    assert len(names) == 15
