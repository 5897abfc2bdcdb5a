"""No sentence of a result contradicts its own figures: rules that hold heading, cards and words to diagnosis.json."""

import re
from dataclasses import replace
from html import unescape

import numpy as np
import pytest

import heli_identifier as hi
from heli_identifier.records import DEMO_RIGS
from heli_identifier.results.report import notebook_view
from heli_identifier.results.words import effect_name, verdict_line
from heli_identifier.tracing import ErrorFigure, RigVerdict, Use, Verdict
from tests.diagnosis_example import example, made_log

EXAMPLE = example([made_log(5.0)])

CARD = {
    Use.CONTROL: "usable for prediction and control",
    Use.PREDICTION: "usable for prediction only",
    Use.NOTHING: "not usable",
}

NEVER = ("little", "+-", "rad/s^2", " nan", "None ")
"""What no person is told: a judgement without a figure, a sign of typewriters, a value that is none."""


def diagnosis_of(seed):
    """The example with effects, coefficients, changes, uses and the loop of one rig of many."""
    random, effects = np.random.default_rng(seed), []

    def change():
        value, half = random.uniform(-0.9, 0.9), random.uniform(1e-3, 0.4)
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
        closed_loop=bool(random.integers(2)),
    )  # fmt: skip


def real_changes(diagnosis):
    """Axes whose leading error really changes, and by how much."""
    field = "ahead_200ms" if diagnosis.closed_loop else "prediction_1s"
    figures = {axis: own["change"][field] for axis, own in diagnosis.to_dict()["axes"].items()}
    return {axis: own["value"] for axis, own in figures.items() if own["low"] > 0.0 or own["high"] < 0.0}


def check_rules(diagnosis):
    """Hold what a person reads first to the document."""
    document, heading = diagnosis.to_dict(), verdict_line(diagnosis)
    page = re.sub(r"\s+", " ", unescape(re.sub(r"<[^>]+>", " ", notebook_view(diagnosis))))
    real = real_changes(diagnosis)
    # what the rig is said to have: in the plant, and its interval does without zero
    for effect in document["effects"]:
        if effect["coefficient"] is None:
            continue
        name = effect_name(effect["name"], effect["axis"])
        own = effect["coefficient"]
        sure = effect["in_plant"] and abs(own["value"]) > 1.96 * own["standard_error"]
        lacks = heading.partition("The model lacks ")[2].partition(".")[0]
        assert sure or name not in lacks
    # nothing refutes the model only where nothing was found
    assert ("do not refute" in heading) == (not document["effects"])
    # a change is stated where it is real alone, and by its own figure
    if real:
        axis = max(real, key=lambda name: abs(real[name]))
        assert f"the {axis}'s error" in heading
        said = float(re.search(r"(?:falls|rises) by ([\d.]+) %", heading)[1])
        assert said == pytest.approx(100.0 * abs(real[axis]), abs=0.51)
        assert ("falls" in heading) == (real[axis] < 0.0)
    else:
        assert "no axis's error" in heading
    for axis, own in document["axes"].items():
        word = "no" if axis not in real else "better" if real[axis] < 0.0 else "worse"
        card = re.search(rf"{axis}: {CARD[Use(own['use'])]}; (\w+)", page)
        assert card and card[1] == word
    told = f"{heading} {page}"
    assert [word for word in NEVER if word in told] == []


@pytest.mark.parametrize("seed", range(30))
def test_no_sentence_contradicts_the_document(seed):
    check_rules(diagnosis_of(seed))


@pytest.mark.slow
@pytest.mark.parametrize("rig", DEMO_RIGS)
def test_no_sentence_of_a_diagnosed_rig_contradicts_its_document(rig):
    training, held_out = hi.read_data_set(*hi.demo_logs(rig))
    check_rules(hi.diagnose(training, held_out=held_out))
