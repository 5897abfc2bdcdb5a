"""Several logs as one data set, the demonstration rigs, and measured logs of other laboratories."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from heli_identifier.errors import LogError
from heli_identifier.records import (
    DEMO_RIGS,
    Log,
    check_excitation,
    check_moving,
    demo_logs,
    named_apart,
    read_data_set,
    read_log,
    read_logs,
)

REAL = Path(__file__).resolve().parents[2] / "shared" / "real"
needs_real = pytest.mark.skipif(not REAL.is_dir(), reason="the measured logs are not part of the project")


@pytest.mark.parametrize("rig", DEMO_RIGS)
def test_a_demonstration_rig_reads_as_three_training_logs_and_a_held_out_one(rig):
    training, held_out = read_data_set(*demo_logs(rig))
    assert [log.name for log in training] == ["train1", "train2", "train3"]
    assert [log.name for log in held_out] == ["held"]
    assert all((log.rate_hz, log.samples, log.notes) == (100.0, 9000, ()) for log in (*training, *held_out))


def test_an_unknown_demonstration_rig_is_refused_with_the_known_ones():
    with pytest.raises(LogError, match="rig-a, rig-b, rig-c"):
        demo_logs("rig-z")


def test_logs_of_one_name_are_told_apart_by_their_folders():
    (a_train, *_), (a_held,) = demo_logs("rig-a")
    _, (b_held,) = demo_logs("rig-b")
    logs = read_logs([a_held, b_held, a_train])
    assert [log.name for log in logs] == ["rig-a/held", "rig-b/held", "train1"]


def test_a_training_log_and_a_held_out_one_of_one_name_are_told_apart_as_well(tmp_path):
    training, held_out = demo_logs("rig-a")
    for folder, log in (("monday", training[0]), ("tuesday", held_out[0])):
        (tmp_path / folder / "logs").mkdir(parents=True)
        shutil.copy(log, tmp_path / folder / "logs" / "run.csv")
    paths = [tmp_path / folder / "logs" / "run.csv" for folder in ("monday", "tuesday")]
    (seen,), (judge,) = read_data_set(paths[:1], paths[1:])
    assert (seen.name, judge.name) == ("monday/logs/run", "tuesday/logs/run")


def test_logs_that_no_folder_tells_apart_are_numbered():
    still = np.zeros(1000)
    (log, *_), _ = demo_logs("rig-a")
    assert [log.name for log in named_apart([run(still, still), run(still, still)])] == ["run", "run (2)"]
    assert [log.name for log in read_logs([log, log])] == ["train1", "train1 (2)"]


def run(front, rear):
    return Log("run", 100.0, np.column_stack([front, rear]), np.zeros((1000, 3)))


def test_a_voltage_that_is_constant_in_every_log_leaves_nothing_to_identify():
    still, moving = np.full(1000, 1.5), np.sin(np.arange(1000) / 50.0)
    with pytest.raises(LogError, match="v_rear is constant in every log, so there is nothing to identify"):
        check_excitation([run(moving, still), run(moving, still)])
    with pytest.raises(LogError, match="v_front is constant"):
        check_excitation([run(still, moving)])


def test_a_log_in_which_an_axis_stands_still_can_serve_no_diagnosis():
    moving = np.sin(np.outer(np.arange(1000) / 50.0, (1.0, 2.0, 3.0)))
    still = moving.copy()
    still[:, 1:] = 0.25
    fine, clamped = (Log(name, 100.0, moving[:, :2], a) for name, a in (("fine", moving), ("bad", still)))
    check_moving([fine])
    with pytest.raises(
        LogError, match="bad: elevation never changes and travel never changes: a clamped axis or a dead encoder"
    ):
        check_moving([fine, clamped])


def test_a_voltage_that_is_constant_in_some_logs_is_welcome():
    still, moving = np.full(1000, 1.5), np.sin(np.arange(1000) / 50.0)
    check_excitation([run(moving, still), run(still, moving)])


def test_a_data_set_without_logs_is_refused():
    with pytest.raises(LogError, match="name at least one file"):
        read_data_set([])


def test_a_held_out_log_may_not_be_one_that_was_fitted_even_under_another_name(tmp_path):
    training, _ = demo_logs("rig-a")
    copy = shutil.copy(training[1], tmp_path / "unseen.csv")
    with pytest.raises(LogError, match=r"unseen.csv is held out for validation but shares samples with .*train2.csv"):
        read_data_set(training, [copy])


def test_a_training_log_may_not_count_twice():
    training, held_out = demo_logs("rig-a")
    with pytest.raises(LogError, match="give each training log once"):
        read_data_set([*training, training[0]], held_out)


def test_a_held_out_log_may_not_count_twice(tmp_path):
    training, held_out = demo_logs("rig-a")
    copy = shutil.copy(held_out[0], tmp_path / "copy.csv")
    with pytest.raises(LogError, match="copy.csv holds the same samples as .*held.csv; give each held-out log once"):
        read_data_set(training, [*held_out, copy])


@needs_real
@pytest.mark.parametrize("number", range(1, 6))
def test_a_closed_loop_log_of_another_laboratory_is_read_behind_its_take_off(number):
    log = read_log(REAL / f"ntnu-{number}.csv", start=6.0)
    assert log.rate_hz == 500.0
    assert log.start == 6.0
    assert np.abs(log.voltages).max() <= 5.0  # its commands were logged behind the clip
    assert log.signal("elevation").max() > -0.5  # it rests at -.53 rad on the table, so it flies


@needs_real
@pytest.mark.parametrize("number", [1, 2, 3])
def test_an_open_loop_log_beyond_the_amplifiers_limit_is_read_and_the_fact_is_said(number):
    log = read_log(REAL / f"ctu-{number}.csv")
    assert log.rate_hz == 500.0
    assert 5.0 < np.abs(log.voltages).max() < 6.5
    assert any("exceeds +-5 V" in note for note in log.notes)


@needs_real
def test_a_table_that_is_no_log_is_refused_with_what_was_found():
    with pytest.raises(LogError, match="found 'vs_total_V', 'elev_ss_rad', 'sin_elev'"):
        read_log(REAL / "ctu-static-thrust.csv")
