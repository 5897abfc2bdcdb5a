"""A folder of results that appears complete or not at all.

Everything is written into a hidden folder beside the target first. Only when the last file is done are the files
moved to their places, each by one rename; should a rename fail, those before it are taken back. Files of other names
that the target already holds stay as they are.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from heli_identifier.errors import ConfigurationError


@contextmanager
def whole_folder(target: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a folder to write into; what it holds is moved to ``target`` if the block ends without an exception.

    Parameters
    ----------
    target : path
        Folder of the results; made with its parents if it does not exist.

    Yields
    ------
    Path
        A folder of its own on the same disk, gone afterwards.

    Raises
    ------
    ConfigurationError
        The target is no folder or cannot be written to; raised before the block runs, so that no long computation
        ends in vain.
    """
    folder = Path(target).absolute()
    existing = next(path for path in (folder, *folder.parents) if path.exists())
    if not existing.is_dir():
        raise ConfigurationError(f"{existing} is a file, a folder is needed there; name another output folder.")
    try:
        draft = TemporaryDirectory(dir=existing, prefix=f".{folder.name}-", ignore_cleanup_errors=True)
    except OSError as error:
        raise ConfigurationError(f"{existing} cannot be written to: {error.strerror}; name another folder.") from error
    with draft as path:
        yield Path(path)
        folder.mkdir(parents=True, exist_ok=True)
        _move_all(Path(path), folder)


def _move_all(draft: Path, folder: Path) -> None:
    """Move every file of ``draft`` into ``folder``, or none."""
    replaced = draft / ".replaced"
    replaced.mkdir()
    done: list[tuple[Path, Path]] = []
    try:
        for file in sorted(path for path in draft.iterdir() if path != replaced):
            place, old = folder / file.name, replaced / file.name
            if place.exists():
                place.rename(old)
            done.append((place, old))
            file.rename(place)
    except OSError as error:
        for place, old in done:
            place.unlink(missing_ok=True)
            if old.exists():
                old.rename(place)
        raise ConfigurationError(f"{folder} cannot be written to: {error.strerror}; nothing was changed.") from error
