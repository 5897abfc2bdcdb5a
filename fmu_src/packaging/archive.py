"""A zip whose bytes depend on its content alone, and files that appear complete or not at all."""

from __future__ import annotations

import io
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path
from tempfile import NamedTemporaryFile

EARLIEST = (1980, 1, 1, 0, 0, 0)
"""The earliest time of a zip entry."""


def zip_bytes(entries: Mapping[str, bytes]) -> bytes:
    """Return a zip of ``entries`` in sorted order with one fixed time and mode."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name in sorted(entries):
            info = zipfile.ZipInfo(name, EARLIEST)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = 0o644 << 16
            info.create_system = 3  # the same on every system that builds
            archive.writestr(info, entries[name], compresslevel=9)
    return buffer.getvalue()


def write_atomically(path: Path, content: bytes) -> Path:
    """Write ``content`` to ``path`` and return it; a reader sees the old file or the new one, never a part."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", delete=False) as temporary:
        try:
            temporary.write(content)
            temporary.close()
            os.chmod(temporary.name, 0o644)
            os.replace(temporary.name, path)
        except BaseException:
            Path(temporary.name).unlink(missing_ok=True)
            raise
    return path
