"""A folder of results: complete or not at all.

Everything is written into a hidden folder beside the target first. Only when the last file is done are the files
moved to their places, each by one rename; should a rename fail, those before it are taken back. Files of other names
that the target already holds stay as they are. A link is followed. Nothing but a regular file is ever replaced.
"""

import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from heli_identifier.errors import ConfigurationError, refuse
from heli_identifier.files import PREFIX, draft_folder, is_kept, sweep, write_atomically
from heli_identifier.processes import undone
from heli_identifier.results.documents import document_text

_SWEPT = 4
"""Folders from the target upwards in which an earlier run may have left a draft, before the target was there."""


@contextmanager
def whole_folder(target: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a folder to write into; what it holds is moved to ``target`` if the block ends without an exception.

    A target that is no folder, or cannot be written to, is a ConfigurationError before the block runs, so that no long
    computation ends in vain. A file that cannot be written in it is an OSError that names the file in the target.
    """
    refuse(not os.fspath(target), "the output folder has no name; name one, or '.' for the working folder.")
    folder = Path(os.path.realpath(target))
    # what is still a link after realpath is a link to itself
    existing = next(path for path in (folder, *folder.parents) if path.exists() or path.is_symlink())
    is_file = not existing.is_dir()
    refuse(is_file, f"{existing} is a file, a folder is needed there; name another output folder.")
    with ExitStack() as stack:
        try:
            draft = stack.enter_context(draft_folder(existing))
        except OSError as error:
            said = f"{existing} cannot be written to: {error.strerror}; name another folder."
            raise ConfigurationError(said) from error
        for above in (folder, *folder.parents)[:_SWEPT]:
            sweep(above, draft.stat().st_mtime)
        try:
            yield draft
        except OSError as error:
            raise _of_target(error, draft, Path(target)) from error
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigurationError(f"{folder} cannot be made: {error.strerror}; nothing was changed.") from error
        _move_all(draft, folder)


def write_files(folder: Path, contents: Mapping[str, Any]) -> tuple[str, ...]:
    """Write files by their names, text and bytes as they are and other values as JSON; give the names."""
    for name, content in contents.items():
        write_atomically(folder / name, content if isinstance(content, str | bytes) else document_text(content))
    return tuple(contents)


def _of_target(error: OSError, draft: Path, target: Path) -> OSError:
    """Give an error of a file in the draft, which is gone when it is read, with the name that the file was to have."""
    named = Path(str(error.filename))
    if draft not in named.parents:
        return error
    parts = (part for part in named.relative_to(draft).parts if not part.startswith(PREFIX))
    return OSError(error.errno, error.strerror, str(target.joinpath(*parts)))


def _move_all(draft: Path, folder: Path) -> None:
    """Move every file of ``draft`` into ``folder``, or none."""
    moves = [(file, Path(os.path.realpath(folder / file.name))) for file in sorted(draft.iterdir())]
    advice = "nothing was changed, name another folder."
    for _, place in moves:
        kind = "a folder" if place.is_dir() else "no regular file"
        foreign = place.exists() and not place.is_file()
        refuse(foreign, f"{place} is {kind} and is not replaced by a file of results; {advice}")
        refuse(is_kept(place), f"{place} is read by this command and not written over; {advice}")
    replaced = draft / ".replaced"
    replaced.mkdir()
    taken_back = ExitStack()
    with undone(taken_back.close):
        try:
            for file, place in moves:
                if place.exists():
                    os.link(place, replaced / file.name)  # the old file stays until the new one replaces it
                    taken_back.callback((replaced / file.name).replace, place)
                else:
                    taken_back.callback(place.unlink, missing_ok=True)
                file.replace(place)
        except OSError as error:
            said = f"{folder} cannot be written to: {error.strerror}; nothing was changed."
            raise ConfigurationError(said) from error
        taken_back.pop_all()
