"""Which way imports run: one table of rules, and a walk over every import of the three packages.

Imports are read from the source, also those inside functions, so that a late import breaks a rule like any other.
"""

import ast
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = ("fmu_src", "heli_plant", "heli_identifier")


class Rule(NamedTuple):
    """``who`` (a package or module, all below it included) imports nothing of ``banned``, but for ``exempt``."""

    why: str
    who: str
    banned: tuple[str, ...]
    exempt: tuple[str, ...] = ()


FMI = ("pythonfmu", "fmpy", "fmu_src")
FILES = (
    "builtins.open", "os", "io", "pathlib", "shutil", "tempfile", "csv", "json", "pickle", "glob", "sqlite3", "zipfile",
)  # fmt: skip
ARRAYS = ("numpy", "numba", "scipy", "pandas", "control", "matplotlib", "statsmodels")
PARTS_OF_THE_PLANT = tuple(
    f"heli_plant.{module}"
    for module in ("simplified_model", "general_model", "neglected", "friction", "rotors", "bending", "ado")
)
MATHEMATICS = tuple(
    f"math.{name}" for name in ("sin", "cos", "tan", "exp", "tanh", "sqrt", "atan2", "log", "hypot")
)  # fmt: skip

RULES = (
    Rule("physics knows no identification", "heli_plant", ("heli_identifier",)),
    Rule("physics knows no FMI", "heli_plant", FMI),
    Rule("physics knows no files, but for the cache of compiled code", "heli_plant", FILES, ("heli_plant.compiled",)),
    Rule(
        "physics is plain floats, but for what runs off line",
        "heli_plant", ARRAYS, ("heli_plant.compiled", "heli_plant.simulation"),
    ),
    Rule(
        "identification takes the form of the physics, never true values",
        "heli_identifier", ("heli_plant.parameters.TABLE_2",), ("heli_identifier.paper",),
    ),
    Rule(
        "identification knows no units, but for what builds and runs them",
        "heli_identifier", ("fmu_src",),
        ("heli_identifier.cli", "heli_identifier.delivery", "heli_identifier.paper"),
    ),
    Rule(
        "what a diagnosis is made of knows no diagnosis",
        "heli_identifier",
        ("heli_identifier.diagnosis",),
        tuple(
            f"heli_identifier.{room}"
            for room in ("diagnosis", "campaign", "report", "delivery", "interface", "second_process", "cli")
        ),
    ),
    Rule("commands call, nothing calls them", "heli_identifier", ("heli_identifier.cli",), ("heli_identifier.cli",)),
    Rule("estimation on line is plain floats", "heli_identifier.online", ARRAYS),
    Rule("excitation is plain floats", "heli_identifier.excitation", ARRAYS),
    Rule("slaves hold no physics", "fmu_src.units", (*MATHEMATICS, "cmath", *ARRAYS)),
    Rule("slaves step the plant, they do not take it apart", "fmu_src.units", PARTS_OF_THE_PLANT),
    Rule("slaves know no commands and no reports", "fmu_src.units", ("heli_identifier.cli", "heli_identifier.report")),
)  # fmt: skip


def below(name, roots):
    """Whether a dotted name is one of ``roots`` or lies below one."""
    return any(name == root or name.startswith(f"{root}.") for root in roots)


def imports(module, source, is_package=False):
    """Every dotted name that a module imports, ``package.module.attribute`` included, and ``builtins.open``."""
    parts = module.split(".") if is_package else module.split(".")[:-1]
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = parts[: len(parts) - node.level + 1] if node.level else []
            origin = ".".join([*base, *([node.module] if node.module else [])])
            yield from (f"{origin}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "open":
            yield "builtins.open"
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            yield f"{node.value.id}.{node.attr}"  # math.sin after `import math`


def project():
    """Every module of the packages with all that it imports."""
    found = {}
    for package in PACKAGES:
        for file in sorted((ROOT / package).rglob("*.py")):
            path = file.relative_to(ROOT).with_suffix("")
            is_package = path.name == "__init__"
            module = ".".join(path.parent.parts if is_package else path.parts)
            found[module] = set(imports(module, file.read_text(encoding="utf-8"), is_package))
    return found


PROJECT = project()


def breaches(rule, modules):
    return [
        f"{module} imports {name}"
        for module, names in modules.items()
        if below(module, [rule.who]) and not below(module, rule.exempt)
        for name in sorted(names)
        if below(name, rule.banned)
    ]


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.why)
def test_imports_keep_their_direction(rule):
    assert breaches(rule, PROJECT) == []


