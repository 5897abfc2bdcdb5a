"""A file is written whole or not at all; drafts of processes that work in one folder, or are asked to end."""

import os
import signal
from contextlib import contextmanager
from multiprocessing import get_context

import pytest

from heli_identifier import files
from heli_identifier.files import write_atomically


@contextmanager
def files_of_at_most(size):
    """Let the system refuse to write more than ``size`` bytes to any file, as a full disk would."""
    resource = pytest.importorskip("resource")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_text_keeps_its_line_ends_and_bytes_are_written_as_they_are(tmp_path):
    assert write_atomically(tmp_path / "text", "θ\r\n").read_bytes() == "θ\r\n".encode()
    assert write_atomically(tmp_path / "bytes", b"\0\xff").read_bytes() == b"\0\xff"


def test_missing_folders_are_made(tmp_path):
    assert write_atomically(tmp_path / "a" / "b" / "file", "text").read_text() == "text"


@pytest.mark.parametrize("size", [2_000, 2_000_000])
def test_a_full_disk_leaves_the_old_file_and_no_part_of_the_new_one(tmp_path, size):
    path = write_atomically(tmp_path / "file", "old")
    with files_of_at_most(1_000), pytest.raises(OSError, match="too large"):
        write_atomically(path, "n" * size)
    assert path.read_text() == "old"
    assert [file.name for file in tmp_path.iterdir()] == ["file"]


def test_a_folder_in_the_file_s_place_stays_and_no_draft_remains(tmp_path):
    (tmp_path / "taken").mkdir()
    with pytest.raises(OSError, match="it is a folder"):
        write_atomically(tmp_path / "taken", "text")
    assert [file.name for file in tmp_path.iterdir()] == ["taken"]


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
