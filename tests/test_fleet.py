"""Several rigs together: the mean of the make against closed forms and published figures, what repeats, the command."""

import json
import shutil
import sys
from dataclasses import replace

import numpy as np
import pytest
from statsmodels.stats.meta_analysis import combine_effects

from heli_identifier.online import Estimate
from heli_identifier.records import demo_files
from heli_identifier.results import Verdict
from heli_identifier.tools import FleetVerdict, combine_rigs, fleet_html, fleet_sentence, rig_folders
from heli_identifier.tools.fleet_page import effect_table
from heli_identifier.tools.meta_analysis import pool_estimates
from heli_plant.effects import CATALOGUE
from tests.commands import heli
from tests.diagnosis_example import adequate_diagnosis, found_effects

VACCINE = np.array([
    [4, 119, 11, 128], [6, 300, 29, 274], [3, 228, 11, 209], [62, 13536, 248, 12619], [33, 5036, 47, 5761],
    [180, 1361, 372, 1079], [8, 2537, 10, 619], [505, 87886, 499, 87892], [29, 7470, 45, 7232], [17, 1699, 65, 1600],
    [186, 50448, 141, 27197], [5, 2493, 3, 2338], [27, 16886, 29, 17825],
], dtype=float)  # fmt: skip
"""Thirteen trials of the BCG vaccine, with it ill, not ill, without it ill, not ill (Colditz et al. 1994)."""


def test_published_figures_of_a_meta_analysis_and_those_of_statsmodels_come_out():
    """Viechtbauer, Conducting Meta-Analyses in R with the metafor Package, J. Stat. Softw. 36(3), 2010: Q = 152.23."""
    a, b, c, d = VACCINE.T  # logarithms of the risk ratios and their standard errors
    y, s = np.log(a / (a + b) * (c + d) / c), np.sqrt(1 / a - 1 / (a + b) + 1 / c - 1 / (c + d))
    theirs, ours = combine_effects(y, s**2, method_re="pm", use_t=True), pool_estimates(y, s)
    assert pytest.approx(152.233, abs=5e-4) == ours.Q and pytest.approx(theirs.q) == ours.Q
    assert ours.Q_p < 1e-4
    # the iteration of statsmodels ends when the sum of squares is off by 1e-5 of 12
    assert ours.mean == pytest.approx(theirs.mean_effect_re, rel=1e-5)
    assert ours.spread**2 == pytest.approx(theirs.tau2, rel=1e-5)
    # the weights are those of q = 1, at which the lower bound of the variance just does not act
    assert ours.interval == pytest.approx(tuple(theirs.conf_int()[3]), rel=1e-5)
    # identical rigs differ in nothing
    found = pool_estimates([0.3, 0.3, 0.3], [0.1, 0.02, 0.05])
    assert (found.I2, found.Q, found.spread, found.spread_interval) == (0.0, 0.0, 0.0, (0.0, 0.0))
    # the lower bound of the variance: a few rigs that agree know the mean no better than their standard errors say
    assert found.standard_error == pytest.approx(1.0 / np.sqrt(1e2 + 2500.0 + 400.0))


FLEETS = 1000
NOISE = 3.0 * np.sqrt(0.95 * 0.05 / FLEETS)
"""Three standard errors of a share of .95 among as many fleets."""


@pytest.mark.slow
@pytest.mark.parametrize("rigs, spread", [(3, 0.0), (5, 0.0), (3, 2.0), (5, 0.5), (5, 2.0), (10, 1.0)])
def test_intervals_hold_mean_and_spread(rigs, spread):
    """Standard errors differ by a factor of up to ten from rig to rig, spreads from none to above all of them."""
    random = np.random.default_rng([rigs, int(10 * spread)])
    held = np.zeros(2)
    for _ in range(FLEETS):
        s = random.uniform(0.2, 2.0, rigs)
        found = pool_estimates(1.0 + random.normal(0.0, np.hypot(s, spread)), s)
        intervals = (found.interval, 1.0), (found.spread_interval, spread)
        held += [low <= value <= high for (low, high), value in intervals]
    mean, of_spread = held / FLEETS
    # Hartung and Knapp's is exact for equal weights only: .01 is the most by which unequal ones miss in their tables
    assert mean >= 0.94 - NOISE
    # exact where the spread is not zero; there the interval is two-sided and holds no more than it says
    assert of_spread >= 0.95 - NOISE
    assert spread == 0.0 or of_spread <= 0.95 + NOISE


def rig(estimates, named=(), alternatives=(), untestable=()):
    """A diagnosis whose catalogue holds the given values with errors of .01, and zero with 1 for all other entries."""
    whole = adequate_diagnosis()
    catalogue = []
    for entry in whole.catalogue:
        key = (entry.name, entry.axis)
        value, error = (estimates[key], 0.01) if key in estimates else (0.0, 1.0)
        verdict = Verdict.SHOWN if key in named else Verdict.NOT_TESTABLE if key in untestable else Verdict.NOT_SHOWN
        catalogue.append(replace(entry, estimate=Estimate(value, error, entry.estimate.unit), verdict=verdict))
    pattern = found_effects()[0]
    effects = tuple(
        replace(pattern, name=name, axis=axis, alternatives=tuple(alternatives),
                coefficient=Estimate(estimates[name, axis], 0.01, "1"))
        for name, axis in named
    )  # fmt: skip
    return replace(whole, effects=effects, catalogue=tuple(catalogue))


