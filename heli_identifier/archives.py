"""Archives and compressed files from strangers, looked at before they are unpacked.

A few kilobytes of zip can hold a petabyte, and an entry's name can lead out of the folder that it is unpacked into. So
the directory of a zip is read first, and a compressed stream is read only up to a limit.
"""

import zipfile
from pathlib import Path, PurePosixPath

LARGEST = 2_000_000_000
"""Bytes that an archive may hold unpacked. The largest FMUs, with tables in them, have some hundred megabytes."""

LARGEST_RATIO = 200.0
"""Unpacked size as a multiple of the packed one. Text packs to a tenth, a table of one repeated line to a hundredth."""

SMALL = 50_000_000
"""Bytes below which the ratio does not matter."""


class ArchiveError(ValueError):
    """An archive is damaged, too large unpacked, or leads out of its folder; the message says which."""


def check_zip(path: Path) -> None:
    """Refuse a zip that cannot be unpacked safely.

    Raises
    ------
    ArchiveError
        It is no zip, is larger than `LARGEST` or packed more than `LARGEST_RATIO` times, or has an entry that lies
        outside of its folder. (zipfile refuses what is encrypted, and makes a file of a link.)
    OSError
        The file cannot be read.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
    except (zipfile.BadZipFile, NotImplementedError, ValueError) as error:
        raise ArchiveError(f"it is no zip archive ({error})") from error
    for entry in entries:
        name = PurePosixPath(entry.filename.replace("\\", "/"))
        if name.is_absolute() or ".." in name.parts or ":" in (name.parts or ("",))[0]:
            raise ArchiveError(f"its entry {entry.filename!r} lies outside of the archive")
    check_size(sum(entry.file_size for entry in entries), sum(entry.compress_size for entry in entries))


def check_size(unpacked: int, packed: int) -> None:
    """Refuse a size [bytes] that no honest archive has, above `LARGEST` or `LARGEST_RATIO`: an ArchiveError."""
    if unpacked > LARGEST:
        raise ArchiveError(f"it holds {unpacked / 1e9:.3g} GB unpacked, at most {LARGEST / 1e9:g} GB are unpacked")
    if unpacked > SMALL and unpacked > LARGEST_RATIO * max(packed, 1):
        raise ArchiveError(
            f"it holds {unpacked / 1e6:.3g} MB packed {unpacked / max(packed, 1):.0f} times, "
            f"at most {LARGEST_RATIO:g} times are unpacked"
        )
