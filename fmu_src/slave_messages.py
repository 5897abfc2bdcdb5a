"""What a unit tells its host: in which words, with which status, and in which characters."""

from __future__ import annotations

from traceback import format_exc

from pythonfmu.enums import Fmi2Status

from .errors import Refusal


def message(call: str, problem: BaseException) -> tuple[str, Fmi2Status]:
    """Return text and status for a ``problem`` in ``call``: a refusal by its words, a surprise by its traceback."""
    if isinstance(problem, Refusal):
        return f"{call}: {problem}", Fmi2Status.discard
    return f"{call}: {type(problem).__name__}: {problem}\n{format_exc()}", Fmi2Status.error


def printable(text: str) -> str:
    """Return ``text`` as it may be handed over: the host reads it as a printf format and as UTF-8."""
    return text.replace("%", "%%").encode("utf-8", "backslashreplace").decode("utf-8")