FRICTION, CABLE = ("dry_friction", "pitch"), ("cable_stiffness", "travel")
TITLE = "dry friction on the pitch"
LAG, DELAY, DEAD = ("motor_lag", "rotors"), ("input_delay", "rotors"), ("dead_zone", "rotors")


def over(*rigs):
    fleet = combine_rigs({f"rig {number}": found for number, found in enumerate(rigs, start=1)})
    return fleet, {(effect.name, effect.axis): effect for effect in fleet.effects}


def own(value, named=True, untestable=False):
    return rig({FRICTION: value}, [FRICTION] if named else (), untestable=[FRICTION] if untestable else ())


@pytest.mark.parametrize("rigs, finding, said", [
    # 2.9 standard errors on each rig: below any threshold of one, 5.8 together; the heading has what a rig names
    ([own(c, False) for c in (0.029, 0.031, 0.028, 0.029)], FleetVerdict.REPEATS, "no effect repeats"),
    # friction that drives is implausible
    ([own(c, False) for c in (-0.029, -0.031, -0.028, -0.029)], FleetVerdict.NOT_SHOWN, "no effect repeats"),
    # a mean of 2.9 standard errors, of which one in seven clean fleets has one among its entries
    ([own(c, False) for c in (0.015, 0.014, 0.015, 0.014)], FleetVerdict.NOT_SHOWN, "no effect repeats"),
    ([own(0.5), *(own(c, False) for c in (0.005, -0.004, 0.0))], FleetVerdict.OWN, "no effect repeats"),
    ([own(0.20), own(0.21), own(0.19)], FleetVerdict.REPEATS, f"{TITLE} repeats with a like coefficient"),
    # five and six standard errors; the mean's interval, of one degree of freedom, holds zero
    ([own(0.05), own(0.06)], FleetVerdict.REPEATS, f"{TITLE} repeats with a like coefficient"),
    # a spread of .03 is below half of the mean, but the errors of .01 do not allow one value
    ([own(0.20), own(0.26), own(0.17)], FleetVerdict.DIFFERS, f"{TITLE} differs from rig to rig"),
    # the interval of the mean spans zero
    ([own(0.5), own(-0.4), own(0.1)], FleetVerdict.DIFFERS, "no effect repeats"),
    # 2.8 standard errors together: p = .004, times the number of entries far above .005
    ([own(0.021), own(0.019)], FleetVerdict.UNCONFIRMED, "no effect repeats"),
    ([own(0.2), own(0.0, False, untestable=True)], FleetVerdict.OPEN, "no effect repeats"),
])  # fmt: skip
def test_a_fleet_finds_what_repeats_what_differs_and_what_is_one_rigs_own(rigs, finding, said):
    fleet, effects = over(*rigs)
    found = effects[FRICTION]
    assert found.finding == finding and found in fleet.effects_with(finding)
    assert fleet_sentence(fleet) == f"Over {len(rigs)} rigs {said}."


def test_a_rig_that_cannot_test_an_effect_or_has_it_as_mechanics_expects_is_left_out():
    _, effects = over(own(0.2), own(0.2), own(9.0, False, untestable=True))
    found = effects[FRICTION]
    assert (found.finding, found.pooled.rigs, found.named) == (FleetVerdict.REPEATS, 2, ("rig 1", "rig 2"))
    assert found.rigs[2].left_out.startswith("not testable: ")
    fleet, effects = over(*[own(0.0, False, untestable=True)] * 2)
    assert effects[FRICTION].finding == FleetVerdict.NOT_TESTABLE
    fleet, effects = over(*[rig({DEAD: 2.0}, [DEAD])] * 2)  # 2 V is the end of what is plausible
    assert "stands at the end" in fleet_html(fleet)
    assert effects[DEAD].finding == FleetVerdict.UNCONFIRMED and "stands at the end" in effects[DEAD].rigs[0].left_out
    assert "not testable" in {cells[1] for cells in effect_table(fleet.effects).rows}
    # what a plant has as mechanics expects it is near 1 by its prior, whatever the logs say
    gravity = ("large_angle_gravity", "elevation")
    pattern = replace(found_effects()[0], name=gravity[0], axis=gravity[1], verdict=Verdict.POSSIBLE, in_plant=True)
    _, effects = over(*[replace(rig({gravity: 1.0}), possible=(pattern,))] * 3)
    assert effects[gravity].finding == FleetVerdict.NOT_TESTABLE
    _, effects = over(*[rig({gravity: 1.0})] * 3)
    assert effects[gravity].finding == FleetVerdict.REPEATS


