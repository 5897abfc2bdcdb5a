"""Where results come from: the command, the versions of the packages, the day."""

import platform
import shlex
import sys
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

PACKAGES = ("heli-twin", "numpy", "scipy", "numba", "pythonfmu", "fmpy")
"""Distributions whose version can change a result."""


def installed_version(name: str) -> str:
    """Return the version of a distribution; "not installed" where it is missing."""
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


__version__ = installed_version("heli-twin")
"""Version of this program."""


def provenance() -> dict[str, Any]:
    """Return the provenance of this process's results: the command line (if it is one of `heli`), date, versions."""
    program, *words = sys.argv
    is_command = Path(program).stem in ("heli", "heli_command")
    return {
        "command": shlex.join(["heli", *words]) if is_command else "heli_identifier in Python",
        "date": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "system": f"{platform.system()} {platform.machine()}",
        "versions": {"Python": platform.python_version(), **{name: installed_version(name) for name in PACKAGES}},
    }
