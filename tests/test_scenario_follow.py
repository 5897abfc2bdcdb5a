"""The scenario ``follow``: the units give what the pure follower gives, and the plant stays on the rig."""

import numpy as np

from fmu_src.master import run
from heli_identifier.following import FollowPlan, FollowSettings, Sample, correct, start_correcting
from heli_identifier.records import Log, write_log
from heli_plant.observer import CORRECTED
from heli_plant.parameters import TABLE_2
from tests.simulated import H, changing

STEPS, CHANGE = 4100, 15.0


def test_the_units_give_corrections_and_events_of_the_pure_follower_and_the_plant_predicts_the_sample_to_come(tmp_path):
    rows = changing(45.0, TABLE_2._replace(k_z=1.2 * TABLE_2.k_z), CHANGE, seed=4)
    table = np.array(rows)
    path = write_log(Log("rig", 1.0 / H, table[:, :2], table[:, 2:]), tmp_path / "log.csv")
    names = ("v_front", "v_rear", "pitch", "elevation", "travel")
    first = {f"plant.initial.{name}": value for name, value in zip(names, rows[0], strict=True)}
    result = run("follow", STEPS * H, H, {"player.log.path": str(path), **first})
    plan = FollowPlan(FollowSettings())
    state, states, events = start_correcting(plan, Sample(*rows[0])), [], []
    for row in rows[1 : STEPS - 1]:
        state, said = correct(state, Sample(*row), plan)
        states.append(state)
        events.extend(said)
    # the units show one step later what the follower knows after samples 1, 2, ...
    for place, (name, _) in enumerate(CORRECTED):
        wanted = [state.twin.values[place] - plan.alone.values[place] for state in states]
        assert result.column(f"corrector.correction.{name}")[2:STEPS].tolist() == wanted
    change = [change.name for change in plan.changes].index(events[-1].name) + 1
    assert events[-1].what == "adopted"
    for name, value in (("count", len(events)), ("change", change), ("value", events[-1].value)):
        assert result.column(f"corrector.event.{name}")[STEPS - 1] == value
    # after the adoption the plant's error is that of the encoders: counts of 1.5e-3 rad, shaken by a quarter
    late = slice(STEPS - 600, STEPS - 1)
    error = result.column("plant.elevation")[late] - table[late, 3]
    assert np.sqrt(np.mean(error**2)) < 1e-3
