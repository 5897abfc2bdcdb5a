"""diagnosis.json keeps its contract and is strict JSON; no sentence of a result contradicts its figures."""

import json
import re
from dataclasses import replace
from functools import partial
from html import unescape

import numpy as np
import pytest

import heli_identifier as hi
from benchmarks.rigs import log_of, windy_logs
from docs.hooks.schema import reference_rows
from heli_identifier.errors import ConfigurationError
from heli_identifier.online import Estimate
from heli_identifier.records import DEMO_RIGS
from heli_identifier.results import (
    DiagnosisFile,
    ErrorFigure,
    RigVerdict,
    Use,
    Verdict,
    corrected_parameters,
    document_text,
    read_document,
    read_parameters,
    to_json_value,
)
from heli_identifier.results.report import report_page
from heli_identifier.results.tables import experiments_of
from heli_identifier.results.words import effect_name, leading_error, typeset_notes, verdict_line
from heli_plant.tabulated_torque import KNOTS
from tests.blind.generator import make_rig
from tests.blind.windy import windy_rig
from tests.diagnosis_example import AFTER, adequate_diagnosis, example_diagnosis, simulated_log

EXAMPLE = example_diagnosis([simulated_log(5.0)])

CARD = {
    Use.CONTROL: "usable for prediction over {} and control",
    Use.PREDICTION: "usable for prediction over {} only",
    Use.NOTHING: "not usable",
}

NEVER = (r"little", r"\+-", r"[a-z]\^-?\d", r"\bnan\b", r"\bNone\b", r"[-−]0(\.0*)?(?![.\d])", r" - ")
"""What no person is told: a judgement without a figure, signs of typewriters, a value that is none, a negative zero."""


def diagnosis_of(seed):
    """The example with effects, coefficients, changes, uses and the loop of one rig of many."""
    random, effects = np.random.default_rng(seed), []

    def change():  # from nine tenths down to what no figure shows
        size = 10.0 ** random.uniform(-6.0, 0.0)
        value, half = random.uniform(-0.9, 0.9) * size, random.uniform(1e-3, 0.4) * size
        return ErrorFigure(value, value - half, value + half)

    for effect in (own for own in EXAMPLE.effects if random.random() < 0.5):
        if effect.coefficient is not None:  # from .5 of itself an error is too large for an interval without zero
            error = float(random.choice((0.1, 0.4, 0.6, 2.0))) * effect.coefficient.value
            effect = replace(effect, coefficient=replace(effect.coefficient, standard_error=error))
        effects.append(effect)
    unknown = any(effect.verdict == Verdict.UNKNOWN for effect in effects)
    verdict = RigVerdict.UNKNOWN_EFFECT if unknown else RigVerdict.EFFECTS_SHOWN
    axes = {
        axis: replace(
            report,
            use=list(Use)[random.integers(len(Use))],
            change={"prediction_1s": change(), "ahead_200ms": change()},
        )
        for axis, report in EXAMPLE.axes.items()
    }
    return replace(
        EXAMPLE, effects=tuple(effects), verdict=verdict if effects else RigVerdict.MODEL_ADEQUATE, axes=axes,
        closed_loop=bool(random.integers(2)), notes=NOTES,
    )  # fmt: skip


NOTES = (
    "train <1>: the elevation's reference is not used, since it is feedback (past angles explain 83 % of it).",
    "the air's torque is 0.26 +- 0.02 rad/s^2",
    "train <1>: no reference behind v_front - v_rear, since the voltages rest.",
)


def real_changes(diagnosis):
    """Axes whose leading error really changes, and by how much: value and interval print on one side of zero."""
    figures = {axis: own["change"].get(leading_error(diagnosis)) for axis, own in diagnosis.to_dict()["axes"].items()}
    ends = {axis: [float(f"{100.0 * end:.1f}") for end in own.values()] for axis, own in figures.items() if own}
    return {axis: figures[axis]["value"] for axis, own in ends.items() if min(own) > 0.0 or max(own) < 0.0}


