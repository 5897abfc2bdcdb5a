"""Mutants: how many wrong laws, signs, units, bounds and checks the tests notice.

Each mutant changes one place of the program: a comparison, a sign, a product, a number, min or max, or it drops a
``raise``. Test files are run in a copy of the tree, those first that import the changed module most directly, until one
of them fails. With ``--against COMMIT`` the same mutants are made in that commit as well and meet its tests; only
places that both have, letter by letter, are drawn.
"""

import argparse
import ast
import os
import random
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic

from benchmarks.harness import ROOT, table

PACKAGES = ("heli_plant", "heli_identifier", "fmu_src")
SWAPS = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "+": "-", "-": "+", "*": "/", "/": "*"}
EXTREMES = {"min": "max", "max": "min"}
HANGS = 300.0
"""Seconds after which a test file is taken to hang; without a mutant none takes half as long."""


@dataclass(frozen=True)
class Mutant:
    """One place and its change; ``place`` is the same in all commits that have this statement in this function."""

    path: str
    kind: str
    place: tuple[str, str, int]
    position: tuple[int, int]
    line: int
    old: str
    new: str

    def apply(self, root: Path) -> str:
        """Change the file; give what it was."""
        file, (start, end) = root / self.path, self.position
        before = file.read_bytes()
        file.write_bytes(before[:start] + self.new.encode() + before[end:])
        return before.decode()


def mutants(root: Path) -> Iterator[Mutant]:
    """Give all mutants of the packages below ``root``."""
    for path in sorted(path for package in PACKAGES for path in (root / package).rglob("*.py")):
        yield from mutants_of(path.relative_to(root).as_posix(), path.read_bytes())


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


def imports(path: Path, root: Path) -> set[Path]:
    """Give the files that a file imports, through the doors of the rooms (their stubs) to what defines a name."""
    found = set()
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.ImportFrom):
            base = path.parents[node.level - 1] if node.level else root
            module = base.joinpath(*(node.module or "").split("."))
            for alias in node.names:
                found |= files_of(module / alias.name) or files_of(defining(module, alias.name))
        elif isinstance(node, ast.Import):
            for alias in node.names:
                found |= files_of(root.joinpath(*alias.name.split(".")))
    return found


def files_of(module: Path) -> set[Path]:
    """Give the file of a module or package, if there is one."""
    return {path for path in (module.with_name(module.name + ".py"), module / "__init__.py") if path.is_file()}


def defining(package: Path, name: str) -> Path:
    """Give the module behind a package's door that defines a name, or the package itself."""
    for door in (package / "__init__.pyi", package / "__init__.py"):
        for node in ast.walk(ast.parse(door.read_bytes())) if door.is_file() else ():
            if isinstance(node, ast.ImportFrom) and any(alias.name == name for alias in node.names):
                return (package if node.level else package.parent) / (node.module or "").replace(".", "/")
    return package


@dataclass
class Tree:
    """Copy of a commit, with the imports of its files and what its tests say unchanged."""

    root: Path
    graph: dict[Path, set[Path]]
    sound: dict[Path, bool] = field(default_factory=dict)

    def tests_of(self, path: str) -> list[Path]:
        """Give the test files that reach a module: those named after it, then the nearest, the most special first."""
        near, order = {self.root / path}, []
        words = set(path.removesuffix(".py").replace("/", "_").split("_")[2:])
        for _ in range(4):
            near |= {file for file, imported in self.graph.items() if imported & near}
            reached = [file for file in near if file.name.startswith("test_") and file not in order]
            order += sorted(reached, key=lambda file: (len(self.graph[file]), file.name))
        return sorted(order, key=lambda file: -len(words & set(file.stem.split("_"))))

    def passes(self, test: Path) -> bool:
        """Whether a test file passes, and ends in time."""
        command = [sys.executable, "-m", "pytest", "-x", "-p", "no:xdist", "-p", "no:cacheprovider", "-m", "not slow"]
        told = {**os.environ, "PYTHONPATH": str(self.root), "PYTHONDONTWRITEBYTECODE": "1"}
        run = subprocess.Popen(
            [*command, str(test)], cwd=self.root, env=told, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        try:
            return run.wait(HANGS) in (0, 5)  # 5: all of its tests are slow
        except subprocess.TimeoutExpired:
            run.kill()
            run.wait()
            return False

    def answer(self, mutant: Mutant, budget: float) -> str:
        """Say which test file kills a mutant, or how many did not within ``budget`` [s]."""
        began, tests, before = monotonic(), self.tests_of(mutant.path), mutant.apply(self.root)
        try:
            for count, test in enumerate(tests):
                if monotonic() - began > budget:
                    return f"survived the nearest {count} of {len(tests)} files"
                if not self.passes(test):
                    (self.root / mutant.path).write_text(before, encoding="utf-8")
                    if self.sound.setdefault(test, self.passes(test)):
                        return f"killed by {test.name}"
                    mutant.apply(self.root)
            return f"survived all {len(tests)} files"
        finally:
            (self.root / mutant.path).write_text(before, encoding="utf-8")


def tree(commit: str, folder: Path) -> Tree:
    """Unpack a commit."""
    root = folder / commit
    root.mkdir()
    archive = subprocess.run(["git", "archive", commit], cwd=ROOT, stdout=subprocess.PIPE, check=True).stdout
    subprocess.run(["tar", "-x"], cwd=root, input=archive, check=True)
    files = [path for package in (*PACKAGES, "tests", "benchmarks") for path in (root / package).rglob("*.py")]
    return Tree(root, {path: imports(path, root) for path in files})


def main(arguments: Sequence[str]) -> None:
    """Draw mutants, as many of each kind, and print which tests kill them."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks mutants", description=__doc__)
    parser.add_argument("--sample", type=int, default=40, help="how many mutants")
    parser.add_argument("--seed", type=int, default=26)
    parser.add_argument("--below", default="", help="change only what lies below this folder, as heli_plant/effects")
    parser.add_argument("--commit", default="HEAD")
    parser.add_argument("--against", help="a commit whose tests meet the same mutants")
    parser.add_argument("--budget", type=float, default=120.0, help="seconds for the tests of one mutant")
    told = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        trees = [tree(commit, Path(folder)) for commit in (told.commit, told.against) if commit]
        own = [{(m.path, m.place): m for m in mutants(one.root)} for one in trees]
        common = [key for key in own[0] if key[0].startswith(told.below) and all(key in others for others in own)]
        rng, drawn, kinds = random.Random(told.seed), [], sorted({own[0][key].kind for key in common})
        rng.shuffle(common)
        for number in range(told.sample):
            kind = kinds[number % len(kinds)]
            drawn.append(next(key for key in common if own[0][key].kind == kind and key not in drawn))
        rows = []
        for key in drawn:
            answers = [one.answer(found[key], told.budget) for one, found in zip(trees, own, strict=True)]
            mutant = own[0][key]
            change = f"{' '.join(mutant.old.split())} -> {mutant.new}"
            rows.append((mutant.kind, f"{mutant.path}:{mutant.line}", change, *answers))
            print(*rows[-1], sep=" | ", file=sys.stderr, flush=True)
    print(table(("kind", "place", "change", *(commit for commit in (told.commit, told.against) if commit)), rows))
    for column, one in enumerate(trees, 3):
        print(f"{one.root.name}: {sum('killed' in row[column] for row in rows)} of {len(rows)} killed")
