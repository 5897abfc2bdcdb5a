"""One fault: how it is made, the command that meets it, and the expected answer."""

import contextlib
import io
import os
import re
import shlex
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from tests.commands import HELI, heli, run_bash

ROOT = Path(__file__).resolve().parents[2]
LONGEST = 900.0
"""Time after which a script counts as hung [s]; a busy machine must not fail a test."""


class Fault(NamedTuple):
    """A fault as the page names it, a function that makes its files in a folder, and the command that meets it.
    ``said``: a part of the expected sentence; ``makes``: names of files that the command may leave in the folder;
    ``shell``: the command is a script of bash in a process of its own, with pipes, signals or limits."""

    what: str
    make: Callable[[Path], object]
    command: str
    said: str
    code: int = 2
    makes: tuple[str, ...] = ()
    shell: bool = False


class Answer(NamedTuple):
    """Answer of a command: exit code, the sentence, everything printed, and files that were left behind."""

    code: int
    sentence: str
    printed: str
    left: tuple[str, ...]


def try_fault(fault: Fault, folder: Path) -> Answer:
    """Try a fault in ``folder``, which is empty."""
    work, temporary = folder / "work", folder / "temporary"
    work.mkdir(parents=True)
    temporary.mkdir()
    fault.make(work)
    before = set(os.listdir(work))
    code, printed = (_by_bash if fault.shell else _in_process)(fault.command, work, temporary)
    left = {*os.listdir(work)} - before - {*fault.makes} | {*os.listdir(temporary)}
    sentence = _sentence(printed, fault.said).replace(f"{work.resolve()}/", "")
    sentence = re.sub(rf"{temporary.resolve()}/\S*/", "TMPDIR/.../", sentence)
    return Answer(code, sentence, printed, tuple(sorted(left)))


def _in_process(command: str, work: Path, temporary: Path) -> tuple[int, str]:
    outer, tempfile.tempdir = tempfile.tempdir, str(temporary)
    try:
        with contextlib.chdir(work):
            result = heli(*shlex.split(command)[1:])
    finally:
        tempfile.tempdir = outer
    return result.exit_code, result.output


def _by_bash(script: str, work: Path, temporary: Path) -> tuple[int, str]:
    heli = work.parent / "bin" / "heli"
    heli.parent.mkdir()
    heli.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -c {shlex.quote(HELI)} "$@"\n')
    heli.chmod(0o755)
    path = f"{heli.parent}{os.pathsep}{os.environ['PATH']}"
    return run_bash(script, work, {"PATH": path, "PYTHONPATH": str(ROOT), "TMPDIR": str(temporary)}, LONGEST)


def _sentence(printed: str, said: str) -> str:
    """Return the line that contains ``said``, if possible a refusal."""
    lines = [" ".join(line.split()) for line in io.StringIO(printed)]
    lines = [line for line in lines if said in line]
    return next((line for line in lines if line.startswith("heli:")), lines[0] if lines else "")
