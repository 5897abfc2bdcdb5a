"""Benchmarks: what is computed of the times, and what stands in the page."""

from importlib import import_module
from math import inf, nan

import numpy as np
import pytest

from benchmarks.__main__ import HEAD, MODULES
from benchmarks.adaptation import disagreement, padasip_omega, record, regressions, replay_omega
from benchmarks.campaign_speed import efficiency
from benchmarks.cost import effects_on, expected
from benchmarks.loop import bars as loop_bars
from benchmarks.loop import figures_of
from benchmarks.machine import processor
from benchmarks.page import assembled, section_of
from benchmarks.printed import Printed
from benchmarks.replay import replay
from benchmarks.simulation import bars as simulation_bars
from benchmarks.soak_run import CASES, GAIN_LIMIT
from benchmarks.tables import Bar, bar_table, figure, seconds, table
from benchmarks.timing import Times, in_turn, ratio
from heli_identifier.online import IdentifierSettings
from heli_plant.effects import CATALOGUE
from tests.faults.case import ROOT

# --- times -------------------------------------------------------------------------------------------------------


def test_contenders_take_turns_in_every_round():
    order = []
    times = in_turn({name: lambda name=name: order.append(name) for name in "ab"}, rounds=3)
    assert order == ["a", "b"] * 4  # one round before is not timed
    assert {name: t.rounds for name, t in times.items()} == {"a": 3, "b": 3}


def test_one_slow_round_moves_neither_median_nor_ratio():
    own, other = Times((1.0, 1.0, 90.0)), Times((5.0, 80.0, 5.0))
    assert (own.median, own.least) == (1.0, 1.0)
    assert ratio(other, own) == 5.0
    assert ratio(other.scaled(10.0), own) == 50.0


def test_times_of_no_round_are_refused():
    with pytest.raises(ValueError, match="at least one"):
        Times(())


def test_two_workers_in_half_the_time_are_fully_efficient():
    assert efficiency(Times((60.0,)), Times((30.0,))) == 1.0
    assert efficiency(Times((60.0,)), Times((60.0,))) == 0.5


# --- tables ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0.00"), (0.26571, "0.266"), (1.0, "1.00"), (14.62, "14.6"), (188.7, "189"), (6e-9, "6.00e-09"),
     (50_200.0, "50200"), (0.99999, "1.00"), (-3.5, "-3.50"), (nan, "none")],
)  # fmt: skip
def test_a_figure_has_three_digits(value, text):
    assert figure(value) == text


@pytest.mark.parametrize(("value", "text"), [(46.9, "46.9 s"), (0.00174, "1.74 ms"), (1.45e-6, "1.45 us")])
def test_a_time_has_the_unit_that_suits_it(value, text):
    assert seconds(value) == text


def test_a_bar_on_its_bound_is_met_and_what_was_not_measured_is_not():
    assert Bar("time", 1.5, 1.5, "s").met
    assert not Bar("time", 1.51, 1.5, "s").met
    assert Bar("ratio", 20.0, 20.0, "times", at_least=True).met
    assert not Bar("ratio", nan, 20.0, "times", at_least=True).met
    assert not Bar("time", nan, 1.5, "s").met


def test_a_missed_bar_stands_out_in_its_table():
    text = bar_table([Bar("slow", 2.0, 1.0, "s"), Bar("fast", 30.0, 20.0, "times", at_least=True)])
    assert "| slow | 2.00 s | at most 1 s | **no** |" in text
    assert "| fast | 30.0 times | at least 20 times | yes |" in text


def test_a_row_that_does_not_fit_its_head_is_refused_and_a_bar_in_a_cell_breaks_no_table():
    with pytest.raises(ValueError, match="2 cells"):
        table(("a",), [("1", "2")])
    assert table(("a",), [("|x|",)]).splitlines()[-1].count("|") == 2


# --- page --------------------------------------------------------------------------------------------------------


def test_measuring_one_section_leaves_the_others_as_they_are_in_their_order():
    page = assembled(HEAD, ("a", "b", "c"), "", {"c": "## C", "a": "## A, first"})
    page = assembled(HEAD, ("a", "b", "c"), page, {"b": "## B"})
    page = assembled(HEAD, ("a", "b", "c"), page, {"a": "## A, again"})
    assert [page.index(f"## {letter}") for letter in "ABC"] == sorted(page.index(f"## {letter}") for letter in "ABC")
    assert section_of(page, "a") == "## A, again"
    assert page.count("## ") == 3
    assert page.startswith("# Benchmarks")


def test_what_stands_outside_the_markers_is_not_kept():
    assert "by hand" not in assembled(HEAD, ("a",), "# Benchmarks\n\nwritten by hand\n", {"a": "## A"})


def test_a_section_that_the_page_does_not_know_is_refused():
    with pytest.raises(ValueError, match="strange"):
        assembled(HEAD, ("a",), "", {"strange": "##"})


