"""The configuration of a rig: what it says and refuses, its template; what `heli init LOG` finds by physics."""

from dataclasses import fields, replace

import numpy as np
import pytest
from scipy.io import savemat
from scipy.signal import lfilter

from heli_identifier import records
from heli_identifier.errors import ConfigurationError, LogError
from heli_identifier.records import LogFormat, RigConfiguration, demo_files, find_suspicions, guess, read_log, response
from heli_identifier.records.guess import _guess_angle_unit, _guess_signs
from heli_identifier.records.heli_toml import read_examples
from heli_identifier.records.units import ANGLES, NAMED
from heli_plant.parameters import TABLE_2
from tests.commands import heli
from tests.simulated import drive, noisy_log


def test_the_template_holds_the_defaults_shows_every_key_and_all_of_them_can_be_switched_on(tmp_path):
    template = records.write_template(tmp_path / "heli.toml")
    assert records.read_configuration(template) == RigConfiguration()
    lines = template.read_text(encoding="utf-8").splitlines()
    template.write_text("\n".join(line.removeprefix("# ") if " = " in line else line for line in lines), "utf-8")
    rig = records.read_configuration(template)
    assert (rig.rest_pitch, rig.format.start) == (-0.14, 6.0)
    content, elsewhere = read_examples(), {"voltage_limit", "encoder_counts"}
    usual = RigConfiguration()
    kinds = {"rig": usual, "log": usual.format, "controller": usual.controller, "geometry": usual.geometry}
    names = {section: {one.name for one in fields(kind)} for section, kind in kinds.items()}
    names |= {"rig": names["rig"] - {"format", "controller", "geometry"} | elsewhere, "log": names["log"] - elsewhere}
    assert {section: {*own} for section, own in content.items()} == names
    assert {*content["controller"]["weights"]} == {one.name for one in fields(usual.controller.weights)}
    assert {*content["log"]["columns"]} == {*content["log"]["units"]} == {*content["log"]["signs"], "time"} == {*NAMED}
    assert content["log"]["references"].keys() == content["rig"]["encoder_counts"].keys() == {*ANGLES}


def test_keys_arrive_where_they_belong_and_a_format_made_in_python_is_held_to_the_same_names(tmp_path):
    rows = ("[rig]", "motor_time_constant = 0.12", "voltage_limit = 6", "encoder_counts.pitch = 2000")
    rows += ("encoder_counts.travel = 16384", "[log]", "end = 60.5", 'units = {pitch = "deg"}')
    (tmp_path / "heli.toml").write_text("\n".join(rows))
    rig = records.read_configuration(tmp_path / "heli.toml")
    form = LogFormat(units={"pitch": "deg"}, end=60.5, encoder_counts=(2000, 4096, 16384), voltage_limit=6.0)
    assert rig == RigConfiguration(motor_time_constant=0.12, format=form)
    combined = LogFormat(signs={"v_rear": -1}).to_project_signs({"v_sum": 3.0, "v_difference": 1.0})
    assert combined == {"v_front": 2.0, "v_rear": -1.0}
    with pytest.raises(ConfigurationError, match="log.references.yaw is no axis"):
        LogFormat(references={"yaw": "psi"})


def test_what_is_given_of_the_rig_is_the_configuration_that_all_logs_were_read_with():
    rig = RigConfiguration(motor_time_constant=0.12, format=LogFormat(encoder_counts=(2000, 2000, 2000)))
    (path, second, *_), _ = records.demo_files("rig-a")
    own, too, other = records.read_log(path, rig), records.read_log(second, rig), records.read_log(second)
    cases = ((own, too), (own, other), (other, own), ())
    assert [records.common_configuration(logs) for logs in cases] == [rig, *[RigConfiguration()] * 3]
    contradicting = replace(too, configuration=replace(rig, name="another rig"))
    with pytest.raises(LogError, match="read with different configurations"):
        records.common_configuration((own, contradicting))


TRUE = read_log(demo_files("rig-b")[0][0], end=45.0)
RNG, TURN = np.random.default_rng(7), 2.0 * np.pi


def quantised(angle, counts):
    step = TURN / counts
    return step * np.round(angle / step)


def rate(angle):
    """A rate as Simulink's filtered derivative gives it: s/(s/20 + 1), held at the samples."""
    h, away = TRUE.step, angle - angle[0]
    return 20.0 * (away - lfilter([0.0, 20.0 * h], [1.0, 20.0 * h - 1.0], away))


def angles(scale=1.0):
    pitch, elevation, travel = TRUE.angles.T
    measured = quantised(travel, 8192), quantised(pitch, 4096), quantised(elevation, 4096)
    return [scale * column for angle in measured for column in (angle, rate(angle))]


