"""Campaign: where rigs come from, what a result is called, rows, results, and rows judged against the truth."""

from dataclasses import replace

import numpy as np
import pytest

from heli_identifier.errors import ConfigurationError
from heli_identifier.records import Log
from heli_identifier.tools import (
    GeneratedRig,
    Rig,
    TrueEffect,
    TrueUnknown,
    Truth,
    generated_rigs,
    rig_folder,
    rigs_below,
)
from heli_identifier.tools.campaign import read_row, result_key, run_campaign
from heli_identifier.tools.campaign_rows import (
    all_named,
    complete,
    coverage,
    false_entries,
    named_first,
    read_rows,
    right,
    summarised,
    truth_columns,
    unknown_recognised,
    write_rows,
)
from heli_identifier.tools.rigs import source_digest
from heli_identifier.tracing import DiagnosisSettings

SETTINGS = DiagnosisSettings()


def found(name, axis, coefficient=0.02, standard_error=0.001, variable=None):
    return {
        "name": name, "axis": axis, "coefficient": coefficient, "standard_error": standard_error, "score": 20.0,
        "verdict": "shown", "alternatives": [], "variable": variable, "frequency_hz": None,
    }  # fmt: skip


def row(truth=None, *effects, verdict="effects shown", **columns):
    return complete(
        {"rig": "r", "key": "k", "verdict": verdict, "effects": list(effects), "seconds": 2.0}
        | truth_columns(truth)
        | columns
    )


FRICTION = Truth("dry_friction", {"a_wx": 0.060}, (TrueEffect("dry_friction", "pitch", 0.02),))
AIRSPEED = Truth(
    "airspeed",
    {},
    (TrueEffect("airspeed_thrust_loss", "pitch", 0.03), TrueEffect("airspeed_thrust_loss", "elevation", 0.03)),
)
DETENT = Truth("detent", unknown=TrueUnknown("pitch", "pitch"))


# --- sources -----------------------------------------------------------------------------------------------------


def folder_with(tmp_path, *files):
    for file in files:
        path = tmp_path / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(file)
    return tmp_path


def test_every_sub_folder_with_a_log_is_a_rig_as_for_a_fleet(tmp_path):
    folder_with(tmp_path, "b/run1.mat", "b/run2.csv", "a/train.csv", "a/held1.csv", "notes/readme.txt", "other.csv")
    first, second = rigs_below(tmp_path)
    assert (first.rig, [path.name for path in first.held_out]) == ("a", ["held1.csv"])
    assert (second.rig, [path.name for path in second.training], second.held_out) == ("b", ["run1.mat", "run2.csv"], ())


def test_sub_folder_without_a_log_to_fit_to_is_refused_by_name(tmp_path):
    folder_with(tmp_path, "a/held.csv")
    with pytest.raises(ConfigurationError, match=r"a holds only held.csv"):
        rigs_below(tmp_path)


@pytest.mark.parametrize("folder", ["empty", "missing"])
def test_folder_without_rigs_is_refused(tmp_path, folder):
    (tmp_path / "empty").mkdir()
    with pytest.raises(ConfigurationError, match=folder):
        rigs_below(tmp_path / folder)


def test_rigs_own_configuration_comes_before_the_shared_one(tmp_path):
    folder_with(tmp_path, "a/train.csv", "a/held.csv", "a/heli.toml", "b/train.csv", "b/held.csv", "lab.toml")
    own, shared = rigs_below(tmp_path, tmp_path / "lab.toml")
    assert (own.configuration.parent.name, shared.configuration.name) == ("a", "lab.toml")


def test_content_of_a_folder_follows_every_byte_of_its_logs_and_its_configuration(tmp_path):
    folder_with(tmp_path, "train.csv", "held.csv", "heli.toml", "notes.txt")
    source = rig_folder(tmp_path, "a")
    seen = {source.content()}
    (tmp_path / "notes.txt").write_text("nothing that a diagnosis reads")
    assert source.content() in seen
    for name in ("train.csv", "held.csv", "heli.toml"):
        (tmp_path / name).write_text("other")
        assert source.content() not in seen
        seen.add(source.content())


