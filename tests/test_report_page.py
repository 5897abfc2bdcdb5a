"""The page stands alone, says what the diagnosis says, and its figures take the theme's colours."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from heli_identifier.online.estimate import Estimate
from heli_identifier.results.figure_held_out import autocorrelation, free_run_figure, residual_figure
from heli_identifier.results.figure_intervals import parameter_figure
from heli_identifier.results.report import report_page
from heli_identifier.results.residuals import residual_text
from heli_identifier.results.style import COLOURS, thinned
from heli_identifier.results.tables import error_rows, gain_rows
from heli_identifier.results.words import (
    held_out_sentence,
    law_text,
    possible_sentence,
    power_text,
    significant,
    unit_text,
    verdict_sentence,
    with_interval,
)
from heli_identifier.tracing import AxisError, Determination, ErrorFigure, Verdict
from heli_plant.parameters import TABLE_2
from tests.diagnosis_example import adequate, example, made_log

LARGEST = 3_000_000
"""Bytes that a page may have."""


class Page(HTMLParser):
    """Tags left open, ids, and addresses of what is fetched."""

    VOID = {"meta", "link", "br", "img", "hr", "input", "path", "use", "rect"}

    def __init__(self, text):
        super().__init__()
        self.open, self.ids, self.addresses = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        self.ids += [values["id"]] if "id" in values else []
        self.addresses += [values[name] for name in ("src", "href") if name in values]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in self.VOID:
            assert self.open.pop() == tag


@pytest.fixture(scope="module")
def text():
    return report_page(example(), "the <rig>")


def test_the_page_is_below_three_megabytes(text):
    assert len(text.encode()) < LARGEST


def test_every_tag_is_closed_and_no_id_is_given_twice(text):
    page = Page(text)
    assert page.open == []
    assert len(page.ids) == len(set(page.ids))


def test_the_page_fetches_nothing(text):
    assert all(address.startswith(("#", "data:")) for address in Page(text).addresses)
    assert not re.search(r"@import|url\((?!#)|<script", text)


def test_every_reference_inside_a_figure_leads_somewhere(text):
    ids = set(Page(text).ids)
    references = re.findall(r'url\(#([^)]+)\)|href="#([^"]+)"', text)
    assert {a or b for a, b in references} <= ids


def test_no_colour_of_the_light_theme_is_left_in_a_figure(text):
    figures = "".join(re.findall(r'<svg class="figure".*?</svg>', text, re.DOTALL))
    assert figures.count("var(--after)") > 10
    for colour in COLOURS.values():
        assert colour not in figures


def test_each_held_out_log_has_four_figures_for_each_axis():
    two = report_page(example([made_log(name="one"), made_log(seed=2, name="two")]), "rig")
    shown = len(re.findall('<svg class="figure"', report_page(example(), "rig")))
    assert len(re.findall('<svg class="figure"', two)) == shown + 12


def test_text_of_the_user_is_no_markup(text):
    assert "the &lt;rig&gt;" in text
    assert "train &lt;1&gt;.csv" in text


def test_the_page_says_every_verdict_of_the_catalogue(text):
    assert text.count('class="tag open">not shown') == len(example().catalogue) - 3
    assert text.count('class="tag open">not testable') == 2


def test_the_page_names_the_experiments_that_would_settle_something(text):
    assert "Turn the travel fast." in text
    assert "chirp from 1 to 6 Hz" in text
    assert "and inertial coupling on the travel is not testable" in text


def test_a_clean_rig_gets_a_page_without_an_effect():
    page = report_page(adequate(), "rig")
    assert "these logs do not refute the simplified model" in page
    assert "No effect of the catalogue scores more than 8.0 nats" in page


def test_a_noise_floor_that_could_not_be_computed_is_a_dash_with_its_reason():
    whole = example()
    nothing = ErrorFigure(0.0, 0.0, 0.0)
    pitch = replace(whole.axes["pitch"], noise_floor=AxisError(nothing, nothing, nothing, nothing))
    page = report_page(replace(whole, axes={**whole.axes, "pitch": pitch}), "rig")
    assert "A dash stands for a noise floor that could not be computed" in page
    assert 'data-label="noise floor">0 ' not in page
    assert replace(whole, axes={"pitch": pitch}).to_dict()["error"]["pitch"]["noise_floor"] == {
        "ahead_100ms_rad": None, "ahead_200ms_rad": None, "prediction_1s_rad": None, "prediction_2s_rad": None,
        "free_run_rad": None, "closed_loop_3s_rad": None,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("p", "after", "said"),
    [
        (0.4, 2e-3, "white noise is not rejected at the 1 % level (Ljung-Box, p = 0.40; before: p < 0.0001)"),
        (0.006, 2e-3, "not entirely white (Ljung-Box, p = 0.0060; before: p < 0.0001), so something is left. It costs"),
        (0.006, 2e-3, "costs the 1 s prediction little: 2.00 mrad against a noise floor of 1.90 mrad."),
        (0.006, 4e-3, "costs the 1 s prediction more than chance explains: 4.00 mrad against a noise floor of"),
    ],
)
def test_a_residual_is_called_white_only_where_the_test_says_so_and_else_weighed_by_what_it_costs(p, after, said):
    report = example().axes["pitch"]
    error = replace(report.after, prediction_1s=ErrorFigure(after, 0.9 * after, 1.1 * after))
    assert said in residual_text(
        "pitch", replace(report, after=error, whiteness_p={"before": 1e-9, "after": p}), TABLE_2
    )


@pytest.mark.parametrize(
    ("axis", "changes", "said"),
    [
        ("pitch", {"a_th": -0.5}, "Nothing pulls this axis back"),
        ("travel", {}, "Nothing pulls this axis back"),
        ("pitch", {"a_th": 0.89, "a_wx": 0.0}, "The model has no damping on this axis"),
        ("elevation", {}, "The model's free run leaves the rig"),
    ],
)
def test_an_axis_without_a_free_run_is_said_to_lack_stiffness_only_where_it_does(axis, changes, said):
    report = example().axes[axis]
    lost = replace(report, after=replace(report.after, free_run=None))
    assert said in residual_text(axis, lost, TABLE_2._replace(**changes))


def test_every_term_that_a_reader_may_not_know_is_explained_on_the_page(text):
    words = text[text.index('id="words"') :]
    terms = "±", "likelihood", "score", "possible", "not determined", "visibility", "as likely", "Ljung-Box p"
    for term in terms:
        assert f"<dt>{term}</dt>" in words
    assert "1.96 standard errors" in words


def test_the_same_diagnosis_gives_the_same_page(text):
    assert report_page(example(), "the <rig>") == text


def test_the_sentence_names_the_effect_its_size_and_what_it_brings():
    said = verdict_sentence(example())
    assert said.startswith("The rig has dry friction on the pitch (c = 0.0250 ± 0.0012 rad/s²)")
    assert "periodic torque on the elevation at 0.700 Hz" in said
    assert "falls from 5.00 to 2.00 mrad" in said


def test_a_rig_of_which_nothing_is_shown_is_not_called_explained_and_its_errors_are_said():
    said = verdict_sentence(adequate())
    assert said.startswith("Nothing in the catalogue is shown: these logs do not refute the simplified model, but 2 of")
    assert said.endswith("is 5.00, 5.00 and 5.00 mrad (pitch, elevation, travel).")


def test_the_sentence_does_not_praise_what_brings_nothing():
    whole = example()
    same = {axis: replace(report, after=report.before) for axis, report in whole.axes.items()}
    assert "falls from" not in verdict_sentence(replace(whole, axes=same))


def test_an_alternative_that_several_effects_share_is_said_once():
    whole = example()
    bending = whole.effects[1]
    assert verdict_sentence(whole).count("or ground effect on the elevation, which explains these logs") == 1
    friction = replace(whole.effects[0], verdict=Verdict.AMBIGUOUS, alternatives=bending.alternatives)
    said = verdict_sentence(replace(whole, effects=(friction, *whole.effects[1:])))
    assert said.count("ground effect on the elevation") == said.count("explains these logs about as well") == 1
    assert "In place of dry friction on the pitch or arm bending on the elevation, ground effect on the" in said
    assert "arm bending on the elevation (c = " in said


def test_what_is_possible_is_said_to_be_no_finding():
    said = possible_sentence(example())
    assert said.startswith("Possible, and no finding: motor lag of the rotors. The corrected plant has motor lag of")
    assert possible_sentence(adequate()) == ""


def test_under_a_controller_the_errors_that_its_voltages_answer_do_not_lead():
    flown = replace(example(), closed_loop=True)
    assert ".2 s ahead on held-out data" in verdict_sentence(replace(adequate(), closed_loop=True))
    assert error_rows(flown)[0]["what"] == ".1 s ahead [mrad]"
    assert "decide nothing here" in held_out_sentence(flown)
    assert "decide nothing" not in held_out_sentence(example())


def test_a_gain_that_references_contradict_is_said_to_be():
    whole = example()
    against = replace(whole.parameters["k_x"], contradicted=True, determination=Determination.NOT_DETERMINED)
    rows = gain_rows(replace(whole, parameters={**whole.parameters, "k_x": against}))
    assert [row["rests"] for row in rows] == ["contradicted", "determined from outside", "not determined"]
    del rows
    given = {name: report for name, report in whole.parameters.items() if name != "k_z"}
    assert gain_rows(replace(whole, parameters=given))[1]["rests"] == "given"


def test_an_unknown_line_is_drawn_as_a_spectrum_and_an_unknown_curve_as_a_curve(text):
    assert "Spectrum of the elevation&#39;s residual on the held-out log" in text
    assert "The curve that was found, against the travel" in text


def test_a_free_run_that_runs_away_leaves_the_measurement_to_be_seen():
    series = example().series[0]
    growth = np.exp(np.arange(len(series.log.angles)) / 50.0)
    away = replace(series, free_run_after=series.free_run_after + growth[:, None])
    above, below = free_run_figure(away, "pitch").axes
    span = np.ptp(series.log.angles[:, 0])
    # the measurement fills at least a third of the upper axes
    assert np.ptp(above.get_ylim()) <= 3.0 * span + 1e-12
    assert np.ptp(below.get_ylim()) <= 2e3 * span + 1e-9


def test_labels_of_long_numbers_and_legends_stay_inside_their_figure():
    series = example().series[0]
    small = replace(series, residual_before=1e-4 * series.residual_before, residual_after=1e-4 * series.residual_after)
    whole = example()
    parameters = parameter_figure(whole.parameters_before, whole.parameters_after)
    for figure in (residual_figure(small, "elevation"), parameters):
        renderer = FigureCanvasAgg(figure).get_renderer()
        for legend in (axes.get_legend() for axes in figure.axes):
            legend.set_in_layout(True)
        drawn = figure.get_tightbbox(renderer)
        width, height = figure.get_size_inches()
        assert 0.0 <= drawn.x0 < drawn.x1 <= width
        assert 0.0 <= drawn.y0 < drawn.y1 <= height


def test_a_line_that_is_thinned_keeps_its_ends_and_every_peak():
    x = np.linspace(0.0, 1.0, 50_000)
    y = np.sin(40.0 * x)
    y[31_234] = 7.0
    few_x, few_y = thinned(x, y)
    assert len(few_x) < 2000
    assert few_y.max() == 7.0
    assert (few_x[0], few_x[-1]) == (0.0, 1.0)
    assert np.all(np.diff(few_x) >= 0.0)


def test_the_autocorrelation_of_white_noise_keeps_its_bounds_and_that_of_a_lag_is_found():
    noise = np.random.default_rng(0).normal(size=20_000)
    bound = 1.96 / np.sqrt(len(noise))
    # 5 % of 50 lags are 2.5; more than 8 are seen once in a thousand draws
    assert (np.abs(autocorrelation(noise, 50)) > bound).sum() <= 8
    echo = noise.copy()
    echo[10:] += 0.5 * noise[:-10]
    # rho(10) = .5/(1 + .25)
    assert autocorrelation(echo, 12)[9] == pytest.approx(0.4, abs=4.0 * bound)


@pytest.mark.parametrize(
    ("value", "error", "said"),
    [
        (0.025143, 0.00025, "0.02514 ± 0.00049"),
        (-0.1, 0.02, "−0.100 ± 0.039"),
        (2.0, None, "2.00"),
        (123.4, 10.0, "123 ± 20"),
        (1.0, float("inf"), "1.00"),
        (float("nan"), 1.0, "–"),
    ],
)
def test_a_value_shows_the_digits_that_its_interval_leaves(value, error, said):
    assert with_interval(Estimate(value, error, "1")) == said


def test_units_and_laws_are_set_as_people_write_them():
    assert unit_text("rad/s^2/V") == "rad/s²/V"
    assert unit_text("1") == ""
    assert law_text("-c w abs(w)") == "−c ω |ω|"
    assert law_text("nu -> nu + c nu abs(nu)") == "ν → ν + c ν |ν|"
    assert law_text("c a_th sin(theta - theta0) cos(eps_h)") == "c a_θ sin(θ − θ_0) cos(ε_h)"
    assert power_text(1e-3) == "10⁻³"
    assert significant(0.0012345) == "0.00123"
