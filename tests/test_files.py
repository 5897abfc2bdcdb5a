"""A file is written whole or not at all."""

from contextlib import contextmanager

import pytest

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