GENERATOR = """
from heli_identifier.tools import Rig
from heli_identifier.records import Log
from heli_identifier.tracing import DiagnosisSettings

def make(seed):
    log = Log("log", 100.0, [[seed, 0.0]] * 9, [[0.0, 0.0, 0.0]] * 9)
    return Rig((log,), (log,))

def nothing(seed):
    return None
"""


@pytest.fixture
def generator(tmp_path, monkeypatch):
    """Make a module that rigs can come from and give its name, another one for every test."""
    name = f"made_{tmp_path.name}"
    (tmp_path / f"{name}.py").write_text(GENERATOR)
    monkeypatch.syspath_prepend(tmp_path)
    return name


def test_generator_is_called_with_one_seed_after_another(generator):
    sources = generated_rigs(f"{generator}:make", 3, first_seed=5)
    assert [source.rig for source in sources] == ["seed 5", "seed 6", "seed 7"]
    assert [source.load().training[0].voltages[0, 0] for source in sources] == [5.0, 6.0, 7.0]


def test_content_of_a_generated_rig_follows_seed_and_source(generator, tmp_path):
    one, other = generated_rigs(f"{generator}:make", 2)
    assert one.content() != other.content()
    before = source_digest([generator])
    (tmp_path / f"{generator}.py").write_text(GENERATOR.replace("9", "8"))
    assert source_digest([generator]) != before


@pytest.mark.parametrize(
    "name, said",
    [("make", "module:function"), ("nowhere_at_all:make", "nowhere_at_all"), ("json:make", "function make")],
)
def test_generator_that_cannot_be_found_is_refused_before_anything_runs(name, said):
    with pytest.raises(ConfigurationError, match=said):
        generated_rigs(name, 1)


def test_generator_that_gives_no_rig_is_told_so(generator):
    with pytest.raises(ConfigurationError, match="NoneType"):
        GeneratedRig("r", f"{generator}:nothing", (1,)).load()


def test_rig_without_a_log_to_judge_by_is_refused():
    log = Log("log", 100.0, np.zeros((9, 2)), np.zeros((9, 3)))
    with pytest.raises(ConfigurationError, match="held_out"):
        Rig((log,), ())


def test_truth_that_the_catalogue_lacks_is_refused():
    with pytest.raises(ConfigurationError, match="dry_friction.*rotors"):
        TrueEffect("dry_friction", "rotors", 0.02)


# --- keys --------------------------------------------------------------------------------------------------------


def test_result_is_called_by_rig_content_settings_and_code():
    first = result_key("a", "content", SETTINGS, "code")
    assert first == result_key("a", "content", replace(SETTINGS), "code")
    others = {
        result_key("b", "content", SETTINGS, "code"),
        result_key("a", "other", SETTINGS, "code"),
        result_key("a", "content", replace(SETTINGS, voltage_limit=6.0), "code"),
        result_key("a", "content", SETTINGS, "newer"),
    }
    assert len(others | {first}) == 5


# --- results -----------------------------------------------------------------------------------------------------


def test_rows_come_back_from_their_file_as_they_were(tmp_path):
    rows = [
        row(FRICTION, found("dry_friction", "pitch"), a_wx=0.061, a_wx_se=0.002, measures={"told_score": 7.5}),
        row(),
        complete({"rig": "r", "key": "k", "error": "unreadable"}),
    ]
    assert read_rows(write_rows(rows, tmp_path / "k.parquet")) == rows
    assert read_row(tmp_path, "k") == rows[0]
    assert read_row(tmp_path, "another") is None
    assert [path.name for path in tmp_path.iterdir()] == ["k.parquet"]  # no draft is left


def test_file_that_is_no_result_is_named(tmp_path):
    (tmp_path / "k.parquet").write_text("torn")
    with pytest.raises(ConfigurationError, match=r"k\.parquet"):
        read_row(tmp_path, "k")


def test_folder_that_cannot_hold_results_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigurationError, match="file cannot hold results"):
        run_campaign([], tmp_path / "file")


# --- against the truth -------------------------------------------------------------------------------------------