FRONT, REAR = TRUE.voltages.T
REFERENCES = [np.repeat(RNG.uniform(-0.3, 0.3, 9), 1000)[: TRUE.samples] for _ in range(2)]
"""Steps that a controller was asked to follow, which nothing of this log did."""
SUM, DIFFERENCE = FRONT + REAR, FRONT - REAR
BOTH, COMBINED = {"v_front": 8, "v_rear": 9}, {"v_difference": 8, "v_sum": 9}
LAYOUTS = {
    "thirteen rows in radians, with references, sum, difference and both voltages": (
        [*angles(), *REFERENCES, DIFFERENCE, SUM, FRONT, REAR], {"v_front": 12, "v_rear": 13}, "rad", {}, False,
    ),
    "nine rows in degrees, with v_sum": ([*angles(np.degrees(1.0)), DIFFERENCE, SUM], COMBINED, "deg", {}, False),
    "nine rows, the difference reversed": ([*angles(), -DIFFERENCE, SUM], COMBINED, "rad", {"v_difference": -1}, False),
    "smooth estimates of the angles behind the measured ones": (
        [*angles(), FRONT, REAR, *(np.convolve(x, np.ones(9) / 9) for x in TRUE.angles[:-8].T)], BOTH, "rad", {}, False,
    ),
    "angles from 0 to a turn": (
        [*(c if k % 2 else c % TURN for k, c in enumerate(angles())), DIFFERENCE, SUM], COMBINED, "rad", {}, False,
    ),
    "the rear rotor before the front one": ([*angles(), REAR, FRONT], BOTH, "rad", {}, True),
    "pitch and elevation that count the other way": (
        [*angles()[:2], *(-column for column in angles()[2:]), FRONT, REAR], BOTH, "rad",
        {"elevation": -1, "pitch": -1}, False,
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", LAYOUTS)
def test_the_rows_of_an_unnamed_matrix_are_found_by_what_they_do_to_each_other(tmp_path, case):
    rows, of_voltages, unit, signs, swapped = LAYOUTS[case]
    savemat(tmp_path / "log.mat", {"ans": np.vstack([TRUE.time, *rows])})
    found = guess(tmp_path / "log.mat")
    places = {"time": 1, "travel": 2, "pitch": 4, "elevation": 6} | of_voltages
    assert found.format.columns == {signal: f"ans({row},:)" for signal, row in places.items()}
    assert {found.format.units[angle] for angle in ("pitch", "elevation", "travel")} == {unit}
    assert (found.format.signs, found.format.swap_rotors) == (signs, swapped)
    assert ("v_difference" in of_voltages) is ("of the pitch's" in found.reasons.get("columns.v_difference", ""))
    (doubt,) = found.doubts
    assert "mirror image" in doubt
    log = read_log(tmp_path / "log.mat", found.format)
    assert np.allclose(log.voltages, TRUE.voltages, atol=1e-12)
    # An encoder of 4096 counts is off by half a count at most.
    assert np.abs(log.angles - TRUE.angles).max() <= np.pi / 4096 + 1e-9 and find_suspicions(log) == ()


def test_the_unit_of_an_angle_and_the_counts_of_its_encoder_follow_from_its_steps():
    turns = 0.1 * np.sin(0.7 * TRUE.time)
    for count in (1000, 4096, 16384):
        for unit, turn in (("rad", TURN), ("deg", 360.0)):
            assert _guess_angle_unit(turn / count * np.round(count * turns))[::2] == (unit, count)
    assert _guess_angle_unit(np.round(4096 * turns))[::2] == ("counts", None)


def test_the_filter_of_the_search_answers_a_step_as_its_double_pole():
    t = np.arange(-500, 500) / 100.0
    found, w = response.filter_columns((t >= 0.0)[:, None] * 1.0, 0.01), response._BANDWIDTH
    x = (w * np.maximum(t, 0.0))[-len(found.value) :]
    exact = 1.0 - (1.0 + x) * np.exp(-x), w * x * np.exp(-x), w**2 * (1.0 - x) * np.exp(-x) * (t[-len(x) :] >= 0.0)
    # exact for a held input; scipy's repeated pole costs half of the digits
    np.testing.assert_allclose(np.hstack(found[:3]), np.transpose(exact), rtol=0, atol=1e-7)
    means, coarse = response.average(np.arange(11.0)[:, None], 100.0)
    assert (means.tolist(), coarse) == ([[1.5], [5.5]], 0.04)  # whole blocks of 25 Hz


def test_the_rotors_are_the_columns_whose_sum_and_difference_the_file_holds_too(tmp_path):
    """At a sum of 3 V, held to .02 V, a rotor with the sum explains the angles as well as both rotors do."""
    total, difference = (drive(45.0) @ [[1.0, 1.0], [1.0, -1.0]]).T
    total = 3.0 + 0.02 * (total - total.mean()) / total.std()
    log = noisy_log(TABLE_2, 0.5 * np.column_stack((total + difference, total - difference)), 0)
    rows = [log.time, *log.angles.T, difference, total, *log.voltages.T]
    savemat(tmp_path / "log.mat", {"ans": np.vstack(rows)})
    columns = guess(tmp_path / "log.mat").format.columns
    assert (columns["v_front"], columns["v_rear"]) == ("ans(7,:)", "ans(8,:)")


def test_a_sign_that_is_not_beyond_doubt_is_left_as_it_is():
    gains = response.Gains(np.array([-1.0, -1.0, 1.0]), np.ones(3), np.zeros(3))
    assert _guess_signs(True, gains, {}) == ({}, False)
    assert _guess_signs(True, gains._replace(score=np.full(3, 100.0)), {}) == ({"elevation": -1, "pitch": -1}, False)


def test_a_file_without_headers_is_looked_into_and_one_of_few_columns_refused(tmp_path):
    rows = [np.arange(TRUE.samples), TRUE.time, *angles(), FRONT, REAR]  # the first column counts them
    np.savetxt(tmp_path / "log.csv", np.transpose(rows), delimiter=",", fmt="%.9g")
    places = {"time": 2, "travel": 3, "pitch": 5, "elevation": 7, "v_front": 9, "v_rear": 10}
    assert guess(tmp_path / "log.csv").format.columns == {s: f"column {place}" for s, place in places.items()}
    np.savetxt(tmp_path / "log.csv", np.transpose((TRUE.time, FRONT, REAR)), delimiter=",", header="a,b,c", comments="")
    with pytest.raises(LogError, match="2 columns of numbers .* two voltages and three angles of a rig are not found"):
        guess(tmp_path / "log.csv")


def test_the_configuration_that_init_writes_reads_the_log_and_gives_every_reason(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows, *_ = LAYOUTS["pitch and elevation that count the other way"]
    savemat("log.mat", {"ans": np.vstack([TRUE.time, *rows])})
    said = heli("init", "log.mat")
    assert said.exit_code == 0, said.output
    text = (tmp_path / "heli.toml").read_text()
    assert 'pitch = "ans(4,:)"' in text and "a larger front voltage lowers it in the file" in text
    assert find_suspicions(read_log("log.mat", records.read_configuration("heli.toml"))) == ()
    again = heli("init", "log.mat")
    assert (again.exit_code, "exists already" in again.output) == (2, True)


V, A = TRUE.voltages, TRUE.angles
WRONG = {
    "rotors exchanged": (V[:, ::-1], A, "the pitch falls where v_front exceeds v_rear"),
    "pitch mirrored": (V, A * [-1.0, 1.0, 1.0], "the pitch falls where v_front exceeds v_rear"),
    "elevation mirrored": (V, A * [1.0, -1.0, 1.0], "the elevation falls where the voltages rise"),
    "angles taken for voltages": (0.5 * A[:, 1:], A, "neither the pitch nor the elevation is seen to follow"),
}


def test_wrong_columns_and_signs_are_noticed_on_reading():
    assert find_suspicions(TRUE) == ()
    for voltages, angles, said in WRONG.values():
        (found,) = find_suspicions(replace(TRUE, voltages=voltages, angles=angles))
        assert said in found


def test_what_was_asked_of_an_axis_is_found_by_its_name(tmp_path):
    asked = np.where(np.arange(TRUE.samples) // 500 % 2, 5.0, 0.0)
    values = np.column_stack((*TRUE.columns.values(), asked, np.radians(asked), asked))
    values[:, 3:6] *= 2.0  # as if the encoders had half the counts
    path, names = tmp_path / "asked.csv", ",".join(TRUE.columns)
    np.savetxt(path, values, delimiter=",", header=f"{names},elev_ref [deg],pitch setpoint,a", comments="")
    found = guess(path)
    assert found.format.references == {"pitch": "pitch setpoint", "elevation": "elev_ref [deg]"}
    assert found.format.encoder_counts == (2048, 2048, 4096)
    read = read_log(path, found.format).references
    # a column without a unit has that of its axis
    np.testing.assert_allclose(read["elevation"], read["pitch"], atol=1e-9)
