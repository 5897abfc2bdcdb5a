"""Drafts of processes that work in one folder, and of one that is asked to end."""

import os
import signal
from multiprocessing import get_context

import pytest

from heli_identifier import files


def drafts_made(folder, count):
    """Make ``count`` drafts after each other."""
    for _ in range(count):
        with files.draft_folder(folder) as draft:
            assert draft.is_dir()


def test_processes_that_sweep_one_folder_leave_each_other_s_drafts_alone(tmp_path):
    processes = [get_context("spawn").Process(target=drafts_made, args=(tmp_path, 500)) for _ in range(3)]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
    assert [process.exitcode for process in processes] == [0, 0, 0]
    assert os.listdir(tmp_path) == []


@pytest.mark.usefixtures("interruptible")
def test_ctrl_c_while_a_draft_is_made_leaves_none(tmp_path, monkeypatch):
    remove = files.undone

    def interrupted(undo):
        signal.raise_signal(signal.SIGINT)
        return remove(undo)

    monkeypatch.setattr(files, "undone", interrupted)
    with pytest.raises(KeyboardInterrupt), files.draft_folder(tmp_path):
        pytest.fail("the signal was lost")
    assert os.listdir(tmp_path) == []
