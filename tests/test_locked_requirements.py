"""The pinned requirements of the demonstration: every package with hashes, none missing, no address of a registry."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parent.parent
LOCKED = (ROOT / "requirements" / "demo.txt").read_text(encoding="utf-8")
ENTRIES = [entry.partition("==")[::2] for entry in re.split(r"\n(?=[a-z])", LOCKED)]
"""Name, and version, marker and hashes."""


def test_every_package_is_pinned_and_has_hashes():
    assert len(ENTRIES) > 40
    assert [name for name, rest in ENTRIES if "--hash=sha256:" not in rest] == []


def test_what_the_project_needs_at_run_time_and_to_be_built_is_there():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    needed = [*project["project"]["dependencies"], *project["build-system"]["requires"]]
    names = {re.split(r"[<>=!~\[; ]", entry)[0].lower().replace("_", "-") for entry in needed}
    assert names <= {name for name, _ in ENTRIES}


def test_no_address_is_named():
    assert not re.search(r"https?:|--(extra-)?index-url|--find-links", LOCKED)
