"""`make audit` never calls a package sound of which no database knows anything."""

import runpy
from pathlib import Path

import pytest

AUDIT = runpy.run_path(str(Path(__file__).parent.parent / "requirements" / "audit.py"), run_name="audit")
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
