"""Mutants: how many wrong laws, signs, numbers, bounds and checks the tests notice.

Each mutant changes one place of the program: a comparison, a sign, a product, a number, min or max, or it drops a
``raise``. Test files are run in a copy of the tree, those first that name the changed module, until one of them fails.
``--sample`` mutants are drawn with ``--seed``, only in files ``--below`` a folder if one is named; the tests of one
mutant get ``--budget`` seconds. With ``--against COMMIT`` the same mutants meet the tests of that commit as well; only
places are drawn that both have, letter by letter.
"""

import ast
import os
import random
import subprocess
import sys
import tempfile
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic
from typing import NamedTuple

from benchmarks.harness import ROOT, table

PACKAGES = ("heli_plant", "heli_identifier", "fmu_src")
OPERATORS: dict[type[ast.AST], tuple[str, ast.AST]] = {
    ast.Lt: ("bound", ast.LtE()), ast.LtE: ("bound", ast.Lt()), ast.Gt: ("bound", ast.GtE()),
    ast.GtE: ("bound", ast.Gt()), ast.Eq: ("bound", ast.NotEq()), ast.NotEq: ("bound", ast.Eq()),
    ast.Add: ("sign", ast.Sub()), ast.Sub: ("sign", ast.Add()), ast.USub: ("sign", ast.UAdd()),
    ast.Mult: ("law", ast.Div()), ast.Div: ("law", ast.Mult()),
}  # fmt: skip
"""Kind of a mutant and what takes the operator's place."""

EXTREMES = {"min": "max", "max": "min"}
HANGS = 300.0
"""Seconds after which a test file is taken to hang; without a mutant none takes half as long."""


def mutated(node: ast.AST) -> tuple[str, ast.AST] | None:
    """Give the kind of a node's mutant and what takes its place."""
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return "number", ast.Constant(value * 2 if value else value + 1)
        case ast.Name(id="min" | "max" as name):
            return "bound", ast.Name(EXTREMES[name], ast.Load())
        case ast.Raise():
            return "check", ast.Pass()
    return OPERATORS.get(type(node))


class Mutant(NamedTuple):
    """One place: its file, kind, line, and which one of its kind in equal lines of the file."""

    path: str
    kind: str
    line: str
    number: int


class Places(ast.NodeTransformer):
    """Counts the places of a file that have mutants, and changes the one of a number."""

    def __init__(self, path: str, source: str, chosen: int = -1) -> None:
        self.path, self.lines, self.chosen, self.line = path, source.splitlines(), chosen, 1
        self.found: list[Mutant] = []
        self.seen: Counter[tuple[str, str]] = Counter()
        self.text = ast.unparse(self.visit(ast.parse(source)))

    def visit(self, node: ast.AST) -> ast.AST:
        """Take note of a place; operators stand in the line of what is before them."""
        self.line = getattr(node, "lineno", self.line)
        if change := mutated(node):
            kind, text = change[0], self.lines[self.line - 1].strip()
            self.seen[kind, text] += 1
            self.found.append(Mutant(self.path, kind, text, self.seen[kind, text]))
            if len(self.found) - 1 == self.chosen:
                return change[1]
        return self.generic_visit(node)


# --- which tests, and what they say --------------------------------------------------------------------------------


@dataclass
class Tree:
    """Copy of a commit, the number of each of its mutants in its file, and whether its test files pass unchanged."""

    root: Path
    mutants: dict[Mutant, int]
    sound: dict[Path, bool] = field(default_factory=dict)

    def tests_of(self, path: str) -> list[Path]:
        """Give the test files that name a module, then those that name its room or package; the shortest come first."""
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
        told = {**os.environ, "PYTHONPATH": str(self.root), "PYTHONDONTWRITEBYTECODE": "1"}
        with suppress(subprocess.TimeoutExpired):
            done = subprocess.run([*command, str(test)], cwd=self.root, env=told, timeout=HANGS, capture_output=True)
            return done.returncode in (0, 5)  # 5: all of its tests are slow
        return False

    def answer(self, mutant: Mutant, budget: float) -> str:
        """Say which test file kills a mutant, or how many did not within ``budget`` [s]."""
        began, tests, file = monotonic(), self.tests_of(mutant.path), self.root / mutant.path
        before = file.read_text(encoding="utf-8")
        same, other = (Places(mutant.path, before, number).text for number in (-1, self.mutants[mutant]))
        try:
            for count, test in enumerate(tests):
                if monotonic() - began > budget:
                    return f"survived the nearest {count} of {len(tests)} files"
                file.write_text(other, encoding="utf-8")
                if not self.passes(test):
                    file.write_text(same, encoding="utf-8")  # without comments as well
                    if self.sound.setdefault(test, self.passes(test)):
                        return f"killed by {test.name}"
            return f"survived all {len(tests)} files"
        finally:
            file.write_text(before, encoding="utf-8")


def tree(commit: str, folder: Path) -> Tree:
    """Unpack a commit."""
    (root := folder / commit).mkdir()
    subprocess.run(f"git archive {commit} | tar -x -C {root}", shell=True, cwd=ROOT, check=True)
    paths = sorted(path for package in PACKAGES for path in (root / package).rglob("*.py"))
    found = [Places(path.relative_to(root).as_posix(), path.read_text(encoding="utf-8")).found for path in paths]
    return Tree(root, {mutant: number for own in found for number, mutant in enumerate(own)})


def mutants(
    sample: int = 40, seed: int = 26, below: str = "", commit: str = "HEAD", against: str | None = None,
    budget: float = 120.0,
) -> None:  # fmt: skip
    """Draw mutants, as many of each kind, and print which tests kill them."""
    commits = [commit, against] if against else [commit]
    with tempfile.TemporaryDirectory() as folder:
        trees = [tree(one, Path(folder)) for one in commits]
        own = [mutant for mutant in trees[0].mutants if mutant.path.startswith(below)]
        common = [mutant for mutant in own if all(mutant in one.mutants for one in trees)]
        random.Random(seed).shuffle(common)
        kinds = sorted({mutant.kind for mutant in common})
        by_kind = {kind: [mutant for mutant in common if mutant.kind == kind] for kind in kinds}
        drawn = [by_kind[kinds[number % len(kinds)]].pop() for number in range(sample)]
        rows = []
        for mutant in drawn:
            rows.append((mutant.kind, mutant.path, mutant.line, *(one.answer(mutant, budget) for one in trees)))
            print(*rows[-1], sep=" | ", file=sys.stderr, flush=True)
    print(table(("kind", "file", "line", *commits), rows))
    for column, one in enumerate(trees, 3):
        print(f"{one.root.name}: {sum('killed' in row[column] for row in rows)} of {len(rows)} killed")
