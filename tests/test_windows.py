"""What touches the system, in a process without fcntl, fork and most signals (`tests/windows`)."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent

SCRIPT = """
import os, sys, time
from pathlib import Path

from heli_identifier.errors import LogError
from heli_identifier.files import draft_folder, sweep, write_atomically
from heli_identifier.records import opening

if __name__ == "__main__":
    assert "fcntl" in sys.modules and sys.modules["fcntl"] is None and not hasattr(os, "fork")
    folder = Path(sys.argv[1])
    for read, argument in ((os.abort, ()), (time.sleep, (1000.0,))):
        opening.PATIENCE = 5.0
        try:
            opening.apart(read, argument, 1, "log.mat")
        except LogError as error:
            assert ("crashes" if read is os.abort else "no end") in str(error)
    opening.PATIENCE = 60.0
    assert opening.apart(divmod, (7, 2), 1, "log.mat") == (3, 1)

    write_atomically(folder / "a.txt", "old")
    write_atomically(folder / "a.txt", "θ")
    assert (folder / "a.txt").read_bytes() == "θ".encode()
    with draft_folder(folder) as draft:
        sweep(folder)
        assert draft.exists()
    assert os.listdir(folder) == ["a.txt"]
    (folder / ".heli-draft-left").mkdir()
    os.utime(folder / ".heli-draft-left", (1.0, 1.0))  # of 1970
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
