"""Tables 1 and 2 and the histories from synthetic runs: ranges, deviations, and what is left out."""

import csv

import numpy as np
import pytest

from heli_identifier.results.style import figure_text
from heli_identifier.workbench.paper.histories import ELEVATION_AND_TRAVEL, histories
from heli_identifier.workbench.paper.published import EXPERIMENTS, PITCH, TABLE_1, TRUTH, UNITS
from heli_identifier.workbench.paper.runs import (
    INITIAL_ESTIMATES,
    INITIAL_GAINS,
    JOINT_RUN,
    KNOWN,
    PITCH_RUN,
    Run,
    order_of,
    twelve_starts,
)
from heli_identifier.workbench.paper.tables import (
    CERTAIN_GAIN,
    deviation,
    found_range,
    table_2,
    write_table,
    write_table_1,
    write_table_2,
)


def run_that_is_off_by(share, kind, experiment, start):
    """A run of three seconds that approaches Table 2 but for a relative ``share``."""
    truth = np.array(TRUTH)
    history = np.outer([0.0, 0.5, 1.0 + share], truth)
    return Run(kind, experiment, start, np.arange(3.0), {name: history for name in kind.identifiers}, np.zeros(3))


@pytest.fixture(scope="module")
def runs():
    """Pitch and joint runs; each is off by 1 % / number, those of a low Gamma(0) by ten times that."""
    made = {}
    for kind in (PITCH_RUN, JOINT_RUN):
        made[kind.name] = [
            run_that_is_off_by(0.01 / start.number * (1.0 if start.gain >= CERTAIN_GAIN else 10.0), kind, e, start)
            for e in EXPERIMENTS
            for start in twelve_starts(e)
        ]
    return made[PITCH_RUN.name], made[JOINT_RUN.name]


def table(path):
    with path.open() as file:
        return list(csv.DictReader(file))


def test_twelve_runs_differ_in_omega_gamma_and_start():
    starts = twelve_starts(1)
    assert [start.number for start in starts] == list(range(1, 13))
    assert len({(start.omega, start.gain) for start in starts}) == 12
    assert len({start.angles + start.rates for start in (*starts, *twelve_starts(2))}) == 24
    assert starts == twelve_starts(1)
    assert {start.gain for start in starts} == set(INITIAL_GAINS)


def test_a_run_tells_theta0_to_one_identifier_only():
    order = order_of(PITCH_RUN, 2, twelve_starts(2)[4])
    assert order["known.pitch.rest_angle_known"] is True
    assert order["estimated.pitch.rest_angle_known"] is False
    assert order["plant.encoder.enabled"] is True
    assert order["estimated.adaptation.initial_gain"] == twelve_starts(2)[4].gain
    assert not [name for name in order if name.startswith("plant.effects")]


def test_the_initial_estimates_are_guesses_and_not_the_truth():
    for guess in INITIAL_ESTIMATES.values():
        shares = [abs(value / true - 1.0) for value, true in zip(guess, TRUTH, strict=True)]
        assert min(shares) > 0.05


def test_a_range_spans_the_final_estimates(runs):
    pitch_runs, _ = runs
    found = found_range(pitch_runs, 1, "a_th", KNOWN)
    # Run 2 is the first of a low Gamma(0), off by 5 %; run 1 by 10 %; run 12 by .01/12, the least.
    assert found.highest == pytest.approx(TRUTH.a_th * 1.10)
    assert found.lowest == pytest.approx(TRUTH.a_th * (1.0 + 0.01 / 12))


def test_table_1_has_the_paper_s_ranges_beside_the_found_ones(runs, tmp_path):
    write_table_1(runs[0], tmp_path)
    rows = table(tmp_path / "table1.csv")
    assert len(rows) == 2 * (3 + 4)
    row = next(r for r in rows if (r["experiment"], r["theta0"], r["parameter"]) == ("2", "known", "k_x"))
    assert (float(row["paper lowest"]), float(row["paper highest"])) == TABLE_1[2]["k_x"]
    assert float(row["largest deviation [%]"]) == pytest.approx(10.0)
    assert row["unit"] == UNITS["k_x"] == "rad/s^2/V"
    every = table(tmp_path / "table1_runs.csv")
    assert len(every) == 24 * 2
    assert float(every[0]["a_wx [1/s]"]) == pytest.approx(TRUTH.a_wx * 1.10)


def test_table_2_takes_the_runs_whose_gain_has_forgotten_the_start(runs, tmp_path):
    rows = {row.name: row for row in table_2(*runs)}
    assert tuple(rows) == TRUTH._fields
    certain = [0.01 / start.number for start in twelve_starts(1) if start.gain >= CERTAIN_GAIN]
    for row in rows.values():
        assert row.deviation == pytest.approx(np.mean(certain))
        assert row.worst == pytest.approx(max(certain))
    write_table_2(*runs, tmp_path)
    assert len(table(tmp_path / "table2.csv")) == 11
    recovery = table(tmp_path / "recovery.csv")
    assert [float(row["Gamma(0)"]) for row in recovery] == [*INITIAL_GAINS, *INITIAL_GAINS]
    # Of Gamma(0) = 1e3 there are runs 1, 5 and 9.
    assert float(recovery[0]["k_y worst deviation [%]"]) == pytest.approx(10.0)


def test_a_deviation_of_a_negative_parameter_is_one_of_its_size():
    assert deviation(1.01 * TRUTH.k_y, "k_y") == pytest.approx(0.01)
    assert deviation(TRUTH.theta0, "theta0") == 0.0


def test_histories_show_every_parameter_in_both_experiments(runs, tmp_path):
    figures = histories(*runs, tmp_path)
    assert sorted(figures) == [f"figure{n}_experiment{e}" for n in (2, 5) for e in EXPERIMENTS]
    text = figure_text(figures["figure5_experiment1"])
    for name in ELEVATION_AND_TRAVEL:
        assert name in text
    assert text == figure_text(histories(*runs, tmp_path)["figure5_experiment1"])
    rows = table(tmp_path / "figure2.csv")
    assert len(rows) == 24 * 3
    assert {f"{name} [{UNITS[name]}]" for name in PITCH} <= set(rows[0])


def test_a_table_quotes_what_holds_a_comma_and_refuses_a_ragged_row(tmp_path):
    path = write_table(tmp_path / "t.csv", ("a", "b"), [("x, y", 1.0 / 3.0)])
    assert path.read_text() == 'a,b\n"x, y",0.333333\n'
    with pytest.raises(ValueError, match="a row of 1 cells under a header of 2"):
        write_table(path, ("a", "b"), [("x",)])
