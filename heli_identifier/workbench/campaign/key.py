"""The name of a result: a digest of everything that it depends on.

A campaign that is started again skips the rigs that have a result of this name. The digest covers the rig's name and
content, the settings, and the source of all code that takes part, so an old result is never taken for a new one.
"""

import hashlib
import json
from collections.abc import Iterable
from dataclasses import asdict
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from heli_identifier.errors import ConfigurationError
from heli_identifier.tracing import DiagnosisSettings

LENGTH = 24
"""Hexadecimal digits of a key: with 96 bits no two of a billion results share one."""

CODE = ("heli_plant", "heli_identifier.online", "heli_identifier.records", "heli_identifier.tracing")
"""Packages that a diagnosis runs."""


def result_key(rig: str, content: str, settings: DiagnosisSettings, code: str) -> str:
    """Return the name of one rig's result.

    Parameters
    ----------
    rig : str
        The rig's name in the campaign.
    content : str
        Digest of its logs, or of what makes them.
    settings : DiagnosisSettings
    code : str
        Digest of the code that makes the row.
    """
    parts = [rig, content, json.dumps(asdict(settings), sort_keys=True), code]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:LENGTH]


@cache
def code_digest() -> str:
    """Return the digest of the source of every package that a diagnosis runs."""
    return source_digest(CODE)


def source_digest(modules: Iterable[str]) -> str:
    """Return the digest of the source of modules, and of packages with everything in their folders.

    Raises
    ------
    ConfigurationError
        A module cannot be found.
    """
    digest = hashlib.sha256()
    for module in modules:
        for path in _files(module):
            digest.update(f"{module} {path.name}".encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()


def files_digest(paths: Iterable[Path]) -> str:
    """Return the digest of files' names and bytes, in the order given."""
    digest = hashlib.sha256()
    for path in paths:
        digest.update(path.name.encode())
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def _files(module: str) -> list[Path]:
    try:
        spec = find_spec(module)
    except ModuleNotFoundError:
        spec = None
    if spec is None:
        raise ConfigurationError(
            f"module {module} cannot be found; run from the folder that holds it, or put that folder on PYTHONPATH."
        )
    folders = [Path(folder) for folder in spec.submodule_search_locations or ()]
    if folders:
        return [path for folder in folders for path in sorted(folder.rglob("*.py"))]
    return [Path(spec.origin)] if spec.origin and spec.origin.endswith(".py") else []
