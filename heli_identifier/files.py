"""Writing a file whole: the one way in which results, logs, configurations and units reach the disk."""

import os
from os import PathLike
from pathlib import Path


def write_atomically(path: str | PathLike[str], content: str | bytes) -> Path:
    """Write a file so that a reader finds the old content or the new one, never a part.

    Parameters
    ----------
    path : str or PathLike
        File to make or replace. Missing folders above it are made.
    content : str or bytes
        Text is written as UTF-8 and keeps its line ends.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OSError
        If the file cannot be written. The old file is then untouched and no draft remains.
    """
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    # The draft lies in the same folder, because a rename is atomic only within one file system. The process id
    # separates two processes that write the same file.
    draft = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        draft.write_bytes(content.encode() if isinstance(content, str) else content)
        draft.replace(target)
    finally:
        draft.unlink(missing_ok=True)
    return target
