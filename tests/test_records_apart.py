"""A reader that crashes, hangs or asks for all memory does not take the command with it."""

import os

import pytest

from heli_identifier.errors import LogError
from heli_identifier.records import opening
from heli_identifier.records.opening import apart


def test_a_reader_that_crashes_is_a_damaged_file():
    with pytest.raises(LogError, match="log.mat is not readable: it is damaged so that its reader crashes"):
        apart(os.abort, (), 1, "log.mat")


def test_a_reader_without_end_is_ended(monkeypatch):
    monkeypatch.setattr(opening, "PATIENCE", 5.0)
    with pytest.raises(LogError, match=r"its reader came to no end within 5 s"):
        apart(exec, ("while True: pass",), 1, "log.mat")


@pytest.mark.skipif(os.name != "posix", reason="Windows bounds no memory")
def test_a_reader_that_asks_for_all_memory_is_refused(monkeypatch):
    monkeypatch.setattr(opening, "MEMORY", 10**9)
    with pytest.raises(LogError, match="log.mat is not readable: it asks for more than 1 GB of memory"):
        apart(bytes, (2 * 10**9,), 1, "log.mat")


def test_what_a_reader_gives_or_raises_arrives_and_what_it_prints_does_not(capfd):
    assert apart(divmod, (7, 2), 1, "log.mat") == (3, 1)
    assert apart(print, ("noise",), 1, "log.mat") is None
    with pytest.raises(ZeroDivisionError):
        apart(divmod, (1, 0), 1, "log.mat")
    assert capfd.readouterr() == ("", "")
