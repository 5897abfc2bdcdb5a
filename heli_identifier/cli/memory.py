"""Memory that a command is allowed (ulimit -v, ulimit -d), looked at before it is needed.

Where the system refuses memory while libraries are loaded, they end the process without a word, wait for ever, or
raise errors of their own. So a limit that is too low for loading them is refused, and an error of the loader is said in
words of memory.
"""

import resource

from heli_identifier.errors import ConfigurationError

LEAST = 1000
"""Megabytes of address space below which no command begins: `heli design` takes 760, most others 130 to 510."""

_NAMES = {resource.RLIMIT_AS: "ulimit -v", resource.RLIMIT_DATA: "ulimit -d"}
_REFUSED = ("cannot allocate memory", "failed to map segment", "cannot map zero-fill", "libllvmlite")
"""What the system's loader says where it gets no memory, in lower case; numba hides its words and names its library."""


def require_memory() -> None:
    """Refuse to begin under a limit of the memory that is too low to load the libraries.

    Under a limit that is high enough the linear algebra is loaded at once, before data take the memory.

    Raises
    ------
    ConfigurationError
        Names the limit.
    """
    for kind, name in _NAMES.items():
        limit, _ = resource.getrlimit(kind)
        if limit == resource.RLIM_INFINITY:
            continue
        if limit < LEAST * 1_000_000:
            raise ConfigurationError(
                f"this process may use {limit / 1e6:.0f} MB of memory ({name}), a command needs {LEAST} MB; "
                "raise the limit."
            )
        import scipy.linalg  # noqa: F401


def is_of_memory(error: BaseException | None) -> bool:
    """Whether an error, or one that it came from, says that the system gave no memory."""
    while error is not None:
        if isinstance(error, MemoryError):
            return True
        if isinstance(error, ImportError | OSError) and any(words in str(error).lower() for words in _REFUSED):
            return True
        error = error.__cause__ or error.__context__
    return False
