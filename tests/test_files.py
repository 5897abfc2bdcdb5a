"""Files and folders of results are written whole or not at all; drafts of processes that share a folder or end."""

import os
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

from heli_identifier import files, processes
from heli_identifier.errors import ConfigurationError
from heli_identifier.files import write_atomically
from heli_identifier.results.documents import write_whole_folder


def names(folder):
    return sorted(path.name for path in Path(folder).iterdir())


def contents(folder):
    return {path.name: path.read_text() for path in Path(folder).iterdir() if path.is_file()}


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


def test_text_and_bytes_are_written_as_they_are_in_folders_that_are_made_and_a_full_disk_leaves_the_old_file(tmp_path):
    assert write_atomically(tmp_path / "a" / "text", "θ\r\n").read_bytes() == "θ\r\n".encode()
    assert write_atomically(tmp_path / "b" / "c" / "bytes", b"\0\xff").read_bytes() == b"\0\xff"
    path = write_atomically(tmp_path / "d" / "file", "old")
    for size in (2_000, 2_000_000):
        with files_of_at_most(1_000), pytest.raises(OSError, match="too large"):
            write_atomically(path, "n" * size)
        assert contents(tmp_path / "d") == {"file": "old"}


@pytest.mark.skipif(not Path("/dev/stdout").exists(), reason="Windows has no name for standard output")
def test_standard_output_that_is_appended_to_a_file_keeps_what_the_file_holds(tmp_path):
    (tmp_path / "all.csv").write_text("old\n")
    code = "from heli_identifier.files import write_atomically; write_atomically('/dev/stdout', 'new')"
    with open(tmp_path / "all.csv", "ab") as out:
        subprocess.run([sys.executable, "-c", code], stdout=out, check=True)
    assert (tmp_path / "all.csv").read_text() == "old\nnew"


@pytest.mark.usefixtures("interruptible")
def test_ctrl_c_while_a_draft_is_made_leaves_none(tmp_path, monkeypatch):
    remove = files.undo_at_end

    def interrupted(undo):
        signal.raise_signal(signal.SIGINT)
        return remove(undo)

    monkeypatch.setattr(files, "undo_at_end", interrupted)
    with pytest.raises(KeyboardInterrupt), files.draft_folder(tmp_path):
        pytest.fail("the signal was lost")
    assert os.listdir(tmp_path) == []


def test_results_appear_together_replace_those_of_their_names_and_leave_others(tmp_path):
    with write_whole_folder(tmp_path / "a" / "b") as draft:
        (draft / "x").write_text("old")
        assert not (tmp_path / "a").exists()
    (tmp_path / "a" / "b" / "mine").write_text("kept")
    with write_whole_folder(tmp_path / "a" / "b") as draft:
        (draft / "x").write_text("new")
    assert contents(tmp_path / "a" / "b") == {"x": "new", "mine": "kept"}
    assert names(tmp_path) == ["a"]
    # an exception leaves nothing behind and nothing changed
    for target in (tmp_path / "a" / "b", tmp_path / "c" / "d"):
        with pytest.raises(RuntimeError), write_whole_folder(target) as draft:
            (draft / "x").write_text("newer")
            raise RuntimeError
    assert contents(tmp_path / "a" / "b") == {"x": "new", "mine": "kept"} and names(tmp_path) == ["a"]


@pytest.mark.parametrize("signalled", [False, True])
def test_a_move_that_fails_or_is_ended_by_a_signal_takes_back_those_before_it(tmp_path, signalled):
    old, original = dict.fromkeys("abc", "old"), Path.replace
    for name, text in old.items():
        (tmp_path / name).write_text(text)

    def replace(self, target):
        # the disk fails when the last file is moved to its place
        if self.name == "c" and Path(target) == tmp_path / "c":
            for undo in reversed(processes._to_undo if signalled else []):  # what the handler of a signal does
                undo()
            raise OSError(28, "No space left on device")
        return original(self, target)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Path, "replace", replace)
        with pytest.raises(ConfigurationError, match="nothing was changed"), write_whole_folder(tmp_path) as draft:
            for name in old:
                (draft / name).write_text("new")
    assert contents(tmp_path) == old and names(tmp_path) == list(old)


def test_a_link_to_a_folder_and_a_link_in_it_are_followed(tmp_path):
    real = tmp_path / "real"
    real.mkdir()
    (tmp_path / "elsewhere").write_text("old")
    (real / "x").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "link").symlink_to(real)
    (tmp_path / "dangling").symlink_to(tmp_path / "made")
    for target in ("link", "dangling"):
        with write_whole_folder(tmp_path / target) as draft:
            (draft / "x").write_text("new")
    assert (real / "x").is_symlink() and (tmp_path / "dangling").is_symlink()
    assert contents(tmp_path) == {"elsewhere": "new"} and contents(tmp_path / "made") == {"x": "new"}
