"""A zip whose bytes depend on its content alone."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping

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
            archive.writestr(info, entries[name])  # the highest level takes twice as long for a hundredth less
    return buffer.getvalue()
