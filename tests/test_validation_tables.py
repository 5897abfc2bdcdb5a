"""An unknown curve that improves the predictions of held-out logs is part of the corrected plant, as a table."""

from functools import cache

import numpy as np
import pytest

from heli_identifier.tracing.prediction.ahead import prediction_starts
from heli_identifier.tracing.prediction.fit import fit
from heli_identifier.tracing.prediction.problem import Problem
from heli_identifier.tracing.prediction.smoothed_state import smoothed_states
from heli_identifier.tracing.prediction.start import first_estimate
from heli_identifier.tracing.search.model import Model, with_unknown
from heli_identifier.tracing.search.selection import score_catalogue
from heli_identifier.tracing.search.tabulation import table_of
from heli_identifier.tracing.search.unknown import fit_periodic, search
from heli_identifier.tracing.validation.held_out import hold_out
from heli_identifier.tracing.validation.plants import Plants
from heli_identifier.tracing.validation.prediction import prediction_errors
from heli_identifier.tracing.validation.tables import reason_against, with_tables
from heli_plant.parameters import TABLE_2
from heli_plant.plant import advance, measured_angles
from heli_plant.specialised import specialised
from heli_plant.state import PlantState
from heli_plant.tabulated_torque import KNOTS
from tests.online_record import H
from tests.simulated import drive, noisy

pytestmark = pytest.mark.slow

SWING, WAVES = 0.3, 3.0


def wavy(k, state):
    """A torque on the elevation that no entry of the catalogue gives [rad/s^2]."""
    return (0.0, SWING * np.sin(WAVES * state.elevation), 0.0)


def flown(seed, law=wavy):
    return noisy(TABLE_2, drive(60.0, seed), seed, law, name=f"log{seed}")


@cache
def found():
    """Null model and the model with the unknown curve, of two training logs."""
    problem = Problem((flown(1), flown(2)))
    null = fit(problem, first_estimate(problem.records, TABLE_2))
    unknown = search(null, score_catalogue(Model(null)).noise_whitener)[0]
    assert (unknown.axis, unknown.variable) == ("elevation", "elevation")
    return null, with_unknown(Model(null), unknown)


@cache
def plants():
    return Plants(found()[0])


@cache
def without_table():
    return plants().of(found()[1])


@cache
def tabled(law):
    return with_tables(found()[1], without_table(), plants(), hold_out([flown(3, law)], 4.0))


def mirrored(k, state):
    """The torque mirrored at the line by which the parameters of the plant without a table imitate it."""
    imitating = without_table().parameters
    line = (TABLE_2.a_e - imitating.a_e) * state.elevation + TABLE_2.a_1 - imitating.a_1
    return (0.0, 2.0 * line - wavy(k, state)[1], 0.0)


def true_errors(record):
    """Errors (S, 3) [rad] of the true plant's predictions 1 s ahead: Table 2 with the law itself, step by step."""
    steps = round(1.0 / H)
    starts = prediction_starts(record, steps)
    states, plant = smoothed_states(record, TABLE_2)[starts], specialised(advance, TABLE_2._asdict())
    time, voltages = record.time.tolist(), [tuple(row) for row in record.voltages.tolist()]
    errors = []
    for first, row in zip(starts, states, strict=True):
        state = PlantState(*row.tolist())
        for k in range(first, first + steps):
            d = float(wavy(k, state)[1])
            state = plant(state, time, voltages, k, 0.0, H, TABLE_2)
            state = state._replace(
                elevation=state.elevation + 0.5 * H * H * d, elevation_rate=state.elevation_rate + H * d
            )
        errors.append(record.angles[first + steps] - np.array(measured_angles(state)))
    return np.array(errors)


def rms(errors):
    return np.sqrt(np.mean(np.square(np.concatenate(errors)), axis=0))


def test_the_corrected_plant_predicts_unseen_logs_nearly_as_well_as_the_true_one():
    """1.2 is the bar; parameters from two minutes of logs alone cost some per cent."""
    with_curve, without = tabled(wavy), without_table()
    unseen = [flown(seed) for seed in (4, 5)]
    truth = rms([true_errors(record) for record in unseen])
    own = rms([prediction_errors(record, with_curve.plant.parameters, 1.0) for record in unseen])
    bare = rms([prediction_errors(record, without.parameters, 1.0) for record in unseen])
    assert (own < 1.2 * truth).all()
    assert bare[1] > 3.0 * truth[1]  # what the parameters alone cannot imitate


def test_its_table_is_the_torque_up_to_what_the_model_has_itself():
    """A constant and a term linear in the elevation belong to a_1 and a_e."""
    with_curve = tabled(wavy)
    (curve,) = with_curve.curves
    p = with_curve.plant.parameters
    x = p.table_first_elevation + p.table_spacing_elevation * np.arange(KNOTS)
    y = np.array([getattr(p, f"table_torque_{k}_elevation") for k in range(1, KNOTS + 1)])
    own = np.column_stack((np.ones(KNOTS), x))
    left = y - SWING * np.sin(WAVES * x)
    left -= own @ np.linalg.lstsq(own, left, rcond=None)[0]
    errors = np.array(
        [with_curve.plant.estimates[f"table_torque_{k}_elevation"].standard_error for k in range(1, KNOTS + 1)]
    )
    # 4 standard errors, and in the middle, where most samples are, a twentieth of the torque
    assert (np.abs(left) < 4.0 * errors + 0.02 * SWING).all()
    assert np.abs(left[4:-4]).max() < 0.05 * SWING
    assert p.table_variable_elevation == 2.0
    assert (p.table_variable_pitch, p.table_variable_travel) == (0.0, 0.0)
    # with what the model has of it, it is the whole torque
    slope = np.polyfit(x[4:-4], (y - SWING * np.sin(WAVES * x))[4:-4], 1)[0]
    assert p.a_e - slope == pytest.approx(TABLE_2.a_e, rel=0.03)


def test_a_curve_that_predicts_the_held_out_logs_worse_stays_out_with_the_figure():
    """Held-out logs of a rig on which the torque acts the other way."""
    other = tabled(mirrored)
    assert other.curves == ()
    assert other.plant is without_table()
    ((unknown, why),) = other.left_out
    assert unknown.axis == "elevation"
    assert why.startswith("with it the mean squared prediction error of the elevation on the held-out logs is ")


def test_a_table_may_cost_other_axes_no_more_than_chance():
    assert reason_against(np.array([1.04, 0.9, 1.0]), {"elevation"}) == ""
    assert "pitch" in reason_against(np.array([1.2, 0.9, 1.0]), {"elevation"})
    assert "elevation" in reason_against(np.array([1.0, 1.01, 1.0]), {"elevation"})
    assert "travel" in reason_against(np.array([1.0, 0.5, np.inf]), {"elevation"})


def test_a_periodic_torque_has_no_table():
    null, _ = found()
    unknown = fit_periodic(null, 1, 0.37)
    with pytest.raises(ValueError, match=r"a periodic torque of 0.37 Hz has no table"):
        table_of(Model(null, (), (unknown,)), 0)
