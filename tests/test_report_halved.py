"""Work of which a copy of the process does half: the same answers in the same order, whatever becomes of the copy."""

import os
import sys
from pathlib import Path

import pytest
from heli_identifier.workbench.report.halved import halved

pytestmark = [
    pytest.mark.skipif(
        sys.platform != "linux" or (os.cpu_count() or 1) < 2, reason="a copy is made on Linux with two cores only"
    ),
    # the process that draws has no threads of its own; that of the tests may, and none of them takes part here
    pytest.mark.filterwarnings("ignore:This process .* is multi-threaded:DeprecationWarning"),
]
HERE = os.getpid()


@pytest.mark.parametrize("count", [0, 1, 2, 7])
def test_answers_come_in_the_order_of_the_items(count):
    assert halved(str, range(count)) == [str(i) for i in range(count)]


def test_half_of_the_work_is_done_by_another_process():
    done = halved(lambda item: str(os.getpid()), range(6))
    assert done[::2] == [str(HERE)] * 3
    assert len(set(done[1::2]) - {str(HERE)}) == 1


def _fails_in_a_copy(item: int) -> str:
    if os.getpid() != HERE:
        raise ZeroDivisionError
    return str(item)


def test_what_a_copy_leaves_undone_is_done_here():
    assert halved(_fails_in_a_copy, range(5)) == ["0", "1", "2", "3", "4"]


def children():
    """Processes that this one has started and not waited for; other tests may have left some."""
    return set(Path(f"/proc/self/task/{os.getpid()}/children").read_text().split())


def test_work_that_fails_here_fails_and_leaves_no_copy():
    before = children()
    with pytest.raises(ZeroDivisionError):
        halved(lambda item: str(1 // (item - 2)), range(4))
    assert children() <= before


def test_an_answer_larger_than_a_pipe_comes_whole():
    assert [len(text) for text in halved(lambda item: "x" * item, [1, 3_000_000, 2, 10_000_000])] == [
        1,
        3_000_000,
        2,
        10_000_000,
    ]
