"""The project: which way imports run, what a command loads, pinned requirements and their audit."""

import re
import runpy
import tomllib
from pathlib import Path

import pytest
from importlinter.cli import lint_imports

from tests.commands import run_python

ROOT = Path(__file__).parent.parent


def test_imports_keep_their_direction(monkeypatch):
    monkeypatch.chdir(ROOT)
    assert lint_imports(no_cache=True) == 0
    # identification takes the form of the physics and never true values
    sources = (ROOT / "heli_identifier").rglob("*.py")
    assert [path.name for path in sources if "TABLE_2" in path.read_text(encoding="utf-8")] == []


@pytest.mark.parametrize("module, without", [
    ("heli_identifier", ("numpy", "numba", "scipy", "pandas", "fmpy", "msgspec", "typer", "rich")),
    ("heli_identifier.cli.app", ("numpy", "numba", "scipy", "pandas", "matplotlib", "fmpy", "rich.table")),
    ("heli_identifier.results.diagnose", ("pandas", "matplotlib", "control")),
    # the plant's modules serve inside an FMU, whose host may have neither numba nor numpy
    *((f"heli_plant.{name}", ("numba", "numpy")) for name in ("plant", "control", "communication", "parameters")),
    ("fmu_src.master", ("fmpy", "numba", "scipy")),
])  # fmt: skip
def test_what_takes_long_to_import_is_imported_by_those_who_need_it(module, without):
    program = f"import sys, {module}; print([name for name in {without!r} if name in sys.modules])"
    assert run_python(program, cwd=ROOT).stdout.strip() == "[]"


LOCKED = (ROOT / "requirements" / "demo.txt").read_text(encoding="utf-8")
ENTRIES = [entry.partition("==")[::2] for entry in re.split(r"\n(?=[a-z])", LOCKED)]
"""Name, and version, marker and hashes."""


def test_all_that_the_project_needs_is_pinned_with_hashes_and_without_addresses():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    needed = [*project["project"]["dependencies"], *project["build-system"]["requires"]]
    names = {re.split(r"[<>=!~\[; ]", entry)[0].lower().replace("_", "-") for entry in needed}
    assert names <= {name for name, _ in ENTRIES}
    assert [name for name, rest in ENTRIES if "--hash=sha256:" not in rest] == []
    assert not re.search(r"https?:|--(extra-)?index-url|--find-links", LOCKED)


AUDIT = runpy.run_path(str(ROOT / "requirements" / "audit.py"), run_name="audit")
SOUND = {"name": "numpy", "version": "2.4.6", "vulns": []}
UNKNOWN = {"name": "scipy", "skip_reason": "Dependency not found on PyPI and could not be audited: scipy (1.17.1)"}
BROKEN = {"name": "scipy", "version": "1.17.1", "vulns": [{"id": "PYSEC-1", "fix_versions": ["1.18"]}]}


@pytest.mark.parametrize(("answers", "code", "said"), [
    ({"pypi": [SOUND]}, 0, "1 packages audited, 0 known vulnerabilities"),
    ({"pypi": [SOUND, UNKNOWN]}, 2, "NOT AUDITED: scipy"),
    ({"pypi": [SOUND, UNKNOWN], "osv": [BROKEN]}, 1, "scipy: PYSEC-1, mended in 1.18"),
    ({"pypi": [SOUND, UNKNOWN], "osv": [SOUND | {"name": "scipy"}]}, 0, "2 packages audited"),
    ({"pypi": [], "osv": []}, 2, "NOT AUDITED: every package"),
    ({"pypi": [UNKNOWN, BROKEN | {"name": "pandas"}]}, 1, "NOT AUDITED: scipy"),
])  # fmt: skip
def test_a_package_without_an_answer_is_a_failure_of_its_own(answers, code, said):
    found, text = AUDIT["verdict"](answers)
    assert found == code
    assert said in text
