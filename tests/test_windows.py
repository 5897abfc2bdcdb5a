"""What touches the system, in a process without fcntl, fork and most signals (`tests/windows`)."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent

SCRIPT = """
import os, sys, time
from functools import partial
from pathlib import Path

from heli_identifier.files import draft_file, draft_folder, sweep, write_atomically
from heli_identifier.platform import machine, run_bounded

def hang():
    while True:
        pass

def no_memory():
    raise MemoryError

if __name__ == "__main__":
    assert "fcntl" in sys.modules and sys.modules["fcntl"] is None and not hasattr(os, "fork")
    folder = Path(sys.argv[1])
    for read, patience, answer in (
        (os.abort, 60.0, "crash"),
        (hang, 0.1, "no end"),
        (partial(int, "no number"), 60.0, ""),
        (no_memory, 60.0, "out of memory"),
    ):
        assert run_bounded(read, patience, 120.0, 10**9) == answer, read
    assert run_bounded(partial(time.sleep, 1000.0), 60.0, 0.5, 10**9) == "no end"

    write_atomically(folder / "a.txt", "old")
    write_atomically(folder / "a.txt", "θ")
    assert (folder / "a.txt").read_bytes() == "θ".encode()
    for make in (draft_file, draft_folder):
        with make(folder) as made:
            path = made[0] if make is draft_file else made
            sweep(folder)
            assert path.exists()
        assert os.listdir(folder) == ["a.txt"]
    (folder / f".heli-draft-{machine()}-{2**22 + 1}-left").mkdir()  # above the largest number of a process
    sweep(folder)
    assert os.listdir(folder) == ["a.txt"]
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the imitation takes open files from /proc")
def test_readers_drafts_and_replacements_need_nothing_that_only_posix_has(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT, encoding="utf-8")
    folder = tmp_path / "a folder"
    folder.mkdir()
    done = subprocess.run(
        [sys.executable, str(script), str(folder)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join((str(HERE / "windows"), str(HERE.parent)))},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
