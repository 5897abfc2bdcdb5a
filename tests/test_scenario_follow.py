"""The scenario ``follow``: the units give what the pure follower gives, and the plant stays on the rig."""

import numpy as np
import pytest

from fmu_src.master import run
from heli_identifier.following import FollowPlan, FollowSettings, Sample, correct, start_correcting
from heli_plant.observer import CORRECTED
from heli_plant.parameters import TABLE_2
from tests.following import H, record

STEPS = 4100
CHANGE = 15.0


@pytest.fixture(scope="module")
def rows():
    return record(45.0, TABLE_2._replace(k_z=1.2 * TABLE_2.k_z), CHANGE, seed=4)


@pytest.fixture(scope="module")
def result(rows, tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "log.csv"
    head = "time [s],v_front [V],v_rear [V],pitch [rad],elevation [rad],travel [rad]"
    table = np.column_stack([np.arange(len(rows)) * H, rows])
    np.savetxt(path, table, "%.17g", ",", header=head, comments="")
    names = ("v_front", "v_rear", "pitch", "elevation", "travel")
    first = {f"plant.initial.{name}": value for name, value in zip(names, rows[0], strict=True)}
    return run("follow", STEPS * H, H, {"player.log.path": str(path), **first})


@pytest.fixture(scope="module")
def followed(rows):
    """States of the pure follower after samples 1, 2, ..., and its events; the units show them one step later."""
    plan = FollowPlan(FollowSettings())
    state, found, events = start_correcting(plan, Sample(*rows[0])), [], []
    for row in rows[1 : STEPS - 1]:
        state, said = correct(state, Sample(*row), plan)
        found.append(state)
        events.extend(said)
    return found, events, plan


def shown(result, name):
    return result.values[:, result.names.index(name)]


def test_the_units_give_the_corrections_of_the_pure_follower(result, followed):
    states, _, plan = followed
    for place, (name, _) in enumerate(CORRECTED):
        wanted = [state.twin.values[place] - plan.alone.values[place] for state in states]
        assert shown(result, f"corrector.correction.{name}")[2:STEPS].tolist() == wanted


def test_the_units_report_the_events_of_the_pure_follower(result, followed):
    _, events, plan = followed
    names = [change.name for change in plan.changes]
    assert events[-1].what == "adopted"
    assert shown(result, "corrector.event.count")[STEPS - 1] == len(events)
    assert shown(result, "corrector.event.change")[STEPS - 1] == names.index(events[-1].name) + 1
    assert shown(result, "corrector.event.value")[STEPS - 1] == events[-1].value


def test_the_corrected_plant_predicts_the_sample_to_come(result, rows):
    """After the adoption the plant's error is that of the encoders: counts of 1.5e-3 rad, shaken by a quarter."""
    late = slice(STEPS - 600, STEPS - 1)
    error = shown(result, "plant.elevation")[late] - np.array([row[3] for row in rows])[late]
    assert np.sqrt(np.mean(error**2)) < 1e-3