def check_rules(diagnosis):
    """Hold what a person reads first to the document."""
    document, heading = diagnosis.to_dict(), verdict_line(diagnosis)
    written = report_page(diagnosis, "rig")
    page = re.sub(r"\s+", " ", unescape(re.sub(r"<style>.*?</style>|<[^>]+>", " ", written, flags=re.S)))
    real = real_changes(diagnosis)
    usable = [axis for axis, own in document["axes"].items() if own["use"] != Use.NOTHING]
    horizon = ".2 s" if diagnosis.closed_loop else "1 s"
    assert len(heading) < 180  # two lines at 1280 px
    # what the rig is said to have: in the plant, and its interval excludes zero
    lacks, axes_by_surety = heading.partition("The model lacks ")[2].partition(".")[0], {True: [], False: []}
    for effect in document["effects"]:
        own = effect["coefficient"]
        sure = effect["in_plant"] and (own is None or abs(own["value"]) > 1.96 * own["standard_error"])
        axes_by_surety[sure].append(effect["axis"])
        assert sure or own is None or effect_name(effect["name"], effect["axis"]) not in lacks
    first_axis = next(iter(axes_by_surety[True] or axes_by_surety[False]), "")
    # nothing refutes the model only where nothing was found
    assert ("do not refute" in heading) == (not document["effects"])
    # a change is stated where it is real and of a usable axis alone, by its own figure, and first of the effect's axis
    stated = {axis: value for axis, value in real.items() if axis in usable}
    if stated:
        axis = max(stated, key=lambda name: (name == first_axis, abs(stated[name])))
        assert f"the {axis}'s error" in heading
        said = float(re.search(r"(?:falls|rises) by ([\d.]+) %", heading)[1])
        assert said == pytest.approx(100.0 * abs(real[axis]), abs=0.51) and said > 0.0
        assert ("falls" in heading) == (real[axis] < 0.0)
    else:
        assert "falls" not in heading and "rises" not in heading
    for axis, own in document["axes"].items():
        word = "no" if axis not in real else "better" if real[axis] < 0.0 else "worse"
        card = re.search(rf"{axis} {CARD[Use(own['use'])].format(horizon)} (\w+)", page)
        assert card and card[1] == word
        assert axis in usable or f"on the {axis}: the law" not in written
    # what an axis needs that cannot be used is flown first
    gains = dict(zip(("pitch", "elevation", "travel"), ("k_x", "k_z", "k_y"), strict=True))
    needed = [document["parameters"].get(gains[axis], {}).get("experiment") for axis in gains if axis not in usable]
    assert not any(needed) or experiments_of(diagnosis)[0][1] in needed
    # nothing is told twice, one line a log, and no letter of a typewriter
    told = re.findall(r"<li>(.*?)</li>", written.partition('<ul class="remarks">')[2].partition("</ul>")[0])
    assert len(told) == len({text.rstrip(".") for text in told})
    first = [line.partition(": ")[0] for line in typeset_notes(document["notes"])]
    assert len(first) == len(set(first))
    assert [word for word in NEVER if re.search(word, f"{heading} {page} {diagnosis.summary()}")] == []


@pytest.mark.parametrize("seed", [*range(30), 52, 75])  # in the last two another axis changes more than the effect's
def test_no_sentence_contradicts_the_document(seed):
    check_rules(diagnosis_of(seed))


def windy():
    """Two logs and a held-out one, flown by a controller."""
    rig = windy_rig(11, effects="bare", counts={"a": 2, "t": 1})
    return windy_logs(rig, "a"), windy_logs(rig, "t")


def blind():
    made = make_rig(9001, "dry_friction:pitch")
    return [log_of(str(k), 100.0, own[:4000]) for k, own in enumerate(made.train[:2])], log_of("held", 100.0, made.held)


@pytest.mark.parametrize(
    "logs", [windy, blind, *(pytest.param(partial(hi.demo_logs, rig), marks=pytest.mark.slow) for rig in DEMO_RIGS)]
)
def test_no_sentence_of_a_diagnosed_rig_contradicts_its_document(logs):
    """Held-out logs of a closed loop keep their own limits, by the error that decides something there."""
    training, held_out = logs()
    found = hi.diagnose(training, held_out=held_out)
    check_rules(found)
    if logs is windy:
        judged = hi.check((*training, *held_out), found, 1.0)  # of no log of the diagnosis is it news
        assert judged.passed and judged.table.title.startswith("Error .2 s ahead")


