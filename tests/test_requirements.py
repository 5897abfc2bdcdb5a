"""Pinned requirements with their hashes, and an audit that calls nothing sound of which no database knows anything."""

import re
import runpy
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
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


@pytest.mark.parametrize(
    ("answers", "code", "said"),
    [
        ({"pypi": [SOUND]}, 0, "1 packages audited, 0 known vulnerabilities"),
        ({"pypi": [SOUND, UNKNOWN]}, 2, "NOT AUDITED: scipy"),
        ({"pypi": [SOUND, UNKNOWN], "osv": [BROKEN]}, 1, "scipy: PYSEC-1, mended in 1.18"),
        ({"pypi": [SOUND, UNKNOWN], "osv": [SOUND | {"name": "scipy"}]}, 0, "2 packages audited"),
        ({"pypi": [], "osv": []}, 2, "NOT AUDITED: every package"),
        ({"pypi": [UNKNOWN, BROKEN | {"name": "pandas"}]}, 1, "NOT AUDITED: scipy"),
    ],
)
def test_a_package_without_an_answer_is_a_failure_of_its_own(answers, code, said):
    found, text = AUDIT["verdict"](answers)
    assert found == code
    assert said in text
