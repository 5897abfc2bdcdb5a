"""The paper's experiments in small: the units recover Table 2, and a known cause of the spread is found again."""

import csv

import numpy as np
import pytest

from benchmarks.paper import __main__ as paper
from benchmarks.paper.spread import (
    EXPERIMENTS,
    HALF_WIDTHS,
    MIDDLES,
    PITCH,
    RANGES,
    candidates,
    estimates_under_torque,
    explain,
    explained,
    fitted,
    identify_pitch,
    random_torque,
    residuals,
    search,
    spread_table,
)
from benchmarks.replay import replay
from heli_identifier.online import IdentifierSettings
from heli_plant.effects import effect
from heli_plant.parameters import TABLE_2

CAUSE, SECOND, IDLE = (
    effect(*key) for key in (("constant_torque", "pitch"), ("input_delay", "rotors"), ("dead_zone", "rotors"))
)
OWN = np.array([0.05, 0.70, 0.25])
# What each effect does to (a_wx, a_th, k_x) of experiments 1 and 2 per unit of its coefficient, made up so that the
# cause at .1 and the second at .03 lead from OWN to the paper's midpoints.
BY_SECOND = np.array([[0.2, 0.0, 0.0], [0.3, 0.1, -0.2]])
BY_CAUSE = (MIDDLES - OWN - 0.03 * BY_SECOND) / 0.1


def stand_in(plant, experiment):
    """An identification whose bias is linear in the effects' coefficients."""
    own = np.array([getattr(plant, name) for name in PITCH])
    return own + (BY_CAUSE * plant.constant_torque_pitch + BY_SECOND * plant.input_delay_rotors)[experiment - 1]


def without_effect(identify):
    return explained(identify, (), fitted(identify, (), MIDDLES.mean(axis=0), 30)[0])


def short(kind):
    return paper.Kind(kind.name, kind.channel, kind.base, 40.0, kind.identifiers)


def table(path):
    with path.open() as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_runs_of_forty_seconds_recover_the_pitch_and_leave_all_tables_and_figures(tmp_path):
    """Two starts, Gamma(0) = 1e5 and 1e6."""
    paper.reproduce(tmp_path / "new", (short(paper.JOINT_RUN), short(paper.PITCH_RUN)), (3, 12))
    figures = {f"figure{n}_experiment{e}.svg" for n in (2, 5) for e in EXPERIMENTS} | {"figure3.svg", "figure4.svg"}
    data = {"table1.csv", "table1_runs.csv", "table2.csv", "recovery.csv", *(f"figure{n}.csv" for n in (2, 3, 4, 5))}
    assert {path.name for path in (tmp_path / "new").iterdir()} == figures | data
    # Thirty seconds of adaptation hold a seventh of the information of two hundred, which leave some .05 %: .35 %,
    # and a margin for the chance of two starts.
    assert max(float(row["largest deviation [%]"]) for row in table(tmp_path / "new" / "table1.csv")) < 1.0
    beside = np.loadtxt(tmp_path / "new" / "figure3.csv", delimiter=",", skiprows=1)
    # A percent of the motion, which is near 1 rad, and half a count of the encoder (.8 mrad).
    assert 0.5 < np.abs(beside[:, 1]).max()
    assert np.abs(beside[:, 1] - beside[:, 2]).max() < 0.01 + 8e-4
    steps = table(tmp_path / "new" / "figure4.csv")
    for rig in ("plant", "identified", "paper_1", "paper_2"):
        # The integral's pole near .5 1/s leaves exp(-10) of the step; the encoder keeps the loop within two counts.
        assert float(steps[-1][f"{rig} pitch [rad]"]) == pytest.approx(paper.PITCH_STEP, abs=4e-3)


def test_the_units_estimate_what_the_library_estimates_from_the_same_record(fmus):
    """The twin identifiers of a run are two replays of one record, with theta0 known and estimated."""
    from fmu_src.master import run_apart

    start, kind = paper.twelve_starts(1)[6], paper.Kind("pitch", 1, 0.5, 20.0, (paper.KNOWN, paper.FREE))
    run = paper.run_once(kind, 1, start, fmus)
    files = {"exciter": fmus["Exciter"], "plant": fmus["HelicopterPlant"], "identifier": fmus["AdaptiveIdentifier"]}
    record = run_apart("open_loop", kind.duration, paper.STEP, paper.parameters_of(kind, 1, start), files)
    angles = record.columns("plant.pitch", "plant.elevation", "plant.travel")
    voltages = record.columns("exciter.v_front", "exciter.v_rear")
    for name, rest_angle in ((paper.KNOWN, paper.TRUTH.theta0), (paper.FREE, None)):
        gains = {"initial_gain": start.gain, "gain_limit": start.gain, "initial": paper.OMEGAS[start.omega]}
        settings = IdentifierSettings(rest_angle=rest_angle, **gains)
        expected = replay(voltages[:-1], angles[:-1], settings, every=100).final
        # Outputs at t_k have used the samples before it; compiled sums may round differently.
        assert run.estimates[name][-1][:4] == pytest.approx(expected[:4], rel=1e-6)


