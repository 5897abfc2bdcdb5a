"""The page stands alone, says first what a laboratory asks, and says nothing that diagnosis.json contradicts."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from heli_identifier.online import Estimate
from heli_identifier.results import AxisError, Determination, ErrorFigure, LogFault, words
from heli_identifier.results.report import report_page
from heli_identifier.results.svg import Axes, figure, thin_line, ticks
from heli_identifier.results.tables import effect_table, error_table, experiments_of, gain_table
from tests.diagnosis_example import adequate_diagnosis, example_diagnosis, simulated_log


class Page(HTMLParser):
    """Tags left open, ids, and addresses of what is fetched."""

    VOID = {"meta", "link", "br", "img", "hr", "input", "path", "use", "rect", "circle"}

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
    return report_page(example_diagnosis(), "the <rig>")


def test_the_page_is_whole_small_and_fetches_nothing_and_text_of_the_user_is_no_markup(text):
    page = Page(text)
    assert page.open == [] and len(page.ids) == len(set(page.ids)) and len(text.encode()) < 1_000_000
    assert all(address.startswith(("#", "data:")) for address in page.addresses)
    assert not re.search(r"@import|url\((?!#)|<script", text)
    assert text == report_page(example_diagnosis(), "the <rig>")
    assert "the &lt;rig&gt;" in text and "train &lt;1&gt;.csv" in text and "<rig>" not in text


def test_the_first_screen_answers_what_a_laboratory_asks(text):
    first = text[: text.index("<h2>Details</h2>")].replace("\u00a0", " ")
    for answer in (
        "The model lacks dry friction on the pitch",  # what is wrong with my model
        "better: −60 % (−65 % to −55 %)",  # how much better is the new one
        "usable for prediction over 1 s and control",  # may I design a controller on it
        "not determined: its interval is ± .1. To fly: Lean the pitch",
        "It would settle: travel gain",  # what should I fly next
        "HelicopterPlant.fmu lies in the folder of this page",  # where is the file
    ):
        assert answer in first
    assert first.count('class="card ') == 3 and first.count('id="motion"') == 1
    assert "little" not in text and "rad/s^2" not in text and "+-" not in text


def test_what_is_not_in_the_plant_faults_of_logs_a_second_log_and_a_noise_floor_that_is_none_are_shown_as_such(text):
    whole = example_diagnosis()
    alone = replace(whole, effects=tuple(replace(own, in_plant=False) for own in whole.effects), possible=())
    page = report_page(alone, "rig")
    assert "No effect that is shown." in page and 'data-label="in the plant">no</td>' in page
    assert "The model lacks" not in words.verdict_line(alone)
    # faults of the logs and remarks stand before the details
    late = LogFault("late", "pitch", "A late column", advice="Fix it.")
    notes = ("A late column. Fix it.", *example_diagnosis().notes)
    page = report_page(replace(example_diagnosis(), faults=(late,), notes=notes), "rig")
    assert page.count("A late column") == 1
    assert page.index("A late column. Fix it") < page.index("voltages reach 5.10 V") < page.index("<h2>Details</h2>")
    # settings that have a value stand there, and what lag and delay come to together
    rivals = report_page(replace(whole, effects=whole.possible), "rig")
    assert "lag and delay of the rotors together: 110 ms" in rivals
    assert "score_needed 8.00, score_needed_certain 6.00, operating_point 1.25." in page
    # each held-out log has its residuals, and the first one the overlay
    count = '<svg class="figure"'
    two = report_page(example_diagnosis([simulated_log(name="one"), simulated_log(seed=2, name="two")]), "rig")
    assert two.count(count) == text.count(count) + 3
    nothing = ErrorFigure(0.0, 0.0, 0.0)
    pitch = replace(whole.axes["pitch"], noise_floor=AxisError(nothing, nothing, nothing, nothing))
    page = report_page(replace(whole, axes={**whole.axes, "pitch": pitch}), "rig")
    assert 'data-label="noise floor">0 ' not in page and "A dash: the plant is unstable" in page


def test_the_first_experiment_is_the_one_that_settles_most():
    whole = example_diagnosis()
    (gain, first), *others = experiments_of(whole)
    assert gain == ["travel gain"] and first.startswith("Lean the pitch")
    assert any("Turn the travel fast." in text and len(names) == 3 for names, text in others)
    settled = replace(adequate_diagnosis(), parameters={}, catalogue=())
    assert experiments_of(settled) == []
    assert "These logs leave no question open" in report_page(settled, "rig")


def test_tables_name_the_effect_its_size_what_could_stand_in_for_it_the_leading_error_and_what_gains_rest_on():
    rows = {row[0]: row[1:] for row in effect_table(example_diagnosis()).rows}
    assert rows["Dry friction on the pitch"][:2] == ("shown", "0.0250 ± 0.0012 rad/s²")
    assert rows["Arm bending on the elevation"][-1] == "ground effect on the elevation"
    assert rows["A periodic torque on the elevation at 0.700 Hz"][-2] == "no"
    assert rows["Motor lag of the rotors"][0] == "possible"
    assert effect_table(adequate_diagnosis()).rows == []
    assert "3 of" in words.verdict_line(adequate_diagnosis())
    # under a controller the errors that its voltages answer do not lead
    flown = replace(example_diagnosis(), closed_loop=True)
    assert error_table(flown).rows[0][1] == ".1 s ahead"
    assert "decide nothing here" in words.held_out_sentence(flown) and "error .2 s ahead" in report_page(flown, "rig")
    # a gain that references contradict or that was given is said to be
    whole = example_diagnosis()
    against = replace(whole.parameters["k_x"], contradicted=True, determination=Determination.NOT_DETERMINED)
    rows = gain_table(replace(whole, parameters={**whole.parameters, "k_x": against})).rows
    assert [row[3] for row in rows] == ["not determined, contradicted", "determined from outside", "not determined"]
    others = {name: report for name, report in whole.parameters.items() if name != "k_z"}
    assert gain_table(replace(whole, parameters=others)).rows[1][3] == "given"


@given(low=st.floats(-1e5, 1e5).map(lambda x: round(x, 4)), span=st.floats(1e-3, 1e6))
def test_ticks_are_round_even_and_each_differs_from_the_next_as_it_is_written(low, span):
    found = ticks(low, low + span, 6)
    values = np.array([value for value, _ in found])
    assert 2 <= len(found) <= 13
    assert values.min() >= low - 1e-6 * span and values.max() <= low + span * (1.0 + 1e-6)
    assert len({label for _, label in found}) == len(found)
    assert not any("e" in label for _, label in found)


def test_a_figure_keeps_peaks_takes_its_colours_from_the_page_and_survives_a_run_that_leaves_it():
    x = np.arange(20_000.0)
    y = np.zeros(20_000)
    y[[777, 15_003]] = 5.0, -3.0
    assert thin_line(x, y)[1].max() == 5.0 and thin_line(x, y)[1].min() == -3.0 and len(thin_line(x, y)[0]) < 4_000
    own = Axes("y [mrad]", limits=(-1.0, 1.0))
    own.line(np.arange(3.0), [0.0, np.nan, 1e30], "after", "run")
    drawn = figure([own], "x", "a <run>")
    assert "var(--after)" in drawn and "a &lt;run&gt;" in drawn and "nan" not in drawn and "inf" not in drawn
    assert "#" not in drawn


def test_numbers_units_and_laws_are_written_as_people_write_them():
    assert words.with_interval(Estimate(0.02512, 2.6e-4, "rad/s^2")) == "0.02512 ± 0.00051 rad/s²"
    assert words.with_interval(Estimate(1.5, None, "1")) == "1.50"
    assert [words.to_digits(x) for x in (-0.00123456, float("nan"), 0.0)] == ["−0.00123", "–", "0"]
    assert (words.unit_text("rad/s^2"), words.unit_text("1"), words.unit_text("s^-1")) == ("rad/s²", "", "s⁻¹")
    assert words.law_text("-c theta^2 - abs(eps)") == "−c θ² − |ε|"