def test_beside_a_named_effect_that_explains_the_same_an_entry_says_nothing():
    """A delay beside a named lag, by their common mechanism, and whatever the diagnosis gives as an alternative."""
    values = {LAG: 0.05, DELAY: 0.0, DEAD: 0.0}
    _, effects = over(rig(values, [LAG], alternatives=[DEAD]), rig(values), rig(values))
    for key in (DELAY, DEAD):
        assert effects[key].rigs[0].left_out == "motor lag of the rotors is named in its place"
        assert effects[key].pooled.rigs == 2
    assert effects[LAG].pooled.rigs == 3
    fleet, _ = over(*[rig({FRICTION: 0.2}, [FRICTION], alternatives=[CABLE])] * 2)
    assert f"{TITLE} or cable stiffness on the travel repeats" in fleet_sentence(fleet)
    # a lag that was given has no mean, and the same rig twice differs in nothing
    assert {parameter.name for parameter in fleet.parameters} == set(adequate_diagnosis().parameters_after) - {"T_m"}
    assert all(parameter.pooled.I2 == 0.0 for parameter in fleet.parameters)


def test_page_and_document_hold_every_effect(monkeypatch):
    fleet, _ = over(
        rig({FRICTION: 0.2, CABLE: 0.3}, [FRICTION, CABLE]),
        rig({FRICTION: 0.21}, [FRICTION], untestable=[LAG]),
        rig({FRICTION: 0.19}, untestable=[CABLE]),
    )
    monkeypatch.setattr(sys, "argv", ["/somewhere/heli", "fleet", "<a>", "b c"])
    text = fleet_html(fleet)
    unseen = [*fleet.effects_with(FleetVerdict.NOT_SHOWN), *fleet.effects_with(FleetVerdict.NOT_TESTABLE)]
    plotted = len(fleet.effects) - len(unseen) + len(fleet.parameters)
    assert text.count("<svg class") == plotted
    assert "heli fleet &#39;&lt;a&gt;&#39; &#39;b c&#39;" in text
    assert "http" not in text.replace("http://www.w3.org", "")  # nothing is fetched from elsewhere
    document = json.loads(json.dumps(fleet.document(), allow_nan=False))
    assert document["schema"] == "heli-fleet/1"
    assert {(e["name"], e["axis"]) for e in document["effects"]} == {(e.name, e.axis) for e in CATALOGUE}
    first = document["effects"][0]
    assert (first["name"], first["finding"], first["named"]) == ("dry_friction", "repeats", ["rig 1", "rig 2"])
    assert first["pooled"]["mean"] == pytest.approx(0.2) and len(document["rigs"]) == 3


def folder_of(place, *logs):
    place.mkdir(parents=True)
    for log in logs:
        shutil.copy(log, place)
    return place


def test_all_logs_are_read_first_and_a_bad_log_or_rig_is_lost_alone(tmp_path, monkeypatch):
    names = {"one": "rig-a", "broken": "rig-a", "two": "rig-b", "odd": "rig-c"}
    folders = [folder_of(tmp_path / name, *(logs[0] for logs in demo_files(of))) for name, of in names.items()]
    for folder, name in ((folders[0], "held_2.csv"), (folders[1], "train.csv")):
        for old in folder.glob("train*") if name == "train.csv" else ():
            old.unlink()
        (folder / name).write_text("a,b\n1,2\n")
    begun = []

    def diagnose(training, held_out, progress):
        begun.append(len(begun))
        if len(begun) == 3:
            raise ZeroDivisionError("odd")
        return rig({FRICTION: 0.2}, [FRICTION])

    monkeypatch.setattr("heli_identifier.tools.rigs.diagnose", diagnose)
    done = heli("fleet", *folders, "--output", tmp_path / "out", "--json")
    assert (done.exit_code, len(begun)) == (1, 3)
    document = json.loads(done.stdout)
    assert [found["rig"] for found in document["rigs"]] == ["one", "two"]
    assert "held_2.csv is left out: " in document["rigs"][0]["notes"][0]  # its other logs serve
    read, raised = document["failures"]
    assert read["rig"] == "broken" and "train.csv" in read["error"]
    assert raised["rig"] == "odd" and raised["error"].startswith("ZeroDivisionError: odd (in diagnose, ")
    assert all(f"rig {name} is left out" in done.stderr for name in ("broken", "odd"))
    assert "left out: ZeroDivisionError" in (tmp_path / "out" / "fleet.html").read_text()


def test_a_configuration_of_this_folder_is_taken_for_rigs_without_one_and_that_is_said(tmp_path, monkeypatch):
    (log, *_), (held,) = demo_files("rig-a")
    folders = [folder_of(tmp_path / name, log, held) for name in ("one", "other")]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "heli.toml").write_text("[log]\nstart = 1e6\n")  # refused once it is applied
    (folders[0] / "heli.toml").write_text("[log]\nstart = 1e6\n")
    done = heli("fleet", *folders)
    assert (done.exit_code, done.stdout) == (2, "")
    assert "configuration: heli.toml of this folder, for rigs without one of their own" in done.stderr
    named = heli("fleet", *folders, "--config", "heli.toml")
    assert "configuration:" not in named.stderr
    labs = [folder_of(tmp_path / lab / "rig", log) for lab in "ab"]  # folders of one name are told apart
    assert [rig.rig for rig in rig_folders(labs)] == [str(folder) for folder in labs]
