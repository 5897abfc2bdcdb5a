"""Zip archives from strangers, looked at before they are unpacked.

A few kilobytes of zip can hold a petabyte, and an entry's name can lead out of the folder that it is unpacked into. So
the directory of a zip is read first.
"""

import zipfile
from pathlib import Path, PurePosixPath

LARGEST = 2_000_000_000
"""Bytes that an archive may hold unpacked. The largest FMUs, with tables in them, have some hundred megabytes."""

_BLOCK = 4096  # bytes of a disk that an entry takes at least


def check_zip(path: Path) -> None:
    """Refuse a zip that cannot be unpacked safely; zipfile refuses what is encrypted, and makes a file of a link.

    Raises
    ------
    ValueError
        It is no zip, holds more than `LARGEST`, or has an entry that lies outside of its folder.
    OSError
        The file cannot be read.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
    except (zipfile.BadZipFile, NotImplementedError, ValueError) as error:
        raise ValueError(f"it is no zip archive ({error})") from error
    for entry in entries:
        name = PurePosixPath(entry.filename.replace("\\", "/"))
        if name.is_absolute() or ".." in name.parts or ":" in (name.parts or ("",))[0]:
            raise ValueError(f"its entry {entry.filename!r} lies outside of the archive")
    if (unpacked := sum(max(entry.file_size, _BLOCK) for entry in entries)) > LARGEST:
        raise ValueError(f"it holds {unpacked / 1e9:.3g} GB unpacked, at most {LARGEST / 1e9:g} GB are unpacked")
