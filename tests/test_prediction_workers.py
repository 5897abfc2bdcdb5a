"""Threads of the search: same results on any number of them, and none that hangs."""

import subprocess
import sys
from time import sleep

import pytest

from heli_identifier.tracing.prediction.workers import beside, parallel, use_threads

FORKED = """
import os, sys
from heli_identifier.tracing.prediction.workers import beside, parallel
square = lambda x: x * x
before = parallel(square, range(5)), beside(square, 3).result()
child = os.fork()
if child == 0:
    os._exit(0 if (parallel(square, range(5)), beside(square, 3).result()) == before else 1)
sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


@pytest.fixture(params=[1, 3])
def threads(request):
    from heli_identifier.tracing.prediction import workers

    before = workers._state["count"]
    use_threads(request.param)
    yield request.param
    use_threads(before)


def test_results_come_in_the_order_of_the_items(threads):
    assert parallel(lambda x: x * x, range(50)) == [x * x for x in range(50)]


def test_inner_work_may_be_parallel_as_well(threads):
    def row(i):
        return parallel(lambda j: i * j, range(4))

    assert parallel(row, range(6)) == [[i * j for j in range(4)] for i in range(6)]
    assert beside(row, 3).result() == [0, 3, 6, 9]


@pytest.mark.skipif(not hasattr(__import__("os"), "fork"), reason="this system cannot fork")
def test_a_forked_process_starts_threads_of_its_own():
    # a pool that came along without its threads would wait for ever
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", FORKED], timeout=300, check=False)
    assert done.returncode == 0


def test_a_caller_that_leaves_early_lets_no_further_item_begin(threads):
    begun = []

    def work(item):
        begun.append(item)
        if item == 0:
            raise ZeroDivisionError
        sleep(0.05)

    with pytest.raises(ZeroDivisionError):
        parallel(work, range(1000))
    count = len(begun)
    sleep(0.5)
    # each thread may have been on its way to one more item when the count was taken
    assert count <= len(begun) <= count + threads < 1000
