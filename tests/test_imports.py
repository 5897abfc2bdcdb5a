"""Which way imports run: the contracts in pyproject.toml, and what an FMU and a command load."""

import subprocess
import sys
from pathlib import Path

import grimp
import pytest
from importlinter.cli import lint_imports

ROOT = Path(__file__).parent.parent
PACKAGES = ("fmu_src", "heli_plant", "heli_identifier")


def test_imports_keep_their_direction(monkeypatch):
    monkeypatch.chdir(ROOT)
    assert lint_imports(no_cache=True) == 0


def test_what_an_fmu_runs_needs_the_standard_library_alone():
    """Modules of the project that the units import, and what those import, and so on; late imports as well."""
    graph = grimp.build_graph(*PACKAGES, include_external_packages=True, cache_dir=None)
    reached = graph.find_upstream_modules("fmu_src.units", as_package=True)
    assert {"heli_plant.plant", "heli_plant.control", "heli_identifier.online"} <= reached
    allowed = {*sys.stdlib_module_names, *PACKAGES, "pythonfmu"}
    assert {name for name in reached if name.partition(".")[0] not in allowed} == set()


def files_with(text, *packages):
    """Names of modules that hold a text."""
    sources = [path for package in packages for path in (ROOT / package).rglob("*.py")]
    return [path.name for path in sources if text in path.read_text(encoding="utf-8")]


def test_identification_takes_the_form_of_the_physics_and_never_true_values():
    assert files_with("TABLE_2", "heli_identifier") == []


def test_machine_code_is_kept_in_the_folder_of_the_user_alone_and_not_beside_the_sources_as_by_numba():
    assert files_with("cache=True", *PACKAGES) == ["compiled.py"]  # which says why not


@pytest.mark.parametrize(
    "module, without",
    [
        ("heli_identifier.cli.app", ("numpy", "numba", "scipy", "pandas", "matplotlib", "fmpy", "rich.table")),
        ("heli_identifier.tracing.diagnose", ("pandas", "matplotlib", "control")),
        ("fmu_src.master", ("fmpy", "numba", "scipy")),
    ],
)
def test_what_takes_long_to_import_is_imported_by_those_who_need_it(module, without):
    program = f"import sys, {module}; print([name for name in {without!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.strip() == "[]"
