"""Deals of logs: every log in one part, half to fit; agreement of what is named."""

import numpy as np
import pytest

from benchmarks.deals import deal, group_jaccard, jaccard


@pytest.mark.parametrize("count, sizes", [(3, (1, 1, 1)), (5, (3, 1, 1)), (8, (4, 2, 2)), (12, (6, 3, 3))])
def test_deal_gives_every_log_to_one_part(count, sizes):
    parts = deal(count, np.random.default_rng(0))
    assert tuple(len(part) for part in parts) == sizes
    assert sorted(np.concatenate(parts)) == list(range(count))


def test_sets_that_are_both_empty_are_no_agreement():
    assert jaccard([{"a", "b"}, {"a"}, set()]) == pytest.approx((0.5 + 0.0 + 0.0) / 3)
    assert np.isnan(jaccard([set(), set()]))


def test_groups_agree_where_either_names_what_the_other_is_named_for():
    either = [{"a": {"a", "b"}}, {"b": {"b"}}]
    assert group_jaccard(either) == 1.0
    assert jaccard([set(named) for named in either]) == 0.0
    # a common alternative is no agreement, and one group does not agree with two
    assert group_jaccard([{"a": {"a", "c"}}, {"b": {"b", "c"}}]) == 0.0
    assert group_jaccard([{"a": {"a", "b", "c"}}, {"b": {"b"}, "c": {"c"}}]) == pytest.approx(0.5)
    assert np.isnan(group_jaccard([{}, {}]))