def test_an_effect_has_coefficient_error_unit_and_shape_and_a_number_that_is_not_finite_is_null():
    friction, bending, line, curve = json.loads(document_text(example_diagnosis().to_dict()))["effects"]
    assert (friction["name"], friction["axis"], friction["verdict"]) == ("dry_friction", "pitch", "shown")
    assert friction["coefficient"] == {"value": 0.025, "standard_error": 0.0006, "unit": "rad/s^2"}
    assert bending["alternatives"] == [["ground_effect", "elevation"]]
    assert bending["shape"]["parameters"]["frequency"]["value"] == 3.1
    assert (line["coefficient"], line["in_plant"], line["shape"]["kind"]) == (None, False, "periodic")
    assert (curve["in_plant"], curve["shape"]["kind"], len(curve["shape"]["curve"][0])) == (True, "curve", 2)
    # json would write Infinity, which no other parser takes
    assert to_json_value({"a": float("inf"), "b": [float("nan"), 1.0]}) == {"a": None, "b": [None, 1.0]}
    entries = example_diagnosis().to_dict()["catalogue"]
    blind = next(entry for entry in entries if entry["name"] == "inertial_coupling")
    assert blind["estimate"]["standard_error"] is None


def test_parameters_read_back_are_the_corrected_plant_with_its_table_to_the_last_bit(tmp_path):
    table = {f"table_torque_{k}_travel": 0.01 * k for k in range(1, KNOTS + 1)}
    plant = AFTER._replace(table_variable_travel=3.0, table_spacing_travel=0.3, **table)
    torque = Estimate(0.02, 0.001, "rad/s^2")
    found = replace(example_diagnosis(), plant_after=plant, effects_after={"table_torque_2_travel": torque})
    written = corrected_parameters(found)
    read = read_parameters(written.write(tmp_path / "parameters.json"))
    assert (read.values, read.expected) == (written.values, written.expected)
    assert {name.split(".")[1] for name in read.values if name.startswith("table.")} == {"travel"}
    assert read.values["table.travel.torque_2"] == torque and read.plant() == plant


def test_the_limit_of_an_axis_is_a_multiple_of_the_larger_of_error_and_noise_floor():
    parameters = corrected_parameters(example_diagnosis())
    expected = parameters.expected["pitch"]
    assert parameters.limits(1.5)["pitch"] == 1.5 * expected.prediction_1s_rad.value
    quiet = replace(parameters, expected={**parameters.expected, "pitch": replace(expected, noise_floor_rad=1.0)})
    assert quiet.limits(1.5)["pitch"] == 1.5


@pytest.mark.parametrize("made", [example_diagnosis, adequate_diagnosis])
def test_a_diagnosis_is_read_back_as_the_value_that_was_written_and_a_damaged_entry_is_named(made, tmp_path):
    file, found, document = tmp_path / "diagnosis.json", made(), made().to_dict()
    file.write_text(document_text(document), encoding="utf-8")
    read = read_document(file, DiagnosisFile)
    assert to_json_value(read) == document
    for name in ("effects_after", "parameters", "parameters_before", "axes", "data", "held_out", "possible"):
        assert getattr(read, name) == getattr(found, name)
    document["axes"]["pitch"]["after"]["prediction_1s"]["value"] = "small"
    file.write_text(document_text(document), encoding="utf-8")
    with pytest.raises(ConfigurationError, match=r"damaged: axes\[...\].after.prediction_1s.value: expected `float"):
        read_document(file, DiagnosisFile)


def test_every_key_of_a_document_is_on_the_reference_page():
    keys = dict(reference_rows(DiagnosisFile))
    assert set(example_diagnosis().to_dict()) <= set(keys)
    assert "axes.<name>.after" in keys and "standard_error" in keys["effects[].coefficient"] and keys["effects[].score"]
