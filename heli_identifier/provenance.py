"""Where results come from: the command, the versions that took part, the day."""

import platform
import shlex
import sys
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from typing import Any

PACKAGES = ("heli-twin", "numpy", "scipy", "numba", "pythonfmu", "fmpy")
"""Distributions whose version can change a result."""


def installed(name: str) -> str:
    """Give the version of a distribution; "not installed" where it is missing."""
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


__version__ = installed("heli-twin")
"""Version of this program."""


def provenance(*command: str) -> dict[str, Any]:
    """Give the provenance of what a command line, given word by word, computes now."""
    return {
        "command": shlex.join(command),
        "date": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "system": f"{platform.system()} {platform.machine()}",
        "versions": {"Python": platform.python_version(), **{name: installed(name) for name in PACKAGES}},
    }


def from_python(function: str) -> dict[str, Any]:
    """Give the provenance of what a function of the package computes now."""
    return provenance(f"heli_identifier.{function}")


def from_command_line() -> dict[str, Any]:
    """Give the provenance of what this command of the command line computes now."""
    return provenance("heli", *sys.argv[1:])
