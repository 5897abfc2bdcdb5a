"""Which way imports run: one table of rules, and a walk over every import of the three packages.

Imports are read from the source, also those inside functions, so that a late import breaks a rule like any other.
"""

import ast
import subprocess
import sys
from importlib import import_module
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
    f"heli_plant.{module}" for module in ("simplified_model", "general_model", "effects", "bending", "ado")
)
MATHEMATICS = tuple(
    f"math.{name}" for name in ("sin", "cos", "tan", "exp", "tanh", "sqrt", "atan2", "log", "hypot")
)  # fmt: skip

H = "heli_identifier"
ROOMS = tuple(
    f"{H}.{room}" for room in ("online", "records", "tracing", "following", "results", "live", "tools", "cli")
)
"""From the ground floor up: a room imports those below it only."""

LINK = tuple(f"{H}.live.{module}" for module in ("datagrams", "port", "order", "clock"))
"""The link to a rig, which travels inside units; the rest of its room is entered by the commands, module by module."""

DOORS = (*ROOMS[:5], f"{H}.tools", f"{H}.online.excitation")
"""Packages whose ``__init__`` names what others may use; live is entered by the commands, module by module."""

MAY_USE_UNITS = (f"{H}.cli", f"{H}.results")

RULES = (
    Rule("physics knows no identification", "heli_plant", (H,)),
    Rule("physics knows no FMI", "heli_plant", FMI),
    Rule(
        "physics knows no files, but for the cache of compiled code",
        "heli_plant", FILES, ("heli_plant.compiled", "heli_plant.code_cache"),
    ),
    Rule(
        "physics is plain floats, but for what runs off line",
        "heli_plant", ARRAYS,
        tuple(f"heli_plant.{name}" for name in ("compiled", "code_cache", "simulation", "along", "dual")),
    ),
    Rule(
        "identification takes the form of the physics, never true values",
        H, ("heli_plant.parameters.TABLE_2",),
    ),
    Rule("identification knows no units, but for what builds and runs them", H, ("fmu_src",), MAY_USE_UNITS),
    *(Rule(f"{lower} does not use what is built on it", lower, ROOMS[i + 1 :]) for i, lower in enumerate(ROOMS[:-1])),
    Rule("the tracer knows the plant in one place", f"{H}.tracing", ("heli_plant",), (f"{H}.tracing.helicopter",)),
    Rule(
        "commands call, nothing calls them",
        H, (f"{H}.cli",), (f"{H}.cli",),
    ),
    *(Rule("the link to a rig needs the standard library alone", module, (*ARRAYS, *ROOMS[:5])) for module in LINK),
    Rule("estimation on line is plain floats", f"{H}.online", ARRAYS),
    Rule("a twin that follows is plain floats and knows no logs", f"{H}.following", (*ARRAYS, *FILES, *ROOMS[1:3])),
    Rule("slaves hold no physics", "fmu_src.units", (*MATHEMATICS, "cmath", *ARRAYS)),
    Rule("slaves step the plant, they do not take it apart", "fmu_src.units", PARTS_OF_THE_PLANT),
    Rule(
        "units know the identifier, the twin that follows and the link to a rig", "fmu_src",
        (*ROOMS[1:3], ROOMS[4], *ROOMS[6:]),
    ),
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


def room_of(module):
    """The room that a module lies in: the excitation has a door of its own inside of ``online``."""
    return max((door for door in (*DOORS, *ROOMS[-3:]) if below(module, [door])), key=len, default="")


@pytest.mark.parametrize("door", DOORS)
def test_a_room_is_entered_by_its_door(door):
    """From outside ``from room import name`` with a name that the door lists, and no module behind it."""
    offered = {f"{door}.{name}" for name in import_module(door).__all__}
    strangers = {
        f"{module} imports {name}"
        for module, names in PROJECT.items()
        for name in names
        if room_of(name) == door and room_of(module) != door and name not in offered
    }
    assert strangers == set()


def run_by_units(modules):
    """Modules of the project that the units import, and what those import, and so on."""
    reached, waiting = set(), [module for module in modules if below(module, ["fmu_src.units"])]
    while waiting:
        module = waiting.pop()
        if module in reached:
            continue
        reached.add(module)
        # an imported name may be a module or something in one; packages passed through travel empty
        for name in modules[module]:
            waiting += [known for known in (name, name.rpartition(".")[0]) if known in modules]
    return reached


def test_what_an_fmu_runs_needs_the_standard_library_alone():
    reached, allowed = run_by_units(PROJECT), {*sys.stdlib_module_names, *PACKAGES, "pythonfmu"}
    assert {"heli_plant.plant", "heli_plant.laws", "heli_plant.control"} <= reached
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


LATE = MAY_USE_UNITS


def is_loaded(node):
    """Whether a statement runs when its module is loaded: not the inside of functions, nor what types alone need."""
    of_types = isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
    return not of_types and not isinstance(node, ast.FunctionDef)


@pytest.mark.parametrize("module", [module for module in PROJECT if below(module, LATE)])
def test_commands_import_the_units_late(module):
    """Help and estimation must not load the FMI tools, only what builds or runs units does; errors load nothing."""
    top = ast.Module([node for node in ast.parse(source_of(module)).body if is_loaded(node)], [])
    early = [name for name in imports(module, ast.unparse(top)) if below(name, ["fmu_src"])]
    assert [name for name in early if not below(name, ["fmu_src.errors"])] == []


@pytest.mark.parametrize(
    "module, without",
    [
        ("heli_identifier.cli.app", ("numpy", "numba", "scipy", "pandas", "matplotlib", "rich.table")),
        ("heli_identifier.cli.terminal", ("numba", "scipy", "pandas", "matplotlib")),
        ("heli_identifier.tracing.diagnose", ("pandas", "matplotlib", "statsmodels", "control")),
        ("heli_identifier.results.report", ("numba", "pandas", "statsmodels")),
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


# --- circles, and the doors of fmu_src ---------------------------------------------------------------------------


def circles(modules):
    """Sets of modules that reach each other by imports, late ones and those for type checkers alone included.

    ``from package import name`` is an import of the module ``package.name`` if there is one, else of ``package``;
    packages that are merely passed through do not count, but what a door takes from its modules does.
    """
    edges = {
        module: {known for name in names if (known := name if name in modules else name.rpartition(".")[0]) in modules}
        for module, names in modules.items()
    }
    reach = {}
    for module in modules:
        seen, waiting = set(), [*edges[module]]
        while waiting:
            if (name := waiting.pop()) not in seen:
                seen.add(name)
                waiting += edges[name]
        reach[module] = seen
    return {
        frozenset(other for other in reach[module] if module in reach[other])
        for module in modules
        if module in reach[module]
    }


def test_no_modules_import_each_other_in_a_circle():
    stubs = {
        ".".join(stub.relative_to(ROOT).parent.parts): set(
            imports(".".join(stub.relative_to(ROOT).parent.parts), stub.read_text(encoding="utf-8"), is_package=True)
        )
        for package in PACKAGES
        for stub in (ROOT / package).rglob("__init__.pyi")
    }
    assert circles({m: names | stubs.get(m, set()) for m, names in PROJECT.items()}) == set()


def test_a_circle_is_seen_whatever_its_length():
    chain = {"p": set(), "p.a": {"p.b.f"}, "p.b": {"p.c"}, "p.c": {"p.a.g", "p.d"}, "p.d": {"p"}}
    assert circles(chain) == {frozenset({"p.a", "p.b", "p.c"})}
    assert circles({**chain, "p.c": {"p.d"}}) == set()


FMU_DOORS = ("fmu_src", "fmu_src.master", "fmu_src.native", "fmu_src.ssp", "fmu_src.packaging")


def test_fmu_src_is_entered_by_its_doors():
    """From outside, names that a door lists; errors have a door of their own, which loads nothing else."""
    offered = {f"{door}.{name}" for door in FMU_DOORS for name in import_module(door).__all__}
    strangers = {
        f"{module} imports {name}"
        for module, names in PROJECT.items()
        for name in names
        if below(name, ["fmu_src"]) and not below(module, ["fmu_src"])
        if name not in offered and not below(name, ["fmu_src.errors"])
    }
    assert strangers == set()


def test_the_errors_and_the_wiring_load_no_fmi_tools():
    program = (
        "import sys, fmu_src.errors; from fmu_src import SCENARIOS; from fmu_src.master import run_apart;"
        "print([name for name in ('fmpy', 'numba', 'scipy') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.strip() == "[]"
