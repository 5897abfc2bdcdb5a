"""Mutants: how many wrong laws, signs, numbers, bounds and checks the tests notice.

Each mutant changes one comparison, sign, product, number, min or max, or drops a ``raise``. In a copy of the tree tests
are tried until one fails: first those that run its line, and first those that run many lines of its module in little
time, as many as take ``--budget`` seconds. Times and lines are measured once, for a quarter of an hour, but not in
compiled code and other processes. ``--sample`` mutants are drawn with ``--seed``, ``--against COMMIT`` from lines that
this commit has too; its tests try survivors.
"""

import os
import random
import sys
import tempfile
from ast import literal_eval
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import cached_property
from io import StringIO
from itertools import chain, count, islice
from json import loads
from math import inf
from pathlib import Path
from subprocess import CompletedProcess, TimeoutExpired, run
from token import NAME, NUMBER, OP
from tokenize import TokenInfo, generate_tokens
from typing import NamedTuple

from coverage import CoverageData

from benchmarks.harness import ROOT

SWAPS = {
    "<": ("bound", "<="), "<=": ("bound", "<"), ">": ("bound", ">="), ">=": ("bound", ">"), "==": ("bound", "!="),
    "!=": ("bound", "=="), "min": ("bound", "max"), "max": ("bound", "min"), "+": ("sign", "-"), "-": ("sign", "+"),
    "*": ("law", "/"), "/": ("law", "*"), "raise": ("check", "pass;"),
}  # fmt: skip
"""Kind of a mutant and the replacement of a word; numbers are doubled."""

TOPS = ("heli_plant", "heli_identifier", "fmu_src")

MEASURE = """
import collections, coverage, json, math
times = collections.Counter()
def pytest_runtest_logstart(nodeid):
    coverage.Coverage.current().switch_context(nodeid)
def pytest_runtest_logreport(report):
    times[report.nodeid] += math.inf if report.failed else report.duration
def pytest_sessionfinish():
    print(json.dumps(times), file=open("times.json", "w"))
"""
"""Plugin of pytest: a context of coverage for each test, whose time [s] is infinite if it fails."""


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
        run(f"mkdir {self.root} && git archive {commit} | tar -x -C {self.root}", shell=True, cwd=ROOT, check=True)
        (self.root / "measure.py").write_text(MEASURE)
        paths = sorted(path for top in TOPS for path in self.root.glob(f"{top}/**/*.py"))
        found = (mutants_of(path.relative_to(self.root).as_posix(), path.read_text()) for path in paths)
        self.mutants = {mutant: (token, replacement) for mutant, token, replacement in chain.from_iterable(found)}

    @cached_property
    def measured(self) -> tuple[dict[str, float], dict[str, dict[int, list[str]]]]:
        """Times of the tests [s], and the tests that run each line of each file."""
        self.pytest("-p", "measure", under=("coverage", "run", f"--source={','.join(TOPS)}", "-m"))
        data = CoverageData(str(self.root / ".coverage"))
        data.read()
        lines = {path: data.contexts_by_lineno(path) for path in data.measured_files()}
        return loads((self.root / "times.json").read_text()), lines

    def tests_of(self, mutant: Mutant, budget: float) -> Iterator[str]:
        """Yield the tests to try, in order, that take ``budget`` [s] together without the mutant."""
        times, lines = self.measured[0], self.measured[1].get(str(self.root / mutant.path), {})
        row = max((row for row in lines if row <= self.mutants[mutant][0].start[0]), default=0)  # where it begins
        number = Counter(chain(*lines.values()))
        for test in sorted(number, key=lambda test: (test not in lines[row], times.get(test, inf) / number[test])):
            if times.get(test, inf) <= budget:
                budget -= times[test]
                yield test

    def pytest(self, *options: str, under: Sequence[str] = (), timeout: float | None = None) -> CompletedProcess[str]:
        """Run pytest in the tree, under another module or alone."""
        command = [sys.executable, "-m", *under, "pytest", "-p", "no:xdist", "-p", "no:cacheprovider", "-m", "not slow"]
        env = os.environ | {"PYTHONPATH": str(self.root), "HELI_CACHE_DIR": str(self.root / "compiled")}
        return run([*command, *options], cwd=self.root, env=env, capture_output=True, text=True, timeout=timeout)

    def try_mutant(self, mutant: Mutant, budget: float) -> str:
        """Say which test kills a mutant, or how many did not that take ``budget`` [s] together."""
        tests, file, mutated = list(self.tests_of(mutant, budget)), self.root / mutant.path, self.mutate(mutant)
        original = file.rename(file.with_suffix(".original"))  # keeps its time: what is compiled stays valid
        file.write_text(mutated, encoding="utf-8")
        try:
            done = self.pytest("-x", *(tests or ["--version"]), timeout=120.0 + 3.0 * budget)
        except TimeoutExpired:
            return "killed, as a test hangs"
        finally:
            original.replace(file)
        said = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
        return f"killed, {' '.join(said[:1])}" if done.returncode else f"survived {len(tests)} tests"

    def mutate(self, mutant: Mutant) -> str:
        """Return the text of a file with a mutant, none if it is no program: a star before arguments is no product."""
        token, replacement = self.mutants[mutant]
        lines, row = (self.root / mutant.path).read_text(encoding="utf-8").splitlines(keepends=True), token.start[0] - 1
        lines[row] = lines[row][: token.start[1]] + replacement + lines[row][token.end[1] :]
        with suppress(SyntaxError):
            compile("".join(lines), mutant.path, "exec")
            return "".join(lines)
        return ""


def mutants(sample: int = 40, seed: int = 26, against: str | None = None, budget: float = 60.0) -> None:
    """Draw mutants, as many of each kind, and print which tests kill them."""
    with tempfile.TemporaryDirectory() as folder:
        trees = [Tree(name, Path(folder)) for name in ("HEAD", against) if name]
        common = [mutant for mutant in trees[0].mutants if all(mutant in tree.mutants for tree in trees)]
        random.Random(seed).shuffle(common)
        turns = {kind: count() for kind in {mutant.kind for mutant in common}}
        common.sort(key=lambda mutant: next(turns[mutant.kind]))  # kinds take turns
        killed = 0
        for mutant in islice(filter(trees[0].mutate, common), sample):
            answers = [trees[0].try_mutant(mutant, budget)]
            killed += "killed" in answers[0]
            answers += [tree.try_mutant(mutant, budget) for tree in trees[1:] if "survived" in answers[0]]
            print(mutant.kind, mutant.path, mutant.line, *answers, sep=" | ", flush=True)
    print(f"{killed} of {sample} killed")