def test_effect_on_another_axis_is_false():
    wrong = row(FRICTION, found("dry_friction", "travel"))
    assert not named_first(wrong)
    assert false_entries(wrong) == [("dry_friction", "travel")]


def test_effect_that_acts_on_two_axes_is_true_on_both_and_named_by_either():
    both = row(AIRSPEED, found("airspeed_thrust_loss", "elevation"), found("airspeed_thrust_loss", "pitch"))
    one = row(AIRSPEED, found("airspeed_thrust_loss", "pitch"))
    for judged in (both, one):
        assert named_first(judged)
        assert all_named(judged)
        assert false_entries(judged) == []


def test_second_effect_that_the_rig_lacks_is_false_but_leaves_the_first_named():
    judged = row(FRICTION, found("dry_friction", "pitch"), found("motor_lag", "rotors"))
    assert named_first(judged)
    assert false_entries(judged) == [("motor_lag", "rotors")]
    assert not right(judged)


def test_strongest_entry_decides_what_is_named_first():
    assert not named_first(row(FRICTION, found("motor_lag", "rotors"), found("dry_friction", "pitch")))


def test_unknown_effect_is_an_accusation_on_a_rig_without_one():
    judged = row(Truth("clean"), found("unknown", "pitch", None, None, "pitch"), verdict="unknown effect")
    assert false_entries(judged) == [("unknown", "pitch")]


@pytest.mark.parametrize(
    "axis, variable, verdict, recognised",
    [
        ("pitch", "pitch", "unknown effect", True),
        ("travel", "pitch", "unknown effect", False),
        ("pitch", "time", "unknown effect", False),
        ("pitch", "pitch", "effects shown", False),
    ],
)
def test_unknown_torque_is_recognised_by_axis_variable_and_verdict(axis, variable, verdict, recognised):
    judged = row(DETENT, found("unknown", axis, None, None, variable), verdict=verdict)
    assert unknown_recognised(judged) is recognised
    assert false_entries(judged) == []


def test_clean_rig_with_nothing_found_is_right_and_a_failed_one_is_not():
    assert right(row(Truth("clean"), verdict="model adequate"))
    assert not right(complete({"rig": "r", "error": "unreadable"} | truth_columns(Truth("clean"))))


def test_interval_covers_what_lies_within_1_96_standard_errors():
    held = coverage(
        row(FRICTION, found("dry_friction", "pitch", 0.02 + 1.9e-3, 1e-3), a_wx=0.060 + 2.0e-3, a_wx_se=1e-3)
    )
    assert held == {"dry_friction pitch": True, "a_wx": False}


def test_what_is_not_known_is_not_counted_as_covered():
    truth = Truth("ground_effect", {}, (TrueEffect("ground_effect", "elevation", None),))
    assert coverage(row(truth, found("ground_effect", "elevation"), a_wx=0.06, a_wx_se=0.01)) == {}


# --- summary -----------------------------------------------------------------------------------------------------


def test_summary_counts_each_kind_for_itself_and_failures_apart():
    summary = summarised(
        [
            row(FRICTION, found("dry_friction", "pitch")),
            row(FRICTION, found("motor_lag", "rotors")),
            row(Truth("clean"), verdict="model adequate", seconds=4.0),
            complete({"rig": "bad", "error": "unreadable", "seconds": 0.1}),
        ]
    )
    friction, clean = summary.kinds
    assert (friction.kind, friction.rigs, friction.named_first, friction.false, friction.right) == (
        "dry_friction",
        2,
        1,
        1,
        1,
    )
    assert (clean.kind, clean.rigs, clean.adequate, clean.false, clean.right) == ("clean", 1, 1, 0, 1)
    assert summary.failures == (("bad", "unreadable"),)
    assert summary.coverage == 1.0
    assert summary.seconds == (2.0, pytest.approx(3.8), 4.0)  # of 2, 2, 4: the 95 % quantile lies at 2 + .9 * 2


def test_summary_without_truth_judges_nothing():
    (kind,) = summarised([row(None, found("motor_lag", "rotors"))]).kinds
    assert (kind.kind, kind.rigs, kind.shown, kind.false, kind.right) == ("", 1, 1, 0, 0)
    assert summarised([]).seconds is None
