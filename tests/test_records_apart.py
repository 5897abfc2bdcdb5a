"""A reader that crashes, hangs or asks for all memory does not take the command with it."""

import os
import signal
from time import sleep

import numpy as np
import pytest

from heli_identifier.errors import LogError
from heli_identifier.records import opening
from heli_identifier.records.opening import check_survives


def test_a_reader_that_crashes_is_a_damaged_file():
    with pytest.raises(LogError, match="log.mat is not readable: it is damaged so that its reader crashes"):
        check_survives(lambda: os.kill(os.getpid(), signal.SIGSEGV), 1, "log.mat")


def test_a_reader_that_asks_for_all_memory_is_refused():
    with pytest.raises(LogError, match="asks for more than 8 GB of memory"):
        check_survives(lambda: np.ones(10**10), 1, "log.mat")


def computing_without_end():
    while True:
        pass


@pytest.mark.parametrize("read", [computing_without_end, signal.pause])
def test_a_reader_without_end_is_ended(monkeypatch, read):
    monkeypatch.setattr(opening, "PATIENCE", 0.1)
    with pytest.raises(LogError, match=r"its reader came to no end within 0.1 s"):
        check_survives(read, 1, "log.mat")


def test_a_reader_that_only_has_to_wait_for_a_busy_machine_passes(monkeypatch):
    monkeypatch.setattr(opening, "PATIENCE", 0.2)
    check_survives(lambda: sleep(0.5), 1, "log.mat")


def test_a_reader_that_crashes_leaves_no_image_of_its_memory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_CORE)
    resource.setrlimit(resource.RLIMIT_CORE, (before[1], before[1]))
    try:
        with pytest.raises(LogError, match="its reader crashes"):
            check_survives(lambda: os.kill(os.getpid(), signal.SIGSEGV), 1, "log.mat")
    finally:
        resource.setrlimit(resource.RLIMIT_CORE, before)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("read", [lambda: 1, lambda: 1 / 0, lambda: os.write(1, b"noise")])
def test_a_reader_that_ends_by_itself_passes_without_a_word(capfd, read):
    check_survives(read, 1, "log.mat")
    assert capfd.readouterr() == ("", "")
