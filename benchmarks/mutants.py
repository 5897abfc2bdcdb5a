"""Mutants: how many wrong laws, signs, numbers, bounds and checks the tests notice.

Each mutant changes one comparison, sign, product, number, min or max, or drops a ``raise``. In a copy of the tree the
test files are tried, those first that run its line, until one fails or ``--budget`` seconds are over. Which lines a
test file runs is measured once, for a quarter of an hour. ``--sample`` mutants are drawn with ``--seed``; ``--against
COMMIT`` draws them from lines that this commit has too, and tries its tests on a survivor.
"""

import os
import random
import subprocess
import sys
import tempfile
from ast import literal_eval
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import cached_property
from io import StringIO
from itertools import chain, count, islice
from pathlib import Path
from time import monotonic
from token import NAME, NUMBER, OP
from tokenize import TokenInfo, generate_tokens
from typing import NamedTuple

from coverage import CoverageData

from benchmarks.harness import ROOT, table

SWAPS = {
    "<": ("bound", "<="), "<=": ("bound", "<"), ">": ("bound", ">="), ">=": ("bound", ">"), "==": ("bound", "!="),
    "!=": ("bound", "=="), "min": ("bound", "max"), "max": ("bound", "min"), "+": ("sign", "-"), "-": ("sign", "+"),
    "*": ("law", "/"), "/": ("law", "*"), "raise": ("check", "pass;"),
}  # fmt: skip
"""Kind of a mutant and the replacement of a word; numbers are doubled."""


class Mutant(NamedTuple):
    """One place in a file: its kind, line, and number among the same kind in equal lines of the file."""

    path: str
    kind: str
    line: str
    number: int


def mutants_of(path: str, source: str) -> Iterator[tuple[Mutant, TokenInfo, str]]:
    """Yield the mutants of a file, each with its token and the replacement."""
    counts = Counter[tuple[str, str]]()
    for token in generate_tokens(StringIO(source).readline):
        kind, replacement = SWAPS.get(token.string, ("", "")) if token.type in (OP, NAME) else ("", "")
        if token.type == NUMBER:
            value = literal_eval(token.string)
            kind, replacement = "number", repr(value * 2 if value else value + 1)
        if kind:
            line = token.line.strip()
            counts[kind, line] += 1
            yield Mutant(path, kind, line, counts[kind, line]), token, replacement


class Tree:
    """Copy of a commit with its mutants."""

    def __init__(self, commit: str, folder: Path) -> None:
        self.root = folder / commit
        self.root.mkdir()
        subprocess.run(f"git archive {commit} | tar -x -C {self.root}", shell=True, cwd=ROOT, check=True)
        tops = ("heli_plant", "heli_identifier", "fmu_src")
        paths = sorted(path for top in tops for path in self.root.glob(f"{top}/**/*.py"))
        found = (mutants_of(path.relative_to(self.root).as_posix(), path.read_text()) for path in paths)
        self.mutants = {mutant: (token, replacement) for mutant, token, replacement in chain.from_iterable(found)}

    @cached_property
    def lines(self) -> dict[Path, set[tuple[str, int]]]:
        """Files and lines that each test file runs in its own process, not compiled."""
        tests = sorted((self.root / "tests").glob("test_*.py"))
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            return dict(zip(tests, pool.map(self.lines_run, tests), strict=True))

    def lines_run(self, test: Path) -> set[tuple[str, int]]:
        """Return files and lines that a test file runs; none if it fails without a mutant."""
        if not self.passes(test, "coverage", "run", f"--source={self.root}", "-m"):
            return set()
        data = CoverageData(str(test.with_suffix(".coverage")))
        data.read()
        return {(path, line) for path in data.measured_files() for line in data.lines(path) or ()}

    def tests_of(self, mutant: Mutant) -> list[Path]:
        """Return the test files, in order: those that run a line, those that run most of its module."""
        file, line = str(self.root / mutant.path), self.mutants[mutant][0].start[0]
        shares = {test: sum(path == file for path, _ in lines) for test, lines in self.lines.items() if lines}
        return sorted(shares, key=lambda test: ((file, line) in self.lines[test], shares[test]), reverse=True)

    def passes(self, test: Path, *under: str) -> bool:
        """Whether a test file passes, and ends in time; pytest runs ``under`` another module, or alone."""
        options = ("-x", "-p", "no:xdist", "-p", "no:cacheprovider", "-m", "not slow")
        command = [sys.executable, "-m", *under, "pytest", *options, str(test)]
        own = {"PYTHONPATH": str(self.root), "COVERAGE_FILE": str(test.with_suffix(".coverage"))}
        own["PYTHONDONTWRITEBYTECODE"] = "1"  # a mutant may have size and time of its original
        with suppress(subprocess.TimeoutExpired):  # the file hangs: without a mutant none takes half as long
            done = subprocess.run(command, cwd=self.root, env=os.environ | own, timeout=600.0, capture_output=True)
            return done.returncode in (0, 5)  # 5: all of its tests are slow
        return False

    def try_mutant(self, mutant: Mutant, budget: float) -> str:
        """Say which test file kills a mutant, or how many did not within ``budget`` [s]."""
        start, tests, file = monotonic(), self.tests_of(mutant), self.root / mutant.path
        original = file.read_text(encoding="utf-8")
        file.write_text(self.mutate(mutant), encoding="utf-8")
        try:
            for number, test in enumerate(tests):
                if monotonic() - start > budget:
                    return f"survived {number} of {len(tests)} files"
                if not self.passes(test):
                    return f"killed by {test.name}"
            return f"survived all {len(tests)} files"
        finally:
            file.write_text(original, encoding="utf-8")

    def mutate(self, mutant: Mutant) -> str:
        """Return the text of a file with a mutant."""
        token, replacement = self.mutants[mutant]
        lines, row = (self.root / mutant.path).read_text(encoding="utf-8").splitlines(keepends=True), token.start[0] - 1
        lines[row] = lines[row][: token.start[1]] + replacement + lines[row][token.end[1] :]
        return "".join(lines)

    def is_program(self, mutant: Mutant) -> bool:
        """Whether Python can parse a mutant: a star before an argument is no product."""
        with suppress(SyntaxError):
            return bool(compile(self.mutate(mutant), mutant.path, "exec"))
        return False


def mutants(sample: int = 40, seed: int = 26, against: str | None = None, budget: float = 120.0) -> None:
    """Draw mutants, as many of each kind, and print which tests kill them."""
    commits = ["HEAD", against] if against else ["HEAD"]
    with tempfile.TemporaryDirectory() as folder:
        trees = [Tree(name, Path(folder)) for name in commits]
        common = [mutant for mutant in trees[0].mutants if all(mutant in tree.mutants for tree in trees)]
        random.Random(seed).shuffle(common)
        turns = {kind: count() for kind in {mutant.kind for mutant in common}}
        common.sort(key=lambda mutant: next(turns[mutant.kind]))  # kinds take turns
        rows = []
        for mutant in islice(filter(trees[0].is_program, common), sample):
            answers = [trees[0].try_mutant(mutant, budget)]
            answers += ["" if "killed" in answers[0] else tree.try_mutant(mutant, budget) for tree in trees[1:]]
            rows.append((mutant.kind, mutant.path, mutant.line, *answers))
            print(*rows[-1], sep=" | ", file=sys.stderr, flush=True)
    print(table(("kind", "file", "line", *commits), rows))
    print(f"{sum('killed' in row[3] for row in rows)} of {len(rows)} killed")
