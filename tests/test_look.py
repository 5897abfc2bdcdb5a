"""`heli look` and `hi.look`: what logs of a rig that a controller flies determine, in the air of a real room."""

import json

import numpy as np
import pytest

import heli_identifier as hi
from benchmarks.rigs import windy_logs
from heli_identifier.records import write_log
from tests.blind.windy import windy_rig
from tests.commands import heli

GAINS = ("k_x", "k_z", "k_y")


@pytest.fixture(scope="module")
def windy():
    """A bare rig in swirling air, its logs, and what they determine."""
    rig = windy_rig(11, "swirl", effects="bare")
    logs = windy_logs(rig, "a")
    return rig, logs, hi.look(logs)


def test_the_loop_is_recognised_a_bare_rig_accused_of_nothing_and_its_gains_are_found_in_swirling_air(windy):
    """Within three half-widths and a quarter of the truth: a likelihood with one colour of air errs by a third."""
    rig, logs, looked = windy
    references = looked.identification.references
    assert references.closed_loop and {"pitch", "elevation"} <= set(references.names)
    assert [name for name, _, _, established in looked.effects if established] == []
    slopes = rig.truth.slopes(float(np.mean(np.concatenate([log.voltages for log in logs]))))
    for name in GAINS:
        estimate = looked.gains[name].estimate
        error = abs(estimate.value - slopes[name])
        assert error < min(3.0 * 1.96 * estimate.standard_error, 0.25 * abs(slopes[name]))


def test_three_lines_say_who_flew_what_moved_and_what_is_determined_and_the_command_prints_json(windy, tmp_path):
    _, logs, looked = windy
    flown, moved, gains = looked.lines
    assert flown.startswith("A controller flew; moved from outside: ")
    assert all(axis in moved for axis in ("pitch", "elevation", "travel"))
    assert all(name in gains for name in GAINS)  # each is either determined or named as missing
    paths = [write_log(log, tmp_path / f"{log.name}.csv") for log in logs[:2]]
    done = heli("look", *paths, "--json")
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["closed_loop"] and set(found["gains"]) == set(GAINS)
    assert found["movement_counts"]["pitch"] > 10.0
