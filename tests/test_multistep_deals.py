"""Deals of logs: every log in one part, half to fit; agreement of what is named."""

import numpy as np
import pytest

from benchmarks.deals import deal, jaccard


@pytest.mark.parametrize("count, sizes", [(3, (1, 1, 1)), (5, (3, 1, 1)), (8, (4, 2, 2)), (12, (6, 3, 3))])
def test_deal_gives_every_log_to_one_part(count, sizes):
    parts = deal(count, np.random.default_rng(0))
    assert tuple(len(part) for part in parts) == sizes
    assert sorted(np.concatenate(parts)) == list(range(count))


def test_sets_that_are_both_empty_are_no_agreement():
    assert jaccard([{"a", "b"}, {"a"}, set()]) == pytest.approx((0.5 + 0.0 + 0.0) / 3)
    assert np.isnan(jaccard([set(), set()]))
