"""The compiled loop of the follow benchmark is the corrector's own step."""

import numpy as np

from benchmarks.follow_fast import corrected
from heli_identifier.online.following import FollowSettings, prepare_following
from heli_plant.parameters import TABLE_2
from tests.following import followed, record


def test_flights_by_blocks_are_those_of_the_pure_step_to_the_bit():
    rows = record(62.0, TABLE_2._replace(k_z=1.2 * TABLE_2.k_z), 25.0, seed=4)
    fresh = [0.0 if k % 977 == 0 else 1.0 for k in range(len(rows))]
    state, events, outputs, _ = followed(rows, fresh)
    said, adoptions, errors, last = corrected(np.array(rows), fresh, prepare_following(FollowSettings()))
    assert said == events
    assert len(adoptions) == 1
    assert last == state
    assert [error[0] for error in errors] == [output.time for output in outputs if output.compared]
