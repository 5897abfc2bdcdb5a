"""Benchmarks that print their tables, run as commands: their figures as rows, their text as it stands."""

import re
import subprocess
import sys
from dataclasses import dataclass

from benchmarks.page import ROOT

LINE = re.compile(r"^(?P<name>\S+(?: \S+)*)(?P<numbers>(?:\s+\d+(?:\.\d+)?(?:e[+-]?\d+)?){2,})(?=\s|$)")
"""A line of a printed table: a name, its median, the smallest of its rounds, and whatever numbers follow."""


@dataclass(frozen=True)
class Printed:
    """What a benchmark printed."""

    command: str
    text: str

    @property
    def rows(self) -> dict[str, tuple[float, ...]]:
        """Numbers of each line of its tables, by the line's name."""
        lines = filter(None, map(LINE.match, self.text.splitlines()))
        return {line["name"]: tuple(map(float, line["numbers"].split())) for line in lines}

    def row(self, name: str) -> tuple[float, ...]:
        """Numbers of the line ``name``: median, smallest of the rounds, and what follows.

        Raises
        ------
        ValueError
            If no line of a table is called so.
        """
        if name not in self.rows:
            raise ValueError(f"{self.command} printed no line {name!r} with a median and a smallest:\n{self.text}")
        return self.rows[name]

    def number(self, before: str) -> float:
        """First number behind some words.

        Raises
        ------
        ValueError
            If the words or the number are missing.
        """
        found = re.search(rf"{re.escape(before)}\s*(\d+(?:\.\d+)?(?:e[+-]?\d+)?)", self.text)
        if found is None:
            raise ValueError(f"{self.command} printed no number behind {before!r}:\n{self.text}")
        return float(found[1])

    @property
    def block(self) -> str:
        """The text as a block of a page."""
        return f"`{self.command}`\n\n```text\n{self.text.strip()}\n```"


def printed(module: str, *arguments: str) -> Printed:
    """Run ``python -m module`` and take what it prints.

    Raises
    ------
    RuntimeError
        If it fails.
    """
    done = subprocess.run(
        [sys.executable, "-m", module, *arguments], capture_output=True, text=True, check=False, cwd=ROOT
    )
    command = " ".join(["python -m", module, *arguments])
    if done.returncode:
        raise RuntimeError(f"{command} failed: {done.stdout[-1000:]}{done.stderr[-1500:]}")
    return Printed(command, done.stdout)
