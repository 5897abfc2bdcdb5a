"""Mutants: how many wrong laws, signs, units, bounds and checks the tests notice.

Each mutant changes one place of the program: a comparison, a sign, a product, a number, min or max, or it drops a
``raise``. Test files are run in a copy of the tree, those first that name the changed module, until one of them fails.
``--sample`` mutants are drawn with ``--seed``, only in files ``--below`` a folder if one is named, of the ``--commit``
whose tests they meet; the tests of one mutant get ``--budget`` seconds. With ``--against COMMIT`` the same mutants are
made in that commit as well and meet its tests; only places that both have, letter by letter, are drawn.
"""

import ast
import os
import random
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic
from typing import NamedTuple

from benchmarks.harness import ROOT, table

PACKAGES = ("heli_plant", "heli_identifier", "fmu_src")
SWAPS = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "+": "-", "-": "+", "*": "/", "/": "*"}
EXTREMES = {"min": "max", "max": "min"}
HANGS = 300.0
"""Seconds after which a test file is taken to hang; without a mutant none takes half as long."""


class Mutant(NamedTuple):
    """One place and its change; ``place`` is the same in all commits that have this statement in this function."""

    path: str
    kind: str
    place: tuple[str, str, int]
    position: tuple[int, int]
    line: int
    old: str
    new: str


def mutants_of(path: str, source: bytes) -> Iterator[Mutant]:
    """Give the mutants of one file."""
    starts = [0]
    for text in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(text))
    seen: dict[tuple[str, str], int] = {}

    def span(node: ast.expr | ast.stmt) -> tuple[int, int]:
        last_line, last_column = node.end_lineno or node.lineno, node.end_col_offset or 0
        return starts[node.lineno - 1] + node.col_offset, starts[last_line - 1] + last_column

    def walk(node: ast.AST, scope: str, statement: str) -> Iterator[Mutant]:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            scope = f"{scope}.{node.name}"
        elif isinstance(node, ast.stmt):
            statement = ast.unparse(node)
        for kind, start, end, new in changes(node):
            key = (scope, f"{kind} {statement}")
            seen[key] = seen.get(key, 0) + 1
            old = source[start:end].decode()
            yield Mutant(path, kind, (*key, seen[key]), (start, end), getattr(node, "lineno", 0), old, new)
        for child in ast.iter_child_nodes(node):
            yield from walk(child, scope, statement)

    def between(left: ast.expr, right: ast.expr, kind: str) -> Iterator[tuple[str, int, int, str]]:
        start, end = span(left)[1], span(right)[0]
        operator = source[start:end].decode().strip(" ()\n")
        if operator in SWAPS:
            start += source[start:end].index(operator.encode())
            yield kind, start, start + len(operator), SWAPS[operator]

    def changes(node: ast.AST) -> Iterator[tuple[str, int, int, str]]:
        match node:
            case ast.Compare(left=left, comparators=[right]):
                yield from between(left, right, "bound")
            case ast.BinOp(left=left, right=right):
                yield from between(left, right, "sign" if isinstance(node.op, ast.Add | ast.Sub) else "law")
            case ast.UnaryOp(op=ast.USub()):
                yield "sign", span(node)[0], span(node)[0] + 1, "+"
            case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
                yield "number", *span(node), repr(value * 2 if value else value + 1)
            case ast.Call(func=ast.Name(id="min" | "max" as name) as called):
                yield "bound", *span(called), EXTREMES[name]
            case ast.Raise():
                yield "check", *span(node), "pass"

    yield from walk(ast.parse(source), "", "")


# --- which tests, and what they say --------------------------------------------------------------------------------


@dataclass
class Tree:
    """Copy of a commit, its mutants by path and place, and whether its test files pass unchanged."""

    root: Path
    mutants: dict[tuple[str, tuple[str, str, int]], Mutant]
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
        began, tests, (start, end) = monotonic(), self.tests_of(mutant.path), mutant.position
        file = self.root / mutant.path
        before = file.read_bytes()
        try:
            for count, test in enumerate(tests):
                if monotonic() - began > budget:
                    return f"survived the nearest {count} of {len(tests)} files"
                file.write_bytes(before[:start] + mutant.new.encode() + before[end:])
                if not self.passes(test):
                    file.write_bytes(before)
                    if self.sound.setdefault(test, self.passes(test)):
                        return f"killed by {test.name}"
            return f"survived all {len(tests)} files"
        finally:
            file.write_bytes(before)


def tree(commit: str, folder: Path) -> Tree:
    """Unpack a commit."""
    root = folder / commit
    root.mkdir()
    subprocess.run(f"git archive {commit} | tar -x -C {root}", shell=True, cwd=ROOT, check=True)
    paths = sorted(path for package in PACKAGES for path in (root / package).rglob("*.py"))
    found = [m for path in paths for m in mutants_of(path.relative_to(root).as_posix(), path.read_bytes())]
    return Tree(root, {(mutant.path, mutant.place): mutant for mutant in found})


def mutants(
    sample: int = 40, seed: int = 26, below: str = "", commit: str = "HEAD", against: str | None = None,
    budget: float = 120.0,
) -> None:  # fmt: skip
    """Draw mutants, as many of each kind, and print which tests kill them."""
    commits = [commit, against] if against else [commit]
    with tempfile.TemporaryDirectory() as folder:
        trees = [tree(one, Path(folder)) for one in commits]
        own, rng, drawn = trees[0].mutants, random.Random(seed), list[Mutant]()
        common = [key for key in own if key[0].startswith(below) and all(key in one.mutants for one in trees)]
        kinds = sorted({own[key].kind for key in common})
        rng.shuffle(common)
        for number in range(sample):
            kind = kinds[number % len(kinds)]
            drawn.append(next(own[key] for key in common if own[key].kind == kind and own[key] not in drawn))
        rows = []
        for mutant in drawn:
            answers = [one.answer(one.mutants[mutant.path, mutant.place], budget) for one in trees]
            change = f"{' '.join(mutant.old.split())} -> {mutant.new}"
            rows.append((mutant.kind, f"{mutant.path}:{mutant.line}", change, *answers))
            print(*rows[-1], sep=" | ", file=sys.stderr, flush=True)
    print(table(("kind", "place", "change", *commits), rows))
    for column, one in enumerate(trees, 3):
        print(f"{one.root.name}: {sum('killed' in row[column] for row in rows)} of {len(rows)} killed")