def test_twelve_runs_differ_in_omega_gamma_and_start():
    starts = [*paper.twelve_starts(1), *paper.twelve_starts(2)]
    assert [start.number for start in starts] == [*range(1, 13)] * 2
    assert len({(start.omega, start.gain) for start in starts}) == 12
    assert len({start.angles + start.rates for start in starts}) == 24


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_both_experiments_give_table_2_on_a_plant_that_obeys_the_model(experiment):
    # Exact angles, Gamma(0) = 1e6: what is left is the straight line between samples, h^2 / 12 of the fastest motion
    # (2 Hz): (.01 * 12.6)^2 / 12 = .13 % of a chirp that carries a tenth of the power.
    assert identify_pitch(TABLE_2, experiment) == pytest.approx([getattr(TABLE_2, name) for name in PITCH], rel=5e-4)


def test_a_steady_torque_and_a_delay_split_the_experiments_as_the_paper_s_are_split():
    # Rounded from what the search through the catalogue ends with.
    own = {"a_wx": 0.0518, "a_th": 0.787, "k_x": 0.2307}
    biased = TABLE_2._replace(**own, constant_torque_pitch=0.094, input_delay_rotors=0.032)
    found = np.array([identify_pitch(biased, experiment) for experiment in EXPERIMENTS])
    assert ((RANGES[..., 0] < found) & (found < RANGES[..., 1])).all()


def test_a_plant_that_runs_away_is_a_bad_explanation_and_no_error():
    assert np.isnan(identify_pitch(TABLE_2._replace(a_wx=-10.0, a_th=-100.0), 1, duration=100.0)).all()
    assert np.isfinite(residuals(np.full((2, 3), np.nan))).all()


def test_the_random_torque_has_the_strength_and_memory_that_were_asked_for():
    deviation, tau, count = 0.02, 0.5, 400_000
    torque = random_torque(deviation, tau, count, seed=1)
    independent, lag = count * paper.STEP / (2.0 * tau), round(tau / paper.STEP)
    # Standard error of a standard deviation: 1 / sqrt(2 n) of it, here .011; four of them.
    assert torque.std() == pytest.approx(deviation, rel=4.0 / np.sqrt(2.0 * independent))
    # Bartlett: the standard error of a correlation is below sqrt(2 / n) with n independent stretches.
    correlation = float(torque[lag:] @ torque[:-lag]) / float(torque @ torque)
    assert correlation == pytest.approx(np.exp(-1.0), abs=4.0 * np.sqrt(2.0 / independent))


def test_a_weak_torque_widens_the_ranges_in_proportion():
    weak, twice = (np.ptp(estimates_under_torque(1.0, s, runs=4, duration=60.0), axis=1) for s in (1e-4, 2e-4))
    # First order in the torque; what is of second order is a share of some 1e-4 / .1 of it.
    np.testing.assert_allclose(twice, 2.0 * weak, rtol=0.05)


def test_two_experiments_on_a_plant_without_an_effect_meet_in_the_weighted_mean():
    found, weights = without_effect(stand_in), HALF_WIDTHS**-2.0
    # Linear least squares ends at its closed form; the solver stops at a relative 1e-8 of the cost.
    assert found.own == pytest.approx(((weights * MIDDLES).sum(axis=0) / weights.sum(axis=0)).tolist(), rel=1e-6)
    assert found.misfit > 2.0  # half widths: no plant gives both of the paper's experiments


def test_the_search_finds_the_causes_at_their_size_before_an_effect_without_influence():
    found = search((IDLE, SECOND, CAUSE), stand_in)
    best = found[0]
    # Zero residual: Gauss-Newton on a linear map is exact but for the differences' rounding.
    assert dict(zip((e.name for e in best.effects), best.coefficients, strict=True)) == pytest.approx(
        {"constant_torque": 0.1, "input_delay": 0.03}, rel=1e-4
    )
    assert best.misfit < 1e-3
    assert [one.effects[0].name for one in found if len(one.effects) == 1][-1] == "dead_zone"
    header, rows = spread_table(found)
    assert {len(row) for row in rows} == {len(header)}
    assert ("motor_lag", "rotors") in {(entry.name, entry.axis) for entry in candidates()}


def test_a_coefficient_keeps_to_its_sign_rule():
    def backwards(plant, experiment):
        return stand_in(plant._replace(constant_torque_pitch=-plant.quadratic_drag_pitch), experiment)

    # The data ask for -.1; a drag may not drive, so that it ends at zero and helps nothing.
    found = explain(backwards, effect("quadratic_drag", "pitch"), without_effect(backwards))
    assert found.coefficients[0] == pytest.approx(0.0, abs=1e-6)
