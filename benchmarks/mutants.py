"""Mutants: how many wrong laws, signs, numbers, bounds and checks the tests notice.

Each mutant changes one comparison, sign, product, number, min or max, or drops a ``raise``. Test files run in a copy of
the tree, those first that name the changed module, until one fails or ``--budget`` seconds are over. ``--sample``
mutants are drawn with ``--seed``, in files ``--below`` a folder; ``--against COMMIT`` tries the tests of that as well.
"""

import os
import random
import subprocess
import sys
import tempfile
from ast import literal_eval
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from io import StringIO
from itertools import chain, count, islice
from pathlib import Path
from time import monotonic
from token import NAME, NUMBER, OP
from tokenize import TokenInfo, generate_tokens
from typing import NamedTuple

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
    """Copy of a commit with its mutants; ``sound`` says of test files whether they pass without a mutant."""

    def __init__(self, commit: str, folder: Path) -> None:
        self.root, self.sound = folder / commit, dict[Path, bool]()
        self.root.mkdir()
        subprocess.run(f"git archive {commit} | tar -x -C {self.root}", shell=True, cwd=ROOT, check=True)
        names = ("heli_plant", "heli_identifier", "fmu_src")
        paths = sorted(path for name in names for path in (self.root / name).rglob("*.py"))
        found = (mutants_of(path.relative_to(self.root).as_posix(), path.read_text()) for path in paths)
        self.mutants = {mutant: (token, replacement) for mutant, token, replacement in chain.from_iterable(found)}

    def tests_of(self, path: str) -> list[Path]:
        """Return test files that name a module, then those that name its room or package; the shortest come first."""
        module = path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
        levels = (module, module.rpartition(".")[0] or module, module.partition(".")[0])
        words, ranks = set(module.replace(".", "_").split("_")[2:]), {}
        for file in (self.root / "tests").glob("test_*.py"):
            text = file.read_text(encoding="utf-8")
            if named := [level for level, name in enumerate(levels) if name in text]:
                ranks[file] = (-len(words & set(file.stem.split("_"))), named[0], len(text))
        return sorted(ranks, key=ranks.__getitem__)

    def passes(self, test: Path) -> bool:
        """Whether a test file passes, and ends in time."""
        command = [sys.executable, "-m", "pytest", "-x", "-p", "no:xdist", "-p", "no:cacheprovider", "-m", "not slow"]
        environment = {**os.environ, "PYTHONPATH": str(self.root), "PYTHONDONTWRITEBYTECODE": "1"}
        command.append(str(test))
        with suppress(subprocess.TimeoutExpired):  # the file hangs: without a mutant none takes half as long
            result = subprocess.run(command, cwd=self.root, env=environment, timeout=300.0, capture_output=True)
            return result.returncode in (0, 5)  # 5: all of its tests are slow
        return False

    def try_mutant(self, mutant: Mutant, budget: float) -> str:
        """Say which test file kills a mutant, or how many did not within ``budget`` [s]."""
        start, tests, file = monotonic(), self.tests_of(mutant.path), self.root / mutant.path
        original = file.read_text(encoding="utf-8")
        try:
            for number, test in enumerate(tests):
                if monotonic() - start > budget:
                    return f"survived the nearest {number} of {len(tests)} files"
                file.write_text(self.mutate(mutant), encoding="utf-8")
                killed = not self.passes(test)
                file.write_text(original, encoding="utf-8")
                if killed and self.sound.setdefault(test, self.passes(test)):
                    return f"killed by {test.name}"
            return f"survived all {len(tests)} files"
        finally:
            file.write_text(original, encoding="utf-8")

    def mutate(self, mutant: Mutant) -> str:
        """Return the text of a file with a mutant."""
        token, replacement = self.mutants[mutant]
        lines = (self.root / mutant.path).read_text(encoding="utf-8").splitlines(keepends=True)
        line = lines[token.start[0] - 1]
        lines[token.start[0] - 1] = line[: token.start[1]] + replacement + line[token.end[1] :]
        return "".join(lines)

    def is_program(self, mutant: Mutant) -> bool:
        """Whether Python can parse a mutant: a star before an argument is no product."""
        try:
            compile(self.mutate(mutant), mutant.path, "exec")
        except SyntaxError:
            return False
        return True


def mutants(
    sample: int = 40, seed: int = 26, below: str = "", commit: str = "HEAD", against: str | None = None,
    budget: float = 120.0,
) -> None:  # fmt: skip
    """Draw mutants, as many of each kind, and print which tests kill them."""
    commits = [commit, against] if against else [commit]
    with tempfile.TemporaryDirectory() as folder:
        trees = [Tree(name, Path(folder)) for name in commits]
        chosen = [mutant for mutant in trees[0].mutants if mutant.path.startswith(below)]
        common = [mutant for mutant in chosen if all(mutant in tree.mutants for tree in trees)]
        random.Random(seed).shuffle(common)
        turns = {kind: count() for kind in {mutant.kind for mutant in common}}
        common.sort(key=lambda mutant: next(turns[mutant.kind]))  # kinds take turns
        rows = []
        for mutant in islice(filter(trees[0].is_program, common), sample):
            answers = (tree.try_mutant(mutant, budget) for tree in trees)
            rows.append((mutant.kind, mutant.path, mutant.line, *answers))
            print(*rows[-1], sep=" | ", file=sys.stderr, flush=True)
    print(table(("kind", "file", "line", *commits), rows))
    for column, tree in enumerate(trees, 3):
        print(f"{tree.root.name}: {sum('killed' in row[column] for row in rows)} of {len(rows)} killed")
