"""Benchmarks: what a comparison finds, settings that a page documents, and figures held against the truth."""


from types import SimpleNamespace

import pytest

from benchmarks import freeze
from benchmarks.soak import CASES, GAIN_LIMIT
from tests.faults.case import ROOT


def test_a_comparison_finds_bits_sizes_and_what_has_come_or_gone():
    old = {"a": [1.0, 2.0], "text": "x", "gone": 1, "array": {"hash": "p", "numbers": [3.0]}}
    assert list(freeze.differences(old, old)) == []
    new = {"a": [1.0, 2.2], "text": "y", "new": 1, "array": {"hash": "q", "numbers": [3.0]}}
    found = dict((place, size) for size, place in freeze.differences(old, new))
    assert found[".a[1]"] == pytest.approx(0.2 / 2.2)
    assert found[".array: other bits"] == 0.0
    assert {place for place, size in found.items() if size == float("inf")} == {
        ".text: 'x' became 'y'", ".gone has gone", ".new is new",
    }  # fmt: skip



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


def test_halves_are_counted_against_the_truth_and_against_each_other():
    from benchmarks.halves import GAINS, Half, Known, summary
    from heli_identifier.tracing import Determination

    def half(name, k_x, families):
        reports = {
            gain: SimpleNamespace(
                estimate=SimpleNamespace(value=value, standard_error=0.05), determination=Determination.OUTSIDE
            )
            for gain, value in zip(GAINS, (k_x, 1.0, 1.0), strict=True)
        }
        effects = [SimpleNamespace(family=family) for family in families]
        gain = SimpleNamespace(gain=SimpleNamespace(value=5.0))
        found = SimpleNamespace(parameters=reports, effects=effects, held_out=gain, agreement=None)
        truth = Known((), frozenset({"friction"}), dict.fromkeys(GAINS, 1.0))
        return Half("kind", "rig", name, truth, found, detectable=frozenset({"friction"}), loss=2.0)

    text = summary([half("a", 1.3, ("friction",)), half("b", 1.0, ("friction", "drag"))])
    # one of six gains is off by .3 with an interval of .098; the joint one of both halves, .139, is too short as well
    assert "| intervals cover; half-widths | 0.833 of 6; 0.098 0.098 0.098 |" in text
    assert "| wrong gains | 1 of 6 determined from outside;" in text
    assert "| halves with something false | 1 of 2 |" in text
    assert "| detectable effects shown | 2 of 2 |" in text
    assert "| halves agree; expected | 0.50; nan (1 rigs) |" in text
    assert "| gains within their joint interval | 2 of 3 |" in text