@pytest.mark.parametrize("name", MODULES)
def test_every_benchmark_gives_a_section(name):
    assert callable(import_module(MODULES[name]).section)


def test_the_processor_is_named_as_the_system_names_it():
    assert processor("processor : 0\nmodel name\t: Fast 9000\nmodel name\t: Fast 9000\n") == "Fast 9000"


# --- printed tables ----------------------------------------------------------------------------------------------

SPEED = """us a step                median    least
ours                      90.0     80.0   Step with the master: prebuilt buffers, 3 calls.
models_alone              70.0     60.0   Run the four units' Python code.
fmpy_per_connection      270.0    260.0   Step the same units.
libcosimpy             not installed   Step with libcosim.
plant_off                 11.6     11.5   Time HelicopterPlant doStep.
plant_on                  33.0     32.5   Time HelicopterPlant doStep.
identifier                43.7     43.6   Time AdaptiveIdentifier doStep.
real time: 93 times
"""

STEPS = """90 s at 10 ms                  median s   smallest s  error rad     ratio
ours, 10 ms                      0.00200      0.00190    6.0e-09         1
scipy RK45, anew each sample     1.40000      1.39013    7.2e-12       704
python-control, tight           15.40000     15.41887    7.0e-07      7808
"""


def test_figures_of_the_loop_are_read_as_they_were_printed_and_held_against_their_bars():
    found = figures_of(Printed("speed", SPEED))
    assert found["ours"] == (90.0, 80.0)
    assert "libcosimpy" not in found
    met = {bar.what: (bar.value, bar.met) for bar in loop_bars(found)}
    assert met["of which the FMI boundary"] == (20.0, True)
    assert met["against fmpy, one call per connection"] == (3.0, True)
    # times are held by their quietest round
    assert met["HelicopterPlant doStep, all effects on"] == (32.5, False)
    assert "against libcosim" not in met


def test_error_and_ratios_of_a_simulated_log_are_read_from_their_columns():
    values = [bar.value for bar in simulation_bars(Printed("steps", STEPS))]
    assert values == [6e-9, 704.0, 7808.0]


def test_a_line_or_number_that_was_not_printed_is_an_error():
    with pytest.raises(ValueError, match="no line 'theirs'"):
        Printed("speed", SPEED).row("theirs")
    with pytest.raises(ValueError, match="no number behind"):
        Printed("speed", SPEED).number("false time:")
    assert Printed("speed", SPEED).number("real time:") == 93.0


# --- adaptation --------------------------------------------------------------------------------------------------


def test_replay_and_padasip_are_the_same_recursion_where_the_gain_is_unbounded():
    pytest.importorskip("padasip")
    settings = IdentifierSettings(gain_limit=inf)
    log = record(4000)
    theirs = padasip_omega(regressions(*log, settings), settings)
    # both are exact least squares; rounding grows with the condition of Gamma, here below 1e6 at 1e-16 a step
    assert disagreement(replay_omega(replay(*log, settings)), theirs) < 1e-8
    assert disagreement(theirs * np.where(np.arange(11) == 0, 1.1, 1.0), theirs) > 1e-3


# --- cost --------------------------------------------------------------------------------------------------------


def test_as_many_effects_are_on_as_asked():
    for count in (0, 5, len(CATALOGUE)):
        assert sum(getattr(effects_on(count), entry.field) != 0.0 for entry in CATALOGUE) == count


def test_what_has_grown_with_the_square_of_the_length_is_expected_to_go_on_so():
    assert expected([], 10_000) == 0.0
    assert expected([(10, 2.0)], 30) == pytest.approx(6.0)
    assert expected([(10, 2.0), (30, 18.0)], 100) == pytest.approx(200.0)
    # a fixed share of the cost makes times grow slower at first; the samples are paid for all the same
    assert expected([(10, 2.0), (30, 3.0)], 60) == pytest.approx(6.0)


# --- soak --------------------------------------------------------------------------------------------------------


def test_the_soak_flies_with_the_settings_that_are_documented_for_rigs_that_change():
    text = (ROOT / "docs" / "howto" / "closed-loop.md").read_text(encoding="utf-8")
    lines = text.partition("## A rig that changes")[2].splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("| `")]
    documented = [{name.split("`")[1]: cells[column] for name, *cells in rows if cells[column]} for column in (0, 1)]
    flown = {case: {"adaptation.gain_limit": GAIN_LIMIT, **settings} for case, settings in CASES.items()}
    assert flown["prediction_error"].pop("motor.lag_known")  # what is known of the rig, and no setting for its changes
    for case, column in (("adaptation", 0), ("prediction_error", 1), ("prediction_error_lag", 1)):
        assert flown[case].keys() == documented[column].keys()
        for name, value in documented[column].items():
            assert flown[case][name] == (value if name == "method" else float(value))
