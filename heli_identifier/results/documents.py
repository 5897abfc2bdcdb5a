"""The files of results: JSON that is checked by types, and folders that are written completely or not at all.

A JSON file is a frozen value whose fields are the file's keys; a number that is not finite is null in it.

Files are first written into a hidden folder beside the target. When the last file is complete, each file is moved to
its place by one rename. If a rename fails, the renames before it are undone. Files of other names in the target do not
change. A link is followed. Only regular files are replaced.
"""

import json
import os
import shutil
from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from math import inf
from os import PathLike
from pathlib import Path
from reprlib import repr as shortened
from typing import Any, TypeVar, get_args, get_type_hints

import msgspec
import numpy as np

from heli_identifier.errors import ConfigurationError, refuse
from heli_identifier.files import draft_folder, is_protected, read_limited, write_atomically
from heli_identifier.processes import undo_at_end

LARGEST_MB = 50.0
"""Size up to which a document is read [MB]; it has some kilobytes."""

File = TypeVar("File")


def to_json_value(value: Any) -> Any:
    """Return a value as JSON can hold it: objects, lists, plain numbers, and null for numbers that are not finite."""
    text = json.dumps(msgspec.to_builtins(value, enc_hook=_convert))  # escapes names of files that are no UTF-8
    return json.loads(text, parse_constant=lambda not_finite: None)


def _convert(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"{type(value).__name__} is no value of a document")


def document_text(document: Any) -> str:
    """Return a value as the text of a JSON file."""
    return json.dumps(to_json_value(document), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def read_document(path: str | PathLike[str], kind: type[File]) -> File:
    """Read a JSON file of results into a value of a ``kind``.

    A ConfigurationError names the file, and the entry that is missing, of the wrong type or
    not finite; in place of the name of one of several entries it says `[...]`.
    """
    file, name = Path(path), (kind.__doc__ or "").partition(":")[0]
    advice = f"; `heli diagnose` writes a {name}"
    data = read_limited(file, LARGEST_MB, ConfigurationError, advice, f"name the {name} in it")
    try:
        content = json.loads(data.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise damage_error(path, f"it is no JSON: {error}") from error
    schema = content.get("schema") if isinstance(content, dict) else None
    (expected,) = get_args(get_type_hints(kind)["schema"])
    if schema != expected:
        raise ConfigurationError(
            f"{path} must hold an object of schema {expected!r}, its schema is {shortened(schema)}; if another version "
            "of this program wrote it, run `heli diagnose` again."
        )
    for entry, number in numbers_of(content):  # Python reads NaN, Infinity and 1e999
        if not abs(number) < inf:
            raise damage_error(path, f"{entry} = {number}: a finite number is expected")
        if number < 0.0 and (entry.endswith("standard_error") or entry.startswith("expected.")):
            raise damage_error(path, f"{entry} = {number}: expected `float` >= 0.0")
    try:
        return msgspec.convert(content, kind, dec_hook=_read_array)
    except msgspec.ValidationError as error:
        fault, _, entry = str(error).partition(" - at `$")
        raise damage_error(path, f"{entry.strip('.`')}: {fault[:1].lower()}{fault[1:]}".removeprefix(": ")) from error


def damage_error(path: str | PathLike[str], fault: str) -> ConfigurationError:
    """Return the error for a file with a fault."""
    return ConfigurationError(f"{path} is damaged: {fault}; write it again with `heli diagnose` or `heli identify`.")


def numbers_of(value: Any, above: str = "") -> Iterator[tuple[str, float]]:
    """Return the numbers of a document, each with the keys that lead to it."""
    if isinstance(value, int | float):
        yield above, value
    entries = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in entries:
        yield from numbers_of(item, f"{above}.{key}" if above else str(key))


def _read_array(_: type, value: Any) -> Any:
    """Read lists of numbers of one length as an array."""
    try:
        return np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError("rows of numbers are expected") from None


@contextmanager
def write_whole_folder(target: str | os.PathLike[str], obsolete: Collection[str] = ()) -> Iterator[Path]:
    """Return a folder to write into; its files are moved to ``target`` if the block ends without an exception.

    Files with ``obsolete`` names, of an earlier result, are removed from the target if they are not written again.
    A target that is no folder or cannot be written to raises a ConfigurationError before the block runs, so that no
    long computation is lost. A file that cannot be written raises an OSError that names the target.
    """
    refuse(not os.fspath(target), "the output folder has no name; name one, or '.' for the working folder.")
    folder = Path(os.path.realpath(target))
    # a path that is still a link after realpath is a link to itself
    existing = next(path for path in (folder, *folder.parents) if path.exists() or path.is_symlink())
    is_file = not existing.is_dir()
    refuse(is_file, f"{existing} is a file, a folder is needed there; name another output folder.")
    with ExitStack() as stack:
        try:
            draft = stack.enter_context(draft_folder(existing))
        except OSError as error:
            raise ConfigurationError(
                f"{existing} cannot be written to: {error.strerror}; name another folder."
            ) from error
        try:
            yield draft
        except OSError as error:
            if not str(error.filename).startswith(str(draft)):
                raise
            raise OSError(error.errno, error.strerror, str(target)) from error  # the draft is deleted by then
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigurationError(f"{folder} cannot be made: {error.strerror}; name another folder.") from error
        _move_all(draft, folder, obsolete)


def write_files(folder: Path, contents: Mapping[str, Any]) -> tuple[str, ...]:
    """Write files by their names: text and bytes as they are, other values as JSON; give the names."""
    for name, content in contents.items():
        write_atomically(folder / name, content if isinstance(content, str | bytes) else document_text(content))
    return tuple(contents)


def _move_all(draft: Path, folder: Path, obsolete: Collection[str]) -> None:
    """Move every file of ``draft`` into ``folder`` and remove ``obsolete`` ones there, or do nothing."""
    moves = [(file, Path(os.path.realpath(folder / file.name))) for file in sorted(draft.iterdir())]
    advice = "nothing was changed, name another folder."
    for _, place in moves:
        kind = "a folder" if place.is_dir() else "no regular file"
        foreign = place.exists() and not place.is_file()
        refuse(foreign, f"{place} is {kind} and is not replaced by a file of results; {advice}")
        refuse(is_protected(place), f"{place} is read by this command and not written over; {advice}")
    written = {file.name for file, _ in moves}
    left = [folder / name for name in obsolete if name not in written and (folder / name).is_file()]
    left = [place for place in left if not is_protected(place)]
    undo, copies = ExitStack(), draft / ".replaced"  # a link would do, but some file systems have none
    copies.mkdir()
    with undo_at_end(undo.close):
        try:
            for number, place in enumerate((*(place for _, place in moves), *left)):
                if place.exists():
                    undo.callback(os.replace, shutil.copy2(place, copies / str(number)), place)
                else:
                    undo.callback(place.unlink, missing_ok=True)
            for file, place in moves:
                file.replace(place)
            for place in left:
                place.unlink()
        except OSError as error:
            raise ConfigurationError(
                f"{folder} cannot be written to: {error.strerror}; nothing was changed."
            ) from error
        undo.pop_all()