def run_by_units(modules):
    """Modules of the project that the units import, and what those import, and so on."""
    reached, waiting = set(), [module for module in modules if below(module, ["fmu_src.units"])]
    while waiting:
        module = waiting.pop()
        if module in reached:
            continue
        reached.add(module)
        package = module.rpartition(".")[0]
        # importing a module runs its package first; an imported name may be a module or something in one
        for name in [package, *modules[module]]:
            waiting += [known for known in (name, name.rpartition(".")[0]) if known in modules]
    return reached


def test_what_an_fmu_runs_needs_the_standard_library_alone():
    reached, allowed = run_by_units(PROJECT), {*sys.stdlib_module_names, *PACKAGES, "pythonfmu"}
    assert {"heli_plant.plant", "heli_plant.neglected", "heli_plant.control"} <= reached
    for module in reached:
        tops = {top_level(node) for node in ast.walk(ast.parse(source_of(module))) if is_absolute_import(node)}
        assert tops <= allowed, f"{module} imports {tops - allowed}"


def source_of(module):
    base = ROOT.joinpath(*module.split("."))
    file = base / "__init__.py" if base.is_dir() else base.with_suffix(".py")
    return file.read_text(encoding="utf-8")


def is_absolute_import(node):
    return isinstance(node, ast.Import) or (isinstance(node, ast.ImportFrom) and not node.level)


def top_level(node):
    return (node.names[0].name if isinstance(node, ast.Import) else node.module).partition(".")[0]


LATE = ("heli_identifier.cli", "heli_identifier.delivery")


@pytest.mark.parametrize("module", [module for module in PROJECT if below(module, LATE)])
def test_commands_import_the_units_late(module):
    """Help and estimation must not load the FMI tools, only what builds or runs units does; errors load nothing."""
    top = ast.Module([node for node in ast.parse(source_of(module)).body if not isinstance(node, ast.FunctionDef)], [])
    early = [name for name in imports(module, ast.unparse(top)) if below(name, ["fmu_src"])]
    assert [name for name in early if not below(name, ["fmu_src.errors"])] == []


@pytest.mark.parametrize(
    "module, without",
    [
        ("heli_identifier.cli.app", ("numpy", "numba", "scipy", "pandas", "matplotlib", "rich.table")),
        ("heli_identifier.cli.summary", ("numba", "scipy", "pandas", "matplotlib")),
        # the process that draws a report starts while the command imports what the search needs
        ("heli_identifier.report.page", ("numba", "scipy.signal", "scipy.stats", "pandas", "statsmodels")),
    ],
)
def test_what_takes_long_to_import_is_imported_by_those_who_need_it(module, without):
    program = f"import sys, {module}; print([name for name in {without!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.strip() == "[]"


# --- the walk itself ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "source, name",
    [
        ("import numpy as np", "numpy"),
        ("def f():\n    from numpy import array", "numpy.array"),
        ("from ..heli_identifier import online", "heli_identifier.online"),
        ("from .parameters import TABLE_2", "heli_plant.parameters.TABLE_2"),
        ("import math\nmath.sin(1.0)", "math.sin"),
        ("with open('x') as f: pass", "builtins.open"),
    ],
)
def test_walk_sees_every_form_of_import(source, name):
    assert name in set(imports("heli_plant.module", source))


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.why)
def test_rule_speaks_up_when_it_is_broken(rule):
    broken = {f"{rule.who}.module": {rule.banned[0]}}
    assert breaches(rule, broken) == [f"{rule.who}.module imports {rule.banned[0]}"]
    assert rule.who in PROJECT
