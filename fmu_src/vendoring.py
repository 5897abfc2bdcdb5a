"""The Python sources that a unit needs, under names with a hash of their content.

All units of a process share ``sys.modules``, so that a second FMU with a package of the same name would silently run
the code of the first one. Therefore every package of the project, the part of pythonfmu that runs, and the slave script
are put into the FMU as ``<name>_<hash>``, and the absolute imports between them are rewritten.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import re
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path, PurePosixPath
from uuid import UUID, uuid5

from .description import render
from .errors import BuildError
from .variables import Value

VENDORED = ("fmu_src", "heli_plant", "heli_identifier", "pythonfmu")  # all other imports must be standard library

_NAMESPACE = UUID("5b6c0a52-5f0e-4f2e-9a55-6a4f5f0f9f21")
_POSTPONED = "from __future__ import annotations\n"  # Python 3.9, the oldest of a host, cannot evaluate all annotations
_STRICT = re.compile(r",\s*strict=(?:True|False)(?=\s*,?\s*\))")


def _module_file(module: str) -> Path | None:
    """Return the file of a module in a vendored package, or None if the name is not a module but an attribute."""
    try:
        spec = importlib.util.find_spec(module)
    except ModuleNotFoundError:
        return None
    return Path(spec.origin) if spec and spec.origin else None


def _imported_modules(module: str, tree: ast.AST, is_package: bool) -> Iterable[str]:
    """Yield every absolute module name that ``module`` may import, also inside functions."""
    package = module if is_package else module.rpartition(".")[0]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            origin = importlib.util.resolve_name("." * node.level + (node.module or ""), package)
            names = [f"{origin}.{alias.name}" for alias in node.names]
            yield from names if all(map(_module_file, names)) else (origin, *names)


def needed_sources(module: str) -> dict[str, str]:
    """Return every source that ``module`` needs, by its path; BuildError names a module that a host cannot run.

    A package of which only a module is imported gets an empty ``__init__``, because the real one imports more than a
    unit needs (files, arrays, the builder).
    """
    sources: dict[str, str] = {}
    modules = [module]
    while modules:
        name = modules.pop()
        file = _module_file(name)
        is_package = file is not None and file.name == "__init__.py"
        path = name.replace(".", "/") + ("/__init__.py" if is_package else ".py")
        if file is None or path in sources:
            continue
        sources[path] = file.read_text(encoding="utf-8")
        for imported in _imported_modules(name, ast.parse(sources[path]), is_package):
            root = imported.split(".")[0]
            if root in VENDORED:
                modules.append(imported)
            elif root not in sys.stdlib_module_names:
                raise BuildError(f"{name} imports {root}, which is not in the standard library; a unit may not need it")
    for path in tuple(sources):
        for folder in PurePosixPath(path).parents[:-1]:
            sources.setdefault(f"{folder}/__init__.py", "")
    return dict(sorted(sources.items()))


def python_unit(unit: type, start_values: Mapping[str, Value]) -> dict[str, bytes]:
    """Return the files of a unit in Python: its sources under hashed names, and the script that the host loads.

    The binary runs the script for every instance and releases its globals once too often, so a list in ``sys`` holds
    a reference to them.
    """
    sources = needed_sources(unit.__module__)
    tag = content_hash({**sources, "start values": repr(sorted(start_values.items()))})[:12]
    script = f"{unit.__name__}_{tag}"
    texts = {path.replace("/", f"_{tag}/", 1): _rewrite(text, tag) for path, text in sources.items()}
    values = [f"{name!r}: {value!r}" for name, value in sorted(start_values.items())]
    texts |= {f"{script}.py": render("slave.py.j2", unit=unit, tag=tag, values=values), "slavemodule.txt": script}
    return {f"resources/{path}": text.encode() for path, text in texts.items()}


def _rewrite(text: str, tag: str) -> str:
    """Rename vendored packages in ``from package import``; remove ``strict`` of zip, which Python 3.9 lacks."""
    text = re.sub(rf"^(\s*from (?:{'|'.join(VENDORED)}))\b", rf"\1_{tag}", text, flags=re.MULTILINE)
    text = _STRICT.sub("", text)
    return text if not text.strip() or _POSTPONED in text else _POSTPONED + text


def content_hash(entries: Mapping[str, str | bytes]) -> str:
    """Return a hexadecimal hash of the names and the content of all entries."""
    digest = hashlib.sha256()
    for name, entry in sorted(entries.items()):
        content = entry.encode() if isinstance(entry, str) else entry
        digest.update(f"{name}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()


def content_guid(entries: Mapping[str, str | bytes]) -> str:
    """Return the GUID of the content of all entries."""
    return f"{{{uuid5(_NAMESPACE, content_hash(entries))}}}"
